"""Motions as cubic splines in time, made shorter by distances and their derivatives.

In each round distances of near pairs are taken at places along the spline. To first order they
are half-spaces of its control points, and within these, limits and a box around where it was the
fastest spline is found. It is gone to as far as distances, taken anew, allow.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.motion.spline_kernels import fastest_spline, HalfSpaces
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.near_pairs import near_rows, NearRows
from scene_graph_ros.planning.parallel.stoppable import Turns

__all__ = [
    "GOOD_ENOUGH",
    "Sampling",
    "Spline",
    "SplineRoom",
    "first_spline",
    "good_duration",
    "load_spline_kernels",
    "shorter_splines",
]

Array = NDArray[np.float64]

_FIXED = 3
"""Control points at each end that say where it begins and ends."""

_SPANS_TO_SPEED, _SPANS_WITHOUT_JERKS = 3.0, 6.0
"""Intervals between knots in the time that it takes to get fast: more where accelerations may
jump, as those of a spline do not."""

_FEWEST, _MOST = 16, 48
"""Intervals altogether."""

_SHORTEST_RAMP, _LONGEST_RAMP = 0.05, 0.45
"""Of its duration: how long a first spline takes to get fast, and to brake."""

_PLACES, _DENSER = 2, 3
"""Between two knots, at which distances are taken; times so many where that was not enough."""

_KEPT = 3e-3
"""m: what a motion keeps beyond its paddings, where its first spline does."""

_NEAR = 0.08
"""m: up to where distances are taken."""

_TRUST = 0.4
"""rad, or m: how far a control point is moved in the first round, per coordinate, at most."""

_PART = 0.5
"""Of what was kept: what has to be kept once more after a step."""

_LESS = 0.02
"""Of what a pair keeps: what it may lose in a step, where it keeps too little."""

_ROOM = 1.02
"""Times the least time between two knots: where a round begins."""

_SPARE = 1e-7
"""rad or m: by how much a control point is inside of its box, at least."""

_STEPS = (1.0, 0.5, 0.2)
"""Parts of a round's step that are tried."""

_LARGER = 2.0
"""Times the box around it: where the whole step was good."""

_SMALLER = 0.3
"""Times the box around it: where no part was any good."""

_GAPS = (0.05, 0.02)
"""How far from the best a round ends; the last ones as the second."""

_ROUNDS = 5
"""At most."""

_SAVED = 0.01
"""Of the duration: a round that saves less is the last."""

GOOD_ENOUGH = 1.03
"""Times the least time without anything in the way: what is good enough."""


class Spline(NamedTuple):
    """A uniform cubic B-spline in time."""

    control_points: Array
    """``(m, k)``."""
    seconds: float
    """From knot to knot."""

    @property
    def spans(self) -> int:
        """How many intervals it has between its knots."""
        return len(self.control_points) - _FIXED

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.spans * self.seconds

    def states(self) -> tuple[Array, Array, Array]:
        """Return positions, velocities and accelerations at its knots, each ``(m - 2, k)``."""
        before, at, after = (self.control_points[i : i + self.spans + 1] for i in range(3))
        u = self.seconds
        return (
            (before + 4.0 * at + after) / 6.0,
            (after - before) / (2.0 * u),
            (before - 2.0 * at + after) / (u * u),
        )

    def bezier(self) -> Array:
        """Return the control points ``(m - 3, 4, k)`` of the Bézier curve of each interval."""
        parts = [self.control_points[i : i + self.spans] for i in range(4)]
        return np.stack(
            [
                (parts[0] + 4.0 * parts[1] + parts[2]) / 6.0,
                (4.0 * parts[1] + 2.0 * parts[2]) / 6.0,
                (2.0 * parts[1] + 4.0 * parts[2]) / 6.0,
                (parts[1] + 4.0 * parts[2] + parts[3]) / 6.0,
            ],
            axis=1,
        )


class SplineRoom(NamedTuple):
    """Where a spline may go, and how fast."""

    plan: CheckerPlan
    at: Array
    """``(nq,)``: all positions, of which some move."""
    rows: NDArray[np.intp]
    """``(k,)``: those that move."""
    limits: Array
    """``(2 or 3, k)``: of velocities, accelerations and perhaps jerks."""
    lower: Array
    """``(k,)``: of positions."""
    upper: Array

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Which positions move, ``(nq,)``."""
        result = np.zeros(len(self.at), dtype=np.bool_)
        result[self.rows] = True
        return result

    def whole(self, points: Array) -> Array:
        """Return configurations ``(..., nq)`` of the positions that move ``(..., k)``."""
        result = np.empty((*points.shape[:-1], len(self.at)))
        result[:] = self.at
        result[..., self.rows] = points
        return result

    def least_seconds(self, control_points: Array) -> float:
        """Return the least time from knot to knot that limits allow."""
        most, differences = 0.0, control_points
        for order, own in enumerate(self.limits, start=1):
            differences = differences[1:] - differences[:-1]
            most = max(most, float((np.abs(differences) / own).max()) ** (1.0 / order))
        return most


_loaded: set[str] = set()
"""What is loaded or compiled."""


def load_spline_kernels(checker: SceneGraphCollisionChecker) -> None:
    """Load the kernels, or compile them, before time is counted, once in a process."""
    if "spline" in _loaded:
        return
    q = checker.plan.tree.zero_configuration()
    lower, upper = np.full((2, 1), [[-1.0], [1.0]])
    room = SplineRoom(checker.plan, q, np.zeros(1, np.intp), np.ones((3, 1)), lower, upper)
    spline = first_spline(room, np.array([[-0.1], [0.1]]))
    sampling = Sampling.even(room, spline.spans)
    _fastest(sampling, spline, sampling.places(spline.control_points), _TRUST, 0)
    _loaded.add("spline")


def first_spline(room: SplineRoom, path: Array) -> Spline:
    """Return a spline that follows a path ``(n, k)`` of straight edges from rest to rest.

    Its control points are on the path: at a speed that is even, but for both ends.
    """
    velocities, accelerations = room.limits[:2]
    jerks = room.limits[2] if len(room.limits) > 2 else np.full(len(velocities), np.inf)
    rise = float((velocities / accelerations + accelerations / jerks).max())
    lengths = (np.abs(np.diff(path, axis=0)) / velocities).max(axis=1)
    along = np.concatenate([[0.0], lengths.cumsum()])
    duration = float(along[-1]) + rise
    parts = _SPANS_TO_SPEED if len(room.limits) > 2 else _SPANS_WITHOUT_JERKS
    spans = int(np.clip(parts * duration / rise, _FEWEST, _MOST))
    ramp = min(max(rise / duration, _SHORTEST_RAMP), _LONGEST_RAMP)
    t = np.linspace(0.0, 1.0, spans - 1)
    s = np.where(t < ramp, t * t / (2.0 * ramp), t - 0.5 * ramp)
    s = np.where(t > 1.0 - ramp, 1.0 - ramp - (1.0 - t) ** 2 / (2.0 * ramp), s) / (1.0 - ramp)
    s *= along[-1]
    inner = np.stack([np.interp(s, along, column) for column in path.T], axis=1)
    inner[0], inner[-1] = path[0], path[-1]
    points = np.concatenate([path[:1], path[:1], inner, path[-1:], path[-1:]])
    return Spline(points, room.least_seconds(points))


class _Places(NamedTuple):
    """Places along a spline, and the pairs that are near there."""

    configurations: Array
    """``(n, k)``."""
    near: NearRows
    owners: NDArray[np.intp]
    """``(r,)``: the place of each row."""
    least: Array
    """``(n,)`` m: the least distance; where nothing is near, up to where was looked."""


class Sampling(NamedTuple):
    """Where distances are taken along splines with so many intervals."""

    room: SplineRoom
    counts: NDArray[np.int64]
    """``(s,)``: at how many places in each interval."""
    spans: NDArray[np.int64]
    """``(n,)``: the interval of each place."""
    weights: Array
    """``(n, 4)``: of its control points."""
    around: NDArray[np.int64]
    """``(4, n)``: these control points."""
    shares: Array
    """``(4, n, k)``: their weights, once for each position."""

    @classmethod
    def of(cls, room: SplineRoom, counts: NDArray[np.int64]) -> Sampling:
        """Return places that are even in each interval, so many."""
        spans = np.repeat(np.arange(len(counts)), counts)
        first = np.repeat(counts.cumsum() - counts, counts)
        t = (np.arange(len(spans)) - first + 0.5) / np.repeat(counts, counts)
        y = 1.0 - t
        weights = np.stack(
            [
                y**3 / 6.0,
                (3.0 * t**3 - 6.0 * t**2 + 4.0) / 6.0,
                (3.0 * y**3 - 6.0 * y**2 + 4.0) / 6.0,
                t**3 / 6.0,
            ],
            axis=1,
        )
        around = spans + np.arange(4)[:, np.newaxis]
        shares = np.repeat(weights.T[:, :, np.newaxis], len(room.rows), axis=2)
        return cls(room, counts, spans, weights, around, shares)

    @classmethod
    def even(cls, room: SplineRoom, spans: int) -> Sampling:
        """Return as many places in each interval."""
        return cls.of(room, np.full(spans, _PLACES))

    def denser(self, chosen: NDArray[np.bool_]) -> Sampling:
        """Return more places in some intervals ``(s,)``."""
        return self.of(self.room, np.where(chosen, _DENSER * self.counts, self.counts))

    def places(self, control_points: Array) -> _Places:
        """Return the places of a spline, with the pairs that are near."""
        q = (self.shares * control_points.take(self.around, axis=0)).sum(axis=0)
        near = near_rows(self.room.plan, self.room.whole(q), _NEAR)
        owners = np.repeat(np.arange(len(q)), near.counts)
        least = np.full(len(q), _NEAR)
        np.minimum.at(least, owners, near.distances)
        return _Places(q, near, owners, least)

    def half_spaces(self, places: _Places, trust: float) -> HalfSpaces:
        """Return half-spaces, to first order, of all pairs that a step may come near to."""
        distances, normals = places.near.distances, places.near.jacobians[:, self.room.rows]
        kept = np.minimum(_KEPT, distances - _LESS * np.abs(distances) - 10.0 * _SPARE)
        counts = distances - kept < trust * np.abs(normals).sum(axis=1)
        owners, normals = places.owners[counts], np.ascontiguousarray(normals[counts])
        reached = (normals * places.configurations[owners]).sum(axis=1)
        ends = np.bincount(owners, minlength=len(self.spans)).cumsum()
        offsets = distances[counts] - kept[counts] - reached
        return HalfSpaces(self.spans, self.weights, ends, normals, offsets)


def good_duration(room: SplineRoom, spline: Spline, least_time: float) -> float:
    """Return the duration (s) from which on no round saves much.

    It is near ``least_time``, or near that of the fastest spline with as many intervals that the
    position with the longest way has by itself.
    """
    points = spline.control_points
    ways = np.abs(points[-1] - points[0])
    slowest = int(np.argmax(ways / room.limits[0]))
    own = np.ascontiguousarray(points[:, slowest : slowest + 1])
    ends = np.zeros((2, 3, 1))
    ends[:, 0] = own[[0, -1]]
    reach = float(np.abs(own - own[0]).max())
    shape = len(own) - 2 * _FIXED, 1
    none = np.empty(0, np.int64)
    spaces = HalfSpaces(none, np.empty((0, 4)), none, np.empty((0, 1)), np.empty(0))
    seconds = np.array([_ROOM * spline.seconds])
    limits = np.ascontiguousarray(room.limits[:, slowest : slowest + 1])
    low, high = (np.full(shape, own[0, 0] + side * reach) for side in (-2.0, 2.0))
    fastest_spline(limits, ends, low, high, spaces, own, seconds, _SAVED)
    return max(GOOD_ENOUGH * least_time, spline.spans * float(seconds[0]))


def shorter_splines(sampling: Sampling, spline: Spline, good: float, turns: Turns) -> list[Spline]:
    """Return splines that take ever less time, and keep their distances at the places.

    They end where a round saves little, where the last is as fast as is ``good`` (s), and where it
    is time to stop.
    """
    found, trust = [spline], _TRUST
    places = sampling.places(spline.control_points)
    for turn in range(_ROUNDS):
        turns.pause()
        if turns.stops.looking[0] != 0:
            break
        points = _fastest(sampling, found[-1], places, trust, turn)
        if points is None:
            break
        step = _step(sampling, found[-1], places, points)
        if step is None:
            trust *= _SMALLER
            continue
        part, tried, places = step
        saved = 1.0 - tried.seconds / found[-1].seconds
        found.append(tried)
        trust *= _LARGER if part == 1.0 else max(part, _SMALLER)
        if tried.duration <= good or (turn >= len(_GAPS) - 1 and saved < _SAVED):
            break
    return found[1:]


def _fastest(
    sampling: Sampling, spline: Spline, places: _Places, trust: float, turn: int
) -> Array | None:
    """Return the control points of the fastest spline as far as is known; None if none is."""
    room, now = sampling.room, spline.control_points
    ends = np.zeros((2, 3, len(room.rows)))
    ends[:, 0] = now[[0, -1]]
    free = now[_FIXED:-_FIXED]
    low = np.minimum(np.maximum(room.lower, free - trust), free - _SPARE)
    high = np.maximum(np.minimum(room.upper, free + trust), free + _SPARE)
    points, seconds = now.copy(), np.array([_ROOM * spline.seconds])
    gap, spaces = _GAPS[min(turn, len(_GAPS) - 1)], sampling.half_spaces(places, trust)
    steps = fastest_spline(room.limits, ends, low, high, spaces, points, seconds, gap)
    return None if steps < 0 else points


def _step(
    sampling: Sampling, spline: Spline, places: _Places, points: Array
) -> tuple[float, Spline, _Places] | None:
    """Return the part of a step that keeps enough, and its end; None where none does."""
    floor = np.minimum(np.minimum(_KEPT, places.least) * _PART, places.least)
    for part in _STEPS:
        tried = spline.control_points + part * (points - spline.control_points)
        reached = sampling.places(tried)
        if (reached.least >= floor).all():
            return part, Spline(tried, sampling.room.least_seconds(tried)), reached
    return None
