"""The fastest motion along a straight line from rest to rest, in whole nanoseconds."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.guessed_motion import PathStates
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.time_optimal import straight_segments

__all__ = ["duration_with_rests", "least_duration", "straight_states"]

_NANOSECOND = 1e-9
"""s."""

_SPARE = 1.0 - 1e-9
"""Of the limits: rounding of positions takes no more, where phases take a millisecond."""

_ROUNDING = 1e-3
"""ns: what is so little above a whole number is at it."""

_SIGNS = (1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0)
"""Of the jerk in each of seven phases."""


def straight_states(
    path: PiecewisePolynomial, limits: MotionLimits, shortest: float
) -> PathStates | None:
    """Return the states between the phases of the fastest motion; None along a bent path.

    It takes seven phases of a constant jerk (Biagiotti and Melchiorri, *Trajectory Planning for
    Automatic Machines and Robots*, 2008, section 3.4). Each takes whole nanoseconds, and at least
    ``shortest`` (s), or none: the rates are as much less as that takes longer.
    """
    points = path.control_points
    if not straight_segments(path).all():
        return None
    ways = points[:, -1] - points[:, 0]
    rates = ways / np.diff(path.breaks)[:, np.newaxis]
    if not (np.abs(rates - rates[0]) <= 1e-12 * np.abs(rates[0]).max()).all():
        return None
    rate = np.abs(rates[0])
    assert limits.jerks is not None
    with np.errstate(divide="ignore", over="ignore"):
        most = [
            _SPARE * float((each / rate).min())
            for each in (limits.velocities, limits.accelerations, limits.jerks)
        ]
    length = path.duration
    rise, hold, cruise = _phases(length, *most)
    # Phases of an instant become part of the others: all rates are less then.
    if hold < shortest:
        rise, hold = rise + hold, 0.0
    if cruise < shortest:
        rise, cruise = rise + 0.5 * cruise, 0.0
    rise, hold, cruise = _whole(max(rise, shortest)), _whole(hold), _whole(cruise)
    jerk = length / (rise * (rise + hold) * (2.0 * rise + hold + cruise))
    return _states(path, jerk, (rise, hold, rise, cruise, rise, hold, rise))


def least_duration(ways: NDArray[np.float64], limits: MotionLimits) -> float:
    """Return the least time (s) in which positions go ``ways`` ``(n,)`` from rest to rest.

    Each by itself: no path from one configuration to another is faster.
    """
    jerks = np.full(len(ways), np.inf) if limits.jerks is None else limits.jerks
    least = 0.0
    for way, *own in zip(
        np.abs(ways).tolist(),
        limits.velocities.tolist(),
        limits.accelerations.tolist(),
        jerks.tolist(),
        strict=True,
    ):
        if way > 0.0:
            rise, hold, cruise = _phases(way, *own)
            least = max(least, 4.0 * rise + 2.0 * hold + cruise)
    return least


def duration_with_rests(points: NDArray[np.float64], limits: MotionLimits) -> float:
    """Return the least time (s) along edges between points ``(n, k)``, at rest at each."""
    ways = np.abs(np.diff(points, axis=0))
    jerks = np.full(ways.shape[1], np.inf) if limits.jerks is None else limits.jerks
    with np.errstate(divide="ignore", over="ignore"):
        rates = [
            (each / ways).min(axis=1).tolist()
            for each in (limits.velocities, limits.accelerations, jerks)
        ]
    total = 0.0
    for own in zip(*rates, strict=True):
        rise, hold, cruise = _phases(1.0, *own)
        total += 4.0 * rise + 2.0 * hold + cruise
    return total


def _phases(length: float, v: float, a: float, jerk: float) -> tuple[float, float, float]:
    """Return the times, s, of a rising acceleration, a constant one, and a constant speed."""
    if a * a >= v * jerk:
        rise, hold = math.sqrt(v / jerk), 0.0
    else:
        rise, hold = a / jerk, v / a - a / jerk
    slowing = v * (2.0 * rise + hold)
    if slowing <= length:
        return rise, hold, (length - slowing) / v
    # It never comes to v; where it does not come to a either, all is rising.
    rise = a / jerk
    peak = 0.5 * a * (math.sqrt(rise * rise + 4.0 * length / a) - rise)
    if peak >= a * rise:
        return rise, peak / a - rise, 0.0
    return float(np.cbrt(0.5 * length / jerk)), 0.0, 0.0


def _whole(seconds: float) -> float:
    """Return whole nanoseconds that are no less, s."""
    return max(math.ceil(seconds / _NANOSECOND - _ROUNDING), 0) * _NANOSECOND


def _states(path: PiecewisePolynomial, jerk: float, phases: tuple[float, ...]) -> PathStates:
    """Return states after each phase, and at first."""
    t, s, speed, acceleration = 0.0, 0.0, 0.0, 0.0
    rows = [(t, s, speed, acceleration)]
    for sign, h in zip(_SIGNS, phases, strict=True):
        if h == 0.0:
            continue
        change = sign * jerk
        s += h * (speed + h * (0.5 * acceleration + h * change / 6.0))
        speed += h * (acceleration + 0.5 * h * change)
        acceleration += h * change
        t += h
        rows.append((t, s, speed, acceleration))
    columns: NDArray[np.float64] = np.array(rows).T
    columns[0] = np.rint(columns[0] / _NANOSECOND) * _NANOSECOND
    columns[1] = (path.start_time + columns[1]).clip(path.start_time, path.end_time)
    columns[1, -1], columns[2:, -1] = path.end_time, 0.0
    return PathStates(*columns)
