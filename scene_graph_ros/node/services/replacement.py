"""Trajectories that are replaced while a robot executes them; imported with the first goal.

Both parts are of one kind, cubics or quintics: a piece of one is one of them again.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError, StaleError
from msg_adapters.stamps import duration_from_msg, stamp_from_msg, stamp_to_msg
from msg_adapters.trajectories import joint_trajectory_from_msg, joint_trajectory_to_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.trajectories import PiecewisePolynomial, TrajectoryPoints

__all__ = ["Replaced", "joined", "replaced_trajectory", "require_followed"]

_FOLLOWED = 0.1
"""rad or m: how far from its trajectory a robot may be that executes it."""


_REST = 1e-6
"""rad/s or m/s: slower is rest."""

_STEP = 100_000_000
"""ns, at least, from one switch that is tried to the next."""


class Replaced(NamedTuple):
    """A trajectory that is being executed, and when another one goes on from it."""

    rows: NDArray[np.intp]
    """``(k,)``: of its joints' positions in a configuration."""
    points: TrajectoryPoints
    """``(m, k)``."""
    curve: PiecewisePolynomial
    """Through these, s."""
    begin: int
    """ns of the node's clock: when its time was 0."""
    due: int
    """ns from then on: when the goal's turn had come."""
    after: int
    """ns from the search to the switch, at least."""
    at: int
    """ns from then on: the switch."""

    def state(self, order: int, size: int) -> NDArray[np.float64]:
        """Return a derivative at the switch, ``(nq,)``; 0 of all other positions."""
        result = np.zeros(size)
        curve = self.curve.derivative(order) if order else self.curve
        # It ends at rest, but for rounding.
        if order == 0 or self.at < self.points.nanoseconds[-1]:
            result[self.rows] = curve.value(self.at * 1e-9)
        return result

    def seconds_left(self, now: int) -> float:
        """Return the time from ``now`` (ns) to the switch, s; negative when that is over."""
        return (self.at - (now - self.begin)) * 1e-9

    def later(self, now: int) -> Replaced | None:
        """Return the next switch that is tried at a time (ns); None after the trajectory's end."""
        end = int(self.points.nanoseconds[-1])
        if self.at >= end:
            return None
        return self._replace(at=min(max(self.at + _STEP, now - self.begin + self.after), end))

    def rest(self) -> TrajectoryPoints:
        """Return the points from the last one that was due up to the switch, which is the last."""
        times = self.points.nanoseconds
        first = max(int(np.searchsorted(times, self.due, side="right")) - 1, 0)
        rows = np.arange(first, int(np.searchsorted(times, self.at, side="left")))
        parts: list[Any] = []
        for order, name in enumerate(("positions", "velocities", "accelerations")):
            values = getattr(self.points, name)
            if values is None:
                parts.append(None)
                continue
            end = self.state(order, int(self.rows.max()) + 1)[self.rows]
            parts.append(np.concatenate([values[rows], end[np.newaxis]]))
        return TrajectoryPoints(np.append(times[rows], self.at), *parts)

    def whole(self, start: NDArray[np.float64]) -> TrajectoryPoints:
        """Return `rest` with all positions, those of other joints as at ``start`` ``(nq,)``."""
        rest, parts = self.rest(), []
        for name in ("positions", "velocities", "accelerations"):
            values = getattr(rest, name)
            if values is not None:
                others = start if name == "positions" else np.zeros(len(start))
                values, own = np.repeat(others[np.newaxis], len(values), axis=0), values
                values[:, self.rows] = own
            parts.append(values)
        return TrajectoryPoints(rest.nanoseconds - rest.nanoseconds[0], *parts)


def replaced_trajectory(
    request: Any, robots: PlanningRobots, moving: NDArray[np.intp], now: int
) -> Replaced | None:
    """Return the trajectory that a goal replaces, None where it replaces none.

    ``moving`` are the rows of the positions that may move; ``now`` is when the goal's turn has
    come (ns). Raises MessageError naming the field, UnknownIdError and NameConflictError for a
    joint, and TrajectoryError for the points.
    """
    message, field = request.executing, "executing"
    if not len(message.points):
        if len(message.joint_names):
            raise MessageError(f"{field} has joints, but no points")
        return None
    _require_fitting(request)
    names, points = _points_of(request)
    rows = _rows(names, request, robots, moving)
    begin, after = stamp_from_msg(message.header.stamp), duration_from_msg(request.replace_after)
    if begin <= 0:
        raise MessageError(f"{field}.header.stamp is zero: it says when time_from_start was 0")
    if after <= 0:
        raise MessageError(f"replace_after must be greater than 0 s, not {after * 1e-9:g}")
    times = points.nanoseconds
    due, at = now - begin, min(now - begin + after, int(times[-1]))
    if due < times[0]:
        raise MessageError(f"{field} begins in {(times[0] - due) * 1e-9:.3f} s only")
    if due >= times[-1]:
        raise MessageError(
            f"{field} ended {(due - times[-1]) * 1e-9:.3f} s ago: leave it empty, and the plan"
            " begins at rest"
        )
    if points.velocities is not None and np.abs(points.velocities[-1]).max() > _REST:
        raise MessageError(f"{field}.points end in motion: a robot has to come to rest")
    return Replaced(rows, points, points.trajectory(), begin, due, after, at)


def _require_fitting(request: Any) -> None:
    """Raise MessageError for options of a goal that don't go with a robot in motion."""
    for is_wrong, field, value in (
        (not request.with_trajectory, "with_trajectory", "true"),
        (request.planner == "regions", "planner", "'fastest' or 'rrt_connect'"),
        (duration_from_msg(request.rise_time) != 0, "rise_time", "0"),
        (request.start_overlap != 0.0, "start_overlap", "0"),
    ):
        if is_wrong:
            raise MessageError(f"{field} must be {value} where executing is replaced")


def _points_of(request: Any) -> tuple[tuple[str, ...], TrajectoryPoints]:
    """Return the joints and the points of the trajectory that is replaced."""
    try:
        names, points = joint_trajectory_from_msg(request.executing)
    except MessageError as error:
        raise MessageError(f"executing.{error}") from error
    if points.velocities is None or len(points.nanoseconds) < 2:
        raise MessageError("executing.points must be two or more, with velocities")
    limits = request.limits
    has_jerk = limits.max_jerk != 0.0 or len(limits.max_jerks) > 0
    if has_jerk and points.accelerations is None:
        raise MessageError("executing.points have no accelerations, and limits have jerks")
    if not has_jerk and points.accelerations is not None:
        raise MessageError("executing.points have accelerations, and limits have no jerks")
    return names, points


def require_followed(
    replaced: Replaced,
    robots: PlanningRobots,
    present: NDArray[np.float64],
    snapshot: WorldSnapshot,
) -> None:
    """Raise StaleError where the robot is not where the trajectory has it.

    ``present`` ``(nq,)`` is where it was at the snapshot's stamps.
    """
    names = [robots.positions.names[row] for row in replaced.rows]
    stamps = np.array([_stamp(robots, name, snapshot) for name in names])
    curve = replaced.curve
    times = np.clip((stamps - replaced.begin) * 1e-9, curve.start_time, curve.end_time)
    there = curve.value(times)[np.arange(len(times)), np.arange(len(times))]
    away = np.where(stamps > 0, np.abs(present[replaced.rows] - there), 0.0)
    worst = int(np.argmax(away))
    if away[worst] > _FOLLOWED:
        raise StaleError(
            f"executing has {quoted(names[worst])} {away[worst]:.3g} from where it was reported,"
            f" and {_FOLLOWED:g} is the most: the robot executes something else"
        )


def _stamp(robots: PlanningRobots, name: str, snapshot: WorldSnapshot) -> int:
    """Return when a position was reported (ns), not above 0 where nobody did."""
    robot = robots.robot_of(name)
    stamps = snapshot.stamps[robot].joint_stamps
    own = name.removeprefix(f"{robot}/")
    return int(stamps.get(own, stamps.get(own.rpartition(".")[0], 0)))


def joined(
    replaced: Replaced, points: TrajectoryPoints, rows: NDArray[np.intp], names: list[str]
) -> tuple[Any, int]:
    """Return one trajectory of both, as a message, and the number of points of the first.

    ``points`` are of the positions ``rows`` ``(k,)`` with ``names``, from the switch on. A joint
    that only one of both moves stands still in the other.
    """
    before = replaced.rest()
    count = len(before.nanoseconds) - 1
    columns = {int(row): k for k, row in enumerate(replaced.rows)}
    parts: list[Any] = []
    for name in ("positions", "velocities", "accelerations"):
        new, old = getattr(points, name), getattr(before, name)
        if new is None:
            parts.append(None)
            continue
        first = np.zeros((count, len(rows)))
        if name == "positions":
            first[:] = new[0]
        for k, row in enumerate(rows.tolist()):
            if row in columns:
                first[:, k] = old[:count, columns[row]]
        parts.append(np.concatenate([first, new]))
    shift = before.nanoseconds[-1] - points.nanoseconds[0]
    times = np.concatenate([before.nanoseconds[:count], points.nanoseconds + shift])
    start = int(times[0])
    message = joint_trajectory_to_msg(names, TrajectoryPoints(times - start, *parts))
    message.header.stamp = stamp_to_msg(replaced.begin + start)
    return message, count


def _rows(
    names: tuple[str, ...], request: Any, robots: PlanningRobots, moving: NDArray[np.intp]
) -> NDArray[np.intp]:
    """Return the rows of the joints of the trajectory."""
    found: dict[int, str] = {}
    for name in names:
        meaning = robots.positions.meaning(name, "executing.joint_names")
        if meaning.row not in moving:
            raise MessageError(
                f"executing moves {quoted(name)}, which group {quoted(request.group)} does not"
            )
        if not meaning.is_own:
            raise MessageError(f"executing.joint_names: {quoted(name)} mimics {meaning.name}")
        if meaning.row in found:
            raise MessageError(f"executing.joint_names has {quoted(name)} twice")
        found[meaning.row] = name
    for name in request.start.names:
        row = robots.positions.row(name, "start.names")
        if row in found:
            raise MessageError(
                f"start has {quoted(name)}, and so has executing: it is where that has it"
            )
    return np.array(list(found), dtype=np.intp)
