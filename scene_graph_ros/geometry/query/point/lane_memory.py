"""How many lanes there are, and their numbers, each line of the processor's cache a vector."""

import numpy as np

from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.compiled.streams import LINE

__all__ = ["LANES", "LANE_ROWS", "answer_numbers", "lane_numbers"]

LANES = 32
"""How many answers to points are computed at once, a few in each of the processor's registers."""

LANE_ROWS = LINE
"""For so many rows answers in lanes are kept before they are put into results."""

_LINE_BYTES = LINE * np.dtype(np.float64).itemsize

lane_numbers = stack_array((22 * LANES,), alignment=_LINE_BYTES)
"""Return an uninitialized array of 22 numbers for each lane, as in ``lanes``."""

answer_numbers = stack_array((8 * LANE_ROWS * LANES,), alignment=_LINE_BYTES)
"""Return an uninitialized array of the answers of all lanes about ``LANE_ROWS`` rows."""
