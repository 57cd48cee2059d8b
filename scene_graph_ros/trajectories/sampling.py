"""Points of trajectories at whole nanoseconds, slow enough for all limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.trajectories.errors import TooLongError
from scene_graph_ros.trajectories.limit_rounding import RATE_ROUNDING
from scene_graph_ros.trajectories.motion_ends import AT_REST, MotionEnds
from scene_graph_ros.trajectories.motion_limits import (
    LimitExcess,
    MotionLimits,
    worst_ratio_of,
)
from scene_graph_ros.trajectories.path_parameterized_trajectory import (
    PathParameterizedTrajectory,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.straight_motion import least_duration
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = [
    "LONGEST",
    "SHORTEST",
    "Sampled",
    "States",
    "gentler",
    "sample",
    "shortest_step",
    "slowed",
    "too_long",
]

SHORTEST = 3e-6
"""s, between two points: in less, rounding of positions and times alone would be accelerations."""

_NOISE = 20.0 * np.finfo(np.float64).eps
"""Of positions: what their rounding changes second and third differences by."""

_OF_ACCELERATION, _OF_JERK = 1e-3, 1e-2
"""Shares of limits that such rounding may take."""

_ALMOST = 0.9
"""Of that time: how much points are apart that shall be so, in spite of rounding."""

_NEAR = 1e-3
"""Of a rise time: in less, rounding of positions and times alone would be jerk."""

_ORDERS = {"velocity": 1, "acceleration": 2, "jerk": 3}
"""What of a trajectory becomes less with which power of its speed."""

_SPARE = 1e-12
"""By how much more a trajectory is slowed down than enough, so that rounding does not undo it: at
first; then twice as much each time."""

_ROUNDS = 30
"""How often a trajectory is slowed down."""

_EXCESS = 5e-4
"""Of a limit: by how much a cubic between two points may exceed it before all is slowed down."""

_PARTS = 16
"""Of the time between two points whose cubic is faster than that, at most."""

LONGEST = 1e9
"""s: what takes longer has no time in a message."""

_GAUSS = (
    (0.5 - 0.1 * 15.0**0.5, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.5 + 0.1 * 15.0**0.5, 5.0 / 18.0),
)
"""Places and weights that integrate up to degree 5 exactly (Gauss and Legendre)."""


def shortest_step(path: PiecewisePolynomial, limits: MotionLimits) -> float:
    """Return the least time between two points on a path, s.

    In less, rounding of positions alone would be a part of the limits that counts.
    """
    points = path.control_points
    noise = np.where(np.ptp(points, axis=(0, 1)) > 0.0, np.abs(points).max(axis=(0, 1)), 0.0)
    noise *= _NOISE
    least = max(SHORTEST, float((noise / limits.accelerations).max() / _OF_ACCELERATION) ** 0.5)
    if limits.jerks is not None:
        least = max(least, float(np.cbrt((noise / limits.jerks).max() / _OF_JERK)))
    return least


def gentler(path: PiecewisePolynomial, limits: MotionLimits) -> MotionLimits:
    """Return limits with which no full speed comes sooner than there can be a point."""
    shortest = shortest_step(path, limits)
    accelerations = np.minimum(limits.accelerations, limits.velocities / shortest)
    return MotionLimits(limits.velocities, accelerations, limits.names)


class Sampled(NamedTuple):
    """Points, and their excess over a limit: none, as a rule."""

    points: TrajectoryPoints
    excess: LimitExcess | None
    factor: float
    """How many times slower than it was."""
    motion_of: Callable[[], PathParameterizedTrajectory]
    """Returns what was sampled, with its rests."""
    rise_time: float
    """s."""

    @property
    def motion(self) -> PathParameterizedTrajectory:
        """What was sampled, with its rests."""
        return self.motion_of()


States = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64] | None]
"""Positions, velocities and perhaps accelerations ``(m, n)``."""


def slowed(
    times: NDArray[np.float64],
    states_at: Callable[[NDArray[np.int64], float], States],
    limits: MotionLimits,
    motion_of: Callable[[], PathParameterizedTrajectory],
    factor: float = 1.0,
    rise_time: float = 0.0,
    *,
    rounds: int = _ROUNDS,
) -> Sampled:
    """Return the points of a motion, slowed down until they are within the limits at all times.

    ``states_at`` gives its states at whole nanoseconds, so many times slower than it is. After so
    many ``rounds`` the rest of the excess is returned, with a factor that may do. Raises
    TooLongError for a motion that takes too long for a message.
    """
    for turn in range(rounds):
        rounded = np.rint(times * factor * 1e9)
        if not rounded[-1] <= LONGEST * 1e9:
            raise too_long(motion_of().path, limits)
        nanoseconds = rounded.astype(np.int64)
        states = states_at(nanoseconds, factor)
        if not (np.diff(nanoseconds) > 0).all():
            break
        worst = worst_ratio_of(nanoseconds, *states, limits)
        if worst.ratio <= 1.0 + RATE_ROUNDING:
            points = TrajectoryPoints(nanoseconds, *states)
            return Sampled(points, None, factor, motion_of, rise_time)
        if worst.ratio == np.inf:
            break
        factor *= worst.ratio ** (1.0 / _ORDERS[worst.kind]) * (1.0 + _SPARE * 2.0**turn)
    points = TrajectoryPoints(nanoseconds, *states)
    return Sampled(points, worst, factor, motion_of, rise_time)


def too_long(path: PiecewisePolynomial, limits: MotionLimits) -> TooLongError:
    """Return the error that names the entry that takes longest by itself."""
    ways = np.abs(np.diff(path.control_points, axis=1)).sum(axis=(0, 1))
    times = [least_duration(each, limits) for each in np.diag(ways)]
    row = int(np.argmax(times))
    kinds = {"velocities": limits.velocities, "accelerations": limits.accelerations}
    if limits.jerks is not None:
        kinds["jerks"] = limits.jerks
    most = ", ".join(f"{kind} up to {each[row]:.4g}" for kind, each in kinds.items())
    return TooLongError(
        f"the trajectory would take more than {LONGEST:g} s: {limits.name(row)!r} moves by"
        f" {ways[row]:.4g}, with {most}, which take {times[row]:.4g} s at least"
    )


def sample(
    motion: PathParameterizedTrajectory,
    limits: MotionLimits,
    *,
    rise_time: float = 0.0,
    with_accelerations: bool = False,
    ends: MotionEnds = AT_REST,
) -> Sampled:
    """Return points through which a trajectory runs within limits, at all times.

    ``motion`` begins at 0 s and is at rest at both ends, unless ``ends`` say how it moves there;
    then it must have no ``rise_time``. Without a ``rise_time`` the points have
    velocities, and cubics run through them. With one (s), each moment becomes the mean of the
    ``rise_time`` around it, which keeps all limits of velocity and acceleration, makes the
    acceleration continuous and its jerk twice the acceleration over the ``rise_time`` at most, and
    takes so much longer; points have accelerations, and quintics run through them. So they do
    ``with_accelerations``, which are a motion's own that do not jump. The curve through the points
    is not quite the sampled one, so it is measured, and slowed down until it is within the
    limits.

    Where the motion stops on its way, it waits for the ``rise_time``: so it stays on its path.
    Raises TooLongError for a motion that takes too long for a message.
    """
    shortest = shortest_step(motion.path, limits)
    if rise_time > 0.0:
        motion = _with_rests(motion, rise_time)
    times = motion.time_scaling.breaks
    if rise_time > 0.0:
        times = np.unique(np.concatenate([times, times + rise_time]))
    times = _apart(times, max(_ALMOST * shortest, _NEAR * rise_time))
    factor = max(1.0, shortest / float(np.diff(times).min()))

    def states(nanoseconds: NDArray[np.int64], factor: float) -> States:
        return _states(motion, nanoseconds, factor, rise_time, with_accelerations, ends)

    if rise_time == 0.0 and not with_accelerations and times[-1] <= LONGEST:
        whole = np.rint(times * 1e9).astype(np.int64)
        times = _denser(times, states(whole, 1.0), limits, shortest)
        factor = max(1.0, shortest / float(np.diff(times).min()))
    rounds = _ROUNDS if ends.is_rest else 1
    return slowed(times, states, limits, lambda: motion, factor, rise_time, rounds=rounds)


def _denser(
    times: NDArray[np.float64], states: States, limits: MotionLimits, shortest: float
) -> NDArray[np.float64]:
    """Return times ``(m,)`` with more between those whose cubics are too fast, by states there.

    By as much as accelerations of a cubic are linear where the motion's are not; with half the
    time between points that is a quarter.
    """
    q, v, _ = states
    steps = np.diff(times)
    h = steps[:, np.newaxis]
    means, before, after = np.diff(q, axis=0) / h, v[:-1], v[1:]
    middles = 1.5 * means - 0.25 * (before + after)
    starts = (6.0 * means - 4.0 * before - 2.0 * after) / h
    ends = (2.0 * before + 4.0 * after - 6.0 * means) / h
    rates = np.abs(middles) / limits.velocities
    changes = np.maximum(np.abs(starts), np.abs(ends)) / limits.accelerations
    excess = np.maximum(rates, changes).max(axis=1) - 1.0
    parts = np.ceil(np.sqrt(excess.clip(0.0, 1.0) / _EXCESS)).clip(1.0, _PARTS)
    parts = np.minimum(parts, np.maximum(steps // shortest, 1.0)).astype(np.int64)
    if (parts == 1).all():
        return times
    inner = [
        np.linspace(low, high, count, endpoint=False)
        for low, high, count in zip(times[:-1], times[1:], parts, strict=True)
    ]
    return np.concatenate([*inner, times[-1:]])


def _with_rests(
    motion: PathParameterizedTrajectory, seconds: float
) -> PathParameterizedTrajectory:
    """Return a motion that waits wherever it stops on its way."""
    scaling = motion.time_scaling
    points, steps = scaling.control_points, np.diff(scaling.breaks)
    stops = [k for k in range(1, len(points)) if points[k, 1, 0] == points[k, 0, 0]]
    points = np.insert(points, stops, points[stops, :1], axis=0)
    breaks = np.concatenate([[0.0], np.insert(steps, stops, seconds).cumsum()])
    return PathParameterizedTrajectory(motion.path, PiecewisePolynomial(breaks, points))


def _apart(times: NDArray[np.float64], shortest: float) -> NDArray[np.float64]:
    """Return times without those that follow another one too soon, but with the last."""
    if times[-1] < 100.0 * shortest:
        return times
    kept = [times[0]]
    for time in times[1:-1]:
        if time - kept[-1] >= shortest and times[-1] - time >= shortest:
            kept.append(time)
    return np.array([*kept, times[-1]])


def _states(
    motion: PathParameterizedTrajectory,
    nanoseconds: NDArray[np.int64],
    factor: float,
    rise_time: float,
    with_accelerations: bool,
    ends: MotionEnds,
) -> States:
    """Return a motion's states, ``factor`` times slower."""
    times = nanoseconds.astype(np.float64) * 1e-9 / factor
    if rise_time == 0.0:
        q, v = motion.value(times), motion.eval_derivative(times) / factor
        _at_ends(v, ends, 0)
        _from_to(q, motion)
        if not with_accelerations:
            return q, v, None
        a = motion.eval_derivative(times, 2) / factor**2
        _at_ends(a, ends, 1)
        return q, v, a
    # The mean over the time before t: its derivatives are differences of what is at its ends.
    v = _mean_rate(motion, times, rise_time)
    a = (_velocity(motion, times) - _velocity(motion, times - rise_time)) / rise_time
    steps = np.diff(times)[:, np.newaxis]
    moved = sum(
        weight * _mean_rate(motion, times[:-1] + part * np.diff(times), rise_time)
        for part, weight in _GAUSS
    )
    q = motion.value(0.0) + np.concatenate([np.zeros((1, motion.rows)), (moved * steps).cumsum(0)])
    _at_ends(v, ends, 0)
    _at_ends(a, ends, 1)
    _from_to(q, motion)
    return q, v / factor, a / factor**2


def _mean_rate(
    motion: PathParameterizedTrajectory, times: NDArray[np.float64], rise_time: float
) -> NDArray[np.float64]:
    """Return the velocities ``(m, n)`` of the mean over ``rise_time`` before each time."""
    return (motion.value(times) - motion.value(times - rise_time)) / rise_time


def _velocity(
    motion: PathParameterizedTrajectory, times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return velocities ``(m, n)``, 0 before the start and after the end."""
    is_inside = (times > motion.start_time) & (times < motion.end_time)
    return np.where(is_inside[:, np.newaxis], motion.eval_derivative(times), 0.0)


def _at_ends(rates: NDArray[np.float64], ends: MotionEnds, order: int) -> None:
    rates[[0, -1]] = 0.0 if ends.rates is None else [each[order] for each in ends.rates]


def _from_to(q: NDArray[np.float64], motion: PathParameterizedTrajectory) -> None:
    q[0], q[-1] = motion.value(motion.start_time), motion.value(motion.end_time)
