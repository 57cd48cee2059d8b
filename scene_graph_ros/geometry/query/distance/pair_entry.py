"""The distance of one pair as a kernel that is compiled once for all others that ask for it."""

import numpy as np

from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.query.distance.dispatch import distance_pair
from scene_graph_ros.geometry.tables.held_table import borrowed_table

__all__ = ["PAIR_DISTANCE"]


def _pair_distance(places, i, j, R_AB, p_AB, max_distance, tolerance):
    return distance_pair(borrowed_table(places), i, j, R_AB, p_AB, max_distance, tolerance)


PAIR_DISTANCE = entry_point(
    _pair_distance, (np.zeros(1, np.int64), 0, 0, 9 * (0.0,), 3 * (0.0,), 0.0, 0.0)
)
"""``distance_pair`` with the ``places`` of a HeldTable in place of the table."""
