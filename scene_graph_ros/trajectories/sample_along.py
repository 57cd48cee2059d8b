"""Points of a trajectory along a path within all limits, as a retimer finds it."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.trajectories.errors import RetimingError, TrajectoryError
from scene_graph_ros.trajectories.jerk_limited import sample_jerk_limited
from scene_graph_ros.trajectories.motion_ends import AT_REST, MotionEnds
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer, TimeOptimalRetimer
from scene_graph_ros.trajectories.sampling import gentler, sample, Sampled

__all__ = ["sample_along"]

_PARTS = (0.5, 0.7, 1.0)
"""Of a rise time that is certainly enough: what is tried."""

_SAME = 1.0 + 1e-6
"""A motion that is slowed down by less keeps the velocities that its ends have to have."""

_TRIES = 5
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

    Our own retimer knows limits of jerk, and motions that do not begin or end at rest. For one that
    knows no limits of jerk the mean over a rise time keeps them: see `_mean`. A ``rise_time`` (s)
    together with limits of jerk is one more of these.

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
    if limits.jerks is None:
        motion = retimer.motion(path, gentler(limits))
        return sample(motion, limits, rise_time=rise_time)
    if own is not None:
        return sample_jerk_limited(path, _risen(limits, rise_time))
    if retimer.keeps_jerks:
        motion = retimer.motion(path, limits)
        return sample(motion, limits, rise_time=rise_time, with_accelerations=True)
    return _mean(path, limits, rise_time, retimer)


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
    """Return a motion that moves at its ends: what is too fast is looked for with less."""
    factor = 1.0
    for _ in range(_TRIES):
        within = _narrowed(limits, factor)
        if limits.jerks is None:
            motion = retimer.motion_between(path, gentler(within), ends)
            found = sample(motion, limits, ends=ends)
        else:
            found = sample_jerk_limited(path, within, ends, judged_by=limits)
        if found.factor <= _SAME and found.excess is None:
            return found
        factor *= max(found.factor, _SAME)
    raise RetimingError(
        "no motion was found that begins and ends with these velocities and accelerations within"
        f" the limits: it would have to be slower by a factor of {found.factor:.3g}"
    )


def _narrowed(limits: MotionLimits, factor: float) -> MotionLimits:
    """Return limits in which a motion changes its velocity more slowly.

    Limits of velocity stay, as it may begin at one.
    """
    jerks = None if limits.jerks is None else limits.jerks / factor**3
    return MotionLimits(limits.velocities, limits.accelerations / factor**2, limits.names, jerks)


def _mean(
    path: PiecewisePolynomial, limits: MotionLimits, rise_time: float, retimer: Retimer
) -> Sampled:
    """Return points of the mean over a rise time of a retimer's motion, which keeps jerks.

    In a rise time accelerations change by twice their limit, at most. So twice the acceleration
    over the jerk is enough, and half of it where accelerations rise from 0 or fall to it; what is
    between may still be faster, though it is slowed down.
    """
    assert limits.jerks is not None
    enough = 2.0 * float((limits.accelerations / limits.jerks).max())
    motion = retimer.motion(path, gentler(limits))
    tried = (
        sample(motion, limits, rise_time=seconds)
        for seconds in sorted({max(rise_time, part * enough) for part in _PARTS})
    )
    return min(tried, key=lambda found: (found.excess is not None, found.points.duration))
