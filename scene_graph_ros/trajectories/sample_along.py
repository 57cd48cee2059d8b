"""Points of a trajectory along a path within all limits, as a retimer finds it."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.trajectories.errors import RetimingError, TooLongError, TrajectoryError
from scene_graph_ros.trajectories.jerk_limited import sample_jerk_limited
from scene_graph_ros.trajectories.motion_ends import AT_REST, MotionEnds
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer, TimeOptimalRetimer
from scene_graph_ros.trajectories.sampling import gentler, sample, Sampled

__all__ = ["averages", "sample_along"]

_PARTS = (0.5, 0.7, 1.0)
"""Of a rise time that is certainly enough: what is tried."""

_LONGER = 10.0
"""Times what it has to take: motions of other retimers that take longer are not believed."""

_LESS = 1e-4
"""Beside an excess: by how much limits are narrowed at first; four times as much each time."""

_SOMEWHAT = 1.01
"""Times a factor with which no motion is found: what is tried next."""

_TRIES = 6
"""With narrower limits, where a motion can't just be slowed down."""


def sample_along(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    *,
    rise_time: float = 0.0,
    retimer: Retimer,
    ends: MotionEnds = AT_REST,
) -> Sampled:
    """Return points of a trajectory along a path, within all limits.

    Our own retimer knows limits of jerk, and motions that do not begin or end at rest. For others
    that know no limits of jerk the mean over a rise time keeps them: see `_mean`. A ``rise_time``
    (s) together with limits of jerk is one more of these.

    Raises RetimingError where the retimer finds no motion, TrajectoryError for ends that it knows
    nothing of.
    """
    own = retimer if isinstance(retimer, TimeOptimalRetimer) else None
    if not ends.is_rest:
        if own is None or rise_time > 0.0:
            raise TrajectoryError(
                "a motion that does not begin and end at rest takes retimer='time_optimal', and"
                " limits of jerk in place of a rise_time"
            )
        return _between(path, limits, own, ends)
    if own is None:
        try:
            found = _by_another(path, limits, rise_time, retimer)
        except TooLongError:
            found = None
        _judge(found, path, limits, rise_time)
        assert found is not None
        return found
    if limits.jerks is None:
        return sample(own.motion(path, gentler(path, limits)), limits, rise_time=rise_time)
    return sample_jerk_limited(path, _risen(limits, rise_time), fineness=own.fineness)


def averages(limits: MotionLimits, rise_time: float, retimer: Retimer) -> bool:
    """Tell whether each moment of a motion of `sample_along` is the mean of a while around it."""
    if limits.jerks is None or retimer.keeps_jerks:
        return rise_time > 0.0
    return not isinstance(retimer, TimeOptimalRetimer)


def _by_another(
    path: PiecewisePolynomial, limits: MotionLimits, rise_time: float, retimer: Retimer
) -> Sampled:
    """Return points of the motion of a retimer that is not ours."""
    if limits.jerks is None:
        return sample(retimer.motion(path, gentler(path, limits)), limits, rise_time=rise_time)
    if retimer.keeps_jerks:
        motion = retimer.motion(path, limits)
        return sample(motion, limits, rise_time=rise_time, with_accelerations=True)
    return _mean(path, limits, rise_time, retimer)


def _judge(
    found: Sampled | None, path: PiecewisePolynomial, limits: MotionLimits, rise_time: float
) -> None:
    """Raise RetimingError where a motion of another retimer takes very much longer than ours.

    None takes too long for a message. Raises TooLongError where ours does.
    """
    duration = np.inf if found is None else found.points.duration
    words = "more than 1e+09" if found is None else f"{duration:.6g}"
    ours = sample_along(path, limits, rise_time=rise_time, retimer=TimeOptimalRetimer())
    if duration > _LONGER * ours.points.duration:
        raise RetimingError(
            f"the retimer's motion would take {words} s within the limits, where"
            f" {ours.points.duration:.6g} s are enough"
        )


def _risen(limits: MotionLimits, rise_time: float) -> MotionLimits:
    """Return limits with which an acceleration takes a rise time to change by twice its limit."""
    assert limits.jerks is not None
    if rise_time == 0.0:
        return limits
    jerks = np.minimum(limits.jerks, 2.0 * limits.accelerations / rise_time)
    return MotionLimits(limits.velocities, limits.accelerations, limits.names, jerks)


def _between(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    retimer: TimeOptimalRetimer,
    ends: MotionEnds,
) -> Sampled:
    """Return a motion that moves at its ends: excesses of speed are looked for with less."""
    factor, found = 1.0, None
    for turn in range(_TRIES):
        within = _narrowed(limits, factor, ends)
        if limits.jerks is None:
            motion = retimer.motion_between(path, gentler(path, within), ends)
            found = sample(motion, limits, ends=ends)
        else:
            try:
                found = sample_jerk_limited(
                    path, within, ends, judged_by=limits, fineness=retimer.fineness
                )
            except RetimingError:
                if found is None:
                    raise
                factor *= _SOMEWHAT
                continue
        if found.excess is None:
            return found
        factor *= found.factor * (1.0 + _LESS * 4.0**turn)
        if limits.jerks is None:
            retimer = retimer.finer()
    assert found is not None
    return found


def _narrowed(limits: MotionLimits, factor: float, ends: MotionEnds) -> MotionLimits:
    """Return limits of a motion that is so much slower, but for the velocities of its ends."""
    assert ends.rates is not None
    kept = np.abs([each.velocity for each in ends.rates]).max(axis=0)
    jerks = None if limits.jerks is None else limits.jerks / factor**3
    velocities = np.maximum(limits.velocities / factor, kept)
    return MotionLimits(velocities, limits.accelerations / factor**2, limits.names, jerks)


def _mean(
    path: PiecewisePolynomial, limits: MotionLimits, rise_time: float, retimer: Retimer
) -> Sampled:
    """Return points of the mean over a rise time of a retimer's motion, which keeps jerks.

    In a rise time accelerations change by twice their limit, at most. So twice the acceleration
    over the jerk is enough, and half of it where accelerations rise from 0 or fall to it; the part
    in between may still be faster, though it is slowed down.
    """
    assert limits.jerks is not None
    enough = 2.0 * float((limits.accelerations / limits.jerks).max())
    motion = retimer.motion(path, gentler(path, limits))
    tried = (
        sample(motion, limits, rise_time=seconds)
        for seconds in sorted({max(rise_time, part * enough) for part in _PARTS})
    )
    return min(tried, key=lambda found: (found.excess is not None, found.points.duration))
