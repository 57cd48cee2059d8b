"""Numbers in step: what single numbers give, lane by lane, and bit by bit."""

import math

from numba.core.errors import TypingError
import numpy as np
import pytest

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    as_lanes,
    bits_of,
    every,
    every_four,
    every_wide,
    FOUR,
    LANES,
    larger,
    load_four,
    load_lanes,
    load_number,
    load_wide,
    lowest_bit,
    magnitude,
    merging,
    reordering,
    root,
    select,
    smaller,
    store_choices,
    store_lanes,
    store_number,
    stream_lanes,
    WIDE,
    with_sign,
)
from scene_graph_ros.geometry.compiled.streams import finish_streams
from scene_graph_ros.geometry.spatial.vectors import cross, dot, rotate

A = np.array([0.0, -0.0, 1.5, -2.25, math.inf, -math.inf, 3e-310, 0.1])
B = np.array([1.0, 2.0, 1.5, 7.0, -1.0, 1.0, 4.0, -0.3])


@lean_kernel
def write_arithmetic(a, b, room, width):
    """Write results of lanes a and b, which are first in an array, after them."""
    store_lanes(room, 2 * width, a + b)
    store_lanes(room, 3 * width, a - 2.0)
    store_lanes(room, 4 * width, 3.0 * a)
    store_lanes(room, 5 * width, 1.0 / b)
    store_lanes(room, 6 * width, -a)
    store_lanes(room, 7 * width, with_sign(b, a))
    store_lanes(room, 8 * width, magnitude(a))
    store_lanes(room, 9 * width, root(magnitude(b)))


@lean_kernel
def eight_in_arithmetic(room):
    """Do so with eight lanes."""
    write_arithmetic(load_lanes(room, 0), load_lanes(room, LANES), room, LANES)


@lean_kernel
def four_in_arithmetic(room):
    """Do so with four lanes."""
    write_arithmetic(load_four(room, 0), load_four(room, FOUR), room, FOUR)


@lean_kernel
def wide_in_arithmetic(room):
    """Do so with wide lanes."""
    write_arithmetic(load_wide(room, 0), load_wide(room, WIDE), room, WIDE)


WIDTHS = pytest.mark.parametrize("width", [LANES, FOUR, WIDE])


@pytest.mark.parametrize("start", [0, FOUR])
@WIDTHS
def test_arithmetic_is_that_of_single_numbers(width, start):
    """Also for infinite numbers, those too small to be normal, and zeros with a sign."""
    a, b = [np.resize(np.roll(row, -start), width) for row in (A, B)]
    room = np.zeros((10, width))
    room[0], room[1] = a, b
    {LANES: eight_in_arithmetic, FOUR: four_in_arithmetic, WIDE: wide_in_arithmetic}[width](room)
    expected = [
        [x + y, x - 2.0, 3.0 * x, 1.0 / y, -x, math.copysign(y, x), abs(x), math.sqrt(abs(y))]
        for x, y in zip(a, b, strict=True)
    ]
    assert room[2:].T.tobytes() == np.array(expected).tobytes()


@lean_kernel
def write_choices(a, b, one, room, width):
    """Write what is chosen by comparisons of lanes a and b; ``one`` has ones."""
    zero = one - 1.0
    store_lanes(room, 2 * width, select(a < b, one, zero))
    store_lanes(room, 3 * width, select(a <= b, one, zero))
    store_lanes(room, 4 * width, select(a > b, 1.0, zero))
    store_lanes(room, 5 * width, select(a >= b, one, 0.0))
    store_lanes(room, 6 * width, select(a == b, one, zero))
    store_lanes(room, 7 * width, select(a != b, one, zero))
    store_lanes(room, 8 * width, select((a < b) & ~(b < 2.0), one, zero))
    store_lanes(room, 9 * width, select((a > b) | (a == b), one, zero))
    return any_of(a > b), all_of(a > b), any_of(a > 1e9), all_of(a < 1e9), all_of(b == 3.0)


@lean_kernel
def eight_chosen(room):
    """Do so with eight lanes."""
    a, b = load_lanes(room, 0), load_lanes(room, LANES)
    return write_choices(a, b, every(1.0), room, LANES)


@lean_kernel
def four_chosen(room):
    """Do so with four lanes."""
    a, b = load_four(room, 0), load_four(room, FOUR)
    return write_choices(a, b, as_lanes((1.0, 1.0, 1.0, 1.0)), room, FOUR)


@lean_kernel
def wide_chosen(room):
    """Do so with wide lanes."""
    a, b = load_wide(room, 0), load_wide(room, WIDE)
    return write_choices(a, b, every_wide(1.0), room, WIDE)


@WIDTHS
def test_comparisons_choose_lane_by_lane(width):
    """Nothing but what is unequal is chosen where one is nan; some and all are told apart."""
    room = np.zeros((10, width))
    room[0] = np.resize([2.0, 3.0, math.nan, 5.0, 0.0, 1.0, 6.0, 7.0], width)
    room[1] = 3.0
    told = {LANES: eight_chosen, FOUR: four_chosen, WIDE: wide_chosen}[width](room)
    assert tuple(map(bool, told)) == (True, False, False, False, True)
    for row, condition in enumerate(
        (
            lambda a: a < 3,
            lambda a: a <= 3,
            lambda a: a > 3,
            lambda a: a >= 3,
            lambda a: a == 3,
            lambda a: a != 3,
            lambda a: a < 3,
            lambda a: a >= 3,
        )
    ):
        assert room[2 + row].tolist() == [float(condition(a)) for a in room[0]]


@lean_kernel
def write_larger(a, b, room, width):
    """Write the larger and the smaller of lanes a and b, and of b and a number."""
    store_lanes(room, 2 * width, larger(a, b))
    store_lanes(room, 3 * width, smaller(a, b))
    store_lanes(room, 4 * width, larger(b, 2.0))
    store_lanes(room, 5 * width, smaller(b, 2.0))


@lean_kernel
def larger_of_eight(room):
    """Do so with eight lanes."""
    write_larger(load_lanes(room, 0), load_lanes(room, LANES), room, LANES)


@lean_kernel
def larger_of_four(room):
    """Do so with four lanes."""
    write_larger(load_four(room, 0), load_four(room, FOUR), room, FOUR)


@lean_kernel
def larger_of_wide(room):
    """Do so with wide lanes."""
    write_larger(load_wide(room, 0), load_wide(room, WIDE), room, WIDE)


@WIDTHS
def test_the_larger_and_the_smaller_are_the_second_where_one_is_nan(width):
    """Also where both are zero, of whatever sign."""
    room = np.zeros((6, width))
    room[0] = np.resize([1.0, math.nan, 0.0, 4.0, -math.inf, math.nan, -0.0, 5.0], width)
    room[1] = np.resize([3.0, 3.0, -0.0, math.nan, 1.0, 7.0, 0.0, 4.0], width)
    {LANES: larger_of_eight, FOUR: larger_of_four, WIDE: larger_of_wide}[width](room)
    pairs = list(zip(*room[:2], strict=True))
    expected = [
        [a if a > b else b for a, b in pairs],
        [a if a < b else b for a, b in pairs],
        [b if b > 2.0 else 2.0 for _, b in pairs],
        [b if b < 2.0 else 2.0 for _, b in pairs],
    ]
    assert room[2:].tobytes() == np.array(expected).tobytes()


@lean_kernel
def single_numbers(a, b, room):
    """Write what functions of lanes give for single numbers, and lanes of two of them."""
    room[0], room[1], room[2] = root(a), magnitude(-b), with_sign(a, b)
    room[3], room[4] = larger(a, b), smaller(a, b)
    room[5], room[6] = select(a < b, a, b), select(a > b, a, b)
    store_lanes(room, 8, select(load_four(room, 0) > every_four(2.0), 1.0, -1.0))


def test_single_numbers():
    """Functions of lanes take single numbers, too, and choose among two for all lanes."""
    room = np.zeros(12)
    single_numbers(6.25, -1.5, room)
    assert room[:7].tolist() == [2.5, 1.5, -6.25, 6.25, -1.5, -1.5, 6.25]
    assert room[8:].tolist() == [1.0, -1.0, -1.0, 1.0]


_turn, _reverse = reordering(1, 2, 0, 3), reordering(*range(LANES - 1, -1, -1))
_zip, _join = merging(0, 4, 1, 5), merging(*range(LANES))


@lean_kernel
def reorder(room):
    """Write orders of the first eight numbers after them; return the sum of some."""
    a, b = load_four(room, 0), load_four(room, FOUR)
    store_lanes(room, 8, _turn(a))
    store_lanes(room, 12, _zip(a, b))
    store_lanes(room, 16, _reverse(_join(b, a)))
    return _join(a, b)[6] + a[1]


def test_orders():
    """Lanes are turned, merged, and taken one by one; halves become eight."""
    room = np.zeros(24)
    room[:8] = range(10, 18)
    assert reorder(room) == 16.0 + 11.0
    assert room[8:12].tolist() == [11, 12, 10, 13]
    assert room[12:16].tolist() == [10, 14, 11, 15]
    assert room[16:].tolist() == [13, 12, 11, 10, 17, 16, 15, 14]


@lean_kernel
def stream(numbers, first, flags):
    """Write 16 numbers past the caches, from a line's start on, and which are odd, as bytes."""
    one = as_lanes((0.0, 1.0, 0.0, 1.0))
    stream_lanes(numbers, first, every(7.0))
    stream_lanes(numbers, first + LANES, one)
    stream_lanes(numbers, first + LANES + FOUR, 2.0 * one)
    finish_streams()
    store_choices(flags, 1, one != 0.0)
    store_choices(flags, 1 + FOUR, every(1.0) == 1.0)


def test_what_is_written_past_the_caches():
    """It is there as if written in the ordinary way, and choices are booleans of arrays."""
    numbers, flags = np.zeros(32), np.zeros(16, np.bool_)
    first = (-numbers.ctypes.data // numbers.itemsize) % LANES
    stream(numbers, first, flags)
    assert numbers[first : first + 16].tolist() == [7.0] * 8 + [0, 1, 0, 1, 0, 2, 0, 2]
    assert np.count_nonzero(numbers) == 12
    assert flags.tolist() == [False] * 2 + [True, False, True] + [True] * 8 + [False] * 3


@lean_kernel
def mixed(room):
    """Add four lanes to eight."""
    return any_of(load_lanes(room, 0) + load_four(room, 0) > 0.0)


@pytest.mark.compiled
def test_lanes_of_two_widths_are_not_mixed():
    """Whoever tries learns it when the kernel is compiled."""
    with pytest.raises(TypingError, match=r"LaneNumbers\(8\), LaneNumbers\(4\)"):
        mixed(np.zeros(8))


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


@lean_kernel
def bits_of_larger(room):
    """Return the bits of the lanes of which the first numbers are larger, and the lowest of them.

    Of eight, of four, and of wide lanes.
    """
    eight = bits_of(load_lanes(room, 0) > load_lanes(room, WIDE))
    four = bits_of(load_four(room, 0) > load_four(room, WIDE))
    wide = bits_of(load_wide(room, 0) > load_wide(room, WIDE))
    return eight, four, wide, lowest_bit(eight), lowest_bit(four), lowest_bit(wide)


def test_bits_are_those_of_the_chosen_lanes():
    """The lowest bit is that of the first lane; it is beyond all where none is chosen."""
    room = np.zeros(2 * WIDE)
    room[[2, 5, WIDE - 1]] = 1.0
    high = 1 << (WIDE - 1)
    assert bits_of_larger(room) == (0b100100, 0b100, high + 0b100100, 2, 2, 2)
    room[[2, 5]] = -1.0
    assert bits_of_larger(room) == (0, 0, high, 64, 64, WIDE - 1)
