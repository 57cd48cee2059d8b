"""Trajectories in one call: goals, path, shortening, timing and proof."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
import time
from typing import NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.constraints.link_constraints import as_constraints, LinkConstraint
from scene_graph_ros.planning.ik.pose_target import PoseTarget
from scene_graph_ros.planning.motion.plan_motion import least_time, spline_motion
from scene_graph_ros.planning.motion.spline_motion import GOOD_ENOUGH, load_spline_kernels
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.paths.path_planner import plan_path
from scene_graph_ros.planning.paths.plan_arguments import checked_numbers
from scene_graph_ros.planning.paths.planned_path import Plan, PlanProgress, PlanStage
from scene_graph_ros.planning.paths.search.path_search import LEAST_SAVING
from scene_graph_ros.planning.timing.path_options import PathOptions, with_options
from scene_graph_ros.planning.timing.path_timing import time_path
from scene_graph_ros.planning.timing.timing_problem import (
    no_path,
    TimedPath,
    timing_problem,
    TimingProblem,
)
from scene_graph_ros.trajectories.motion_limits import MotionLimits

if TYPE_CHECKING:
    from scene_graph_ros.convex.sets.convex_set import ConvexSet

__all__ = ["plan_trajectory"]

_TRIES = 3
"""Paths that are made motions of, where the first ones are much slower than what is possible."""

_SLOW = 1.2
"""Times the least time that start and goal allow: motions that take longer are worth a try."""


def plan_trajectory(
    checker: SceneGraphCollisionChecker,
    start: ArrayLike,
    goal: ArrayLike | PoseTarget | Sequence[PoseTarget] | ConvexSet,
    limits: MotionLimits,
    *,
    group: str | None = None,
    constraints: Iterable[LinkConstraint] = (),
    start_velocity: ArrayLike | None = None,
    start_acceleration: ArrayLike | None = None,
    start_tolerance: float = 0.0,
    start_overlap: float = 0.0,
    seed: int = 0,
    timeout: float | None = None,
    watch: Callable[[PlanProgress], None] | None = None,
) -> TimedPath:
    """Return a fast motion from ``start`` ``(nq,)`` to ``goal``, proven free at all times.

    A path is found as `plan_path` does. It becomes a cubic spline in time, which is made shorter
    while distances and their derivatives say where it may go, until a round saves little. Its
    points and their polynomials keep all ``limits`` at all times and are proven free, as of
    `time_path`; otherwise, and where it does not begin at rest or in a collision, it is the path
    that is timed. Where it takes much longer than start and goal alone would, two more paths are
    tried. The motion does not follow the path: its ``plan`` has that.

    ``goal`` is as of `plan_path`, or a `ConvexSet` of the positions that may move, those of
    ``group`` or all: configurations in it that are near the start and near random ones are the
    goals. ``limits`` name all positions that move. ``start_velocity`` and ``start_acceleration``
    ``(nq,)`` are as of `time_path`, all others as of `plan_path`; ``timeout`` (s) is for all of
    it: when a path is found, but no motion yet, there is none in time. The motion holds
    ``constraints`` at all times, proven; then it is the path that is timed.

    Raises as `plan_path` and `time_path` do, and PlanningError for a set of another dimension.
    """
    patience, _ = checked_numbers(seed, timeout, LEAST_SAVING)
    checker = checker.clone()  # Others may change theirs meanwhile.
    load_spline_kernels(checker)
    asked = _Asked(
        checker,
        limits,
        start_velocity,
        start_acceleration,
        start_tolerance,
        as_constraints(constraints),
        _Clock(patience, watch),
    )
    own = asked.problem(np.repeat(checker.checked_configurations(start)[:1], 2, axis=0))
    given, goal = goal, _without_set(checker, goal, start, group, seed)
    is_set = goal is not given
    best: TimedPath | None = None
    for turn in range(_TRIES):
        plan = plan_path(
            checker,
            start,
            goal,
            group=group,
            seed=seed + turn,
            timeout=asked.clock.left(),
            constraints=asked.constraints,
            start_tolerance=start_tolerance,
            start_overlap=start_overlap,
            watch=asked.clock.tell,
        )
        found = asked.motion(replace(plan, goal=0) if is_set and plan.is_success else plan, own)
        if best is None or (found.is_success and not found.duration >= best.duration > 0.0):
            best = found
        least = least_time(own._replace(path=plan.configurations)) if plan.is_success else 0.0
        is_fast = best.is_success and best.duration <= _SLOW * least
        if not plan.is_success or is_fast or not own.start.is_rest or asked.clock.left() == 0.0:
            break
    assert best is not None
    return best


_Goal = ArrayLike | PoseTarget | Sequence[PoseTarget]


def _without_set(
    checker: SceneGraphCollisionChecker,
    goal: _Goal | ConvexSet,
    start: ArrayLike,
    group: str | None,
    seed: int,
) -> _Goal:
    """Return configurations of a goal that is a set; any other goal as it is."""
    if isinstance(goal, (np.ndarray, PoseTarget, Sequence)):
        return goal
    # Whoever has a set has imported this.
    from scene_graph_ros.convex.sets.convex_set import ConvexSet
    from scene_graph_ros.planning.motion.goal_sets import goals_in_set

    return goals_in_set(checker, goal, start, group, seed) if isinstance(goal, ConvexSet) else goal


class _Clock:
    """The time limit, and the watch function."""

    def __init__(
        self, patience: float | None, watch: Callable[[PlanProgress], None] | None
    ) -> None:
        self._begin, self._patience, self._watch = time.monotonic(), patience, watch

    def left(self) -> float | None:
        """Return the seconds that are left; None without a time limit."""
        spent = time.monotonic() - self._begin
        return None if self._patience is None else max(self._patience - spent, 0.0)

    def tell(self, progress: PlanProgress) -> None:
        """Tell it, with the time since the beginning of all."""
        if self._watch is not None:
            self._watch(progress._replace(seconds=time.monotonic() - self._begin))


class _Asked(NamedTuple):
    """The arguments, but for start and goal."""

    checker: SceneGraphCollisionChecker
    limits: MotionLimits
    start_velocity: ArrayLike | None
    start_acceleration: ArrayLike | None
    start_tolerance: float
    constraints: tuple[LinkConstraint, ...]
    clock: _Clock

    def problem(self, path: NDArray[np.float64]) -> TimingProblem:
        """Return the timing problem of a path."""
        start = (self.start_velocity, self.start_acceleration)
        options = PathOptions(None, (), (), start, (None, None))
        problem = timing_problem(self.checker, path, self.limits, constraints=self.constraints)
        problem = with_options(problem, options)
        return problem._replace(start_tolerance=self.start_tolerance)

    def motion(self, plan: Plan, own: TimingProblem) -> TimedPath:
        """Return the motion of a plan, or why there is none; ``own`` is the start's problem."""
        if not plan.is_success:
            return no_path(plan)
        path = plan.configurations
        problem = own.along(path)
        found: TimedPath | None = None
        if len(path) == 2:
            # Along a straight edge the motion is known: often nothing is faster.
            found = self._timed(plan)
            if found.is_success and found.duration <= GOOD_ENOUGH * least_time(problem):
                return replace(found, plan=plan)
        is_open = problem.start.is_rest and plan.free_from == 0 and not self.constraints
        if len(path) > 1 and is_open:
            turns = Turns(self.clock.left(), lambda: self._tell(plan))
            spline = spline_motion(problem, turns)
            if spline is not None and not (
                found is not None and found.is_success and found.duration <= spline.duration
            ):
                found = spline
        return replace(found or self._timed(plan), plan=plan)

    def _tell(self, plan: Plan) -> None:
        self.clock.tell(PlanProgress(PlanStage.TIMING, 0.0, plan.tree_sizes, plan.edges))

    def _timed(self, plan: Plan) -> TimedPath:
        """Return the motion along the path itself."""
        return time_path(
            self.checker,
            plan.configurations,
            self.limits,
            start_tolerance=self.start_tolerance,
            free_from=plan.free_from,
            constraints=self.constraints,
            start_velocity=self.start_velocity,
            start_acceleration=self.start_acceleration,
            timeout=self.clock.left(),
            watch=lambda: self._tell(plan),
        )
