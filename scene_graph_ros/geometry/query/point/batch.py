"""Signed distance from many points to all rows of a shape table, in one call."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
import math
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
from scene_graph_ros.geometry.query.point.all_rows import (
    answer_all,
    group_by_kind,
    HeldKinds,
    hold_kinds,
)
from scene_graph_ros.geometry.query.point.answers import Answers, new_answers
from scene_graph_ros.geometry.query.point.dispatch import distance_point_within
from scene_graph_ros.geometry.spatial.vectors import (
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    rotate_inverse,
    store_vector,
    subtract,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE

__all__ = ["distance_points", "distances_to_all"]

_FIRST_CAPACITY = 64
Result = TypeVar("Result")


@kernel
def _world_boxes(table, X_WG):
    """Return the rows' bounding boxes in W, (6, n): three lower and three upper coordinates."""
    n = table.kind.shape[0]
    boxes = np.empty((6, n))
    for i in range(n):
        for axis in range(3):
            lower = upper = X_WG[i, axis, 3]
            for k in range(3):
                r = X_WG[i, axis, k]
                if r != 0.0:
                    a, b = r * table.lower[i, k], r * table.upper[i, k]
                    lower += min(a, b)
                    upper += max(a, b)
            boxes[axis, i] = lower
            boxes[axis + 3, i] = upper
    return boxes


@kernel
def _square_bounds(boxes, p_WQ, bounds):
    """Write each row's squared distance from Q to its box, a lower bound, into ``bounds``."""
    x, y, z = p_WQ
    for i in range(bounds.shape[0]):
        dx = max(max(boxes[0, i] - x, x - boxes[3, i]), 0.0)
        dy = max(max(boxes[1, i] - y, y - boxes[4, i]), 0.0)
        dz = max(max(boxes[2, i] - z, z - boxes[5, i]), 0.0)
        bounds[i] = dx * dx + dy * dy + dz * dz


@kernel
def _largest_coordinate(boxes):
    """Return the largest finite magnitude among the boxes' coordinates."""
    largest = 0.0
    for k in range(6):
        for i in range(boxes.shape[1]):
            magnitude = abs(boxes[k, i])
            if magnitude < math.inf:
                largest = max(largest, magnitude)
    return largest


@inlined_kernel
def _answer_rows(table, X_WG, p_WQ, q, first, bounds, reach, threshold, count, columns):
    """Write the answers of rows from ``first`` on; return (next row, count) when full or done."""
    point, row, phi, p_GN, grad_W, unique = columns
    n = bounds.shape[0]
    for i in range(first, n):
        if bounds[i] > reach * reach:
            continue
        if count == point.shape[0]:
            return i, count
        R_WG = load_rotation(X_WG, i)
        p_GQ = rotate_inverse(R_WG, subtract(p_WQ, load_translation(X_WG, i)))
        distance, nearest, gradient, is_unique = distance_point_within(table, i, p_GQ, threshold)
        if distance <= threshold:
            point[count], row[count], phi[count], unique[count] = q, i, distance, is_unique
            store_vector(p_GN, count, nearest)
            store_vector(grad_W, count, rotate(R_WG, gradient))
            count += 1
    return n, count


@kernel
def _answer_points(table, X_WG, p_WQs, boxes, bounds, threshold, at, last, columns):
    """Answer points until ``last`` or until the columns are full.

    ``at`` is (point, row, count): where to go on. Returns it for the next call.
    """
    q, i, count = at
    n = bounds.shape[0]
    largest = _largest_coordinate(boxes)
    while q < last:
        p_WQ = load_vector(p_WQs, q)
        magnitude = max(largest, abs(p_WQ[0]), abs(p_WQ[1]), abs(p_WQ[2]))
        reach = max(threshold, 0.0) + COINCIDENCE * magnitude
        _square_bounds(boxes, p_WQ, bounds)
        i, count = _answer_rows(table, X_WG, p_WQ, q, i, bounds, reach, threshold, count, columns)
        if i < n:
            break
        q, i = q + 1, 0
    return q, i, count


Columns = tuple[NDArray[Any], ...]


def _new_columns(capacity: int) -> Columns:
    """Return the columns (point, row, phi, p_GN, grad_W, unique), unset."""
    return (
        np.empty(capacity, np.int64),
        np.empty(capacity, np.int64),
        np.empty(capacity),
        np.empty((capacity, 3)),
        np.empty((capacity, 3)),
        np.empty(capacity, np.bool_),
    )


def _answer_some(
    table: Any, X_WG: Any, p_WQs: Any, boxes: Any, threshold: float, points: range, room: Columns
) -> Columns:
    """Answer a range of points, in ``room`` while it lasts; return the columns that are filled."""
    bounds = np.empty(len(X_WG))
    at, last = (points.start, 0, 0), points.stop
    while True:
        at = _answer_points(table, X_WG, p_WQs, boxes, bounds, threshold, at, last, room)
        if at[0] >= last:
            return tuple(column[: at[2]] for column in room)
        full, room = room, _new_columns(2 * len(room[0]) + _FIRST_CAPACITY)
        for column, longer in zip(full, room, strict=True):
            longer[: len(column)] = column


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
    boxes, n = _world_boxes(table, X_WG), len(X_WG)

    def answer(share: range) -> Columns:
        room = _new_columns(min(len(share) * n, _FIRST_CAPACITY + len(share)))
        return _answer_some(table, X_WG, p_WQs, boxes, threshold, share, room)

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


def _shares(count: int, threads: int) -> list[range]:
    """Share the points out among threads."""
    parts = max(min(threads, count), 1)
    return [range(k * count // parts, (k + 1) * count // parts) for k in range(parts)]


def _for_each(answer: Callable[[range], Result], shares: list[range]) -> list[Result]:
    """Return what ``answer`` returns for each share, computed by a thread each."""
    if len(shares) == 1:
        return [answer(shares[0])]
    with ThreadPoolExecutor(len(shares)) as pool:
        return list(pool.map(answer, shares))
