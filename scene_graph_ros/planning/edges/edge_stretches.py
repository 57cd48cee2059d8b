"""The stretches of an edge that wait to be proven free, and those that are looked at."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.planning.edges.motion_kernels import Motions
from scene_graph_ros.planning.pairs.bodies import Places
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = [
    "COLLIDES",
    "FREE",
    "MOST_STRETCHES",
    "RECENT",
    "UNDECIDED",
    "UNFINISHED",
    "EdgeRules",
    "EdgeScratch",
    "Stretches",
    "longest_of",
    "new_stretches",
    "put",
]

COLLIDES = 0
FREE = 1
UNDECIDED = 2
UNFINISHED = 3
"""Left after as many looks as were allowed."""

MOST_STRETCHES = 4096
"""Stretches of an edge that wait to be looked at; an edge that needs more stays undecided."""

RECENT = 8
"""Pairs that collided last, and are asked first of the next edge."""


class EdgeRules(NamedTuple):
    """The rules of proofs, and the wanted extent of answers."""

    measures: bool
    """Whether to find up to where an edge is free; else it is left once known not to be."""
    part: float
    """Of a distance, how much may be used up before it is measured again: what is left is kept."""
    tolerance: float
    """Metres: where less is left, an edge is undecided."""
    asks_ends: bool = True
    """Whether an edge's ends are looked at first; else they must be known to be free."""


class EdgeScratch(NamedTuple):
    """The scratch arrays of proofs of edges; of one thread."""

    motions: Motions
    stretches: Stretches
    places: Places


class Stretches(NamedTuple):
    """The stretches of an edge that wait, in a ring, and those that are looked at; scratch."""

    ends: np.ndarray
    counts: np.ndarray
    """Where the ring begins, and how many wait."""
    low: np.ndarray
    middle: np.ndarray
    high: np.ndarray
    below: np.ndarray
    """How far before the middles all pairs looked at so far are free; negative where no longer."""
    above: np.ndarray
    """The same behind them."""
    states: np.ndarray
    """FREE, unless a pair collides or is too near in the middle."""
    blockers: np.ndarray
    open: np.ndarray
    """Pairs that covers do not decide, times LANES, plus the lane."""
    rests: np.ndarray
    """What their covers keep beyond the padding, metres."""
    recent: np.ndarray
    """The pairs that collided last."""


def new_stretches(pairs: int) -> Stretches:
    """Return scratch for one thread."""
    low, middle, high, below, above = (np.empty(LANES) for _ in range(5))
    return Stretches(
        np.empty((MOST_STRETCHES, 2)),
        np.zeros(2, np.int64),
        low,
        middle,
        high,
        below,
        above,
        np.empty(LANES, np.int64),
        np.empty(LANES, np.int64),
        np.empty(LANES * pairs, np.int64),
        np.empty(LANES * pairs),
        np.full(RECENT, -1),
    )


@inlined_kernel
def put(stretches, low, high):
    """Put a stretch behind those that wait; tell whether there was room."""
    count = stretches.counts
    if count[1] >= MOST_STRETCHES - LANES:
        return False
    place = (count[0] + count[1]) % MOST_STRETCHES
    stretches.ends[place, 0], stretches.ends[place, 1] = low, high
    count[1] += 1
    return True


@inlined_kernel
def longest_of(stretches, count):
    """Return the extent around a middle of the unproven part."""
    longest = 0.0
    for k in range(count):
        longest = max(longest, stretches.below[k], stretches.above[k])
    return longest
