"""Turn numbers that lie beside each other in lanes into rows of columns, and the other way.

Lanes hold the same number of many points or shapes; a column wants all rows of a point one after
the other, and a pose is a row of its own. Eight by eight, numbers are turned in the processor's
registers, so that every line of the cache is read and written once.
"""

from typing import NamedTuple

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    every,
    load_four,
    load_lanes,
    merging,
    store_choices,
    store_lanes,
    stream_lanes,
)
from scene_graph_ros.geometry.query.point.lane_memory import LANE_ROWS, LANES

__all__ = ["ANSWER", "SQUARE", "put_square", "stream_square", "take_square"]

_NUMBERS = 8
"""Numbers of an answer: phi, p_GN, grad_W, and whether it is unique, 1 or 0."""
ANSWER = _NUMBERS * LANES
"""Numbers of the answers of all lanes about one row, number k of lane j at ``k * LANES + j``."""
SQUARE = LANE_ROWS
"""Rows, and lanes, that are turned at once."""

_POSE = 16
_UNIQUE = 7

_joined = merging(*range(SQUARE))
_even, _odd = merging(0, 8, 2, 10, 4, 12, 6, 14), merging(1, 9, 3, 11, 5, 13, 7, 15)
_first_pairs, _last_pairs = merging(0, 1, 4, 5, 8, 9, 12, 13), merging(2, 3, 6, 7, 10, 11, 14, 15)


@inlined_kernel
def _half_turned(array, places, start):
    """Return four of the columns of vectors that begin at eight places, from ``start`` on."""
    # Taking halves from memory is no work for the one unit that shuffles.
    a = _joined(load_four(array, places[0] + start), load_four(array, places[2] + start))
    b = _joined(load_four(array, places[1] + start), load_four(array, places[3] + start))
    c = _joined(load_four(array, places[4] + start), load_four(array, places[6] + start))
    d = _joined(load_four(array, places[5] + start), load_four(array, places[7] + start))
    even, other_even, odd, other_odd = _even(a, b), _even(c, d), _odd(a, b), _odd(c, d)
    return (
        _first_pairs(even, other_even),
        _first_pairs(odd, other_odd),
        _last_pairs(even, other_even),
        _last_pairs(odd, other_odd),
    )


@inlined_kernel
def _turned(array, places):
    """Return the eight columns of the vectors that begin at eight places of an array."""
    return _half_turned(array, places, 0) + _half_turned(array, places, SQUARE // 2)


@inlined_kernel
def _place_of(first, number, width, k):
    """Return the index of number k, of columns of ``width`` numbers that begin with ``number``."""
    return first + (k // width) * ANSWER + (number + k % width) * LANES


@inlined_kernel
def _places_of(first, number, width, k):
    """Return the indices of eight numbers, from number k on."""
    return (
        _place_of(first, number, width, k),
        _place_of(first, number, width, k + 1),
        _place_of(first, number, width, k + 2),
        _place_of(first, number, width, k + 3),
        _place_of(first, number, width, k + 4),
        _place_of(first, number, width, k + 5),
        _place_of(first, number, width, k + 6),
        _place_of(first, number, width, k + 7),
    )


class _Rows(NamedTuple):
    """Where rows of columns are written: the first lane's first row, and others from there."""

    at: int
    stride: int
    """From a lane's rows to those of the next."""
    is_streamed: bool
    """Whether they are written past the caches."""


@inlined_kernel
def _write(column, start, vector, is_streamed):
    if is_streamed:
        stream_lanes(column, start, vector)
    else:
        store_lanes(column, start, vector)


@inlined_kernel
def _put_numbers(answers, first, number, width, part, column, rows):
    """Write a part of each lane's rows into a column of ``width`` numbers: eight numbers."""
    turned = _turned(answers, _places_of(first, number, width, SQUARE * part))
    start, step = width * rows.at + SQUARE * part, width * rows.stride
    _write(column, start, turned[0], rows.is_streamed)
    _write(column, start + step, turned[1], rows.is_streamed)
    _write(column, start + 2 * step, turned[2], rows.is_streamed)
    _write(column, start + 3 * step, turned[3], rows.is_streamed)
    _write(column, start + 4 * step, turned[4], rows.is_streamed)
    _write(column, start + 5 * step, turned[5], rows.is_streamed)
    _write(column, start + 6 * step, turned[6], rows.is_streamed)
    _write(column, start + 7 * step, turned[7], rows.is_streamed)


@inlined_kernel
def _are_unique(answers, places, k):
    return load_lanes(answers, places[k]) != 0.0


@inlined_kernel
def _all_unique(answers, places):
    """Return for which lanes the answers about all rows are unique."""
    return (
        (_are_unique(answers, places, 0) & _are_unique(answers, places, 1))
        & (_are_unique(answers, places, 2) & _are_unique(answers, places, 3))
        & (_are_unique(answers, places, 4) & _are_unique(answers, places, 5))
        & (_are_unique(answers, places, 6) & _are_unique(answers, places, 7))
    )


@inlined_kernel
def _put_flags(answers, first, unique, at, stride):
    places = _places_of(first, _UNIQUE, 1, 0)
    if all_of(_all_unique(answers, places)):
        for lane in range(SQUARE):
            store_choices(unique, at + lane * stride, every(1.0) != 0.0)
    else:
        turned = _turned(answers, places)
        store_choices(unique, at, turned[0] != 0.0)
        store_choices(unique, at + stride, turned[1] != 0.0)
        store_choices(unique, at + 2 * stride, turned[2] != 0.0)
        store_choices(unique, at + 3 * stride, turned[3] != 0.0)
        store_choices(unique, at + 4 * stride, turned[4] != 0.0)
        store_choices(unique, at + 5 * stride, turned[5] != 0.0)
        store_choices(unique, at + 6 * stride, turned[6] != 0.0)
        store_choices(unique, at + 7 * stride, turned[7] != 0.0)


@inlined_kernel
def _put(answers, first, columns, rows):
    phi, p_GN, grad_W, unique = columns
    _put_numbers(answers, first, 0, 1, 0, phi, rows)
    _put_numbers(answers, first, 1, 3, 0, p_GN, rows)
    _put_numbers(answers, first, 1, 3, 1, p_GN, rows)
    _put_numbers(answers, first, 1, 3, 2, p_GN, rows)
    _put_numbers(answers, first, 4, 3, 0, grad_W, rows)
    _put_numbers(answers, first, 4, 3, 1, grad_W, rows)
    _put_numbers(answers, first, 4, 3, 2, grad_W, rows)
    _put_flags(answers, first, unique, rows.at, rows.stride)


@inlined_kernel
def put_square(answers, first, columns, at, stride):
    """Put eight lanes' answers about eight rows into columns.

    The first lane is at ``answers[first]``, its first row goes to ``at``, the next rows after
    it, and the next lanes' rows ``stride`` further each. The columns are phi, p_GN, grad_W
    and unique, all flat.
    """
    _put(answers, first, columns, _Rows(at, stride, False))


@inlined_kernel
def stream_square(answers, first, columns, at, stride):
    """Put answers as ``put_square`` does, past the caches.

    Each lane's first row has to begin a line in each column of numbers. Nobody may read
    before ``finish_streams``.
    """
    _put(answers, first, columns, _Rows(at, stride, True))


@inlined_kernel
def take_square(X, rows, tile, lane, number, poses, to):
    """Write eight numbers of eight poses as lanes, the first ones to ``poses[to]``.

    The poses are those of the eight rows from ``rows[tile, lane]`` on, and the numbers are those
    from ``number`` on. All arrays are C-contiguous.
    """
    turned = _turned(
        X,
        (
            _POSE * rows[tile, lane] + number,
            _POSE * rows[tile, lane + 1] + number,
            _POSE * rows[tile, lane + 2] + number,
            _POSE * rows[tile, lane + 3] + number,
            _POSE * rows[tile, lane + 4] + number,
            _POSE * rows[tile, lane + 5] + number,
            _POSE * rows[tile, lane + 6] + number,
            _POSE * rows[tile, lane + 7] + number,
        ),
    )
    store_lanes(poses, to, turned[0])
    store_lanes(poses, to + LANES, turned[1])
    store_lanes(poses, to + 2 * LANES, turned[2])
    store_lanes(poses, to + 3 * LANES, turned[3])
    store_lanes(poses, to + 4 * LANES, turned[4])
    store_lanes(poses, to + 5 * LANES, turned[5])
    store_lanes(poses, to + 6 * LANES, turned[6])
    store_lanes(poses, to + 7 * LANES, turned[7])
