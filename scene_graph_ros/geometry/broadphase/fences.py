"""Fat bounding boxes, here called fences, and the sorted list of the pairs whose fences meet.

A fence has room for some steps of its box. While a box stays inside, its pairs in the list are
all that it can be near to.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.box_vectors import CORNER
from scene_graph_ros.geometry.broadphase.pair_tests import is_pair_wanted
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import any_of, load_four
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.tolerances import BOX_ROUNDING

__all__ = ["NO_ROOM", "Fences", "is_outside", "make_fence", "new_fences", "renew_pairs"]

NO_ROOM = -1
"""Instead of a number of pairs: there are more than the array has room for."""

MAX_MERGED = 200
"""So many new pairs are sorted and merged into the list; more, and the whole list is sorted."""
DENSE = (4.0, 0.3)
SPARSE = (8.0, 1.0)
"""A fence leaves room for so many steps like the last one in each direction, but for no more than
this part of the box's width. Wide fences are left seldom, but they meet more others: where there
are more pairs than boxes, looking at those takes longer than making new fences."""


class Fences(NamedTuple):
    """The fences of n rows, twice: coordinate by coordinate, and corner by corner."""

    sides: NDArray[np.float64]
    """(6, n): lower and upper corners."""
    lower: NDArray[np.float64]
    """(n, CORNER), as corners of boxes; nothing is below the spare number."""
    upper: NDArray[np.float64]
    """(n, CORNER); nothing is above the spare number."""


def new_fences(n: int) -> Fences:
    """Return the arrays to write to: boxes without extent at the origin."""
    lower, upper = np.zeros((2, n, CORNER))
    lower[:, 3], upper[:, 3] = -math.inf, math.inf
    return Fences(np.zeros((6, n)), lower, upper)


@inlined_kernel
def make_fence(lower, upper, fences, step, i, is_dense):
    """Put a new fence around the box of row i, with room for steps like its last."""
    steps, most = DENSE if is_dense else SPARSE
    width = 0.0
    for axis in range(3):
        width = max(width, upper[i, axis] - lower[i, axis])
    room = 0.0
    if width < math.inf and step[i] < width:  # what jumps has no use for a fence
        room = min(steps * step[i], most * width)
    for axis in range(3):
        low, high = lower[i, axis] - room, upper[i, axis] + room
        fences.lower[i, axis] = fences.sides[axis, i] = low
        fences.upper[i, axis] = fences.sides[3 + axis, i] = high


@inlined_kernel
def is_outside(lower, upper, fences, i):
    """Tell whether the box of row i is partly outside of its fence."""
    at = i * CORNER
    return any_of(
        (load_four(lower, at) < load_four(fences.lower, at))
        | (load_four(upper, at) > load_four(fences.upper, at))
    )


@inlined_kernel
def _grown(low, high, margin):
    """Grow an interval by a margin, and by the rounding of a gap."""
    extra = margin + BOX_ROUNDING * (abs(low) + abs(high) + margin)
    return low - extra, high + extra


@lean_kernel
def _meet(fence, i, margin, meets):
    """Write into ``meets`` which fences come within ``margin`` of row i's."""
    x, X = _grown(fence[0, i], fence[3, i], margin)
    y, Y = _grown(fence[1, i], fence[4, i], margin)
    z, Z = _grown(fence[2, i], fence[5, i], margin)
    for j in range(fence.shape[1]):
        meets[j] = (
            (x <= fence[3, j])
            & (y <= fence[4, j])
            & (z <= fence[5, j])
            & (fence[0, j] <= X)
            & (fence[1, j] <= Y)
            & (fence[2, j] <= Z)
        )


@inlined_kernel
def _is_after(pairs, a, others, b):
    """Tell whether pair a comes after pair b of others."""
    first = others[b, 0]
    return pairs[a, 0] > first or (pairs[a, 0] == first and pairs[a, 1] > others[b, 1])


@lean_kernel
def _sort_few(pairs, first, last):
    """Sort a few pairs, those from first to last, by insertion."""
    for k in range(first + 1, last):
        i, j = pairs[k, 0], pairs[k, 1]
        at = k
        while at > first and (
            pairs[at - 1, 0] > i or (pairs[at - 1, 0] == i and pairs[at - 1, 1] > j)
        ):
            pairs[at, 0], pairs[at, 1] = pairs[at - 1, 0], pairs[at - 1, 1]
            at -= 1
        pairs[at, 0], pairs[at, 1] = i, j


@lean_kernel
def _merge(pairs, kept, count, spare):
    """Merge the sorted pairs from ``kept`` to ``count`` into the sorted ones before them."""
    for k in range(kept, count):
        spare[k - kept, 0], spare[k - kept, 1] = pairs[k, 0], pairs[k, 1]
    a, b = kept - 1, count - kept - 1
    for at in range(count - 1, -1, -1):
        if b < 0:
            break
        if a >= 0 and _is_after(pairs, a, spare, b):
            pairs[at, 0], pairs[at, 1] = pairs[a, 0], pairs[a, 1]
            a -= 1
        else:
            pairs[at, 0], pairs[at, 1] = spare[b, 0], spare[b, 1]
            b -= 1


@lean_kernel
def _counting_pass(source, target, count, column, starts):
    """Write pairs to ``target`` in the order of one column, else in theirs."""
    starts[:] = 0
    for k in range(count):
        starts[source[k, column] + 1] += 1
    for row in range(len(starts) - 1):
        starts[row + 1] += starts[row]
    for k in range(count):
        slot = starts[source[k, column]]
        starts[source[k, column]] += 1
        target[slot, 0], target[slot, 1] = source[k, 0], source[k, 1]


@lean_kernel
def renew_pairs(fence, frame, filter_bits, margin, is_out, out, scratch, pairs, found, spare):
    """Write the list ``pairs`` into ``found``, with the pairs of the rows in ``out`` looked up.

    Return how many there are, or NO_ROOM. ``scratch`` is starts (n + 1,), words and meets, the
    same bytes as integers and as bools, at least n of these; ``spare`` is as long as ``found``.
    """
    starts, words, meets = scratch
    n = fence.shape[1]
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        found[count & LAST_PLACE, 0], found[count & LAST_PLACE, 1] = i, j
        count += not (is_out[i] | is_out[j])
    kept = count
    for i in out:
        _meet(fence, i, margin, meets)
        for word in range(len(words)):
            if words[word] == 0:
                continue
            for j in range(8 * word, min(8 * word + 8, n)):
                # A half space meets all: what is infinite has no fence.
                if not meets[j] or i == j or (is_out[j] and j < i):
                    continue
                if is_pair_wanted(frame, filter_bits, i, j):
                    if count == len(found):
                        return NO_ROOM
                    found[count, 0], found[count, 1] = min(i, j), max(i, j)
                    count += 1
    if count - kept > MAX_MERGED:
        _counting_pass(found, spare, count, 1, starts)
        _counting_pass(spare, found, count, 0, starts)
    else:
        _sort_few(found, kept, count)
        _merge(found, kept, count, spare)
    return count
