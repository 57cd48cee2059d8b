"""Motions of tools along straight lines, as goals ask for them; imported with the first one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import configurations_to_msg
from msg_adapters.stamps import duration_from_msg, stamp_to_msg
from msg_adapters.status import ok_status
from msg_adapters.trajectories import joint_trajectory_to_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.services.plan_goals import (
    CancelledError,
    checked_goal,
    patience,
    PlanGoal,
    start_inside,
    thinned,
)
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import (
    plan_straight,
    PoseTarget,
    StraightFailure,
    StraightPlan,
    TimedPath,
)

__all__ = ["plan"]

_TURN = 0.1
"""Seconds between two feedbacks."""

_R = PlanPath.Result
_FAILURES = {
    StraightFailure.JOINT_LIMIT: _R.GOAL_UNREACHED,
    StraightFailure.OUT_OF_REACH: _R.GOAL_UNREACHED,
    StraightFailure.TOO_FAST: _R.GOAL_UNREACHED,
    StraightFailure.COLLIDES: _R.NOT_FREE,
    StraightFailure.START: _R.START_COLLIDES,
    StraightFailure.TIMEOUT: _R.TIMEOUT,
    StraightFailure.TIMING: _R.NOT_TIMED,
    StraightFailure.CONSTRAINT: _R.GOAL_VIOLATES_CONSTRAINT,
    StraightFailure.START_VIOLATES_CONSTRAINT: _R.START_VIOLATES_CONSTRAINT,
}


def plan(
    goal: Goal,
    snapshot: WorldSnapshot,
    limit: Callable[[str], Any],
    text: Callable[[str], tuple[str, str]],
    clock: Callable[[], int],
) -> tuple[Any, PlannedPath | None]:
    """Return the result of a goal with the planner "straight", and the path.

    Where the way can't be followed to its end, the result has the path up to there. Raises as
    `path_plans.plan` does.
    """
    begin, core, request = time.monotonic(), snapshot.query.snapshot, goal.request
    robots = snapshot.robots.planning(core, snapshot.bases)
    wanted = checked_goal(request, robots, snapshot, limit, clock())
    target, X_WTs = _way(request, wanted.goals)
    result = PlanPath.Result(
        status=ok_status(),
        scene_version=snapshot.scene_version,
        stamp=stamp_to_msg(snapshot.stamp),
    )
    checker, timed = robots.checker(core, **wanted.paddings), None
    watch = _Watch(goal, begin)
    try:
        found = plan_straight(
            checker,
            start_inside(wanted.start, robots, wanted.moving, limit),
            X_WTs,
            target.link,
            target.X_LT,
            wanted.limits,
            group=wanted.group,
            constraints=wanted.constraints,
            timeout=patience(request.timeout, limit),
            watch=watch.look,
        )
        _tell(found, robots, wanted, result)
        if found.is_success and found.timed is not None and wanted.limits is not None:
            timed = thinned(
                found.timed, checker, wanted.limits, limit, watch.look, wanted.constraints
            )
            if not timed.is_success:
                result.failure, result.reason = _R.NOT_TIMED, timed.reason or ""
    except CancelledError as cancelled:
        result.failure, result.reason = _R.CANCELED, str(cancelled)
    result.seconds = time.monotonic() - begin
    if result.failure:
        return result, None
    return result, _planned(goal, found.configurations, timed, robots, wanted, result)


def _tell(found: StraightPlan, robots: PlanningRobots, wanted: PlanGoal, result: Any) -> None:
    """Fill a result from a plan, but for the trajectory."""
    q = found.configurations
    result.path = configurations_to_msg(robots.positions, q, wanted.moving)
    result.least_clearance = found.least_clearance
    result.length = float(np.linalg.norm(np.diff(q, axis=0), axis=1).sum())
    if found.failure is not None:
        result.failure = _FAILURES[found.failure]
        result.reason = f"{found.reason}: the tool comes {100.0 * found.fraction:.4g} % far"


def _planned(
    goal: Goal,
    q: NDArray[np.float64],
    timed: TimedPath | None,
    robots: PlanningRobots,
    wanted: PlanGoal,
    result: Any,
) -> PlannedPath:
    """Return the path, or the trajectory along it; fill the result with that."""
    times, ends = None, q if len(q) > 1 else np.repeat(q, 2, axis=0)
    curves = np.stack([ends[:-1], ends[1:]], axis=1)
    if timed is not None and timed.points is not None and timed.trajectory is not None:
        joints = [robots.positions.short(column) for column in wanted.moving]
        result.trajectory = joint_trajectory_to_msg(joints, timed.points.of(wanted.moving))
        result.trajectory_clearance, result.stops = timed.least_clearance, timed.stops
        q, times = timed.points.positions, timed.trajectory.breaks
        curves = timed.trajectory.control_points
    names = robots.positions.names
    return PlannedPath(
        goal.id,
        q,
        curves,
        times,
        names,
        wanted.moving,
        **wanted.paddings,
        free_from=0,
    )


class _Watch:
    """Feedback now and then, and the end of a goal that is cancelled."""

    def __init__(self, goal: Goal, begin: float) -> None:
        self._goal, self._begin, self._told = goal, begin, -_TURN

    def look(self) -> None:
        """Send the time spent so far as feedback. Raises CancelledError."""
        seconds = time.monotonic() - self._begin
        if self._goal.is_cancelled:
            raise CancelledError(f"cancelled after {seconds:.3g} s, on the tool's way")
        if seconds - self._told >= _TURN:
            self._told = seconds
            self._goal.tell(PlanPath.Feedback(state=PlanPath.Feedback.SEARCHING, seconds=seconds))


def _way(
    request: Any, goals: NDArray[np.float64] | Sequence[PoseTarget]
) -> tuple[PoseTarget, NDArray[np.float64]]:
    """Return the tool, and its poses ``(m, 4, 4)``. Raises MessageError naming the field."""
    for is_wrong, words in (
        (isinstance(goals, np.ndarray), "goals must be empty, and pose_goals lead along the way"),
        (len(request.executing.points) > 0, "executing must be empty: it begins at rest"),
        (request.start_overlap != 0.0, "start_overlap must be 0"),
        (duration_from_msg(request.rise_time) != 0, "rise_time must be 0"),
    ):
        if is_wrong:
            raise MessageError(f"{words}, with the planner 'straight'")
    assert not isinstance(goals, np.ndarray)
    first = goals[0]
    for row, (target, message) in enumerate(zip(goals, request.pose_goals, strict=True)):
        if target.link != first.link or not np.array_equal(target.X_LT, first.X_LT):
            raise MessageError(
                f"pose_goals[{row}] is of another link or tool than pose_goals[0]: the planner"
                " 'straight' leads one"
            )
        if message.position_tolerance or message.rotation_tolerance:
            raise MessageError(
                f"pose_goals[{row}] has a tolerance, and the planner 'straight' passes it exactly"
            )
    return first, np.array([target.X_WT for target in goals])
