"""Trajectories along proven paths: rounded at their corners, timed, and proven once more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import enum
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.check_kernels import NO_PAIR
from scene_graph_ros.planning.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.curves import turning_quaternions
from scene_graph_ros.planning.edge_kernels import EdgeRules, FREE
from scene_graph_ros.planning.edge_proofs import EdgeProofs, prove
from scene_graph_ros.planning.path_ends import pair_words
from scene_graph_ros.planning.stoppable import run_stoppable, Stops
from scene_graph_ros.planning.trajectories.corners import CornerPath
from scene_graph_ros.planning.trajectories.errors import TrajectoryError
from scene_graph_ros.planning.trajectories.motion_limits import (
    find_excess,
    LimitExcess,
    MotionLimits,
)
from scene_graph_ros.planning.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.planning.trajectories.sampling import gentler, sample, Sampled, SHORTEST
from scene_graph_ros.planning.trajectories.time_optimal import GRID_POINTS, retime
from scene_graph_ros.planning.trajectories.trajectory_points import TrajectoryPoints

__all__ = ["TimedPath", "TimingFailure", "time_path"]

_KEPT = 20.0
"""Times the checker's tolerance, what is left beside a rounded corner: what runs through points is
not quite on it."""

_SMALLEST = 1.0 / 64.0
"""Of the largest: corners that would have to be rounded less are stopped at."""


_LATE = "no trajectory was found in time"


class TimingFailure(enum.Enum):
    """Why there is no trajectory."""

    LIMIT = 1
    """It is beyond a limit."""
    NOT_FREE = 2
    """It is not proven free, though the path was."""
    TIMEOUT = 3
    """It was not done in time."""


@dataclass(frozen=True, eq=False)
class TimedPath:
    """A trajectory along a path, proven free and within limits at all times; or why there is none.

    ``points`` have the configurations of all positions ``(m, nq)``; ``trajectory`` is what runs
    through them, in s. ``least_clearance`` (m) is what all pairs certainly keep, beyond their
    paddings, at all times. ``stops`` is at how many corners of the path the robots come to rest,
    ``rounded`` how many they round. ``failure`` and ``reason`` say why there is none.
    """

    points: TrajectoryPoints | None
    trajectory: PiecewisePolynomial | None
    least_clearance: float
    rounded: int
    stops: int
    failure: TimingFailure | None
    reason: str | None

    @property
    def is_success(self) -> bool:
        """Whether there is a trajectory."""
        return self.failure is None

    @property
    def duration(self) -> float:
        """How long it takes, s; 0 without success."""
        return 0.0 if self.points is None else self.points.duration


class _Problem(NamedTuple):
    """What was asked for, checked."""

    checker: SceneGraphCollisionChecker
    path: NDArray[np.float64]
    """``(n, nq)``."""
    rows: NDArray[np.intp]
    """``(k,)``: the positions that have limits."""
    limits: MotionLimits
    rise_time: float
    grid_points: int

    def whole(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return configurations ``(..., nq)`` of the positions that move ``(..., k)``."""
        result = np.empty((*points.shape[:-1], self.path.shape[1]))
        result[:] = self.path[0]
        result[..., self.rows] = points
        return result

    def prove(
        self, points: NDArray[np.float64], tolerance: float, stop: NDArray[np.int64]
    ) -> EdgeProofs:
        """Prove curves by their control points ``(n, m, k)``."""
        rules = EdgeRules(measures=False, part=0.5, tolerance=tolerance)
        return prove(self.checker.plan, self.whole(points), rules, stop=stop)


def time_path(
    checker: SceneGraphCollisionChecker,
    path: ArrayLike,
    limits: MotionLimits,
    *,
    rise_time: float = 0.0,
    grid_points: int = GRID_POINTS,
    timeout: float | None = None,
    watch: Callable[[], None] | None = None,
) -> TimedPath:
    """Return a fast trajectory along a path ``(n, nq)`` of straight edges, from rest to rest.

    ``limits`` are of the positions that move, by name; all others must be the same on all of the
    path. Corners are rounded by parabolas, as large as is proven free, and stopped at where none
    is. What is returned are points and the cubics through them, as controllers run them: of these
    it is shown that they keep all limits at all times, and proven that they are free. With a
    ``rise_time`` (s) accelerations do not jump, but take so long to change; then points have
    accelerations, and it is the quintics through them.

    ``grid_points`` are stretches of each corner with one speedup each: more are faster, and take
    longer to find. ``timeout`` (s) and ``watch`` are as of `plan_path`.

    Raises TrajectoryError naming what makes no sense: a path that moves positions without limits,
    or turns a floating joint. Raises as `SceneGraphCollisionChecker` does for configurations of
    another shape.
    """
    # Others may change theirs meanwhile.
    problem = _problem(checker.clone(), path, limits, rise_time, grid_points)
    patience = None if timeout is None else as_float(timeout)
    if timeout is not None and (patience is None or not 0.0 <= patience < math.inf):
        raise TrajectoryError(f"timeout must be seconds from 0 on, or None, not {quoted(timeout)}")
    return run_stoppable(lambda stops: _timed(problem, stops), patience, watch or (lambda: None))


def _problem(
    checker: SceneGraphCollisionChecker,
    path: ArrayLike,
    limits: MotionLimits,
    rise_time: float,
    grid_points: int,
) -> _Problem:
    """Return what was asked for, checked."""
    q, tree = checker.checked_configurations(path), checker.plan.tree
    if np.ndim(path) != 2 or not len(q):
        raise TrajectoryError(f"path must have shape (n, nq), not {np.shape(path)}")
    if not limits.names:
        raise TrajectoryError("limits must have the names of the positions that move")
    rows = np.array([tree.position_index(name) for name in limits.names], dtype=np.intp)
    for _, name in turning_quaternions(tree, q[np.newaxis]):
        raise TrajectoryError(f"the path turns the floating joint {name!r}: it can't be timed")
    others = np.setdiff1d(np.arange(tree.num_positions), rows)
    for column in others[np.ptp(q[:, others], axis=0) > 0.0]:
        raise TrajectoryError(
            f"the path moves position {tree.position_names[column]!r}, which has no limits"
        )
    seconds = as_float(rise_time)
    if seconds is None or not 0.0 <= seconds < math.inf:
        raise TrajectoryError(f"rise_time must be seconds from 0 on, not {quoted(rise_time)}")
    number = as_float(grid_points)
    if number is None or number < 1.0 or not number.is_integer():
        raise TrajectoryError(
            f"grid_points must be a whole number from 1 on, not {quoted(grid_points)}"
        )
    return _Problem(checker, q, rows, limits, seconds, int(number))


def _timed(problem: _Problem, stops: Stops) -> TimedPath:
    """Return the trajectory; told to stop, why there is none."""
    corners = CornerPath(problem.path[:, problem.rows], problem.limits.velocities)
    if len(corners.points) == 1:
        return _at_rest(problem, corners, stops)
    largest, gentle = corners.largest_sizes(), gentler(problem.limits)
    sizes = _proven_sizes(problem, corners, largest, stops)
    while True:
        motion = retime(corners.rounded(sizes), gentle, grid_points=problem.grid_points)
        sampled = sample(motion, problem.limits, rise_time=problem.rise_time)
        if sampled.excess is not None:
            return _beyond(problem, sampled.excess)
        trajectory = sampled.points.trajectory()
        proofs = problem.prove(trajectory.control_points, problem.checker.tolerance, stops.proving)
        excess = _position_excess(problem, trajectory)
        if excess is None and (proofs.statuses == FREE).all():
            return _found(problem, sampled.points, trajectory, proofs, sizes)
        if stops.looking[0] != 0:
            return _failed(TimingFailure.TIMEOUT, _LATE)
        times = [] if excess is None else [excess.time]
        bad = np.flatnonzero(proofs.statuses != FREE)
        times += (0.5 * (trajectory.breaks[bad] + trajectory.breaks[bad + 1])).tolist()
        if not sizes.any():
            return _stuck(problem, trajectory, proofs, excess)
        _shrink(corners, sizes, largest, _places(problem, sampled, times))


def _proven_sizes(
    problem: _Problem, corners: CornerPath, largest: NDArray[np.float64], stops: Stops
) -> NDArray[np.float64]:
    """Return how much of each corner can be rounded, at most, so that it is proven free."""
    sizes = largest.copy()
    tolerance = _KEPT * problem.checker.tolerance
    untried = np.arange(corners.num_corners)
    while len(untried) and stops.looking[0] == 0:
        proofs = problem.prove(corners.rounded_corners(sizes)[untried], tolerance, stops.looking)
        untried = untried[proofs.statuses != FREE]
        sizes[untried] *= 0.5
        sizes[sizes < _SMALLEST * largest] = 0.0
        untried = untried[sizes[untried] > 0.0]
    sizes[untried] = 0.0
    return sizes


def _places(problem: _Problem, sampled: Sampled, times: list[float]) -> NDArray[np.float64]:
    """Return where on the rounded path a trajectory is at times, s."""
    # With a rise time it is at the mean of what was before.
    before = np.array(times) / sampled.factor - 0.5 * problem.rise_time
    return sampled.motion.time_scaling.value(before)[:, 0]


def _shrink(
    corners: CornerPath,
    sizes: NDArray[np.float64],
    largest: NDArray[np.float64],
    places: NDArray[np.float64],
) -> None:
    """Round the corners next to some places by half as much, or not at all."""
    rows = {corners.corner_at(sizes, float(s)) for s in places}
    for row in rows:
        sizes[row] *= 0.5
        if sizes[row] < _SMALLEST * largest[row]:
            sizes[row] = 0.0


def _position_excess(problem: _Problem, trajectory: PiecewisePolynomial) -> LimitExcess | None:
    tree = problem.checker.plan.tree
    return find_excess(
        trajectory,
        problem.limits,
        lower=tree.lower[problem.rows],
        upper=tree.upper[problem.rows],
    )


def _found(
    problem: _Problem,
    own: TrajectoryPoints,
    trajectory: PiecewisePolynomial,
    proofs: EdgeProofs,
    sizes: NDArray[np.float64],
) -> TimedPath:
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


def _rates(problem: _Problem, rates: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    """Return rates of all positions ``(m, nq)``: those that do not move have none."""
    if rates is None:
        return None
    result = np.zeros((len(rates), problem.path.shape[1]))
    result[:, problem.rows] = rates
    return result


def _at_rest(problem: _Problem, corners: CornerPath, stops: Stops) -> TimedPath:
    """Return the trajectory that stays where it is, for as short as that can be said."""
    points = np.repeat(corners.points, 2, axis=0)
    times = np.array([0, round(SHORTEST * 1e9)])
    rates = np.zeros_like(points)
    more = rates if problem.rise_time > 0.0 else None
    own = TrajectoryPoints(times, points, rates, more)
    trajectory = own.trajectory()
    proofs = problem.prove(trajectory.control_points, problem.checker.tolerance, stops.proving)
    excess = _position_excess(problem, trajectory)
    if stops.looking[0] != 0 and (proofs.statuses != FREE).any():
        return _failed(TimingFailure.TIMEOUT, _LATE)
    if excess is not None or (proofs.statuses != FREE).any():
        return _stuck(problem, trajectory, proofs, excess)
    return _found(problem, own, trajectory, proofs, np.empty(0))


def _beyond(problem: _Problem, excess: LimitExcess) -> TimedPath:
    return _failed(TimingFailure.LIMIT, excess.words(problem.limits.name(excess.row)))


def _stuck(
    problem: _Problem,
    trajectory: PiecewisePolynomial,
    proofs: EdgeProofs,
    excess: LimitExcess | None,
) -> TimedPath:
    """Say what stops a trajectory that stops at all corners."""
    if excess is not None:
        return _beyond(problem, excess)
    row = int(np.argmax(proofs.statuses != FREE))
    pair, (low, high) = int(proofs.pairs[row]), trajectory.breaks[row : row + 2]
    who = "all pairs"
    if pair != NO_PAIR:
        who = pair_words(problem.checker, problem.checker.plan.ids(pair))
    what = f"{who} are not proven apart between {low:.6g} and {high:.6g} s"
    return _failed(TimingFailure.NOT_FREE, what)


def _failed(kind: TimingFailure, reason: str) -> TimedPath:
    return TimedPath(None, None, 0.0, 0, 0, kind, reason)
