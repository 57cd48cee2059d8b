"""A motion along a path that is near to the fastest one, and whose acceleration goes on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.derivatives_of import derivatives_of
from scene_graph_ros.trajectories.errors import RetimingError
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.state_kernels import write_averaged, write_evened, write_passed

__all__ = ["PathStates", "guessed_motion"]

Array = NDArray[np.float64]

_PARTS = 8
"""Of each segment of a path: in each of them its speed is one."""

_SHARE = 0.7
"""Of limits of acceleration and jerk: what bends of a path may take."""

_RAMP = 0.05
"""Of the duration: how long speeds take to change, twice."""

_PER_SEGMENT, _FEWEST, _MOST = 10, 64, 4000
"""Nodes: for each segment of a path, and altogether."""

_LEAST = 8
"""Nodes of a motion that is too short for more."""

_RISES = 8
"""Nodes in the time in which an acceleration rises to its limit."""

_SHORTEST = 5e-5
"""s, between two nodes: in less, rounding of positions would be jerk."""

_EASED = 0.4
"""Of a path, at most: where the speed at an end becomes that of the guess."""

_JOINS = 40
"""States that are tried for that."""

_GENTLE = 0.6
"""Of the limit of jerk: what will do there."""

_FASTEST = 1e150
"""Squares of larger numbers may be infinite."""

_BACK = 0.2
"""Of the mean speed: what a bound of the speed may be below 0."""


class PathStates(NamedTuple):
    """Where a motion along a path is at some nodes, and how fast."""

    times: Array
    """``(n + 1,)``, s, from 0 on."""
    s: Array
    speed: Array
    """ds/dt."""
    acceleration: Array

    def evened(self, count: int | None = None) -> PathStates:
        """Return states at as many nodes evenly apart in time, on the quintics between these."""
        m = (count or len(self.s) - 1) + 1
        rows = np.empty((3, m))
        write_evened(PathStates(*map(np.ascontiguousarray, self)), rows)
        return PathStates(np.linspace(0.0, self.times[-1], m), *rows)

    def scaling(self) -> PiecewisePolynomial:
        """Return s by time."""
        columns = (each[:, np.newaxis] for each in (self.s, self.speed, self.acceleration))
        return PiecewisePolynomial.quintic_hermite(self.times, *columns)


def guessed_motion(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    start: tuple[float, float],
    end: tuple[float, float],
    fineness: float = 1.0,
    shortest: float = _SHORTEST,
) -> PathStates:
    """Return states of a motion with some speed and acceleration at both ends.

    On each part of the path it is as fast as velocities and the path's bends allow, and about as
    fast as accelerations do; then it is the mean of that over a while, twice. It keeps no limits.
    Between two states are ``shortest`` (s) at least.
    """
    s, times = _passed(path, limits)
    duration = float(times[-1])
    assert limits.jerks is not None
    rise = float((limits.accelerations / limits.jerks).min())
    count = int(max(_FEWEST, min(_MOST, _PER_SEGMENT * path.num_segments)))
    count = int(fineness * np.clip(_RISES * duration / rise, _FEWEST, max(count, _FEWEST)))
    count = int(np.clip(count, _LEAST, max(duration / max(shortest, _SHORTEST), _LEAST)))
    ramp = max(_RAMP, 2.0 / count) * duration
    rows = np.empty((3, count + 1))
    write_averaged(s, times, ramp, rows)
    states = PathStates(np.linspace(0.0, duration + 2.0 * ramp, count + 1), *rows)
    if not (any(start) or any(end)):
        return states
    # What must not change at an end can't be slowed down, so the rest is within the limits.
    states = _within(path, states, limits)
    with np.errstate(over="ignore"):
        largest = float((limits.jerks / _largest_rates(path)).min())
    if any(start):
        states = _eased(states, start, largest)
    if any(end):
        states = _reversed(_eased(_reversed(states), (end[0], -end[1]), largest))
    return states.evened(count)


def _passed(path: PiecewisePolynomial, limits: MotionLimits) -> tuple[Array, Array]:
    """Return places along a path, and when they are passed at speeds that are even between."""
    low, high = path.breaks[:-1], path.breaks[1:]
    s = np.linspace(low, high, _PARTS, endpoint=False, axis=1).ravel()
    s = np.append(s, high[-1])
    middles = 0.5 * (s[:-1] + s[1:])
    first, second, third = np.abs(derivatives_of(path, middles)[1:])
    assert limits.jerks is not None
    with np.errstate(divide="ignore", over="ignore"):
        speeds = np.minimum(
            (limits.velocities / first).min(axis=1),
            np.minimum(
                np.sqrt(_SHARE * limits.accelerations / second).min(axis=1),
                np.cbrt(_SHARE * limits.jerks / third).min(axis=1),
            ),
        )
        changes = (limits.accelerations / first).min(axis=1)
    times = np.empty_like(s)
    write_passed(s, np.minimum(speeds, _FASTEST), np.minimum(changes, _FASTEST), times)
    return s, times


def _within(path: PiecewisePolynomial, states: PathStates, limits: MotionLimits) -> PathStates:
    """Return a motion so much slower that it is about within limits."""
    _, first, second, _ = derivatives_of(path, states.s)
    speed, change = states.speed[:, np.newaxis], states.acceleration[:, np.newaxis]
    a = second * speed**2 + first * change
    jerks = np.diff(a, axis=0) / np.diff(states.times)[:, np.newaxis]
    assert limits.jerks is not None
    factor = max(
        float((np.abs(first * speed) / limits.velocities).max()),
        float((np.abs(a) / limits.accelerations).max()) ** 0.5,
        float((np.abs(jerks) / limits.jerks).max()) ** (1.0 / 3.0),
    )
    if factor == 0.0:
        return states
    return PathStates(
        states.times * factor,
        states.s,
        states.speed / factor,
        states.acceleration / factor**2,
    )


def _largest_rates(path: PiecewisePolynomial) -> Array:
    """Return bounds ``(k,)`` of how fast positions change along a path; above 0."""
    largest: Array = np.abs(path.derivative().control_points).max(axis=(0, 1))
    return np.maximum(largest, np.finfo(np.float64).tiny)


def _eased(states: PathStates, start: tuple[float, float], largest: float) -> PathStates:
    """Return states that begin with another speed and acceleration.

    A quintic leads from these to one of the states; the first one that it reaches with a jerk of
    less than ``largest``, or with the least.
    """
    speed, acceleration = start
    along = states.s - states.s[0]
    last = int(np.argmax(along > _EASED * along[-1]))
    best: tuple[float, int, float] | None = None
    for k in np.unique(np.linspace(1, max(last, 1), _JOINS).astype(int)).tolist():
        if not along[k] > 0.0:
            continue
        mean = 0.5 * (speed + float(states.speed[k]))
        seconds = float(along[k]) / mean
        ends = np.array([[0.0, along[k]]]).T
        rates = np.array([[speed, states.speed[k]]]).T
        changes = np.array([[acceleration, states.acceleration[k]]]).T
        curve = PiecewisePolynomial.quintic_hermite([0.0, seconds], ends, rates, changes)
        jerk = float(np.abs(curve.derivative(3).control_points).max()) / largest
        moves = curve.derivative().control_points.min() > -_BACK * mean
        if moves and (best is None or jerk < best[0]):
            best = jerk, k, seconds
        if best is not None and best[0] <= _GENTLE:
            break
    if best is None:
        raise RetimingError("no motion was found that begins and ends with these velocities")
    _, k, seconds = best
    times = np.concatenate([[0.0], seconds + states.times[k:] - states.times[k]])
    first = (states.s[0], speed, acceleration)
    rows = (states.s, states.speed, states.acceleration)
    kept = (np.concatenate([[a], each[k:]]) for a, each in zip(first, rows, strict=True))
    return PathStates(times, *kept)


def _reversed(states: PathStates) -> PathStates:
    """Return the same motion the other way."""
    times, s = states.times[-1] - states.times[::-1], -states.s[::-1]
    return PathStates(times, s, states.speed[::-1], -states.acceleration[::-1])
