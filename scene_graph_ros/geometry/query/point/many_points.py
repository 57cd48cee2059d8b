"""Signed distances of many points to all rows, none left out: a shape at a time, points in step.

Answers are put together for a block of points, in a room that the processor keeps at hand, and
then written to the result in one go.
"""

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.meshes.hull_blocks import SCAN_LIMIT
from scene_graph_ros.geometry.query.point.hull_lanes import answer_hull
from scene_graph_ros.geometry.query.point.lane_memory import (
    answer_numbers,
    lane_numbers,
    LANES,
)
from scene_graph_ros.geometry.query.point.lane_rows import ANSWER, put_square, SQUARE
from scene_graph_ros.geometry.query.point.lanes import (
    answer_lanes,
    enter_frame,
    keep_answers,
    question,
    set_answer,
    set_triple,
)
from scene_graph_ros.geometry.query.point.point_convex import point_hull
from scene_graph_ros.geometry.query.point.streaming import copy, finish_streams, stream
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.vectors import load_rotation, load_translation, load_vector

__all__ = ["Answers", "answer_many_points", "new_room"]

Answers = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]
"""Flat columns phi (k,), p_GN (3 k,), grad_W (3 k,) and unique (k,)."""

_CONVEX = int(ShapeKind.CONVEX)
_MESH = int(ShapeKind.MESH)

_ROOM = 1 << 14
"""Answers of a block, of 57 bytes each: they stay in the processor's second cache."""
_WIDTH = _ROOM // LANES
"""Rows of a block, a multiple of SQUARE."""


def new_room(n: int) -> Answers:
    """Return room for the answers of a block about n rows: flat phi, p_GN, grad_W and unique."""
    k = LANES * min(n, _WIDTH)
    return np.empty(k), np.empty(3 * k), np.empty(3 * k), np.empty(k, np.bool_)


@lean_kernel
def _load_points(points, p_WQs, first, count):
    for j in range(LANES):
        set_triple(points, 0, j, load_vector(p_WQs, first + min(j, count - 1)))


@inlined_kernel
def _put_row(answers, first, room, at, stride):
    """Put the answers of all lanes about one row into a room."""
    phi, p_GN, grad_W, unique = room
    for j in range(LANES):
        k, to = (first + j) & LAST_PLACE, (at + j * stride) & LAST_PLACE
        phi[to], unique[to] = answers[k], answers[k + 7 * LANES] != 0.0
        for axis in range(3):
            p_GN[3 * to + axis] = answers[k + (1 + axis) * LANES]
            grad_W[3 * to + axis] = answers[k + (4 + axis) * LANES]


@lean_kernel
def _put(answers, slots, room, at, stride):
    """Put the answers of all lanes about the rows of all slots into a room."""
    if slots == SQUARE:
        for j in range(0, LANES, SQUARE):
            put_square(answers, j, room, at + j * stride, stride)
    else:
        for slot in range(slots):
            _put_row(answers, slot * ANSWER, room, at + slot, stride)


@inlined_kernel
def _answer_row(kinds, i, points, lanes, R_WG, p_WG):
    """Answer all lanes about row i."""
    kind = kinds.kind[i]
    enter_frame(lanes, points, load_vector(kinds.size, i), R_WG, p_WG)
    if kind == _CONVEX:
        start = kinds.block[i]
        if kinds.blocks[start] <= SCAN_LIMIT:
            answer_hull(lanes, kinds.blocks, start)
        else:
            for j in range(LANES):
                size, p_GQ = question(lanes, j)
                set_answer(lanes, j, point_hull(kinds.blocks, start, size[0], p_GQ))
    elif kind != _MESH:
        answer_lanes(lanes, kind)


@lean_kernel
def _write(room, width, columns, at, stride, count, is_large):
    """Write the answers of a room, ``width`` for each of ``count`` points, into the columns."""
    run = 1
    if width == stride:
        width, run = width * count, count
    for j in range(0, count, run):
        to, first = at + j * stride, j * width
        for k in range(width):
            columns[3][(to + k) & LAST_PLACE] = room[3][(first + k) & LAST_PLACE]
        if is_large:
            stream(columns[0], to, room[0], first, width)
            stream(columns[1], 3 * to, room[1], 3 * first, 3 * width)
            stream(columns[2], 3 * to, room[2], 3 * first, 3 * width)
        else:
            copy(columns[0], to, room[0], first, width)
            copy(columns[1], 3 * to, room[1], 3 * first, 3 * width)
            copy(columns[2], 3 * to, room[2], 3 * first, 3 * width)


@lean_kernel
def answer_many_points(kinds, X_WG, p_WQs, first, last, is_large, room, columns):
    """Answer points first to last about all rows but meshes.

    Point q and row i have the place ``q * n + i`` of the ``columns``, which are phi, p_GN, grad_W
    and unique, flat. ``is_large`` tells that the result is larger than the processor's caches;
    ``room`` is from ``new_room``.
    """
    n = X_WG.shape[0]
    lanes, points, answers = lane_numbers(), lane_numbers(), answer_numbers()
    for begin in range(first, last, LANES):
        count = min(LANES, last - begin)
        _load_points(points, p_WQs, begin, count)
        for row in range(0, n, _WIDTH):
            width = min(_WIDTH, n - row)
            for at in range(0, width, SQUARE):
                slots = min(SQUARE, width - at)
                for slot in range(slots):
                    i = row + at + slot
                    R_WG = load_rotation(X_WG, i)
                    _answer_row(kinds, i, points, lanes, R_WG, load_translation(X_WG, i))
                    keep_answers(lanes, R_WG, answers, slot * ANSWER)
                _put(answers, slots, room, at, width)
            _write(room, width, columns, begin * n + row, n, count, is_large)
    finish_streams()
