"""Motions that stop in a line of their own first, and go on from there to where the path leads.

So do those that are too fast to turn, or have no way of speeding up: likewise a motion that ends
moving begins the last of its way at rest. Stops are in closed form: accelerations become none, and
then all joints brake together.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.timing.timing_problem import TimingProblem
from scene_graph_ros.trajectories.motion_ends import EndRates
from scene_graph_ros.trajectories.motion_limits import MotionLimits
from scene_graph_ros.trajectories.straight_motion import duration_with_rests
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints
from scene_graph_ros.trajectories.waypoints import rounding_of, telling_points

__all__ = ["Stopping", "stopping_first"]

Array = NDArray[np.float64]

_ALONG = 1e-9
"""Relative: a way that is so near to the direction of an edge is along it."""

_SHORTEST = 10_000
"""ns: the shortest phase."""

_LONGEST = 1e6
"""s: who needs longer to stop had better not."""

_SPARE = 1e-9
"""Of the limits: rounding of positions takes no more."""


class Stopping(NamedTuple):
    """A motion in parts that rest where they meet."""

    lead: TrajectoryPoints | None
    """From the start to rest, of the positions that move."""
    between: TimingProblem
    tail: TrajectoryPoints | None
    """From rest to the end."""

    @property
    def longest(self) -> float:
        """The duration with rests at all points, s."""
        own = self.between
        total = duration_with_rests(own.path[:, own.rows], own.limits)
        return total + sum(each.duration for each in (self.lead, self.tail) if each is not None)


def stopping_first(problem: TimingProblem) -> Stopping | None:
    """Return a motion that stops where its path does not begin or end at rest.

    None where that leads off a path that it must not leave, or beyond the first or last edge in
    line with it.
    """
    q, rest = problem.path[:, problem.rows], EndRates(*np.zeros((2, len(problem.rows))))
    # Points on straight edges between others are no ends of these.
    kept = telling_points(q, rounding_of(q, problem.limits.velocities), problem.through)
    if len(kept) < 2:
        return None
    path, through = problem.path, problem.through.copy()
    first, last = 0, len(path)
    lead = tail = None
    if not problem.start.is_rest:
        lead = _stop(q[0], problem.start, problem.limits)
        if lead is None or not _is_allowed(problem, q[kept[:2]], lead.positions[-1]):
            return None
        first = int(kept[1])
    if not problem.end.is_rest:
        backward = EndRates(-problem.end.velocity, problem.end.acceleration)
        stop = _stop(q[-1], backward, problem.limits)
        if stop is None or not _is_allowed(problem, q[kept[:-3:-1]], stop.positions[-1]):
            return None
        tail = _reversed(stop)
        last = int(kept[-2]) + 1
    rows, marks = [path[first:last]], [through[first:last]]
    if lead is not None:
        rows, marks = [problem.whole(lead.positions[-1:]), *rows], [np.zeros(1, np.bool_), *marks]
    if tail is not None:
        rows, marks = [*rows, problem.whole(tail.positions[:1])], [*marks, np.zeros(1, np.bool_)]
    own = problem._replace(
        path=np.concatenate(rows), through=np.concatenate(marks), start=rest, end=rest
    )
    return Stopping(lead, own, tail)


def _is_allowed(problem: TimingProblem, ends: Array, stop: Array) -> bool:
    """Tell whether a motion may stop there from the first end of an edge ``(2, k)``."""
    edge, way = ends[1] - ends[0], stop - ends[0]
    row = int(np.argmax(np.abs(edge)))
    if edge[row] == 0.0:
        return False
    part = float(way[row] / edge[row])
    if (np.abs(way - part * edge) <= _ALONG * np.abs(way).max()).all() and part > 0.0:
        return part <= 1.0
    return problem.deviation is None


def _stop(q: Array, rates: EndRates, limits: MotionLimits) -> TrajectoryPoints | None:
    """Return the points of a motion from q ``(k,)`` to rest, at whole nanoseconds.

    None where that takes too long.
    """
    velocity, acceleration = rates
    longest = float((np.abs(velocity) / limits.accelerations).max())
    if limits.jerks is not None:
        changes = np.abs(acceleration), np.sqrt(limits.jerks * np.abs(velocity))
        longest += sum(float((each / limits.jerks).max()) for each in changes)
    if longest > _LONGEST:
        return None
    times, states = [0], [(q, velocity, acceleration)]

    def go(nanoseconds: int, jerk: Array) -> None:
        t = nanoseconds * 1e-9
        q, v, a = states[-1]
        times.append(times[-1] + nanoseconds)
        states.append((q + t * (v + t * (a / 2.0 + t * jerk / 6.0)), v + t * (a + t * jerk / 2.0),
                       a + t * jerk))  # fmt: skip

    if limits.jerks is None:
        count = _whole(float((np.abs(velocity) / limits.accelerations).max()))
        even = [0, count], np.stack([q, q + 0.5e-9 * count * velocity]), [velocity, 0.0 * velocity]
        return TrajectoryPoints(np.array(even[0]), even[1], np.stack(even[2]))
    if acceleration.any():
        count = _whole(float((np.abs(acceleration) / limits.jerks).max()))
        go(count, -acceleration / (count * 1e-9))
        states[-1] = (*states[-1][:2], np.zeros_like(q))
    v = states[-1][1]
    if v.any():
        moving = v != 0.0
        most = float((limits.accelerations[moving] / np.abs(v[moving])).min())
        jerk = float((limits.jerks[moving] / np.abs(v[moving])).min())
        rise = _whole(min(most / jerk, math.sqrt(1.0 / jerk)))
        hold = max(_whole(1.0 / min(most, math.sqrt(jerk))) - rise, 0)
        if 0 < hold < _SHORTEST:
            rise, hold = rise + hold, 0
        change = -v / (rise * 1e-9 * (rise + hold) * 1e-9)
        go(rise, change)
        if hold:
            go(hold, 0.0 * change)
        go(rise, -change)
        states[-1] = states[-1][0], np.zeros_like(q), np.zeros_like(q)
    rows = (np.stack(each) for each in zip(*states, strict=True))
    return TrajectoryPoints(np.array(times), *rows)


def _whole(seconds: float) -> int:
    """Return so many nanoseconds, or a few more."""
    return max(math.ceil(seconds * (1.0 + _SPARE) * 1e9), _SHORTEST)


def _reversed(points: TrajectoryPoints) -> TrajectoryPoints:
    """Return the same motion the other way."""
    assert points.velocities is not None
    a = points.accelerations
    return TrajectoryPoints(
        points.nanoseconds[-1] - points.nanoseconds[::-1],
        points.positions[::-1],
        -points.velocities[::-1],
        None if a is None else a[::-1],
    )
