"""Signed distances of points to all rows, none left out.

Many points are measured to one shape at a time, few points to many shapes of one kind at a time.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.point.answers import Answers, write_answer
from scene_graph_ros.geometry.query.point.dispatch import point_mesh_within
from scene_graph_ros.geometry.query.point.kind_table import HeldKinds
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.many_points_one_shape import answer_many_points
from scene_graph_ros.geometry.query.point.one_point_many_shapes import answer_few_points
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    subtract,
)
from scene_graph_ros.geometry.tables.shape_table import ShapeTable

__all__ = ["answer_all"]

_SEEN_AGAIN = 1 << 16
"""Answers, of 57 bytes each: so many may still be in the caches when somebody reads them."""


@kernel
def _answer_meshes(table, rows, X_WG, p_WQs, first, last, columns):
    n = X_WG.shape[0]
    for q in range(first, last):
        p_WQ = load_vector(p_WQs, q)
        for slot in range(rows.shape[0]):
            i = rows[slot]
            R_WG = load_rotation(X_WG, i)
            p_GQ = rotate_inverse(R_WG, subtract(p_WQ, load_translation(X_WG, i)))
            phi, nearest, gradient, unique = point_mesh_within(table, i, p_GQ, math.inf)
            write_answer(columns, q * n + i, phi, nearest, rotate(R_WG, gradient), unique)


def answer_all(
    table: ShapeTable,
    held: HeldKinds,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    points: range,
    columns: Answers,
) -> None:
    """Write the answers of a range of points about all n rows into columns for all points.

    Point q and row i have the place ``q * n + i``.
    """
    kinds, places = held
    first, last, tiles = points.start, points.stop, len(kinds.tile_rows)
    many = last - len(points) % LANES
    if len(X_WG) <= (last - many) * tiles:  # so many points fill the lanes better than shapes do
        many = last
    if first < many:
        is_large = len(columns[0]) > _SEEN_AGAIN
        answer_many_points(places, X_WG, p_WQs, first, many, is_large, columns)
    if many < last:
        answer_few_points(places, X_WG, p_WQs, many, last, columns)
    if len(kinds.meshes):
        _answer_meshes(table, kinds.meshes, X_WG, p_WQs, first, last, columns)
