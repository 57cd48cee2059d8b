"""The distance of one pair as a kernel that is compiled once for all others that ask for it."""

import numpy as np

from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.query.distance.dispatch import are_turned, distance_pair
from scene_graph_ros.geometry.spatial.vectors import add, relative_pose, rotate, scale
from scene_graph_ros.geometry.tables.held_table import borrowed_table

__all__ = ["PAIR_DISTANCE"]


def _pair_distance(places, i, j, X_WA, X_WB, max_distance, tolerance):
    table = borrowed_table(places)
    turned = are_turned(table, i, j)
    if turned:
        i, j, X_WA, X_WB = j, i, X_WB, X_WA
    (R_WA, p_WA), (R_WB, p_WB) = X_WA, X_WB
    R_AB, p_AB = relative_pose(R_WA, p_WA, R_WB, p_WB)
    phi, p_ACa, p_ACb, nhat_A, _, gap, _ = distance_pair(
        table, i, j, R_AB, p_AB, max_distance, tolerance
    )
    p_WCa, p_WCb = add(p_WA, rotate(R_WA, p_ACa)), add(p_WA, rotate(R_WA, p_ACb))
    nhat_W = rotate(R_WA, nhat_A)
    if turned:
        return phi, p_WCb, p_WCa, scale(-1.0, nhat_W), gap
    return phi, p_WCa, p_WCb, nhat_W, gap


_POSE = 9 * (0.0,), 3 * (0.0,)

PAIR_DISTANCE = entry_point(_pair_distance, (np.zeros(1, np.int64), 0, 0, _POSE, _POSE, 0.0, 0.0))
"""Returns (phi, p_WCa, p_WCb, nhat_BA_W, gap) of rows i (A) and j (B) at the poses (R, p) in W, by
``distance_pair``, with the ``places`` of a HeldTable in place of the table."""
