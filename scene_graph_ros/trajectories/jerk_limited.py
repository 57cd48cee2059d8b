"""Points of a trajectory along a path within limits of jerk, too."""

from __future__ import annotations

from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.sampling import gentler, sample, Sampled

__all__ = ["sample_along"]

_PARTS = (0.5, 0.7, 1.0)
"""Of a rise time that is certainly enough: what is tried."""

_LESS = 2.0**-0.5
"""By how much less acceleration is tried next."""

_LEAST = 1e-9
"""Of the limits: the least acceleration that is tried."""

_WORSE = 2
"""So many accelerations in turn that are no faster end the search."""


def sample_along(
    path: PiecewisePolynomial,
    limits: MotionLimits,
    *,
    rise_time: float = 0.0,
    retimer: Retimer,
) -> Sampled:
    """Return points along a path, as a retimer and `sample` make them, within all limits.

    Where there are limits of jerk that the retimer knows nothing of, the mean over a rise time
    keeps them: accelerations change by twice their limit in it, at most. So a rise time of twice
    the acceleration over the jerk is enough, and half of it where accelerations rise from 0 or
    fall to it; what is between may still be faster, though it is slowed down. Short ways never
    come to the limit of acceleration, so less of it, and with it a shorter rise time, is faster
    there. Of all that is tried the shortest trajectory is returned.

    Raises RetimingError where the retimer finds no motion.
    """
    if limits.jerks is None:
        return sample(retimer.motion(path, gentler(limits)), limits, rise_time=rise_time)
    if retimer.keeps_jerks:
        motion = retimer.motion(path, limits)
        return sample(motion, limits, rise_time=rise_time, with_accelerations=True)
    best: Sampled | None = None
    share, worse = 1.0, 0
    while share > _LEAST and worse < _WORSE:
        accelerations = share * limits.accelerations
        softer = gentler(MotionLimits(limits.velocities, accelerations, limits.names))
        motion = retimer.motion(path, softer)
        enough = 2.0 * float((accelerations / limits.jerks).max())
        tried = [
            sample(motion, limits, rise_time=seconds)
            for seconds in sorted({max(rise_time, part * enough) for part in _PARTS})
        ]
        found = min(tried, key=_order)
        worse += 1
        if best is None or _order(found) < _order(best):
            best, worse = found, 0
        share *= _LESS
    assert best is not None
    return best


def _order(sampled: Sampled) -> tuple[bool, float]:
    """Return what is less for what is better: within limits, and short."""
    return sampled.excess is not None, sampled.points.duration
