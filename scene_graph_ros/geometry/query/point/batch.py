"""Signed distance from many points to all rows of a shape table, in one call.

Where none is left out, many points are measured to one shape at a time, few points to many shapes
of one kind at a time.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.query.point.answers import Answers, new_answers, write_answer
from scene_graph_ros.geometry.query.point.dispatch import point_mesh_within
from scene_graph_ros.geometry.query.point.kind_table import group_by_kind, HeldKinds, hold_kinds
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.many_points_one_shape import answer_many_points
from scene_graph_ros.geometry.query.point.one_point_many_shapes import answer_few_points
from scene_graph_ros.geometry.query.point.within_distance import (
    answer_within,
    Columns,
    world_boxes,
)
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    subtract,
)
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["answer_all", "distance_points", "distances_to_all"]

Result = TypeVar("Result")

_SEEN_AGAIN = 1 << 16
"""Answers, of 57 bytes each: so many may still be in the caches when somebody reads them."""


def distance_points(
    table: Any,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    threshold: float,
    threads: int = 1,
) -> Columns:
    """Return the signed distances phi <= threshold of (m, 3) points to all n rows of a table.

    ``X_WG`` is (n, 4, 4). Returned are the columns (point, row, phi, p_GN, grad_W, unique), of
    shapes (k,), (k,), (k,), (k, 3), (k, 3), (k,), sorted by point, then row: the fields of
    ``distance_point``, the nearest point in the row's frame G, the gradient in W. A row whose
    bounding box is further away than the threshold is skipped. The points are shared out among
    ``threads`` >= 1; each answer is computed the same way whoever computes it.
    """
    if threshold == math.inf:
        m, n = len(p_WQs), len(X_WG)
        kinds, answers = hold_kinds(group_by_kind(table)), new_answers(m * n)
        columns = distances_to_all(table, kinds, X_WG, p_WQs, threads, answers)
        return np.repeat(np.arange(m), n), np.tile(np.arange(n), m), *columns
    boxes = world_boxes(table, X_WG)

    def answer(share: range) -> Columns:
        return answer_within(table, X_WG, p_WQs, boxes, threshold, share)

    filled = _for_each(answer, _shares(len(p_WQs), threads))
    if len(filled) == 1:
        return filled[0]
    return tuple(np.concatenate(same) for same in zip(*filled, strict=True))


def distances_to_all(
    table: Any,
    kinds: HeldKinds,
    X_WG: NDArray[np.float64],
    p_WQs: NDArray[np.float64],
    threads: int,
    answers: Answers,
) -> Columns:
    """Return the signed distances of (m, 3) points to all n rows of a table, none left out.

    They are written to ``answers``, flat columns for m n of them. Returned are (phi, p_GN, grad_W,
    unique), in their shapes, as ``distance_points`` does; point q and row i have row q n + i.
    """

    def answer(share: range) -> None:
        answer_all(table, kinds, X_WG, p_WQs, share, answers)

    if threads == 1:
        answer(range(len(p_WQs)))
    else:
        _for_each(answer, _shares(len(p_WQs), threads))
    phi, p_GN, grad_W, unique = answers
    return phi, p_GN.reshape(-1, 3), grad_W.reshape(-1, 3), unique


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


def _shares(count: int, threads: int) -> list[range]:
    """Share the points out among threads."""
    parts = max(min(threads, count), 1)
    return [range(k * count // parts, (k + 1) * count // parts) for k in range(parts)]


def _for_each(answer: Callable[[range], Result], shares: list[range]) -> list[Result]:
    """Return the results of ``answer`` for each part, computed by a thread each."""
    if len(shares) == 1:
        return [answer(shares[0])]
    with ThreadPoolExecutor(len(shares)) as pool:
        return list(pool.map(answer, shares))
