"""Goals of the planning action, checked; imported when the first one's turn comes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError, TooLargeError, UnavailableError
from msg_adapters.link_constraints import link_constraint_from_msg
from msg_adapters.pose_goals import pose_target_from_msg
from msg_adapters.robot_configurations import (
    configurations_from_msg,
    count_rows,
    padding_from_msg,
)
from msg_adapters.stamps import duration_from_msg
from msg_adapters.trajectories import motion_limits_from_msg, rise_time_from_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.services.replacement import (
    Replaced,
    replaced_trajectory,
    require_followed,
)
from scene_graph_ros.node.services.tally import require
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.reported_joints import require_reported
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import (
    LinkConstraint,
    MissingRetimerError,
    PlanProgress,
    PoseTarget,
    SceneGraphCollisionChecker,
    thin_trajectory,
    TimedPath,
)
from scene_graph_ros.planning.checker.position_limits import moved_inside
from scene_graph_ros.planning.constraints.link_constraints import MOST_CONSTRAINTS
from scene_graph_ros.robots.tree_kernels import FLOATING
from scene_graph_ros.trajectories import MotionLimits
from scene_graph_ros.trajectories.retimer import Retimer
from scene_graph_ros.trajectories.retimers.named_retimers import as_retimer

__all__ = ["CancelledError", "PlanGoal", "checked_goal", "patience", "start_inside", "thinned"]


class CancelledError(Exception):
    """The goal was cancelled, when the work had come so far."""

    @classmethod
    def of_search(cls, progress: PlanProgress) -> CancelledError:
        """Return the error that describes how far a search had come."""
        sizes = progress.tree_sizes
        return cls(
            f"cancelled after {progress.seconds:.3g} s: the trees from start and goal had"
            f" {sizes[0]} and {sizes[1]} configurations, after {progress.edges} edges"
        )


class PlanGoal(NamedTuple):
    """A goal, checked."""

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
    retimer: Retimer
    start_overlap: float
    """Metres."""
    constraints: tuple[LinkConstraint, ...]
    replaced: Replaced | None
    """The trajectory that it goes on from."""

    def later(self, now: int) -> PlanGoal | None:
        """Return the same goal with a later start on the trajectory that it goes on from.

        ``now`` is the node's time, ns. None where there is no later one.
        """
        replaced = None if self.replaced is None else self.replaced.later(now)
        if replaced is None:
            return None
        start = self.start.copy()
        start[replaced.rows] = replaced.state(0, len(start))[replaced.rows]
        return self._replace(start=start, replaced=replaced)

    @property
    def start_rates(self) -> dict[str, Any]:
        """How it begins to move, as `time_path` takes it: ``(nq,)``, or None for rest."""
        replaced, size = self.replaced, len(self.start)
        if replaced is None:
            return {"start_velocity": None, "start_acceleration": None}
        has_jerk = replaced.points.accelerations is not None
        return {
            "start_velocity": replaced.state(1, size),
            "start_acceleration": replaced.state(2, size) if has_jerk else None,
        }


def checked_goal(
    request: Any,
    robots: PlanningRobots,
    snapshot: WorldSnapshot,
    limit: Callable[[str], Any],
    now: int,
) -> PlanGoal:
    """Return a goal, checked, of robots in a snapshot, at a time of the node's (ns).

    Raises StaleError where nobody has reported their positions; see `require_reported`.
    """
    present = robots.present(snapshot.positions)
    count = count_rows(request.start) + count_rows(request.goals) + len(request.pose_goals)
    require(limit, "max_robot_configurations_per_request", count, "configurations")
    starts = configurations_from_msg(request.start, robots.positions, present, "start")
    if len(starts) != 1:
        raise MessageError(f"start has {len(starts)} rows, and must have one")
    group, moving = None, np.arange(robots.tree.num_positions)
    if request.group:
        group = robots.groups.names[robots.groups.row(request.group, "group")]
        moving = robots.tree.group_positions(group)
    replaced = replaced_trajectory(request, robots, moving, now)
    if replaced is not None:
        rows = replaced.rows
        starts[0][rows] = replaced.state(0, len(present))[rows]
    inside = start_inside(starts[0], robots, moving, limit)
    goals = _goals(request, robots, inside)
    paddings = {
        name: padding_from_msg(getattr(request, name), name)
        for name in ("environment_padding", "self_padding")
    }
    limits = None
    if request.with_trajectory:
        limits = _limits(request.limits, robots, moving)
    rise_time = rise_time_from_msg(request.rise_time, "rise_time")
    retimer = _retimer(limit("retimer") if request.with_trajectory else "time_optimal")
    overlap = padding_from_msg(request.start_overlap, "start_overlap")
    if overlap < 0.0:
        raise MessageError(f"start_overlap must not be negative, got {overlap:g}")
    constraints = _constraints(request, robots)
    require_reported(request, robots, snapshot, limit, now)
    if replaced is not None:
        require_followed(replaced, robots, present, snapshot)
    how = limits, rise_time, retimer, overlap, constraints, replaced
    return PlanGoal(starts[0], goals, group, moving, paddings, *how)


def start_inside(
    start: NDArray[np.float64],
    robots: PlanningRobots,
    moving: NDArray[np.intp],
    limit: Callable[[str], Any],
) -> NDArray[np.float64]:
    """Return a start ``(nq,)`` with positions a little beyond limits, if they may move, within."""
    moves = np.isin(np.arange(len(start)), moving)
    return moved_inside(robots.tree, start, moves, float(limit("start_tolerance")))


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


def _constraints(request: Any, robots: PlanningRobots) -> tuple[LinkConstraint, ...]:
    """Return the constraints along the whole motion. Raises TooLargeError for too many."""
    count = len(request.constraints)
    if count > MOST_CONSTRAINTS:
        raise TooLargeError(
            f"constraints must be {MOST_CONSTRAINTS} at most, and there are {count}"
        )
    return tuple(
        link_constraint_from_msg(each, robots.links, f"constraints[{row}]")
        for row, each in enumerate(request.constraints)
    )


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


def _retimer(name: str) -> Retimer:
    """Return the retimer that is configured. Raises UnavailableError where it is missing."""
    try:
        return as_retimer(name)
    except MissingRetimerError as error:
        raise UnavailableError(f"parameter retimer: {error}") from error


def patience(timeout: Any, limit: Callable[[str], Any]) -> float:
    """Return seconds to look for a path; raises MessageError for less than none."""
    seconds = duration_from_msg(timeout) * 1e-9
    if seconds < 0.0:
        raise MessageError(f"timeout is negative: {seconds:g} s")
    most = float(limit("max_planning_time"))
    return min(seconds, most) if seconds > 0.0 else most


def thinned(
    timed: TimedPath,
    checker: SceneGraphCollisionChecker,
    limits: MotionLimits,
    limit: Callable[[str], Any],
    watch: Callable[[], None],
    constraints: tuple[LinkConstraint, ...] = (),
    *,
    others: int = 0,
) -> TimedPath:
    """Return a trajectory of as many points as there may be, or why there is none.

    There will be ``others`` before them.
    """
    return thin_trajectory(
        checker,
        timed,
        limits,
        max(int(limit("max_trajectory_points")) - others, 2),
        deviation=float(limit("thinning_deviation")),
        constraints=constraints,
        timeout=float(limit("max_planning_time")),
        watch=watch,
    )
