"""The distance of a grid, of heights or voxels, and a shape as a kernel compiled once."""

import numpy as np

from scene_graph_ros.geometry.compiled.entry_points import entry_point
from scene_graph_ros.geometry.query.elements.element_places import is_of_voxels
from scene_graph_ros.geometry.query.elements.field_search import nearest_prism
from scene_graph_ros.geometry.query.elements.voxel_search import nearest_voxel

__all__ = ["FIELD_DISTANCE"]


def _field_distance(places, field, j, X_FB, max_distance, tolerance):
    R_FB, p_FB = X_FB
    if is_of_voxels(places, field):
        return nearest_voxel(places, field, j, R_FB, p_FB, max_distance, tolerance)
    return nearest_prism(places, field, j, R_FB, p_FB, max_distance, tolerance)


_POSE = 9 * (0.0,), 3 * (0.0,)

FIELD_DISTANCE = entry_point(_field_distance, (np.zeros(1, np.int64), 0, 0, _POSE, 0.0, 0.0))
"""Returns the answer of ``nearest_prism``, or ``nearest_voxel``, about a field and row j at a pose
in its frame."""
