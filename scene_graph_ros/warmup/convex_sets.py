"""What compiles the kernels of convex sets."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry.optimization.solve.feasibility import find_point
from scene_graph_ros.geometry.optimization.solve.rows import Rows

__all__ = ["ask_convex_sets"]


def ask_convex_sets() -> None:
    """Ask for a point of a segment."""
    find_point(Rows(np.array([[1.0], [-1.0]]), np.ones(2)))
