"""The checked arguments of timing, and its answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
import enum
import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import pair_words
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.link_constraints import LinkConstraint
from scene_graph_ros.planning.constraints.proof_kernels import HELD
from scene_graph_ros.planning.edges.curves import turning_quaternions
from scene_graph_ros.planning.edges.edge_proofs import EdgeProofs, prove
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE, UNDECIDED, UNFINISHED
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.parallel.deadline import checked_timeout
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.paths.planned_path import Plan
from scene_graph_ros.planning.plan_failure import PlanFailure
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories.errors import TrajectoryError
from scene_graph_ros.trajectories.limit_rounding import LIMIT_ROUNDING, RATE_ROUNDING
from scene_graph_ros.trajectories.motion_ends import EndRates
from scene_graph_ros.trajectories.motion_limits import (
    LimitExcess,
    MotionLimits,
    value_excess,
    worst_ratio_of,
)
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.retimer import Retimer, TimeOptimalRetimer
from scene_graph_ros.trajectories.trajectory_points import TrajectoryPoints

__all__ = [
    "TimedPath",
    "TimingFailure",
    "TimingProblem",
    "as_timed_path",
    "beyond_limit",
    "constraint_failure",
    "in_turns",
    "no_path",
    "not_free",
    "not_retimed",
    "position_excess",
    "rate_or_position_excess",
    "timing_problem",
    "too_late",
    "too_many_points",
]


_LONG = 32
"""Edges or segments: what has more is timed in a thread of its own, as that may take long."""

_Answer = TypeVar("_Answer")


class TimingFailure(enum.Enum):
    """Why there is no trajectory."""

    LIMIT = 1
    """It is beyond a limit."""
    NOT_FREE = 2
    """It is not proven free, though the path was."""
    TIMEOUT = 3
    """It was not done in time."""
    NOT_RETIMED = 4
    """The retimer that was asked for found none."""
    NO_PATH = 5
    """There is no path: the `Plan` says why."""
    TOO_MANY_POINTS = 6
    """It has more points than asked for, and with fewer it would be another one."""
    CONSTRAINT = 7
    """It is not proven to hold a constraint."""


@one_line()
@dataclass(frozen=True, eq=False)
class TimedPath:
    """A trajectory along a path, proven free and within limits at all times; or why there is none.

    ``points`` have the configurations of all positions ``(m, nq)``; ``trajectory`` is what runs
    through them, in s. ``least_clearance`` (m) is what all pairs certainly keep, beyond their
    paddings, at all times from point ``free_from`` on: 0, unless it leads out of a collision.
    ``stops`` is at how many corners of the path the robots come to rest,
    ``rounded`` how many they round. ``failure`` and ``reason`` say why there is none. ``plan`` is
    the `Plan` that was looked for first, where `plan_trajectory` was asked. ``thinned_by`` (rad or
    m) is how far from the trajectory it was thinned of it is at most.
    """

    points: TrajectoryPoints | None
    trajectory: PiecewisePolynomial | None
    least_clearance: float
    rounded: int
    stops: int
    failure: TimingFailure | None
    reason: str | None
    free_from: int = 0
    plan: Plan | None = None
    thinned_by: float = 0.0

    @property
    def is_success(self) -> bool:
        """Whether there is a trajectory."""
        return self.failure is None

    @property
    def duration(self) -> float:
        """How long it takes, s; 0 without success."""
        return 0.0 if self.points is None else self.points.duration


class TimingProblem(NamedTuple):
    """The checked arguments."""

    checker: SceneGraphCollisionChecker
    path: NDArray[np.float64]
    """``(n, nq)``."""
    rows: NDArray[np.intp]
    """``(k,)``: the positions that have limits."""
    limits: MotionLimits
    rise_time: float
    retimer: Retimer
    start_tolerance: float
    """rad or m: how far beyond limits the first configuration may be."""
    deviation: NDArray[np.float64] | None
    """``(k,)``: how far from the path a trajectory may be."""
    through: NDArray[np.bool_]
    """``(n,)``: which configurations it passes exactly."""
    at_rest: NDArray[np.bool_]
    """``(n,)``: at which it rests."""
    start: EndRates
    """Velocity and acceleration ``(k,)``; of none where it rests."""
    end: EndRates
    held: HeldConstraints
    """What it has to hold at all times."""

    def along(self, path: NDArray[np.float64]) -> TimingProblem:
        """Return the same with a checked path ``(n, nq)``, none of whose rows has to be reached.

        Raises TrajectoryError for one that moves a position without limits.
        """
        _require_limits(self.checker.plan.tree, path, self.rows)
        none = np.zeros(len(path), dtype=np.bool_)
        return self._replace(path=path, through=none, at_rest=none)

    def whole(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return configurations ``(..., nq)`` of the positions that move ``(..., k)``."""
        result = np.empty((*points.shape[:-1], self.path.shape[1]))
        result[:] = self.path[0]
        result[..., self.rows] = points
        return result

    def prove(
        self,
        points: NDArray[np.float64],
        turns: Turns,
        *,
        tolerance: float | None = None,
        may_wait: bool = False,
    ) -> EdgeProofs:
        """Prove curves by their control points ``(n, m, k)``, with the checker's tolerance (m).

        When the time is over, there is still a little for them, unless they ``may_wait``.
        """
        own = self.checker.tolerance if tolerance is None else tolerance
        rules = EdgeRules(measures=False, part=0.5, tolerance=own)
        stop = turns.stops.looking if may_wait else turns.stops.proving

        def proofs() -> EdgeProofs:
            return prove(self.checker.plan, self.whole(points), rules, stop=stop)

        proven = proofs()
        turns.pause()
        if (proven.statuses == UNFINISHED).any():
            proven = turns.beside(proofs)
        return self._with_constraints(points, proven, stop)

    def _with_constraints(
        self, points: NDArray[np.float64], proven: EdgeProofs, stop: NDArray[np.int64]
    ) -> EdgeProofs:
        """Return proofs of which those are undecided that are not proven to hold constraints."""
        if not self.held:
            return proven
        broken = self.held.prove(self.whole(points), stop=stop).answers != HELD
        broken &= proven.statuses == FREE
        return proven._replace(
            statuses=np.where(broken, UNDECIDED, proven.statuses),
            pairs=np.where(broken, NO_PAIR, proven.pairs),
        )


def timing_problem(
    checker: SceneGraphCollisionChecker,
    path: ArrayLike,
    limits: MotionLimits,
    rise_time: float = 0.0,
    retimer: Retimer | None = None,
    constraints: Iterable[LinkConstraint] = (),
) -> TimingProblem:
    """Return the checked arguments. Raises TrajectoryError as `time_path` says."""
    q, tree = checker.checked_configurations(path), checker.plan.tree
    if np.ndim(path) != 2 or not len(q):
        raise TrajectoryError(f"path must have shape (n, nq), not {np.shape(path)}")
    if not limits.names:
        if len(limits.velocities) != tree.num_positions:
            raise TrajectoryError(
                f"limits has {len(limits.velocities)} entries without names, and there are"
                f" {tree.num_positions} positions: give names, of {', '.join(tree.position_names)}"
            )
        limits = replace(limits, names=tree.position_names)
    rows = np.array([tree.position_index(name) for name in limits.names], dtype=np.intp)
    _require_limits(tree, q, rows)
    seconds = as_float(rise_time)
    if seconds is None or not 0.0 <= seconds < math.inf:
        raise TrajectoryError(f"rise_time must be seconds from 0 on, not {quoted(rise_time)}")
    none, rest = np.zeros(len(q), dtype=np.bool_), EndRates(*np.zeros((2, len(rows))))
    return TimingProblem(
        checker,
        q,
        rows,
        limits,
        seconds,
        retimer or TimeOptimalRetimer(),
        0.0,
        None,
        none,
        none,
        rest,
        rest,
        HeldConstraints(tree, constraints),
    )


def _require_limits(tree: KinematicTree, q: NDArray[np.float64], rows: NDArray[np.intp]) -> None:
    """Raise TrajectoryError where a path ``(n, nq)`` moves positions without limits."""
    for _, name in turning_quaternions(tree, q[np.newaxis]):
        raise TrajectoryError(f"the path turns the floating joint {name!r}: it can't be timed")
    moves = (q != q[0]).any(axis=0)
    moves[rows] = False
    for column in np.flatnonzero(moves):
        raise TrajectoryError(
            f"the path moves position {tree.position_names[column]!r}, which has no limits"
        )


def rate_or_position_excess(
    problem: TimingProblem, points: TrajectoryPoints, trajectory: PiecewisePolynomial
) -> LimitExcess | None:
    """Return the largest excess of the trajectory through points over a limit of any kind."""
    assert points.velocities is not None
    states = points.positions, points.velocities, points.accelerations
    worst = worst_ratio_of(points.nanoseconds, *states, problem.limits)
    if worst.ratio > 1.0 + RATE_ROUNDING:
        return worst
    return position_excess(problem, trajectory)


def in_turns(
    job: Callable[[Turns], _Answer],
    count: int,
    timeout: float | None,
    watch: Callable[[], None] | None,
) -> _Answer:
    """Return the answer of a job on a path of ``count`` edges, which must look at its turns."""
    turns = Turns(checked_timeout(timeout, TrajectoryError), watch or (lambda: None))
    return job(turns) if count <= _LONG else turns.beside(lambda: job(turns))


def position_excess(problem: TimingProblem, trajectory: PiecewisePolynomial) -> LimitExcess | None:
    """Return the largest excess over limits of positions, or None, where rates are known."""
    return value_excess(trajectory, *_position_limits(problem))


def _position_limits(problem: TimingProblem) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return limits ``(k,)`` of the positions that move.

    One that begins a little beyond its limits, as a start may, goes no farther.
    """
    tree, first = problem.checker.plan.tree, problem.path[0, problem.rows]
    lower, upper = tree.lower[problem.rows], tree.upper[problem.rows]
    slack = problem.start_tolerance + LIMIT_ROUNDING
    least = np.where(first >= lower - slack, np.minimum(lower, first), lower)
    most = np.where(first <= upper + slack, np.maximum(upper, first), upper)
    return least, most


def as_timed_path(
    problem: TimingProblem,
    own: TrajectoryPoints,
    trajectory: PiecewisePolynomial,
    proofs: EdgeProofs,
    sizes: NDArray[np.float64],
) -> TimedPath:
    """Return a trajectory that is free and within limits, round at corners of some ``sizes``."""
    points = TrajectoryPoints(
        own.nanoseconds,
        problem.whole(own.positions),
        _rates(problem, own.velocities),
        _rates(problem, own.accelerations),
    )
    least = max(float(proofs.numbers[:, 2].min()), 0.0)
    rounded = int((sizes > 0.0).sum())
    whole = PiecewisePolynomial(trajectory.breaks, problem.whole(trajectory.control_points))
    return TimedPath(points, whole, least, rounded, len(sizes) - rounded, None, None)


def _rates(
    problem: TimingProblem, rates: NDArray[np.float64] | None
) -> NDArray[np.float64] | None:
    """Return rates of all positions ``(m, nq)``: those that do not move have none."""
    if rates is None:
        return None
    result = np.zeros((len(rates), problem.path.shape[1]))
    result[:, problem.rows] = rates
    return result


def beyond_limit(problem: TimingProblem, excess: LimitExcess) -> TimedPath:
    """Return that there is none, as a limit is exceeded."""
    return _failed(TimingFailure.LIMIT, excess.words(problem.limits.name(excess.row)))


def not_free(
    problem: TimingProblem,
    trajectory: PiecewisePolynomial,
    proofs: EdgeProofs,
    excess: LimitExcess | None,
) -> TimedPath:
    """Return that there is none, as it is beyond a limit, or not proven free where it stops."""
    if excess is not None:
        return beyond_limit(problem, excess)
    row = int(np.argmax(proofs.statuses != FREE))
    pair, (low, high) = int(proofs.pairs[row]), trajectory.breaks[row : row + 2]
    broken = constraint_failure(problem, trajectory)
    if broken is not None:
        return broken
    who = "all pairs"
    if pair != NO_PAIR:
        who = pair_words(problem.checker, problem.checker.plan.ids(pair))
    what = f"{who} are not proven apart between {low:.6g} and {high:.6g} s"
    return _failed(TimingFailure.NOT_FREE, what)


def constraint_failure(
    problem: TimingProblem, trajectory: PiecewisePolynomial
) -> TimedPath | None:
    """Return which constraint a trajectory is not proven to hold and when, as a failure, or None.

    ``trajectory`` is of the positions that have limits.
    """
    curves = problem.whole(trajectory.control_points)
    proofs = problem.held.prove(curves)
    if (proofs.answers == HELD).all():
        return None
    row = int(np.argmax(proofs.answers != HELD))
    low, high = trajectory.breaks[row : row + 2]
    words = problem.held.describe(curves[row], proofs, row)
    return _failed(TimingFailure.CONSTRAINT, f"between {low:.6g} and {high:.6g} s it {words}")


def _failed(kind: TimingFailure, reason: str) -> TimedPath:
    return TimedPath(None, None, 0.0, 0, 0, kind, reason)


def not_retimed(words: str) -> TimedPath:
    """Return that a retimer found none."""
    return _failed(TimingFailure.NOT_RETIMED, words)


def no_path(plan: Plan) -> TimedPath:
    """Return that there is no path that a trajectory could follow, for a plan without success."""
    is_late = plan.failure is PlanFailure.TIMEOUT
    kind = TimingFailure.TIMEOUT if is_late else TimingFailure.NO_PATH
    return replace(_failed(kind, plan.reason or ""), plan=plan)


def too_many_points(words: str) -> TimedPath:
    """Return that there is none of so few points."""
    return _failed(TimingFailure.TOO_MANY_POINTS, words)


def too_late() -> TimedPath:
    """Return that it was not done in time."""
    return _failed(TimingFailure.TIMEOUT, "no trajectory was found in time")
