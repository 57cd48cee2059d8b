"""Paths of robots in the world, as goals ask for them; imported when the first one does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.pose_goals import pose_target_from_msg
from msg_adapters.robot_configurations import (
    configurations_from_msg,
    configurations_to_msg,
    count_rows,
    padding_from_msg,
)
from msg_adapters.stamps import duration_from_msg, stamp_to_msg
from msg_adapters.status import ok_status
from msg_adapters.trajectories import (
    joint_trajectory_to_msg,
    motion_limits_from_msg,
    rise_time_from_msg,
)
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.services.tally import require
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import (
    Plan,
    plan_path,
    PlanProgress,
    PlanStage,
    PoseTarget,
    SceneGraphCollisionChecker,
    time_path,
    TimedPath,
)
from scene_graph_ros.planning.trajectories import MotionLimits
from scene_graph_ros.robots.tree_kernels import FLOATING

__all__ = ["plan"]


class _CancelledError(Exception):
    """The goal was cancelled, when the search had come so far."""

    def __init__(self, progress: PlanProgress) -> None:
        sizes = progress.tree_sizes
        super().__init__(
            f"cancelled after {progress.seconds:.3g} s: the trees from start and goal had"
            f" {sizes[0]} and {sizes[1]} configurations, after {progress.edges} edges"
        )


class _Asked(NamedTuple):
    """What a goal says, checked."""

    start: NDArray[np.float64]
    """``(nq,)``."""
    goals: NDArray[np.float64] | Sequence[PoseTarget]
    """``(m, nq)``, or where tools are to be."""
    group: str | None
    moving: NDArray[np.intp]
    """``(k,)``: the positions that may change."""
    paddings: dict[str, float]
    limits: MotionLimits | None
    """Of the moving positions, where a trajectory is wanted."""
    rise_time: float


def plan(
    goal: Goal, snapshot: WorldSnapshot, limit: Callable[[str], Any]
) -> tuple[Any, PlannedPath | None]:
    """Return the result of a goal of PlanPath, and the path; feedback goes out meanwhile.

    Raises UnknownIdError, NameConflictError, MessageError, TooLargeError, PlanningError and
    TrajectoryError for what can't be worked on, naming the field and its value.
    """
    begin, core = time.monotonic(), snapshot.query.snapshot
    robots = snapshot.robots.planning(core)
    asked = _asked(goal.request, robots, robots.present(snapshot.positions), limit)
    result = PlanPath.Result(
        status=ok_status(),
        scene_version=snapshot.scene_version,
        stamp=stamp_to_msg(snapshot.stamp),
    )

    def watch(progress: PlanProgress) -> None:
        if goal.is_cancelled:
            raise _CancelledError(progress)
        goal.tell(_feedback(progress))

    path, checker = None, robots.checker(core, **asked.paddings)
    try:
        found = plan_path(
            checker,
            asked.start,
            asked.goals,
            seed=goal.request.seed,
            timeout=_patience(goal.request.timeout, limit),
            group=asked.group,
            watch=watch,
        )
        _tell(found, result)
        if found.is_success:
            result.path = configurations_to_msg(
                robots.positions, found.configurations, asked.moving
            )
            path = _planned(goal, robots, asked, checker, found, result, limit)
    except _CancelledError as cancelled:
        result.failure, result.reason = PlanPath.Result.CANCELED, str(cancelled)
    result.seconds = time.monotonic() - begin
    return result, path


def _planned(
    goal: Goal,
    robots: PlanningRobots,
    asked: _Asked,
    checker: SceneGraphCollisionChecker,
    found: Plan,
    result: Any,
    limit: Callable[[str], Any],
) -> PlannedPath | None:
    """Return what was planned: the path, or a trajectory along it, of which the result is told."""
    q, times = found.configurations, None
    ends = q if len(q) > 1 else np.repeat(q, 2, axis=0)
    curves = np.stack([ends[:-1], ends[1:]], axis=1)
    if asked.limits is not None:
        timed = _timed(goal, asked.limits, checker, found, asked.rise_time, limit)
        if timed.points is None or timed.trajectory is None:
            result.failure, result.reason = PlanPath.Result.NOT_TIMED, timed.reason or ""
            return None
        columns = asked.moving
        result.trajectory = joint_trajectory_to_msg(
            [robots.positions.short(column) for column in columns], timed.points.of(columns)
        )
        result.trajectory_clearance, result.stops = timed.least_clearance, timed.stops
        q, times = timed.points.positions, timed.trajectory.breaks
        curves = timed.trajectory.control_points
    names = robots.positions.names
    return PlannedPath(goal.id, q, curves, times, names, asked.moving, **asked.paddings)


def _timed(
    goal: Goal,
    limits: MotionLimits,
    checker: SceneGraphCollisionChecker,
    found: Plan,
    rise_time: float,
    limit: Callable[[str], Any],
) -> TimedPath:
    """Return the trajectory along a path that was found."""
    begin = time.monotonic()

    def watch() -> None:
        seconds = time.monotonic() - begin
        if goal.is_cancelled:
            raise _CancelledError(
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

    patience = float(limit("max_planning_time"))
    return time_path(
        checker, found.configurations, limits, rise_time=rise_time, timeout=patience, watch=watch
    )


def _asked(
    request: Any,
    robots: PlanningRobots,
    present: NDArray[np.float64],
    limit: Callable[[str], Any],
) -> _Asked:
    """Return what a goal says, checked, of robots that are at ``present`` ``(nq,)``."""
    count = count_rows(request.start) + count_rows(request.goals) + len(request.pose_goals)
    require(limit, "max_robot_configurations_per_request", count, "configurations")
    starts = configurations_from_msg(request.start, robots.positions, present, "start")
    if len(starts) != 1:
        raise MessageError(f"start has {len(starts)} rows, and must have one")
    goals = _goals(request, robots, starts[0])
    group, moving = None, np.arange(robots.tree.num_positions)
    if request.group:
        group = robots.groups.names[robots.groups.row(request.group, "group")]
        moving = robots.tree.group_positions(group)
    paddings = {
        name: padding_from_msg(getattr(request, name), name)
        for name in ("environment_padding", "self_padding")
    }
    limits = None
    if request.with_trajectory:
        limits = _limits(request.limits, robots, moving)
    rise_time = rise_time_from_msg(request.rise_time, "rise_time")
    return _Asked(starts[0], goals, group, moving, paddings, limits, rise_time)


def _goals(
    request: Any, robots: PlanningRobots, start: NDArray[np.float64]
) -> NDArray[np.float64] | Sequence[PoseTarget]:
    """Return the configurations ``(m, nq)`` to end at, or where tools are to be."""
    has_goals = bool(len(request.goals.names) or len(request.goals.positions))
    if len(request.pose_goals):
        if has_goals:
            raise MessageError("goals has positions, and pose_goals is there, too: give either")
        return [
            pose_target_from_msg(each, robots.links, f"pose_goals[{row}]")
            for row, each in enumerate(request.pose_goals)
        ]
    if not len(request.goals.names):
        raise MessageError(
            "goals.names is empty, and so is pose_goals: a goal names at least one position, or"
            " says where a tool is to be"
        )
    goals = configurations_from_msg(request.goals, robots.positions, start, "goals")
    if not len(goals):
        raise MessageError("goals.positions is empty: there must be one row at least")
    return goals


def _limits(message: Any, robots: PlanningRobots, moving: NDArray[np.intp]) -> MotionLimits:
    """Return the limits of the positions that move; raises MessageError where a joint floats."""
    tree = robots.tree
    for joint, start in zip(tree.joints, tree.table.starts[1:], strict=True):
        if joint.kind == FLOATING and start in moving:
            raise MessageError(
                f"with_trajectory: joint {quoted(joint.name)} floats, and there are trajectories"
                " of positions only: name a group without it"
            )
    return motion_limits_from_msg(message, robots.positions, tree, moving, "limits")


def _patience(timeout: Any, limit: Callable[[str], Any]) -> float:
    """Return seconds to look for a path; raises MessageError for less than none."""
    seconds = duration_from_msg(timeout) * 1e-9
    if seconds < 0.0:
        raise MessageError(f"timeout is negative: {seconds:g} s")
    most = float(limit("max_planning_time"))
    return min(seconds, most) if seconds > 0.0 else most


def _feedback(progress: PlanProgress) -> Any:
    return PlanPath.Feedback(
        state=progress.stage.value,
        seconds=progress.seconds,
        tree_sizes=np.array(progress.tree_sizes, dtype=np.uint64),
        edges=progress.edges,
    )


def _tell(found: Plan, result: Any) -> None:
    """Fill a result with what a plan says, but for the path."""
    result.edges = found.edges
    if found.failure is not None:
        result.failure, result.reason = found.failure.value, found.reason or ""
        return
    result.failure, result.goal = PlanPath.Result.NONE, found.goal or 0
    result.least_clearance, result.length = found.least_clearance, found.length
