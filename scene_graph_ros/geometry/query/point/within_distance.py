"""Signed distances of points to the rows that are no further away than a threshold."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel
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

__all__ = ["Columns", "answer_within", "world_boxes"]

_FIRST_CAPACITY = 64


class _Asked(NamedTuple):
    """The rows of a table, placed, and how far they may be."""

    table: Any
    X_WG: NDArray[np.float64]
    boxes: NDArray[np.float64]
    """What ``world_boxes`` returns."""
    threshold: float
    """Metres."""


@kernel
def world_boxes(table, X_WG):
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
def _answer_rows(asked, p_WQ, at, bounds, reach, columns):
    """Write a point's answers about rows, going on where ``at`` is, as ``_answer_points`` does.

    Returned is where it is when all rows are answered, or the columns are full.
    """
    table, X_WG, _, threshold = asked
    point, row, phi, p_GN, grad_W, unique = columns
    q, first, count = at
    n = bounds.shape[0]
    for i in range(first, n):
        if bounds[i] > reach * reach:
            continue
        if count == point.shape[0]:
            return q, i, count
        R_WG = load_rotation(X_WG, i)
        p_GQ = rotate_inverse(R_WG, subtract(p_WQ, load_translation(X_WG, i)))
        distance, nearest, gradient, is_unique = distance_point_within(table, i, p_GQ, threshold)
        if distance <= threshold:
            point[count], row[count], phi[count], unique[count] = q, i, distance, is_unique
            store_vector(p_GN, count, nearest)
            store_vector(grad_W, count, rotate(R_WG, gradient))
            count += 1
    return q, n, count


@kernel
def _answer_points(asked, p_WQs, bounds, at, last, columns):
    """Answer points until ``last`` or until the columns are full.

    ``at`` is (point, row, count): where to go on. Returns it for the next call.
    """
    q, i, count = at
    n = bounds.shape[0]
    largest = _largest_coordinate(asked.boxes)
    while q < last:
        p_WQ = load_vector(p_WQs, q)
        magnitude = max(largest, abs(p_WQ[0]), abs(p_WQ[1]), abs(p_WQ[2]))
        reach = max(asked.threshold, 0.0) + COINCIDENCE * magnitude
        _square_bounds(asked.boxes, p_WQ, bounds)
        q, i, count = _answer_rows(asked, p_WQ, (q, i, count), bounds, reach, columns)
        if i < n:
            break
        q, i = q + 1, 0
    return q, i, count


Columns = tuple[NDArray[Any], ...]
"""The columns (point, row, phi, p_GN, grad_W, unique)."""


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


def answer_within(
    table: Any, X_WG: Any, p_WQs: Any, boxes: Any, threshold: float, points: range
) -> Columns:
    """Return the answers of a range of points that are no further away than a threshold."""
    room = _new_columns(min(len(points) * len(X_WG), _FIRST_CAPACITY + len(points)))
    asked, bounds = _Asked(table, X_WG, boxes, threshold), np.empty(len(X_WG))
    at, last = (points.start, 0, 0), points.stop
    while True:
        at = _answer_points(asked, p_WQs, bounds, at, last, room)
        if at[0] >= last:
            return tuple(column[: at[2]] for column in room)
        full, room = room, _new_columns(2 * len(room[0]) + _FIRST_CAPACITY)
        for column, longer in zip(full, room, strict=True):
            longer[: len(column)] = column
