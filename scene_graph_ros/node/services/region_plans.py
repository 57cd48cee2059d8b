"""Trajectories through regions, as goals ask for them; imported when the first one does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.region_trajectories import (
    region_trajectory_to_msg,
    RegionTrajectoryRules,
    rules_from_msg,
)
from msg_adapters.robot_configurations import configurations_from_msg, count_rows
from msg_adapters.stamps import stamp_to_msg
from msg_adapters.status import ok_status
from msg_adapters.trajectories import joint_trajectory_to_msg
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.convex.iris.regions_yaml import (
    regions_from_document,
    regions_to_yaml,
)
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSetsOptions,
    HPolyhedron,
    SolverError,
)
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.goals import Goal
from scene_graph_ros.node.services.plan_goals import (
    CancelledError,
    checked_goal,
    patience,
    PlanGoal,
    start_inside,
    thinned,
)
from scene_graph_ros.node.services.plan_watch import NoPlanError, PlanWatch
from scene_graph_ros.node.services.tally import require
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import (
    IrisZoOptions,
    plan_path,
    plan_through_regions,
    region_around,
    RegionError,
    RegionNotFoundError,
    RegionPlan,
    regions_along,
    SceneGraphCollisionChecker,
    time_curve,
    time_path,
    TimedPath,
)
from scene_graph_ros.planning.checker.path_ends import find_troubles
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.planning.timing.leading_part import joined
from scene_graph_ros.scene_files.yaml_document import parse_yaml
from scene_graph_ros.trajectories import CompositeTrajectory, MotionLimits

__all__ = ["plan"]

_F, _STATES = PlanPath.Result, PlanPath.Feedback


class _Regions(NamedTuple):
    """Regions, and the configurations that they are to connect."""

    names: list[str]
    regions: list[HPolyhedron]
    goal: NDArray[np.float64]
    """``(nq,)``."""
    row: int
    """Which of the goals that is."""
    grown: str
    """YAML of them where they were not given."""
    edges: int = 0
    """How many were looked at for a path."""


class _Work(NamedTuple):
    """The inputs of the work on a goal."""

    goal: Goal
    wanted: PlanGoal
    """With a start within limits."""
    measured: NDArray[np.float64]
    """``(nq,)``: where the robots are."""
    rules: RegionTrajectoryRules
    robots: PlanningRobots
    checker: SceneGraphCollisionChecker
    padded: SceneGraphCollisionChecker
    """With what growing keeps more."""
    watch: PlanWatch
    limit: Callable[[str], Any]

    @property
    def options(self) -> IrisZoOptions:
        """How regions grow; it ends where the watch says so."""

        def constraint(q: NDArray[np.float64]) -> NDArray[np.float64]:
            self.watch.look()
            return np.zeros((len(q), 1))

        seed = int(self.goal.request.seed)
        return IrisZoOptions(
            random_seed=seed, additional_constraints=constraint, **self.rules.growing
        )


def plan(
    goal: Goal,
    snapshot: WorldSnapshot,
    limit: Callable[[str], Any],
    text: Callable[[str], tuple[str, str]],
    clock: Callable[[], int],
) -> tuple[Any, PlannedPath | None]:
    """Return the result of a goal with the planner "regions", and the trajectory.

    Raises as `path_plans.plan` does, and ConvexSetError for regions that are none.
    """
    request, core = goal.request, snapshot.query.snapshot
    result = PlanPath.Result(
        status=ok_status(),
        scene_version=snapshot.scene_version,
        stamp=stamp_to_msg(snapshot.stamp),
    )
    if not request.with_trajectory:
        raise MessageError(
            "with_trajectory must be true for the planner 'regions', and limits say how fast the"
            " joints may be"
        )
    robots = snapshot.robots.planning(core, snapshot.bases)
    wanted = checked_goal(request, robots, snapshot, limit, clock())
    if wanted.start_overlap:
        raise MessageError("start_overlap must be 0 with the planner 'regions': a start is in one")
    if wanted.constraints:
        raise MessageError("constraints must be empty with the planner 'regions'")
    measured = wanted.start
    wanted = wanted._replace(start=start_inside(measured, robots, wanted.moving, limit))
    rules = rules_from_msg(request.regions, "regions")
    require(
        limit,
        "max_robot_configurations_per_request",
        rules.growing["num_particles"],
        "regions.num_particles",
    )
    more = {
        **wanted.paddings,
        "environment_padding": wanted.paddings["environment_padding"] + rules.growth_padding,
    }
    checker, padded = (robots.checker(core, **each) for each in (wanted.paddings, more))
    watch = PlanWatch(goal, patience(request.timeout, limit))
    work = _Work(goal, wanted, measured, rules, robots, checker, padded, watch, limit)
    path = None
    try:
        watch.look()
        path = _planned(work, _regions(work, text), result)
    except CancelledError as cancelled:
        result.failure, result.reason = _F.CANCELED, str(cancelled)
    except NoPlanError as error:
        result.failure, result.reason = error.failure, str(error)
    result.seconds = watch.seconds
    return result, path


# Which regions.


def _regions(work: _Work, text: Callable[[str], tuple[str, str]]) -> _Regions:
    """Return regions as the goal says: given, around seeds, or along a path."""
    given = work.goal.request.regions
    has_seeds = bool(len(given.seeds.names) or len(given.seeds.positions))
    if given.resource and given.text:
        raise MessageError("regions.resource and regions.text are both given: give either")
    if (given.resource or given.text) and has_seeds:
        raise MessageError("regions.seeds has positions, and regions are given, too: give either")
    if not given.resource and not given.text and not has_seeds:
        return _along_path(work)
    goals = work.wanted.goals
    if not isinstance(goals, np.ndarray):
        raise MessageError(
            "pose_goals must be empty where regions are given or grow around seeds: goals say"
            " which configuration to end at"
        )
    if len(goals) != 1:
        raise MessageError(
            f"goals has {len(goals)} rows, and must have one where regions are given or grow"
            " around seeds"
        )
    if has_seeds:
        return _around_seeds(work, goals[0])
    where, found = text(given.resource) if given.resource else ("regions.text", given.text)
    document = parse_yaml(found, where, is_quoted=not given.resource).data
    return _read(work, document, where, goals[0])


def _read(work: _Work, document: Any, where: str, goal: NDArray[np.float64]) -> _Regions:
    """Return the regions of a YAML text."""
    child = work.goal.request.regions.child_name or None
    found = regions_from_document(document, where, child)
    require(work.limit, "max_regions", len(found), where)
    if not found:
        raise MessageError(f"{where} has no regions")
    size = len(work.wanted.moving)
    for name, region in found.items():
        if region.ambient_dimension != size:
            raise MessageError(
                f"{where}: {quoted(name)} has {region.ambient_dimension} dimensions, and"
                f" {size} positions move"
            )
        require(work.limit, "max_faces_per_region", len(region.b), f"{where}: {quoted(name)}")
        for what, is_wrong in (("empty", region.is_empty), ("unbounded", _is_unbounded(region))):
            if is_wrong():
                raise MessageError(f"{where}: {quoted(name)} is {what}")
    _check_ends(work, work.checker, goal)
    return _Regions(list(found), list(found.values()), goal, 0, "")


def _is_unbounded(region: HPolyhedron) -> Callable[[], bool]:
    return lambda: not region.is_bounded()


def _check_ends(
    work: _Work, checker: SceneGraphCollisionChecker, goal: NDArray[np.float64]
) -> None:
    """Raise NoPlanError where start or goal are not free, or beyond limits."""
    ends = np.stack([work.wanted.start, goal])
    moves = np.zeros(ends.shape[1], dtype=np.bool_)
    moves[work.wanted.moving] = True
    first, last = find_troubles(checker, ends, checker.tolerance, new_stop(), moves=moves)
    if first is not None:
        raise NoPlanError(first.of_start.value, f"the start {first.words}")
    if last is not None:
        raise NoPlanError(last.of_goal.value, f"the goal {last.words}")


def _around_seeds(work: _Work, goal: NDArray[np.float64]) -> _Regions:
    """Return a region around each seed."""
    message = work.goal.request.regions.seeds
    count = count_rows(message)
    require(work.limit, "max_regions", count, "regions.seeds: rows")
    seeds = configurations_from_msg(
        message, work.robots.positions, work.wanted.start, "regions.seeds"
    )
    moved = np.ones(seeds.shape[1], dtype=np.bool_)
    moved[work.wanted.moving] = False
    for column in np.flatnonzero((seeds != work.wanted.start).any(axis=0) & moved):
        name = work.robots.positions.names[column]
        raise MessageError(f"regions.seeds: {quoted(name)} is not of the group")
    _check_ends(work, work.padded, goal)
    work.watch.turn_to(_STATES.GROWING)
    found = []
    for row, seed in enumerate(seeds):
        found.append(
            _grown(
                f"regions.seeds, row {row}",
                lambda seed=seed: region_around(  # type: ignore[misc]
                    work.padded, seed, options=work.options, group=work.wanted.group
                ),
            )
        )
    return _of_grown([each.region for each in found], goal, 0)


def _along_path(work: _Work) -> _Regions:
    """Return regions along a path that is looked for first."""
    found = plan_path(
        work.padded,
        work.wanted.start,
        work.wanted.goals,
        seed=work.goal.request.seed,
        timeout=work.watch.left,
        group=work.wanted.group,
        watch=work.watch.follow,
    )
    if found.failure is not None:
        raise NoPlanError(found.failure.value, found.reason or "")
    work.watch.turn_to(_STATES.GROWING)
    path = found.configurations
    regions = _grown(
        "regions along a path",
        lambda: regions_along(work.padded, path, options=work.options, group=work.wanted.group),
    )
    grown = [each.region for each in regions]
    return _of_grown(grown, path[-1], found.goal or 0)._replace(edges=found.edges)


def _grown(what: str, grow: Callable[[], Any]) -> Any:
    """Return the grown regions; raises NoPlanError where there are none."""
    try:
        return grow()
    except (RegionError, RegionNotFoundError, SolverError) as error:
        raise NoPlanError(_F.NO_REGIONS, f"{what}: {error}") from None


def _of_grown(regions: list[HPolyhedron], goal: NDArray[np.float64], row: int) -> _Regions:
    names = [str(k) for k in range(len(regions))]
    text = regions_to_yaml(dict(zip(names, regions, strict=True)))
    return _Regions(names, regions, goal, row, text)


# The way through them.


def _planned(work: _Work, given: _Regions, result: Any) -> PlannedPath:
    """Return the trajectory, of which the result is told; raises NoPlanError without one."""
    watch, wanted, limits = work.watch, work.wanted, work.wanted.limits
    assert limits is not None, "with_trajectory"
    watch.turn_to(_STATES.SOLVING)
    found = _solved(work, given, limits.velocities)
    watch.turn_to(_STATES.TIMING)
    trajectory = found.trajectory
    assert trajectory is not None, "else there is a failure"
    timed = _timed(work, trajectory, limits)
    if timed.points is None or timed.trajectory is None:
        raise NoPlanError(_F.NOT_TIMED, timed.reason or "")
    positions, columns = work.robots.positions, wanted.moving
    result.failure, result.goal, result.edges = _F.NONE, given.row, given.edges
    result.least_clearance = found.least_clearance
    result.trajectory = joint_trajectory_to_msg(
        [positions.short(column) for column in columns], timed.points.of(columns)
    )
    result.trajectory_clearance, result.stops = timed.least_clearance, timed.stops
    result.through_regions = region_trajectory_to_msg(
        trajectory,
        [given.names[k] for k in found.regions],
        positions,
        columns.tolist(),
        cost=found.result.cost,
        lower_bound=found.result.lower_bound,
        grown=given.grown,
    )
    return PlannedPath(
        work.goal.id,
        timed.points.positions,
        timed.trajectory.control_points,
        timed.trajectory.breaks,
        positions.names,
        columns,
        **wanted.paddings,
        free_from=0,
    )


def _timed(work: _Work, curve: CompositeTrajectory, limits: MotionLimits) -> TimedPath:
    """Return the trajectory along a curve, after one back within limits where that is needed."""
    watch, start = work.watch, work.wanted.start
    how: dict[str, Any] = {"rise_time": work.wanted.rise_time, "retimer": work.wanted.retimer}
    timed = [
        time_curve(
            work.checker, curve, limits, at=start, timeout=watch.left, watch=watch.look, **how
        )
    ]
    if (work.measured != start).any():
        back = np.stack([work.measured, start])
        most = float(work.limit("start_tolerance"))
        how |= {"start_tolerance": most, "timeout": watch.left, "watch": watch.look}
        timed.insert(0, time_path(work.checker, back, limits, **how))
    return thinned(joined(timed), work.checker, limits, work.limit, watch.look)


def _solved(work: _Work, given: _Regions, velocities: NDArray[np.float64]) -> RegionPlan:
    """Return the fastest way through regions, proven; raises NoPlanError without one."""

    def look() -> bool:
        work.watch.look()
        return False

    options = GraphOfConvexSetsOptions(
        rounding_seed=int(work.goal.request.seed), termination_func=look, **work.rules.search
    )
    try:
        found = plan_through_regions(
            given.regions,
            work.wanted.start,
            given.goal,
            velocities=velocities,
            checker=work.checker,
            group=work.wanted.group,
            options=options,
            **work.rules.curves,
        )
    except SolverError as error:
        raise NoPlanError(_F.NO_WAY, str(error)) from None
    if found.trajectory is None:
        raise NoPlanError(_F.NO_WAY, found.reason)
    if not found.is_success:
        raise NoPlanError(_F.NOT_FREE, found.reason)
    return found
