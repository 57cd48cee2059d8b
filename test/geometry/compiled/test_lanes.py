"""Numbers in step: what single numbers give, lane by lane, and bit by bit."""

import math

import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    every,
    LANES,
    load_lanes,
    load_number,
    magnitude,
    root,
    select,
    store_lanes,
    store_number,
    with_sign,
)
from scene_graph_ros.geometry.spatial.vectors import cross, dot, rotate

A = np.array([0.0, -0.0, 1.5, -2.25, math.inf, -math.inf, 3e-310, 0.1])
B = np.array([1.0, 2.0, 1.5, 7.0, -1.0, 1.0, 4.0, -0.3])


@lean_kernel
def arithmetic(room):
    """Write results of lanes a and b, which are first in an array, after them."""
    a, b = load_lanes(room, 0), load_lanes(room, LANES)
    store_lanes(room, 2 * LANES, a + b)
    store_lanes(room, 3 * LANES, a - 2.0)
    store_lanes(room, 4 * LANES, 3.0 * a)
    store_lanes(room, 5 * LANES, 1.0 / b)
    store_lanes(room, 6 * LANES, -a)
    store_lanes(room, 7 * LANES, with_sign(b, a))
    store_lanes(room, 8 * LANES, magnitude(a))
    store_lanes(room, 9 * LANES, root(magnitude(b)))


def test_arithmetic_is_that_of_single_numbers():
    """Also for infinite numbers, those too small to be normal, and zeros with a sign."""
    room = np.zeros((10, LANES))
    room[0], room[1] = A, B
    arithmetic(room)
    expected = [
        [a + b, a - 2.0, 3.0 * a, 1.0 / b, -a, math.copysign(b, a), abs(a), math.sqrt(abs(b))]
        for a, b in zip(A, B, strict=True)
    ]
    assert room[2:].T.tobytes() == np.array(expected).tobytes()


@lean_kernel
def choices(room):
    """Write what is chosen by comparisons of lanes a and b."""
    a, b = load_lanes(room, 0), load_lanes(room, LANES)
    zero, one = every(0.0), every(1.0)
    store_lanes(room, 2 * LANES, select(a < b, one, zero))
    store_lanes(room, 3 * LANES, select(a <= b, one, zero))
    store_lanes(room, 4 * LANES, select(a > b, 1.0, zero))
    store_lanes(room, 5 * LANES, select(a >= b, one, 0.0))
    store_lanes(room, 6 * LANES, select(a == b, one, zero))
    store_lanes(room, 7 * LANES, select((a < b) & ~(b < 2.0), one, zero))
    store_lanes(room, 8 * LANES, select((a > b) | (a == b), one, zero))
    return any_of(a > b), all_of(a > b), any_of(a > 1e9), all_of(a < 1e9)


def test_comparisons_choose_lane_by_lane():
    """Nothing is chosen where one is nan; some and all are told apart."""
    room = np.zeros((9, LANES))
    room[0], room[1] = [0.0, 1.0, 2.0, 3.0, math.nan, 5.0, 6.0, 7.0], [3.0] * LANES
    told = choices(room)
    assert tuple(map(bool, told)) == (True, False, False, False)
    for row, condition in enumerate(
        (
            lambda a: a < 3,
            lambda a: a <= 3,
            lambda a: a > 3,
            lambda a: a >= 3,
            lambda a: a == 3,
            lambda a: a < 3,
            lambda a: a >= 3,
        )
    ):
        assert room[2 + row].tolist() == [float(condition(a)) for a in room[0]]


@lean_kernel
def vectors(room):
    """Write R v and v x w . v of lanes v and w, with one rotation for all."""
    v = load_lanes(room, 0), load_lanes(room, LANES), load_lanes(room, 2 * LANES)
    w = load_lanes(room, 3 * LANES), load_lanes(room, 4 * LANES), load_lanes(room, 5 * LANES)
    x = rotate((0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), v)
    store_lanes(room, 6 * LANES, x[0])
    store_lanes(room, 7 * LANES, x[1])
    store_lanes(room, 8 * LANES, dot(cross(v, w), w))


def test_functions_of_vectors_take_lanes():
    """What is written for tuples of numbers serves lanes."""
    room = np.random.default_rng(1).normal(size=(9, LANES))
    v = room[:3].copy()
    vectors(room)
    assert np.array_equal(room[6], -v[1])
    assert np.array_equal(room[7], v[0])
    assert room[8] == pytest.approx(0.0, abs=1e-15 * LANES)


@lean_kernel
def move_number(room, start, end):
    """Copy a number from one place to another."""
    store_number(room, end, load_number(room, start))


def test_single_numbers_are_counted_flat():
    """A place counts through all rows."""
    room = np.arange(24.0).reshape(3, 8)
    move_number(room, 9, 22)
    assert room[2, 6] == 9.0
