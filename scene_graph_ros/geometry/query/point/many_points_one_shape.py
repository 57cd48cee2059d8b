"""Signed distances of many points to all rows, none left out: a shape at a time, points in step.

Answers about some rows are kept in lanes and then put into the columns in one go, turned. Where
the result is large, each point's answers about eight rows are whole lines of the columns, which
are written past the caches.
"""

import math

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.streams import finish_streams, LINE, numbers_to_line
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.query.point.closed_forms import CLOSED_FORMS
from scene_graph_ros.geometry.query.point.ellipsoid_lanes import answer_ellipsoid
from scene_graph_ros.geometry.query.point.hull_lanes import answer_hull
from scene_graph_ros.geometry.query.point.kind_table import borrowed
from scene_graph_ros.geometry.query.point.lane_memory import answer_numbers, lane_numbers, LANES
from scene_graph_ros.geometry.query.point.lanes import (
    Asked,
    keep_answer,
    p_GQ_of_lane,
    set_triple,
)
from scene_graph_ros.geometry.query.point.lanes_to_rows import (
    ANSWER,
    put_square,
    SQUARE,
    stream_square,
)
from scene_graph_ros.geometry.query.point.point_convex import point_hull
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import load_rotation, load_translation, load_vector
from scene_graph_ros.geometry.tables.hull_blocks import SCAN_LIMIT

__all__ = ["answer_many_points"]

_CONVEX = int(ShapeKind.CONVEX)
_ELLIPSOID = int(ShapeKind.ELLIPSOID)


def _against_one(point_shape):
    """Return a kernel that measures all lanes to one shape, from the world and back, in one loop.

    Nothing is kept in between, so that most of it happens in the processor's registers.
    """

    @inlined_kernel
    def answer(size, asked):
        for j in range(LANES):
            keep_answer(asked, j, point_shape(size, p_GQ_of_lane(asked, j)))

    return answer


@by_kind(
    inlined_kernel, ["kind"], {kind: _against_one(form) for kind, form in CLOSED_FORMS.items()}
)
def _answer_closed_form(kind, size, asked):
    """Answer all lanes about one shape."""


@lean_kernel
def _load_points(points, p_WQs, first, step, count):
    for j in range(LANES):
        set_triple(points, 0, j, load_vector(p_WQs, first + step * min(j, count - 1)))


@inlined_kernel
def _put_lanes(answers, slot, lane, count, columns, at, stride):
    """Put the answers of the lanes from ``lane`` to ``count`` about one row into the columns."""
    phi, p_GN, grad_W, unique = columns
    for j in range(lane, count):
        k, to = (slot * ANSWER + j) & LAST_PLACE, (at + j * stride) & LAST_PLACE
        phi[to], unique[to] = answers[k], answers[k + 7 * LANES] != 0.0
        for axis in range(3):
            p_GN[3 * to + axis] = answers[k + (1 + axis) * LANES]
            grad_W[3 * to + axis] = answers[k + (4 + axis) * LANES]


@lean_kernel
def _put(answers, slots, count, columns, at, stride, is_streamed):
    """Put the answers of ``count`` lanes about the rows of all slots into the columns."""
    lane = 0
    if slots == SQUARE:
        for _ in range(count // SQUARE):
            if is_streamed:
                stream_square(answers, lane, columns, at + lane * stride, stride)
            else:
                put_square(answers, lane, columns, at + lane * stride, stride)
            lane += SQUARE
    if lane < count:
        for slot in range(slots):
            _put_lanes(answers, slot, lane, count, columns, at + slot, stride)


@lean_kernel
def _answer_large_hull(asked, blocks, start, size):
    for j in range(LANES):
        keep_answer(asked, j, point_hull(blocks, start, size, p_GQ_of_lane(asked, j)))


@inlined_kernel
def _answer_row(kinds, i, asked):
    """Answer all lanes about row i."""
    kind, size = kinds.kind[i], load_vector(kinds.size, i)
    if kind == _ELLIPSOID:
        answer_ellipsoid(asked, size)
    elif kind != _CONVEX:
        _answer_closed_form(kind, size, asked)
    elif kinds.blocks[kinds.block[i]] <= SCAN_LIMIT:
        answer_hull(asked, kinds.blocks, kinds.block[i], size[0])
    else:
        _answer_large_hull(asked, kinds.blocks, kinds.block[i], size[0])


@lean_kernel
def _answer_block(kinds, X_WG, p_WQs, begin, step, count, head, columns):
    """Answer ``count`` points, from ``begin`` on by steps, about all rows but meshes.

    Rows are taken eight by eight after the first ``head``; with ``head`` >= 0 they are written
    past the caches.
    """
    use_widest_vectors()
    n = X_WG.shape[0]
    points, answers = lane_numbers(), answer_numbers()
    _load_points(points, p_WQs, begin, step, count)
    row, slots = 0, min(head, n) if head > 0 else min(SQUARE, n)
    while row < n:
        for slot in range(slots):
            i = row + slot
            R_WG, p_WG = load_rotation(X_WG, i), load_translation(X_WG, i)
            _answer_row(kinds, i, Asked(R_WG, p_WG, points, answers, slot * ANSWER))
        _put(answers, slots, count, columns, begin * n + row, step * n, head >= 0)
        row += slots
        slots = min(SQUARE, n - row)


@inlined_kernel
def _are_lined(columns):
    """Tell whether all columns of numbers begin where a line of the cache does."""
    phi, p_GN, grad_W, _ = columns
    return (numbers_to_line(phi) | numbers_to_line(p_GN) | numbers_to_line(grad_W)) == 0


@lean_kernel
def answer_many_points(places, X_WG, p_WQs, first, last, is_large, columns):
    """Answer points first to last about all rows but meshes.

    ``places`` are those of ``hold_kinds``. Point q and row i have the place ``q * n + i`` of the
    ``columns``, which are phi, p_GN, grad_W and unique, flat. ``is_large`` tells that the result
    is larger than the processor's caches; then points whose answers begin at the same place of a
    line are answered together.
    """
    kinds = borrowed(places)
    n, begin = X_WG.shape[0], first
    if is_large and _are_lined(columns):
        step = LINE // math.gcd(n, LINE)
        while last - begin >= step * LANES:
            for q in range(begin, begin + step):
                head = (-q * n) & (LINE - 1)
                _answer_block(kinds, X_WG, p_WQs, q, step, LANES, head, columns)
            begin += step * LANES
    while begin < last:
        count = min(LANES, last - begin)
        _answer_block(kinds, X_WG, p_WQs, begin, 1, count, -1, columns)
        begin += count
    finish_streams()
