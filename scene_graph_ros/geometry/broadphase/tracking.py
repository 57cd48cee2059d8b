"""Candidate pairs of things that move a little from one call to the next.

Every box that moves has a larger one around it, its fence, and the pairs whose fences meet are
kept in a list. While all boxes stay inside of their fences, the candidates are found by a look at
the pairs of the list. A box that leaves gets a new fence, and its pairs are looked up again; when
many leave, all pairs are searched anew. Boxes that don't move have no fence but themselves.

The candidates are those that a search of all pairs finds, with any history.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import bound_row, BoxGeometry
from scene_graph_ros.geometry.broadphase.box_vectors import new_placed_rows, PlacedRows
from scene_graph_ros.geometry.broadphase.fences import (
    Fences,
    is_outside,
    make_fence,
    new_fences,
    NO_ROOM,
    renew_pairs,
)
from scene_graph_ros.geometry.broadphase.hierarchical_grid import candidate_pairs
from scene_graph_ros.geometry.broadphase.pair_tests import (
    box_reaches_half_space,
    square_of_gap,
    square_within,
)
from scene_graph_ros.geometry.broadphase.separating_axes import drop_separated
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.pose_vectors import remember_pose
from scene_graph_ros.geometry.tables.holding import Holding

__all__ = ["BOUNDED", "COUNTERS", "LOOKED_AT", "REFENCED", "SEARCHED", "Bodies", "Tracker"]

COUNTERS = 4
"""What was done is counted, so that tests can tell work from no work."""
BOUNDED = 0
"""Boxes computed, since their pose changed."""
LOOKED_AT = 1
"""Pairs of boxes compared."""
REFENCED = 2
"""Boxes that left their fence and were compared with every other."""
SEARCHED = 3
"""Searches of all pairs."""

_LENGTH, _TURN = 4, 5
"""After the counters: of the list, and which of two arrays it is in."""
_STATE = 6

MAX_REFENCED = 200
"""When more boxes leave at once, all pairs are searched, which then takes less time."""
_LOST = -1
"""Instead of a number of candidates: all pairs have to be searched."""
_NO_PAIRS = np.empty((0, 2), np.int64)
_ROOM = 256
"""Pairs more than twice those found for which a list has room."""


class Bodies(NamedTuple):
    """The data of candidates, beside poses: n rows."""

    geometry: BoxGeometry
    moving: NDArray[np.int64]
    """(m,) the rows that may move; the poses of the others are always the same."""
    is_half_space: NDArray[np.bool_]
    """(n,)"""
    frame: NDArray[np.int32]
    """(n,), as in ``candidate_pairs``."""
    filter_bits: NDArray[np.uint8]
    """As there."""


class _Tracked(NamedTuple):
    """The state of the last poses."""

    X_last: NDArray[np.float64]
    """(n, 4, 4)"""
    placed: PlacedRows
    fences: Fences
    step: NDArray[np.float64]
    """(n,) how far the box moved when it left its fence."""
    is_out: NDArray[np.bool_]
    """(n,), and which those are, after their number: (n + 1,). Nobody is between calls."""
    out: NDArray[np.int64]
    scratch: tuple[Any, ...]
    """For ``renew_pairs``."""
    lists: NDArray[np.int64]
    """(3, room, 2): two that take turns to have the list, and the candidates."""
    state: NDArray[np.int64]
    """(_STATE,)"""


def _new_tracked(n: int, lists: NDArray[np.int64]) -> _Tracked:
    words = np.zeros((n + 7) // 8, np.int64)
    return _Tracked(
        X_last=np.full((n, 4, 4), np.nan),
        placed=new_placed_rows(n),
        fences=new_fences(n),
        step=np.zeros(n),
        is_out=np.zeros(n, np.bool_),
        out=np.zeros(n + 1, np.int64),
        scratch=(np.zeros(n + 1, np.int64), words, words.view(np.bool_)),
        lists=lists,
        state=np.zeros(_STATE, np.int64),
    )


def _new_lists(length: int, n: int) -> NDArray[np.int64]:
    """Return lists with room for more than so many of the pairs of n rows."""
    return np.empty((3, min(2 * length + _ROOM, n * (n - 1) // 2), 2), np.int64)


def _example() -> tuple[Bodies, _Tracked]:
    """Return the state of no rows."""
    numbers, rows = np.empty((0, 4)), np.empty(0, np.int64)
    bodies = Bodies(
        BoxGeometry(numbers, np.empty((0, 2), np.int64), numbers, numbers), rows,
        np.empty(0, np.bool_), np.empty(0, np.int32), np.empty((0, 0), np.uint8),
    )  # fmt: skip
    return bodies, _new_tracked(0, _new_lists(0, 0))


_holding = Holding("arrays as Bodies describes them", _example)
_borrowed = _holding.borrowed


@inlined_kernel
def _reaches_half_space(lower, upper, is_half_space, X_WG, i, j, margin):
    """Tell whether a box and a half space come within ``margin``; two half spaces always do."""
    if is_half_space[i]:
        return is_half_space[j] or box_reaches_half_space(lower, upper, j, X_WG, i, margin)
    return box_reaches_half_space(lower, upper, i, X_WG, j, margin)


@inlined_kernel
def _move(bodies, tracked, X_WG, rows):
    """Bring the boxes of ``rows`` up to date; mark and list those that are out of their fence."""
    lower, upper, out = tracked.placed.lower, tracked.placed.upper, tracked.out
    bounded = count = 0
    for row in rows:
        i = row & LAST_PLACE
        if not remember_pose(X_WG, i, tracked.X_last, i):
            continue
        bounded += 1
        x, y, z = lower[i, 0], lower[i, 1], lower[i, 2]
        bound_row(bodies.geometry, X_WG, i, tracked.placed)
        if bodies.is_half_space[i] or is_outside(lower, upper, tracked.fences, i):
            tracked.step[i] = max(abs(lower[i, 0] - x), abs(lower[i, 1] - y), abs(lower[i, 2] - z))
            tracked.is_out[i] = True
            count += 1
            out[count] = i
    out[0] = count
    tracked.state[BOUNDED] += bounded


@inlined_kernel
def _renew(bodies, tracked, margin):
    """Give those that are out new fences and look up their pairs; return False if all is lost."""
    state, lists, is_out = tracked.state, tracked.lists, tracked.is_out
    length, turn = state[_LENGTH], state[_TURN]
    out = tracked.out[1 : tracked.out[0] + 1]
    is_dense = length > len(is_out)
    for i in out:
        make_fence(
            tracked.placed.lower, tracked.placed.upper, tracked.fences, tracked.step, i, is_dense
        )
    state[REFENCED] += len(out)
    state[LOOKED_AT] += len(out) * len(is_out)
    length = renew_pairs(
        tracked.fences.sides, bodies.frame, bodies.filter_bits, margin, is_out, out,
        tracked.scratch, lists[turn, :length], lists[1 - turn], lists[2],
    )  # fmt: skip
    if length == NO_ROOM:
        return False
    state[_LENGTH], state[_TURN] = length, 1 - turn
    for i in out:
        is_out[i] = False
    return True


@inlined_kernel
def _select(bodies, tracked, X_WG, margin, pairs, result):
    """Write the pairs that come within ``margin`` of each other; return how many."""
    lower, upper, is_half_space = tracked.placed.lower, tracked.placed.upper, bodies.is_half_space
    limit = square_within(margin)
    count = 0
    for k in range(len(pairs)):
        i, j = pairs[k, 0] & LAST_PLACE, pairs[k, 1] & LAST_PLACE
        result[count & LAST_PLACE, 0], result[count & LAST_PLACE, 1] = i, j
        is_near = square_of_gap(lower, upper, i, j) <= limit
        if is_half_space[i] | is_half_space[j]:
            is_near = _reaches_half_space(lower, upper, is_half_space, X_WG, i, j, margin)
        count += is_near
    return count


@lean_kernel
def _track(places, X_WG, margin, is_close):
    """Write the candidates, the last of ``lists``; return how many there are, or _LOST.

    With ``is_close`` those are left out that ``drop_separated`` shows to be further apart.
    """
    bodies, tracked = _borrowed(places)
    state, lists = tracked.state, tracked.lists
    if state[_LENGTH] < 0:
        return _LOST
    _move(bodies, tracked, X_WG, bodies.moving)
    if tracked.out[0] > MAX_REFENCED:
        return _LOST
    if tracked.out[0] > 0 and not _renew(bodies, tracked, margin):
        return _LOST
    pairs, result = lists[state[_TURN], : state[_LENGTH]], lists[2]
    state[LOOKED_AT] += len(pairs)
    count = _select(bodies, tracked, X_WG, margin, pairs, result)
    if is_close:
        count = drop_separated(
            bodies.geometry.extents, tracked.placed.centre, X_WG, result, count, margin
        )
    return count


@kernel
def _search(bodies, tracked, X_WG, margin, is_new, is_dense):
    """Make all fences anew and return all pairs whose fences meet, sorted."""
    fences = tracked.fences
    n = len(fences.lower)
    if is_new:
        _move(bodies, tracked, X_WG, np.arange(n))
        tracked.step[:] = 0.0
    for i in range(n):
        make_fence(tracked.placed.lower, tracked.placed.upper, fences, tracked.step, i, is_dense)
    tracked.is_out[:] = False
    tracked.state[SEARCHED] += 1
    lower, upper = fences.lower[:, :3].copy(), fences.upper[:, :3].copy()
    return candidate_pairs(
        lower, upper, bodies.is_half_space, X_WG, bodies.frame, bodies.filter_bits, margin
    )


class Tracker:
    """Finds candidates for one margin, in poses that follow each other. One thread at a time."""

    def __init__(self, bodies: Bodies, margin: float) -> None:
        """Take the bodies, and a finite margin >= 0, in metres."""
        self._bodies = bodies
        self._margin = margin
        n = len(bodies.frame)
        self._keep(_new_tracked(n, _new_lists(0, n)))
        self._tracked.state[_LENGTH] = _LOST

    def _keep(self, tracked: _Tracked) -> None:
        """Write down where the arrays are."""
        self._tracked = tracked
        self._places = _holding.places((self._bodies, tracked))
        self._candidates = tracked.lists[2]

    @property
    def counters(self) -> NDArray[np.int64]:
        """Counts of the work so far, (COUNTERS,)."""
        return self._tracked.state[:COUNTERS].copy()

    def find(self, X_WG: NDArray[np.float64], is_close: bool) -> NDArray[np.int64]:
        """Return the candidates at poses (n, 4, 4), sorted rows (k, 2).

        With ``is_close`` those are left out that ``drop_separated`` shows to be further apart.
        """
        count = _track(self._places, X_WG, self._margin, is_close)
        if count == _LOST:
            self._search(X_WG)
            count = _track(self._places, X_WG, self._margin, is_close)
        return self._candidates[:count].copy() if count else _NO_PAIRS

    def _search(self, X_WG: NDArray[np.float64]) -> None:
        """Search all pairs, and make the list anew. An interruption leaves it lost."""
        tracked, n = self._tracked, len(self._bodies.frame)
        length = int(tracked.state[_LENGTH])
        tracked.state[_LENGTH] = _LOST
        pairs = _search(self._bodies, tracked, X_WG, self._margin, length < 0, length > n)
        if 2 * len(pairs) > tracked.lists.shape[1]:
            lists = _new_lists(len(pairs), n)
            self._keep(tracked._replace(lists=lists))
        self._tracked.lists[0, : len(pairs)] = pairs
        self._tracked.state[_LENGTH:] = len(pairs), 0
