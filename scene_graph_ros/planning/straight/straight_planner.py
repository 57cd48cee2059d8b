"""Motions that lead a tool along straight lines and arcs, joint by joint without a jump."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.spatial.poses import as_pose, as_poses
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import find_troubles, pair_words
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.link_constraints import LinkConstraint
from scene_graph_ros.planning.constraints.proof_kernels import HELD
from scene_graph_ros.planning.ik.arguments import first_configurations
from scene_graph_ros.planning.ik.pose_search import pose_search, PoseSearch, which_move
from scene_graph_ros.planning.ik.pose_target import InverseKinematicsError
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.planning.straight.edge_deviation import edge_deviations
from scene_graph_ros.planning.straight.straight_plan import StraightFailure, StraightPlan
from scene_graph_ros.planning.straight.tool_ways import ToolWay
from scene_graph_ros.planning.timing.path_timing import time_path
from scene_graph_ros.planning.timing.timing_problem import TimedPath
from scene_graph_ros.trajectories.motion_limits import MotionLimits

__all__ = ["plan_straight"]

_LONGEST = 0.1
"""rad, or of the arm's unit: the change of a joint along an edge at most."""

_FIRST, _LEAST = 0.05, 1e-6
"""Of a piece of the way: the first step, and one that is too short to go on with."""

_ROUNDING = 2e-9
"""m and rad: how far from the way both ends of an edge are at most."""

_MOTIONS = ("straight", "screw")


def plan_straight(
    checker: SceneGraphCollisionChecker,
    start: ArrayLike,
    X_WTs: ArrayLike,
    link: str,
    X_LT: ArrayLike | None = None,
    limits: MotionLimits | None = None,
    *,
    group: str | None = None,
    motion: str = "straight",
    constraints: Iterable[LinkConstraint] = (),
    deviation: float = 1e-4,
    rotation_deviation: float = 1e-3,
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> StraightPlan:
    """Return configurations that lead a tool T from where it is through poses, as far as they go.

    T is fixed to ``link`` at ``X_LT`` ``(4, 4)``, and goes from its pose at ``start`` ``(nq,)``
    through ``X_WTs`` ``(m, 4, 4)``. With the motion ``"straight"`` its origin goes along a line to
    each next pose, while it turns about one axis; with ``"screw"`` both at once about and along
    one axis, so that the origin goes along an arc or a helix. Each configuration is the one near
    the last that has the tool on the way. Steps are so short that the straight edges between them
    certainly keep within ``deviation`` (m) and ``rotation_deviation`` (rad) of it, and no joint
    changes by more than 0.1 rad: so there are no jumps. All edges are proven free. Where a joint
    is at its limit, the arm ends, or something is in the way, the motion ends before, and says
    why. With ``limits`` it is timed (`time_path`). ``group`` names the joints that may move.
    After ``timeout`` (s) it ends where it is; ``watch`` is called now and then and may raise.

    ``constraints`` are as of `plan_path`: it ends before an edge that is not proven to hold them.

    Raises InverseKinematicsError naming the argument, PlanningError for bad constraints,
    InvalidPoseError for a pose that is not rigid, KinematicTreeError for an unknown link or group
    and for a bad start, and TrajectoryError for bad limits.
    """
    deviations = _positive(deviation=deviation, rotation_deviation=rotation_deviation)
    deadline = Deadline.of(timeout, watch, InverseKinematicsError)
    if motion not in _MOTIONS:
        raise InverseKinematicsError(
            f"motion must be one of {', '.join(_MOTIONS)}, not {quoted(motion)}"
        )
    if not checker.is_straight:
        raise InverseKinematicsError(
            "plan_straight needs a checker with straight edges; this one's provider has its own"
        )
    tree = checker.plan.tree
    moves, X = which_move(tree, link, group), as_pose(np.eye(4) if X_LT is None else X_LT, "X_LT")
    if start is None:
        raise InverseKinematicsError("start must be a configuration (nq,), not None")
    q, poses = first_configurations(tree, start, name="start"), as_poses(X_WTs, "X_WTs")
    held = HeldConstraints(tree, constraints)
    (trouble,) = find_troubles(checker, q, checker.tolerance, new_stop(), moves=moves)
    excess = held.describe_excess(q[0])
    if trouble is not None or excess is not None:
        words, why = f"the start {excess}", StraightFailure.START_VIOLATES_CONSTRAINT
        if trouble is not None:
            words, why = f"the start {trouble.words}", StraightFailure.START
        return _plan(q, [0.0], (0.0, 0.0), 0.0, (why, words))
    search = pose_search(tree, link, X, moves, q[0], tries=1, seed=0)
    first = tree.link_poses(q, [link])[0, 0] @ X
    way = ToolWay(np.concatenate([first[np.newaxis], poses]), search.chain.unit,
                  is_screw=motion == "screw")  # fmt: skip
    walk = _Walk(search, way, deviations, tree.position_names)
    ended = walk.go(search.chain.coordinates(q)[0], deadline)
    x = np.array(walk.x)
    path = search.chain.configurations(x, np.repeat(q, len(x), axis=0))
    path[0] = q[0]
    return _proven(checker, path, walk, ended, held, limits, deadline)


def _positive(**numbers: float) -> tuple[float, ...]:
    result = []
    for name, value in numbers.items():
        number = as_float(value)
        if number is None or not 0.0 < number < math.inf:
            raise InverseKinematicsError(f"{name} must be a positive number, not {quoted(value)}")
        result.append(number)
    return tuple(result)


_Ended = tuple[StraightFailure, str] | None


class _Step(NamedTuple):
    x: NDArray[np.float64]
    deviations: tuple[float, float]


class _Walk:
    """Steps along a way, from one configuration to the next."""

    def __init__(
        self,
        search: PoseSearch,
        way: ToolWay,
        deviations: tuple[float, ...],
        names: tuple[str, ...],
    ) -> None:
        self._search, self._way, self._most, self._names = search, way, deviations, names
        self.x: list[NDArray[np.float64]] = []
        self.fractions: list[float] = []
        self.deviations: list[tuple[float, float]] = []
        """Of each edge."""

    def go(self, x: NDArray[np.float64], deadline: Deadline) -> _Ended:
        """Go on until the way ends, and return why it ends before."""
        way, piece, s, length = self._way, 0, 0.0, _FIRST
        self.x, self.fractions = [x], [way.fraction(0, 0.0) if way.pieces else 1.0]
        while piece < len(way.pieces):
            if deadline.is_over():
                words = f"no more of it was followed within {deadline.timeout:.10g} s"
                return StraightFailure.TIMEOUT, words
            # The last two steps share what is left, so that none is much shorter than it may be.
            left = 1.0 - s
            to = 1.0 if length >= left else s + min(length, 0.5 * left)
            step = self._step(piece, s, to)
            ratio = self._ratio(step)
            if ratio > 1.0:
                length = (to - s) * max(0.2, 0.9 / math.sqrt(ratio))
                if length < _LEAST:
                    return self._why(step, piece, to)
                continue
            self.x.append(self._search.chain.regular(step.x))
            self.deviations.append(step.deviations)
            self.fractions.append(way.fraction(piece, to))
            length = (to - s) * min(3.0, 0.9 / math.sqrt(max(ratio, 1e-2)))
            s = to
            if to == 1.0:
                before, piece, s = way.sizes[piece], piece + 1, 0.0
                if piece < len(way.pieces):
                    length = min(1.0, length * before / way.sizes[piece])
        return None

    def _step(self, piece: int, s: float, to: float) -> _Step:
        x, goal = self.x[-1], self._search.goals(self._way.pose(piece, to)[np.newaxis])
        tries = self._search.followed(goal, x[np.newaxis])
        if not tries.reached[0, 0]:
            return _Step(tries.x[0, 0], (math.inf, math.inf))
        way, turn = edge_deviations(self._search.chain, x, tries.x[0, 0])
        bent = self._way.sagitta(piece, to - s)
        return _Step(tries.x[0, 0], (way + bent + _ROUNDING, turn + _ROUNDING))

    def _ratio(self, step: _Step) -> float:
        """Return the ratio of a step's bend to its limit: it grows with its squared length."""
        parts = [each / most for each, most in zip(step.deviations, self._most, strict=True)]
        changes = self._search.chain.changes(self.x[-1][np.newaxis], step.x[np.newaxis])
        change = float(np.abs(changes).max(initial=0.0)) / _LONGEST
        return max(*parts, change * change)

    def _why(self, step: _Step, piece: int, to: float) -> tuple[StraightFailure, str]:
        """Return why no step is short enough."""
        chain = self._search.chain
        positions = chain.names(self._names)
        if math.isinf(step.deviations[0]):
            lower, upper = step.x <= chain.lower, step.x >= chain.upper
            held = np.flatnonzero(lower | upper)
            words = ", ".join(
                f"{positions[k]!r} is at its {'lower' if lower[k] else 'upper'} limit"
                f" {(chain.lower if lower[k] else chain.upper)[k] * chain.units[k]:.6g}"
                for k in held
            )
            if len(held):
                return StraightFailure.JOINT_LIMIT, f"the way goes on, but joint {words}"
            return (
                StraightFailure.OUT_OF_REACH,
                "no configuration near the last one has the tool further along the way: it is out"
                " of reach, or beside a singularity",
            )
        (change,) = chain.changes(self.x[-1][np.newaxis], step.x[np.newaxis])
        k = int(np.argmax(np.abs(change)))
        part = self._way.fraction(piece, to) - self.fractions[-1]
        return (
            StraightFailure.TOO_FAST,
            f"joint {positions[k]!r} would have to change by {change[k] * chain.units[k]:.3g} in"
            f" {part:.1e} of the way: it is beside a singularity",
        )


def _proven(
    checker: SceneGraphCollisionChecker,
    path: NDArray[np.float64],
    walk: _Walk,
    ended: _Ended,
    held: HeldConstraints,
    limits: MotionLimits | None,
    deadline: Deadline,
) -> StraightPlan:
    """Return the part of a path that is proven free, and to hold constraints, timed if asked."""
    edges = np.stack([path[:-1], path[1:]], axis=1)
    measures, holds = checker.measure_edges(edges), held.prove(edges)
    count = next((k for k, each in enumerate(measures) if not each.completely_free), len(path) - 1)
    broken = np.flatnonzero(holds.answers != HELD)
    if len(broken) and broken[0] <= count:
        count = int(broken[0])
        words = f"the next edge {held.describe(edges[count], holds, count)}"
        ended = StraightFailure.CONSTRAINT, words
    elif count < len(measures):
        pair = measures[count].pair
        words = pair_words(checker, pair) if pair is not None else "the robot and its surroundings"
        ended = (
            StraightFailure.COLLIDES,
            f"the next edge is not free: {words} collide, or keep less than"
            f" {1e3 * checker.tolerance:g} mm",
        )
    deviations = np.array(walk.deviations[:count]).reshape(-1, 2).max(axis=0, initial=0.0)
    # At the start alone its own clearance is what is known: an edge of no length has it.
    kept = measures[:count] or checker.measure_edges(np.repeat(path[:1], 2, axis=0)[np.newaxis])
    clearance = min(each.least_clearance for each in kept)
    path, fractions, timed = path[: count + 1], walk.fractions[: count + 1], None
    if limits is not None and count:
        how: dict[str, Any] = {"timeout": deadline.left, "watch": deadline.look}
        timed = time_path(checker, path, limits, constraints=held.constraints, **how)
        if timed.failure is not None and ended is None:
            ended = StraightFailure.TIMING, f"it is not timed: {timed.reason}"
    both = float(deviations[0]), float(deviations[1])
    return _plan(path, fractions, both, clearance, ended, timed)


def _plan(
    path: NDArray[np.float64],
    fractions: list[float],
    deviations: tuple[float, float],
    clearance: float,
    ended: _Ended,
    timed: TimedPath | None = None,
) -> StraightPlan:
    failure, reason = ended if ended is not None else (None, None)
    return StraightPlan(path, np.array(fractions), *deviations, clearance, failure, reason, timed)
