"""From regions, a start and a goal to a trajectory, proven for a robot in its scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.graphs.model.options import GraphOfConvexSetsOptions
from scene_graph_ros.convex.iris.regions_yaml import load_iris_regions_yaml_file
from scene_graph_ros.convex.questions.arguments import as_nonnegative, as_vector, as_whole
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.distance_and_interpolation import (
    LinearDistanceAndInterpolationProvider,
)
from scene_graph_ros.planning.checker.path_ends import pair_words
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure, EdgeStatus
from scene_graph_ros.planning.errors import OutOfTimeError
from scene_graph_ros.planning.gcs.edges_between_subgraphs import EdgesBetweenSubgraphs
from scene_graph_ros.planning.gcs.gcs_trajectory_optimization import GcsTrajectoryOptimization
from scene_graph_ros.planning.gcs.result import GcsTrajectoryResult
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.paths.path_planner import PATIENCE, plan_path
from scene_graph_ros.planning.paths.search.position_space import (
    get_continuous_revolute_joint_indices,
)
from scene_graph_ros.planning.plan_failure import PlanFailure
from scene_graph_ros.planning.regions.around_seeds import regions_along
from scene_graph_ros.planning.regions.errors import RegionNotFoundError
from scene_graph_ros.planning.regions.held_positions import Held
from scene_graph_ros.planning.regions.iris_zo_options import IrisZoOptions
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory

__all__ = ["RegionPlan", "plan_through_regions"]


@one_line()
@dataclass(frozen=True, eq=False)
class RegionPlan:
    """A trajectory through regions, a lower bound of the cost, and its proof in a robot's scene.

    ``trajectory`` is None where there is none through the regions. ``measures`` has for each
    segment the checker's proof, empty without one. ``reason`` says why there is no
    success, or how the path was chosen. ``regions`` are the indices of those on the way, one for
    each segment; ``grown`` those that were not given.
    """

    trajectory: CompositeTrajectory | None
    result: GcsTrajectoryResult
    measures: tuple[EdgeMeasure, ...]
    reason: str
    regions: tuple[int, ...] = ()
    grown: tuple[ConvexSet, ...] = ()

    @property
    def is_success(self) -> bool:
        """Whether there is a trajectory, which the checker proved free where one was given."""
        return self.trajectory is not None and all(m.completely_free for m in self.measures)

    @property
    def least_clearance(self) -> float:
        """Lower bound of pairs' distances beyond their padding, m; 0 unless that was proven."""
        if not self.measures:
            return 0.0
        return min(measure.least_clearance for measure in self.measures)


def plan_through_regions(
    regions: Sequence[ConvexSet] | str | Path | None,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    velocities: ArrayLike,
    order: int = 3,
    continuity_order: int = 1,
    time_weight: float = 1.0,
    length_weight: float = 0.0,
    checker: SceneGraphCollisionChecker | None = None,
    group: str | None = None,
    continuous_revolute_joints: Sequence[int] | None = None,
    options: GraphOfConvexSetsOptions | None = None,
    growth_padding: float = 0.01,
    seed: int = 0,
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> RegionPlan:
    """Return the fastest trajectory through regions, with its gap and proof.

    ``regions`` are convex sets of configurations, or a file that `save_iris_regions_yaml_file`
    wrote. With None and a checker they are grown along a path that `plan_path` finds, by
    `regions_along`; both keep ``growth_padding`` (m) more from all else than the trajectory has
    to, and depend on ``seed``. ``start`` and ``goal`` ``(n,)`` are in some of them; no joint is
    faster than ``velocities`` ``(n,)``. In each region leads a Bézier curve of ``order``, and r(s)
    goes on up to ``continuity_order``, from 0 on. With a ``checker`` each segment is proven free
    in the robot's scene, by its control points, and joints that turn without an end are the
    robot's, unless given. The trajectory has no jumps of whole turns. With a ``group`` of the
    robots' SRDF start and goal are still all positions, but regions, velocities, joints and the
    trajectory are of the group's alone; all others stay as they are at the start.

    ``options`` are those of `GcsTrajectoryOptimization.solve_path`. After ``timeout`` (s) no path
    is looked for any more, no region grows, and the best trajectory that was found is the answer.
    Without it a path is looked for for 60 s. ``watch`` is called now and then, and may raise.

    Raises ConvexSetError for regions and a timeout that make no sense, KinematicTreeError for a
    group that there is not, OSError where the file can't be read, SolverError where the solver
    failed, RegionNotFoundError where there is no path to grow regions along, OutOfTimeError where
    none grew in time.
    """
    label, deadline = "plan_through_regions", Deadline.of(timeout, watch, ConvexSetError)
    if isinstance(regions, (str, Path)):
        regions = list(load_iris_regions_yaml_file(regions).values())
    first = as_vector(start, f"{label}: start")
    last = as_vector(goal, f"{label}: goal", len(first))
    if checker is not None and checker.model.tree.num_positions != len(first):
        raise ConvexSetError(
            f"{label}: start has {len(first)} positions, the checker's robots have"
            f" {checker.model.tree.num_positions}"
        )
    held = _held(checker, group, first, last, label)
    grown: tuple[ConvexSet, ...] = ()
    if regions is None:
        regions = grown = _grown(checker, (first, last), group, growth_padding, seed, deadline)
    first, last = first[held.rows], last[held.rows]
    fastest = _speeds(velocities, len(first))
    if continuous_revolute_joints is None:
        continuous_revolute_joints = _turning(checker, held)
    graph = GcsTrajectoryOptimization(len(first), continuous_revolute_joints)
    free = graph.add_regions(regions, as_whole(order, f"{label}: order", 1), name="regions")
    begin = graph.add_regions([Point(first)], 0, name="start")
    end = graph.add_regions([Point(last)], 0, name="goal")
    ends = {"start": graph.add_edges(begin, free), "goal": graph.add_edges(free, end)}
    graph.add_time_cost(time_weight)
    if length_weight:
        graph.add_path_length_cost(length_weight)
    graph.add_velocity_bounds(-fastest, fastest)
    if as_whole(continuity_order, f"{label}: continuity_order", 0):
        free.add_path_continuity_constraints(continuity_order)
    trajectory, result = graph.solve_path(
        begin, end, options, timeout=deadline.left, watch=deadline.look if watch else None
    )
    if trajectory is None:
        late = ""
        if result.is_stopped and deadline.is_over():
            late = f"no trajectory was found within {deadline.timeout:.10g} s"
        reason = _why(ends, free.regions, first, last) or late or result.reason
        return RegionPlan(None, result, (), reason, (), grown)
    whole = graph.unwrap_to_continuous_trajectory(trajectory, graph.continuous_revolute_joints)
    places = {vertex.id: k for k, vertex in enumerate(free.vertices)}
    on_way = tuple(places[v.id] for v in result.vertices if v.id in places)
    if checker is None:
        return RegionPlan(whole, result, (), result.reason, on_way)
    measures = _measured(checker, held, whole)
    reason = _collision(checker, measures) or result.reason
    return RegionPlan(whole, result, measures, reason, on_way, grown)


def _speeds(velocities: ArrayLike, count: int) -> NDArray[np.float64]:
    """Return each position's largest speed. Raises ConvexSetError unless they are positive."""
    label = "plan_through_regions: velocities"
    fastest = as_vector(velocities, label, count)
    if (fastest <= 0.0).any():
        k = int(np.argmin(fastest))
        raise ConvexSetError(f"{label}[{k}] must be positive, not {fastest[k]}")
    return fastest


def _turning(checker: SceneGraphCollisionChecker | None, held: Held) -> list[int]:
    """Return the indices of moving positions that turn without an end; without a checker none."""
    if checker is None:
        return []
    joints = get_continuous_revolute_joint_indices(checker.model.tree)
    turning: list[int] = np.flatnonzero(np.isin(held.rows, joints)).tolist()
    return turning


def _measured(
    checker: SceneGraphCollisionChecker, held: Held, trajectory: CompositeTrajectory
) -> tuple[EdgeMeasure, ...]:
    """Return the measure of each segment, by its control points."""
    points = np.array([segment.control_points for segment in trajectory.segments])  # type: ignore[attr-defined]
    straight = checker.clone()  # Segments of order 1 are no ways of a provider's.
    linear = LinearDistanceAndInterpolationProvider(checker.model.tree)
    straight.set_distance_and_interpolation_provider(linear)
    return tuple(straight.measure_edges(held.whole(points)))


def _grown(
    checker: SceneGraphCollisionChecker | None,
    ends: tuple[NDArray[np.float64], NDArray[np.float64]],
    group: str | None,
    padding: float,
    seed: int,
    deadline: Deadline,
) -> tuple[ConvexSet, ...]:
    """Return regions along a path, both with more padding."""
    label = "plan_through_regions"
    if checker is None:
        raise ConvexSetError(f"{label}: regions is None, and without a checker none can grow")
    more = as_nonnegative(padding, f"{label}: growth_padding")
    now = checker.maybe_get_uniform_robot_environment_padding()
    if now is None:
        raise ConvexSetError(
            f"{label}: regions is None, and the paddings of robots and all else differ, so that"
            " growth_padding can't be added to them; grow regions by regions_along"
        )
    padded = checker.clone()
    padded.set_padding_all_robot_environment_pairs(now + more)
    path = plan_path(
        padded,
        *ends,
        seed=seed,
        group=group,
        timeout=PATIENCE if deadline.timeout is None else deadline.left,
        watch=lambda _: deadline.look(),
    )
    if path.failure is PlanFailure.TIMEOUT:
        raise OutOfTimeError(f"{label}: no path to grow regions along: {path.reason}")
    if not path.is_success:
        raise RegionNotFoundError(f"{label}: no path to grow regions along: {path.reason}")
    how: dict[str, Any] = {"timeout": deadline.left, "watch": deadline.look}
    options = IrisZoOptions(random_seed=seed)
    found = regions_along(padded, path.configurations, options=options, group=group, **how)
    return tuple(each.region for each in found)


def _held(
    checker: SceneGraphCollisionChecker | None,
    group: str | None,
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    label: str,
) -> Held:
    """Return the moving positions. Raises ConvexSetError where a goal moves another."""
    if group is None:
        return Held(np.arange(len(start)), start)
    if checker is None:
        raise ConvexSetError(f"{label}: group needs a checker, whose robots have groups")
    tree = checker.model.tree
    rows = tree.group_positions(group)
    others = np.setdiff1d(np.arange(len(start)), rows)
    for k in others[start[others] != goal[others]]:
        raise ConvexSetError(
            f"{label}: goal: position {tree.position_names[k]!r} is not of group {group!r} and"
            f" must stay at {start[k]:.10g}, not {goal[k]:.10g}"
        )
    return Held(rows, start)


def _why(
    ends: dict[str, EdgesBetweenSubgraphs], regions: Any, start: np.ndarray, goal: np.ndarray
) -> str:
    """Return a sentence on an end in no region, and its distance to the nearest; empty if none."""
    for (name, edges), q in zip(ends.items(), (start, goal), strict=True):
        if not edges.edges:
            away = [float(region.projection(q[None]).distances[0]) for region in regions]
            k = int(np.argmin(away))
            return (
                f"the {name} is in none of {len(regions)} regions; regions[{k}] is the nearest,"
                f" {away[k]:.3g} away"
            )
    return ""


def _collision(checker: SceneGraphCollisionChecker, measures: Sequence[EdgeMeasure]) -> str:
    """Return the obstacle of the first segment that isn't proven free; empty if none."""
    for k, measure in enumerate(measures):
        if not measure.completely_free:
            word = "collides" if measure.status is EdgeStatus.COLLIDES else "is too near"
            pair = "" if measure.pair is None else f": {pair_words(checker, measure.pair)}"
            at = 0.0 if measure.at is None else measure.at
            return f"segment {k} {word} at {at:.3f} of its time{pair}"
    return ""
