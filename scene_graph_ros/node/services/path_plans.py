"""Paths of robots in the world, as goals ask for them; imported when the first one does."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import time
from typing import Any

import numpy as np
from trajectory_msgs.msg import JointTrajectory

from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import (
    configurations_to_msg,
)
from msg_adapters.stamps import stamp_to_msg
from msg_adapters.status import ok_status
from msg_adapters.trajectories import (
    joint_trajectory_to_msg,
)
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.services.plan_goals import (
    CancelledError,
    checked_goal,
    patience,
    PlanGoal,
    thinned,
)
from scene_graph_ros.node.services.replacement import joined, Replaced
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import (
    Plan,
    plan_path,
    plan_trajectory,
    PlanProgress,
    PlanStage,
    SceneGraphCollisionChecker,
    time_path,
    TimedPath,
)
from scene_graph_ros.planning.timing.path_timing import prove_part
from scene_graph_ros.trajectories import MotionLimits

__all__ = ["plan"]


def plan(
    goal: Goal,
    snapshot: WorldSnapshot,
    limit: Callable[[str], Any],
    text: Callable[[str], tuple[str, str]],
    clock: Callable[[], int],
) -> tuple[Any, PlannedPath | None]:
    """Return the result of a goal of PlanPath, and the path; feedback goes out meanwhile.

    ``clock`` returns the node's time, ns. Raises StaleError, UnknownIdError, NameConflictError,
    MessageError, TooLargeError, UnavailableError, PlanningError and TrajectoryError for goals that
    can't be worked on, naming the field and its value.
    """
    begin, core = time.monotonic(), snapshot.query.snapshot
    robots = snapshot.robots.planning(core, snapshot.bases)
    wanted: PlanGoal | None = checked_goal(goal.request, robots, snapshot, limit, clock())
    assert wanted is not None
    result = PlanPath.Result(
        status=ok_status(),
        scene_version=snapshot.scene_version,
        stamp=stamp_to_msg(snapshot.stamp),
    )
    path, checker = None, robots.checker(core, **wanted.paddings)
    try:
        while path is None and wanted is not None:
            path = _search(goal, robots, wanted, checker, result, limit, clock)
            is_untimed = result.failure == PlanPath.Result.NOT_TIMED
            wanted = wanted.later(clock()) if is_untimed else None
    except CancelledError as cancelled:
        result.failure, result.reason = PlanPath.Result.CANCELED, str(cancelled)
    result.seconds = time.monotonic() - begin
    return result, path


def _search(
    goal: Goal,
    robots: PlanningRobots,
    wanted: PlanGoal,
    checker: SceneGraphCollisionChecker,
    result: Any,
    limit: Callable[[str], Any],
    clock: Callable[[], int],
) -> PlannedPath | None:
    """Return the path of a goal, and fill the result. Raises CancelledError."""

    def watch(progress: PlanProgress) -> None:
        if goal.is_cancelled:
            raise CancelledError.of_search(progress)
        goal.tell(_feedback(progress))

    timeout = patience(goal.request.timeout, limit)
    if wanted.replaced is not None:
        timeout = min(timeout, max(wanted.replaced.seconds_left(clock()), 0.0))
        if not _is_rest_free(goal, wanted, wanted.replaced, checker, result, limit):
            return None
    how: dict[str, Any] = {
        "seed": goal.request.seed,
        "timeout": timeout,
        "group": wanted.group,
        "start_tolerance": float(limit("start_tolerance")),
        "start_overlap": wanted.start_overlap,
        "constraints": wanted.constraints,
        "watch": watch,
    }
    fastest, motion = _limits_of_fastest(goal.request, wanted), None
    if fastest is None:
        found = plan_path(checker, wanted.start, wanted.goals, **how)
    else:
        rates = wanted.start_rates
        motion = plan_trajectory(checker, wanted.start, wanted.goals, fastest, **rates, **how)
        assert motion.plan is not None
        found = motion.plan
    _tell(found, result)
    if not found.is_success:
        return None
    result.path = configurations_to_msg(robots.positions, found.configurations, wanted.moving)
    path = _planned(goal, robots, wanted, checker, found, motion, result, limit)
    return None if path is None or _is_unusable(result, wanted, limit, clock()) else path


def _is_rest_free(
    goal: Goal,
    wanted: PlanGoal,
    replaced: Replaced,
    checker: SceneGraphCollisionChecker,
    result: Any,
    limit: Callable[[str], Any],
) -> bool:
    """Tell whether what is executed is free up to the switch in the world of now; else say so."""
    assert wanted.limits is not None, "a goal that replaces has limits"

    def watch() -> None:
        if goal.is_cancelled:
            raise CancelledError("cancelled while what is executed was proven")

    patience, points = float(limit("max_planning_time")), replaced.whole(wanted.start)
    proof = prove_part(checker, points, wanted.limits, wanted.constraints, patience, watch)
    if not proof.is_success:
        result.failure = PlanPath.Result.NOT_FREE
        result.reason = f"executing, up to where it is replaced, is not free now: {proof.reason}"
    return proof.is_success


def _is_unusable(result: Any, wanted: PlanGoal, limit: Callable[[str], Any], now: int) -> bool:
    """Tell whether a trajectory comes too late to go on from another; then say so."""
    if wanted.replaced is None:
        return False
    late, most = -wanted.replaced.seconds_left(now), int(limit("max_trajectory_points"))
    if late > 0.0:
        result.failure = PlanPath.Result.TIMEOUT
        result.reason = f"it was found {late:.3f} s after the time at which it should begin"
    elif len(result.trajectory.points) > most:
        result.failure = PlanPath.Result.NOT_TIMED
        result.reason = (
            f"with the rest of what is executed it has {len(result.trajectory.points)} points, and"
            f" max_trajectory_points is {most}"
        )
    if result.failure:
        result.trajectory = JointTrajectory()
    return bool(result.failure)


def _limits_of_fastest(request: Any, wanted: PlanGoal) -> MotionLimits | None:
    """Return the limits of the motion that the planner "fastest" is to find; else None.

    Raises MessageError for a goal that wants no trajectory, or one with a rise time.
    """
    if request.planner != "fastest":
        return None
    if wanted.limits is None:
        raise MessageError(
            "with_trajectory must be true for the planner 'fastest', and limits say how fast the"
            " robots may be"
        )
    if wanted.rise_time > 0.0:
        raise MessageError(
            "rise_time must be 0 with the planner 'fastest': limits of jerk say how fast"
            " accelerations may change"
        )
    return wanted.limits


def _planned(
    goal: Goal,
    robots: PlanningRobots,
    wanted: PlanGoal,
    checker: SceneGraphCollisionChecker,
    found: Plan,
    motion: TimedPath | None,
    result: Any,
    limit: Callable[[str], Any],
) -> PlannedPath | None:
    """Return the path, or a trajectory, along it or that is there already; fill the result."""
    q, times, free_from = found.configurations, None, found.free_from
    ends = q if len(q) > 1 else np.repeat(q, 2, axis=0)
    curves = np.stack([ends[:-1], ends[1:]], axis=1)
    if wanted.limits is not None:
        timed = motion or _timed(goal, wanted, wanted.limits, checker, found, limit)
        replaced = wanted.replaced
        timed = thinned(
            timed,
            checker,
            wanted.limits,
            limit,
            partial(_look, goal, found, time.monotonic()),
            wanted.constraints,
            others=0 if replaced is None else len(replaced.rest().nanoseconds) - 1,
        )
        if timed.points is None or timed.trajectory is None:
            result.failure, result.reason = PlanPath.Result.NOT_TIMED, timed.reason or ""
            return None
        columns = wanted.moving
        names = [robots.positions.short(column) for column in columns]
        points = timed.points.of(columns)
        free_from = result.trajectory_free_from = timed.free_from
        if replaced is None:
            result.trajectory = joint_trajectory_to_msg(names, points)
        else:
            result.trajectory, count = joined(replaced, points, columns, names)
            result.replaces_from = result.trajectory_free_from = count
        result.trajectory_clearance, result.stops = timed.least_clearance, timed.stops
        q, times = timed.points.positions, timed.trajectory.breaks
        curves = timed.trajectory.control_points
    return PlannedPath(
        goal.id,
        q,
        curves,
        times,
        robots.positions.names,
        wanted.moving,
        **wanted.paddings,
        free_from=free_from,
    )


def _timed(
    goal: Goal,
    wanted: PlanGoal,
    limits: MotionLimits,
    checker: SceneGraphCollisionChecker,
    found: Plan,
    limit: Callable[[str], Any],
) -> TimedPath:
    """Return the trajectory along a path that was found."""
    patience = float(limit("max_planning_time"))
    return time_path(
        checker,
        found.configurations,
        limits,
        rise_time=wanted.rise_time,
        retimer=wanted.retimer,
        start_tolerance=float(limit("start_tolerance")),
        free_from=found.free_from,
        constraints=wanted.constraints,
        timeout=patience,
        watch=partial(_look, goal, found, time.monotonic()),
        **wanted.start_rates,
    )


def _look(goal: Goal, found: Plan, begin: float) -> None:
    """Give feedback on timing a path. Raises CancelledError for a goal that is cancelled."""
    seconds = time.monotonic() - begin
    if goal.is_cancelled:
        raise CancelledError.of_search(
            PlanProgress(PlanStage.PROVING, seconds, found.tree_sizes, found.edges)
        )
    goal.tell(
        PlanPath.Feedback(
            state=PlanPath.Feedback.TIMING,
            seconds=seconds,
            tree_sizes=np.array(found.tree_sizes, dtype=np.uint64),
            edges=found.edges,
        )
    )


def _feedback(progress: PlanProgress) -> Any:
    return PlanPath.Feedback(
        state=progress.stage.value,
        seconds=progress.seconds,
        tree_sizes=np.array(progress.tree_sizes, dtype=np.uint64),
        edges=progress.edges,
    )


def _tell(found: Plan, result: Any) -> None:
    """Fill a result from a plan, but for the path."""
    result.edges = found.edges
    if found.failure is not None:
        result.failure, result.reason = found.failure.value, found.reason or ""
        return
    result.failure, result.reason = PlanPath.Result.NONE, ""
    result.goal = found.goal or 0
    result.least_clearance, result.length = found.least_clearance, found.length
    result.free_from = found.free_from
