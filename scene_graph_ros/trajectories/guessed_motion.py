"""A motion along a path that is near to the fastest one, and whose acceleration goes on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.derivatives_of import derivatives_of
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial

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

_RISES = 4
"""Nodes in the time in which an acceleration rises to its limit."""

_SHORTEST = 5e-5
"""s, between two nodes: in less, rounding of positions would be jerk."""

_EASED = 0.4
"""Of a path, at most: where the speed at an end becomes that of the guess."""


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
        times = np.linspace(0.0, self.times[-1], (count or len(self.s) - 1) + 1)
        rows = list(derivatives_of(self.scaling(), times)[:3, :, 0])
        for row, own in zip(rows, (self.s, self.speed, self.acceleration), strict=True):
            row[[0, -1]] = own[[0, -1]]
        rows[0] = np.maximum.accumulate(rows[0].clip(self.s[0], self.s[-1]))
        return PathStates(times, *rows)

    def scaling(self) -> PiecewisePolynomial:
        """Return s by time."""
        columns = (each[:, np.newaxis] for each in (self.s, self.speed, self.acceleration))
        return PiecewisePolynomial.quintic_hermite(self.times, *columns)


def guessed_motion(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    start: tuple[float, float],
    end: tuple[float, float],
) -> PathStates:
    """Return states of a motion with some speed and acceleration at both ends.

    On each part of the path it is as fast as velocities and the path's bends allow; then it is the
    mean of that over a while, twice. It keeps no limits.
    """
    s, times = _uneven(path, limits)
    duration = float(times[-1])
    assert limits.jerks is not None
    rise = float((limits.accelerations / limits.jerks).min())
    # At least what it takes to be within limits of jerk from rest to rest.
    count = int(max(_FEWEST, min(_MOST, _PER_SEGMENT * path.num_segments)))
    count = int(np.clip(_RISES * duration / rise, _FEWEST, max(count, _FEWEST)))
    ramp = max(_RAMP, 2.0 / count) * duration
    states = _averaged(s, times, ramp, count)
    if any(start):
        states = _eased(states, start)
    if any(end):
        states = _reversed(_eased(_reversed(states), (end[0], -end[1])))
    return states.evened(count)


def _uneven(path: PiecewisePolynomial, limits: MotionLimits) -> tuple[Array, Array]:
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
    return s, np.concatenate([[0.0], (np.diff(s) / speeds).cumsum()])


def _averaged(s: Array, times: Array, ramp: float, count: int) -> PathStates:
    """Return states of the mean of a motion over twice a ``ramp``: a B-spline's, of degree 1.

    It is at rest before and after; its mean's derivatives are differences of its integrals.
    """
    last = float(times[-1])
    t = np.linspace(-ramp, last + ramp, count + 1)
    steps = np.diff(times)
    once = np.concatenate([[0.0], (0.5 * steps * (s[1:] + s[:-1])).cumsum()])
    # Between two places s is even: its integrals are parabolas and cubics.
    twice = np.concatenate(
        [[0.0], (steps * once[:-1] + steps**2 * (2.0 * s[:-1] + s[1:]) / 6.0).cumsum()]
    )

    def values(at: Array) -> tuple[Array, Array, Array]:
        inside = at.clip(0.0, last)
        k = (np.searchsorted(times, inside, side="right") - 1).clip(0, len(steps) - 1)
        x = inside - times[k]
        slope = (s[k + 1] - s[k]) / steps[k]
        own = s[k] + slope * x
        first = once[k] + x * (s[k] + 0.5 * slope * x)
        second = twice[k] + x * (once[k] + x * (0.5 * s[k] + slope * x / 6.0))
        beyond = at - inside
        return own, first + beyond * own, second + beyond * (first + 0.5 * beyond * own)

    before, now, after = values(t - ramp), values(t), values(t + ramp)
    acceleration, speed, place = (
        (a - 2.0 * b + c) / ramp**2 for a, b, c in zip(before, now, after, strict=True)
    )
    place[0], place[-1] = s[0], s[-1]
    place = np.maximum.accumulate(place.clip(s[0], s[-1]))
    speed[[0, -1]] = acceleration[[0, -1]] = 0.0
    return PathStates(t + ramp, place, np.maximum(speed, 0.0), acceleration)


def _eased(states: PathStates, start: tuple[float, float]) -> PathStates:
    """Return states that begin with another speed and acceleration."""
    speed, acceleration = start
    length = float(states.s[-1] - states.s[0])
    along = states.s - states.s[0]
    joins = (states.speed >= speed) | (along >= _EASED * length)
    k = max(int(np.argmax(joins)), 1)
    if not states.speed[k] > 0.0:
        k = int(np.argmax(states.speed > 0.0))
    seconds = 2.0 * float(along[k]) / (speed + float(states.speed[k]))
    times = np.concatenate([[0.0], seconds + states.times[k:] - states.times[k]])
    first = (states.s[0], speed, acceleration)
    rows = (states.s, states.speed, states.acceleration)
    kept = (np.concatenate([[a], each[k:]]) for a, each in zip(first, rows, strict=True))
    return PathStates(times, *kept)


def _reversed(states: PathStates) -> PathStates:
    """Return the same motion the other way."""
    times, s = states.times[-1] - states.times[::-1], -states.s[::-1]
    return PathStates(times, s, states.speed[::-1], -states.acceleration[::-1])
