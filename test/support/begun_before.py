"""Imported, this calls a kernel: numba has read all that it reads before the first one.

And it takes all that is there for lasting: a process that is forked from this one looks for
garbage in its own objects alone, and does not copy the pages of the others for that.
"""

from __future__ import annotations

import gc

import numpy as np

from scene_graph_ros.geometry.spatial.pose_kernels import check_poses

__all__: list[str] = []

check_poses(np.eye(4)[np.newaxis])

gc.collect()
gc.freeze()
