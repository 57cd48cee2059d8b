"""Paths of robots from one configuration to another that are proven free of collisions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
import time
from typing import Any, NamedTuple, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import find_troubles
from scene_graph_ros.planning.checker.position_limits import describe_excess, moved_inside
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.link_constraints import as_constraints, LinkConstraint
from scene_graph_ros.planning.constraints.proof_kernels import HELD
from scene_graph_ros.planning.edges.edge_proofs import EdgeProofs, prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE, UNFINISHED
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.ik.pose_target import PoseTarget
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.stoppable import new_stop, run_stoppable, Stops, Turns
from scene_graph_ros.planning.paths.lead_out import lead_out, LeadOut
from scene_graph_ros.planning.paths.ompl_bridge.ompl_planner import OmplPlanner
from scene_graph_ros.planning.paths.plan_arguments import (
    checked_numbers,
    checked_tolerance,
    targets_of,
)
from scene_graph_ros.planning.paths.plan_ends import (
    checked_ends,
    checked_moves,
    lead_violation,
    violation,
)
from scene_graph_ros.planning.paths.planned_path import Plan, PlanProgress, PlanStage
from scene_graph_ros.planning.paths.planners import check_planner, new_search
from scene_graph_ros.planning.paths.pose_goals import find_pose_goals, load_pose_kernels
from scene_graph_ros.planning.paths.search.path_search import (
    LEAST_SAVING,
    PathSearch,
    search_rules,
    SearchTask,
)
from scene_graph_ros.planning.paths.search.position_space import (
    moving_positions,
    PositionSpace,
)
from scene_graph_ros.planning.plan_failure import PlanFailure

if TYPE_CHECKING:
    from scene_graph_ros.planning.paths.roadmaps.roadmap import Roadmap

__all__ = ["plan_path"]

_SAME = 1e-12
"""rad and m: a start that is nearer to a goal is there."""

_loaded: set[str] = set()
"""What is loaded or compiled."""

_QUOTED = 5
"""Goals of which is said what is wrong with them."""


class _Progress:
    """How far a plan has come, for the thread that waits for it."""

    def __init__(self, spent: float = 0.0) -> None:
        """``spent`` seconds ago it began."""
        self._begin = time.monotonic() - spent
        self.stage = PlanStage.CHECKING
        self.search: PathSearch | None = None

    @property
    def seconds(self) -> float:
        return time.monotonic() - self._begin

    def now(self) -> PlanProgress:
        seconds, search = self.seconds, self.search
        if search is None:
            return PlanProgress(self.stage, seconds, (0, 0), 0)
        return PlanProgress(self.stage, seconds, search.tree_sizes, search.edges)


class _Problem(NamedTuple):
    """The checked arguments."""

    checker: SceneGraphCollisionChecker
    start: NDArray[np.float64]
    """``(nq,)``."""
    goals: NDArray[np.float64]
    """``(m, nq)``."""
    space: PositionSpace
    moves: NDArray[np.bool_]
    """``(nq,)``: which positions may change."""
    lead: LeadOut
    """From where the start was measured to the ``start``: from within limits, and from a collision
    to what is free. Its last configuration is the start."""
    timeout: float | None
    progress: _Progress
    stops: Stops
    turns: Turns | None
    """Whom it takes turns with; without, it is in a thread of its own."""
    search: PathSearch
    held: HeldConstraints

    @property
    def search_rules(self) -> EdgeRules:
        """The rules of proofs during the search for a path."""
        return search_rules(self.checker.tolerance)

    def prove(self, *arguments: Any, **keywords: Any) -> EdgeProofs:
        """Do as `prove` does, in turns."""
        scratch, turns = self.search.scratch, self.turns
        proofs = prove(*arguments, **keywords, scratch=scratch)
        if turns is not None and (proofs.statuses == UNFINISHED).any():
            proofs = turns.beside(lambda: prove(*arguments, **keywords, scratch=scratch))
        return proofs


PATIENCE = 60.0
"""Seconds that a path is looked for where nobody says how long, as the node does."""


def plan_path(
    checker: SceneGraphCollisionChecker,
    start: ArrayLike,
    goal: ArrayLike | PoseTarget | Sequence[PoseTarget],
    *,
    planner: str | OmplPlanner = "rrt_connect",
    seed: int = 0,
    timeout: float | None = PATIENCE,
    group: str | None = None,
    roadmap: Roadmap | None = None,
    constraints: Iterable[LinkConstraint] = (),
    least_saving: float = LEAST_SAVING,
    start_tolerance: float = 0.0,
    start_overlap: float = 0.0,
    watch: Callable[[PlanProgress], None] | None = None,
) -> Plan:
    """Return a path from ``start`` ``(nq,)`` to ``goal``, proven free, or why there is none.

    ``goal`` is a configuration ``(nq,)`` or several ``(m, nq)``, any of which will do; those that
    collide or are beyond limits are left out. Or it says where a tool is to be, or several such
    targets: then goals are those of `inverse_kinematics`, and the plan's ``goal`` is the target.
    ``group`` names the group of joints (of an SRDF) that may move; all others must be at a goal as
    they are at the start.
    Positions that may not move need not be within limits. A start that is beyond limits by no
    more than ``start_tolerance`` (rad or m) is taken; the path's first edge, which is proven like
    all others, moves it back to them.
    A start at which pairs are nearer than their paddings by no more than ``start_overlap`` (m) is
    led out: the path's first edges go to a configuration near by that is free, the plan's
    ``free_from``, from where on all is proven. Of the edges before it is proven that no pair gets
    deeper than at the start by more than 0.01 mm, and that no other collides.
    Joints that turn without an end go round whichever way is free, and may arrive full turns away
    from the goal's number.
    ``constraints`` are conditions on links that hold at all configurations of the path, proven to
    1e-9 rad and m: `AngleBetweenVectorsConstraint`, `OrientationConstraint`, `PositionConstraint`.
    Start and goals have to hold them, too. Then trees grow by steps that are projected to where
    the conditions hold, and the planner has to be ``"rrt_connect"``.

    The path is the same for the same ``seed``, unless it ran out of time: ``timeout`` (s) ends the
    search for shorter ones, too; kernels that are not compiled yet are, before time is counted.
    With None a search goes on until there is a path, a tree has 2^20 configurations, or
    KeyboardInterrupt. It notices both within 0.1 s. ``watch`` is told how far it has come, about
    every 0.05 s and in the thread that called; an error in it ends the search and is raised.

    The planner ``"rrt_connect"`` grows two trees (Kuffner and LaValle, *RRT-Connect*, 2000).
    An `OmplPlanner` has one of OMPL's look for the path, with our proofs of its motions.
    ``"prm"`` looks for a way through a `Roadmap`, which may be given: then it knows earlier
    proofs, and its path depends on all that the roadmap was used for. All then cut off
    the path's corners, first where that saves most, until none saves ``least_saving`` of the
    path's length: from 1e-4, for the shortest paths, to 1, for the path as it was found. Each
    edge, and in the end each edge of the path once more, is proven as
    `SceneGraphCollisionChecker.measure_edge` does.

    Raises PlanningError naming the argument, MissingOmplError, and as
    `SceneGraphCollisionChecker` does for configurations of another shape or with numbers that mean
    nothing.
    """
    constraints = as_constraints(constraints)
    check_planner(planner, roadmap, has_constraints=bool(constraints))
    patience, saving = checked_numbers(seed, timeout, least_saving)
    slack, overlap = (
        checked_tolerance(name, value)
        for name, value in (("start_tolerance", start_tolerance), ("start_overlap", start_overlap))
    )
    checker = checker.clone()  # Others may change theirs meanwhile.
    start = real_array(start, "start must be numbers (nq,)", PlanningError)
    if start.ndim != 1:
        raise PlanningError(f"start must have shape (nq,), not {start.shape}")
    targets, held = targets_of(goal), HeldConstraints(checker.plan.tree, constraints)
    reached: Sequence[int] | None = None
    spent = 0.0
    if targets is not None:
        found = _reaching(checker, start, targets, group, int(seed), patience, watch, slack)
        if isinstance(found, Plan):
            return found
        goal, reached, spent = found
    first, goals = checked_ends(checker, start, goal)
    moves = checked_moves(checker, first, goals, group)
    measured, first = first, moved_inside(checker.plan.tree, first, moves, slack)
    lead = lead_out(checker, measured, first, moves, overlap)
    first = lead.configurations[-1] if len(lead.configurations) else first
    space = PositionSpace.of(checker.plan, np.concatenate([first[np.newaxis], goals]), moves)
    left = None if patience is None else max(patience - spent, 0.0)
    make_search = new_search(planner, roadmap, left, held, moves)
    rules = search_rules(checker.tolerance)
    task = SearchTask(checker.plan, space, rules, int(seed), new_stop(), saving)
    search = make_search(task)
    _load_kernels(checker, search)
    progress = _Progress(spent)

    def solve(search: PathSearch, stops: Stops, turns: Turns | None) -> Plan:
        return _solve(
            _Problem(
                checker,
                first,
                goals,
                space,
                moves,
                lead,
                patience,
                progress,
                stops,
                turns,
                search,
                held,
            )
        )

    def look() -> None:
        if watch is not None:
            watch(progress.now())

    if planner == "rrt_connect" and not held:
        turns = Turns(left, look)
        search.begin(turns.stops.looking, turns)
        plan = solve(search, turns.stops, turns)
    else:
        plan = run_stoppable(
            lambda stops: solve(make_search(task._replace(stop=stops.looking)), stops, None),
            left,
            look,
        )
    return plan if reached is None or plan.goal is None else replace(plan, goal=reached[plan.goal])


def _load_kernels(checker: SceneGraphCollisionChecker, search: PathSearch) -> None:
    """Load the kernels, or compile them, before time is counted, once in a process."""
    key = type(search).__name__
    if key in _loaded:
        return
    none = np.empty((0, 2, checker.plan.tree.num_positions))
    prove(checker.plan, none, _final_rules(checker), scratch=search.scratch)
    search.load_kernel()
    _loaded.add(key)


def _final_rules(checker: SceneGraphCollisionChecker) -> EdgeRules:
    """Return the rules of the final proof."""
    return EdgeRules(False, part=0.5, tolerance=checker.tolerance, asks_ends=False)


def _reaching(
    checker: SceneGraphCollisionChecker,
    start: ArrayLike,
    targets: Sequence[PoseTarget],
    group: str | None,
    seed: int,
    patience: float | None,
    watch: Callable[[PlanProgress], None] | None,
    slack: float,
) -> tuple[NDArray[np.float64], Sequence[int], float] | Plan:
    """Return goals ``(m, nq)``, the target that each reaches, and the time (s), or why not."""
    near, tree = checker.checked_configurations(start)[0], checker.plan.tree
    moves = moving_positions(tree, group)
    near = moved_inside(tree, near, moves, slack)
    outside = describe_excess(tree, near, moves)
    if outside is not None:
        return _refused(near, PlanFailure.START_BEYOND_LIMITS, f"the start {outside}")
    load_pose_kernels(checker, targets)
    progress = _Progress()

    deadline = Deadline(patience, None if watch is None else lambda: watch(progress.now()))
    found = find_pose_goals(checker, targets, near=near, group=group, seed=seed, deadline=deadline)
    if found.failure is not None:
        return _refused(near, found.failure, found.reason)
    return found.configurations, found.targets, progress.seconds


def _solve(problem: _Problem) -> Plan:
    """Return the plan; told to stop, the best one so far."""
    checker, tolerance = problem.checker, problem.search_rules.tolerance
    ends = np.concatenate([problem.start[np.newaxis], problem.goals])
    stop = problem.stops.proving
    found = find_troubles(checker, ends, tolerance, stop, problem.prove, problem.moves)
    trouble, *others = (
        each or violation(problem.held, q) for each, q in zip(found, ends, strict=True)
    )
    if trouble is not None:
        words = f"the start {trouble.words}{problem.lead.words}"
        return _failed(problem, trouble.of_start, words)
    broken = lead_violation(problem.held, problem.lead.configurations)
    if broken is not None:
        words = f"the way from the start back to limits {broken}"
        return _failed(problem, PlanFailure.START_VIOLATES_CONSTRAINT, words)
    usable = [row for row, other in enumerate(others) if other is None]
    if usable:
        return _search(problem, usable)
    faults = [other for other in others if other is not None]
    kind = min((other.of_goal for other in faults), key=lambda kind: kind.value)
    if len(faults) == 1:
        return _failed(problem, kind, f"the goal {faults[0].words}")
    words = "; ".join(f"goal {row} {each.words}" for row, each in enumerate(faults[:_QUOTED]))
    return _failed(problem, kind, f"none of {len(faults)} goals can be reached: {words}")


def _search(problem: _Problem, usable: Sequence[int]) -> Plan:
    """Look for a path to one of the goals that can be used."""
    start, goals, space = problem.start, problem.goals[list(usable)], problem.space
    search = problem.search
    problem.progress.search, problem.progress.stage = search, PlanStage.SEARCHING
    for row, goal in zip(usable, goals, strict=True):
        if space.length(np.stack([start, goal + space.turns(start, goal)])) < _SAME:
            return _proven(problem, [start[np.newaxis]], row)
    found = search.find(start, goals)
    if found is None:
        return _not_found(problem)
    path, root = found
    problem.progress.stage = PlanStage.SHORTENING
    return _proven(problem, [search.shortened(path), path], usable[root])


def _proven(
    problem: _Problem,
    paths: Sequence[NDArray[np.float64]],
    goal: int,
) -> Plan:
    """Return the first of some paths to a goal that is proven once more, edge by edge."""
    problem.progress.stage = PlanStage.PROVING
    lead = problem.lead
    rules, stop = _final_rules(problem.checker), problem.stops.proving
    for path in paths:
        # What leads out of a collision was proven to get no deeper; all else is free.
        begin = lead.configurations[:-1]
        free_from = len(begin) if lead.leaves_collision else 0
        whole = np.concatenate([begin, path])
        free = whole[free_from:]
        ends = free if len(free) > 1 else np.repeat(free, 2, axis=0)
        edges = np.stack([ends[:-1], ends[1:]], axis=1)
        proofs = problem.prove(problem.checker.plan, edges, rules, stop=stop)
        if _is_held(problem, whole, edges) and (proofs.statuses == FREE).all():
            whole.setflags(write=False)
            least = max(float(proofs.numbers[:, 2].min()), 0.0)
            length = problem.space.length(whole)
            sizes, edges_seen = problem.search.tree_sizes, problem.search.edges
            return Plan(whole, least, length, goal, None, None, sizes, edges_seen, free_from)
    return _not_found(problem, "found, but not proven once more")


def _is_held(problem: _Problem, whole: NDArray[np.float64], edges: NDArray[np.float64]) -> bool:
    """Tell whether conditions hold on all of a path, also where it is led out."""
    if not problem.held:
        return True
    every = np.stack([whole[:-1], whole[1:]], axis=1) if len(whole) > 1 else edges
    proofs = problem.held.prove(every, stop=problem.stops.proving)
    return bool((proofs.answers == HELD).all())


def _not_found(problem: _Problem, what: str = "found") -> Plan:
    """Describe the progress of a search."""
    search, is_late = problem.search, problem.stops.looking[0] != 0
    when = f" within {problem.timeout:.10g} s" if is_late else ""
    words = f"no path was {what}{when}: {search.words}"
    kind = PlanFailure.TIMEOUT if is_late else PlanFailure.EXHAUSTED
    return _failed(problem, kind, words, search)


def _failed(
    problem: _Problem, kind: PlanFailure, reason: str, search: PathSearch | None = None
) -> Plan:
    sizes, edges = (search.tree_sizes, search.edges) if search else ((0, 0), 0)
    return _refused(problem.start, kind, reason, sizes, edges)


def _refused(
    start: NDArray[np.float64],
    kind: PlanFailure,
    reason: str,
    sizes: tuple[int, int] = (0, 0),
    edges: int = 0,
) -> Plan:
    nothing = np.empty((0, len(start)))
    return Plan(nothing, 0.0, 0.0, None, kind, reason, sizes, edges)
