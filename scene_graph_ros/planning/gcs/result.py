"""A trajectory through regions, measured again: its constraints and their residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.graphs.model.edge import Vertex
from scene_graph_ros.convex.graphs.search.result import GraphOfConvexSetsResult
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.gcs.joined_edges import Bounds
from scene_graph_ros.planning.gcs.subgraph import Subgraph
from scene_graph_ros.trajectories.bezier_curve import BezierCurve
from scene_graph_ros.trajectories.composite_trajectory import CompositeTrajectory

__all__ = ["GcsTrajectoryResult", "Step", "measured", "trajectory_of"]

PROMISED = 1e-9
"""Relative to a bound or to the size of a region: the most that a trajectory may break."""

_PROMISED_NONLINEAR = 1e-6
"""The same of what is not convex, and solved by sequential quadratic programming."""


@dataclass(frozen=True, eq=False)
class Step:
    """One region on the way: the vertex's coordinates, and continuity at its end.

    ``offset`` ``(n,)`` is added where the next region begins, ``continuity`` the order to which
    derivatives of r(s) go on there, ``continuous`` those orders that go on of q(t), and
    ``meeting`` the bounds of derivatives of q(t) there, of both regions.
    """

    vertex: Vertex
    subgraph: Subgraph
    x: np.ndarray
    offset: np.ndarray
    continuity: int
    continuous: tuple[int, ...] = ()
    meeting: tuple[Bounds, ...] = ()

    @property
    def points(self) -> np.ndarray:
        """The control points ``(order + 1, n)``."""
        return self.subgraph.variables.control_points(self.x)

    @property
    def duration(self) -> float:
        """How long it takes, s."""
        return self.subgraph.variables.duration(self.x)


@one_line()
@dataclass(frozen=True, eq=False)
class GcsTrajectoryResult:
    """A trajectory, a lower bound of the cost, and the trajectory's residuals, measured.

    ``cost`` is infinite without a trajectory, and ``reason`` says why there is none. No trajectory
    of this kind through these regions costs less than ``lower_bound``, which is proven.
    """

    is_success: bool
    cost: float
    lower_bound: float
    reason: str
    graph_result: GraphOfConvexSetsResult
    """Of the graph's own shortest path."""
    vertices: tuple[Vertex, ...] = ()
    """Those on the way, of regions alone."""
    outside: float = 0.0
    """How far a control point is outside of its region at most, in the region's own units."""
    jump: float = 0.0
    """By how much the path, or a derivative that was asked to go on, jumps between regions: of
    r(s), and across a joint's turn without that turn."""
    velocity_excess: float = 0.0
    """How far a velocity is beyond its bound, relative to the larger of both its bounds."""
    derivative_jump: float = 0.0
    """By how much a derivative of q(t) that was asked to go on jumps, relative to its size, or to
    that of the way in the segment's duration where that is larger."""
    derivative_excess: float = 0.0
    """How far a bounded derivative above the first is beyond its bound, relative to that."""
    unrest: float = 0.0
    """How far from 0 a derivative is where that was asked for, relative to the largest that it is
    in its region."""

    @property
    def is_stopped(self) -> bool:
        """Whether the time was over, or ``termination_func`` ended it."""
        return self.graph_result.is_stopped

    @property
    def gap(self) -> float:
        """How much less than the cost a trajectory might cost, in the cost's own units."""
        return max(0.0, self.cost - self.lower_bound) if self.is_success else np.inf


def trajectory_of(steps: Sequence[Step]) -> CompositeTrajectory | None:
    """Return the segments one after another from 0 s on; None where none takes any time.

    Raises SolverError where one moves in no time.
    """
    segments: list[BezierCurve] = []
    start = 0.0
    for step in steps:
        end = start + step.duration
        if end - start < step.duration:
            # Rounded so that nothing becomes faster.
            end = float(np.nextafter(end, np.inf))
        if np.ptp(step.points, axis=0).max(initial=0.0) > 0.0 and _takes_no_time(step):
            raise SolverError(
                f"{step.vertex.name}: the way through the region takes no time; give add_regions"
                " an h_min above 0, or a bound of velocities"
            )
        if step.duration <= 0.0:
            continue
        segments.append(BezierCurve(start, end, step.points))
        start = end
    return CompositeTrajectory(tuple(segments)) if segments else None


def _takes_no_time(step: Step) -> bool:
    """Tell whether the duration is zero up to the solver's residual, and may be zero.

    A bound of velocities says how long a way takes, also where that is next to nothing.
    """
    shortest, longest = step.subgraph.durations
    if step.duration <= 0.0:
        return True
    is_bounded = any(np.isfinite(bound).any() for bound in step.subgraph.velocity_bounds)
    return not shortest and not is_bounded and step.duration <= PROMISED * longest


def measured(
    steps: Sequence[Step], found: GraphOfConvexSetsResult, trajectory: CompositeTrajectory | None
) -> GcsTrajectoryResult:
    """Return a trajectory's residuals. Raises SolverError where one is above its limit."""
    outside, relative = 0.0, 0.0
    for step in steps:
        region = step.subgraph.regions[step.subgraph.vertices.index(step.vertex)]
        nearest = region.projection(step.points)
        assert nearest is not None, "regions of a graph are not empty"
        beyond = float(nearest.distances.max(initial=0.0))
        size = _size(step)
        outside, relative = max(outside, beyond), max(relative, beyond / (size or 1.0))
    jump, relative_jump = _jump(steps)
    at_rest, meeting_speed, meeting_excess = _meeting_excess(steps)
    excess = max(_velocity_excess(steps, trajectory), meeting_speed)
    derivative_jump = _derivative_jump(steps)
    beyond_bounds = max(_derivative_excess(steps), meeting_excess)
    for what, value, accepted in (
        ("leaves a region", relative, PROMISED),
        ("jumps between two regions", relative_jump, PROMISED),
        ("is beyond a bound of its velocity", excess, PROMISED),
        ("has a derivative that jumps", derivative_jump, _PROMISED_NONLINEAR),
        ("is beyond a bound of a derivative", beyond_bounds, PROMISED),
        ("has a derivative that is not 0 where it is to be", at_rest, PROMISED),
    ):
        if value > accepted:
            raise SolverError(
                f"GcsTrajectoryOptimization: the trajectory that the solver found {what} by"
                f" {value:.1e} of its size, accepted is {accepted:g}"
            )
    return GcsTrajectoryResult(
        found.is_success,
        found.cost,
        found.lower_bound,
        found.reason,
        found,
        tuple(step.vertex for step in steps),
        outside,
        jump,
        excess,
        derivative_jump,
        beyond_bounds,
        at_rest,
    )


def _size(step: Step) -> float:
    """Return the size of a region and of the coordinates in it, in the region's own units."""
    half = step.vertex.placed.half[: step.points.shape[1]]
    return float(np.abs(step.points).max(initial=0.0)) + float(half.max(initial=0.0))


def _rates(step: Step, order: int) -> np.ndarray:
    """Return the control points of a derivative of q(t)."""
    curve = BezierCurve(0.0, step.duration, step.points)
    return curve.derivative(order).control_points


def _derivative_jump(steps: Sequence[Step]) -> float:
    worst = 0.0
    for both in itertools.pairwise(steps):
        first, second = both
        for order in first.continuous:
            a, b = _rates(first, order), _rates(second, order)
            # Where it is 0 but for rounding, it is small beside the way in that time.
            ways = [float(np.ptp(s.points, axis=0).max()) / s.duration**order for s in both]
            size = max(float(np.abs(a).max()), float(np.abs(b).max()), *ways) or 1.0
            worst = max(worst, float(np.abs(b[0] - a[-1]).max()) / size)
    return worst


def _derivative_excess(steps: Sequence[Step]) -> float:
    return max(
        (
            _beyond(_rates(step, order).min(axis=0), _rates(step, order).max(axis=0), low, high)
            for step in steps
            for order, low, high in step.subgraph.derivative_bounds
        ),
        default=0.0,
    )


def _meeting_excess(steps: Sequence[Step]) -> tuple[float, float, float]:
    """Return the excess over bounds where two regions meet.

    Of derivatives that are to be 0, of velocities, and of higher ones.
    """
    unrest, speed, other = 0.0, 0.0, 0.0
    for first, second in itertools.pairwise(steps):
        for order, low, high in first.meeting:
            for step, index in ((first, -1), (second, 0)):
                if step.subgraph.order < order or step.duration <= 0.0:
                    continue
                rates = _rates(step, order)
                at = rates[index]
                if not low.any() and not high.any():
                    size = float(np.abs(rates).max(initial=0.0)) or 1.0
                    unrest = max(unrest, float(np.abs(at).max(initial=0.0)) / size)
                elif order == 1:
                    speed = max(speed, _beyond(at, at, low, high))
                else:
                    other = max(other, _beyond(at, at, low, high))
    return unrest, speed, other


def _beyond(least: np.ndarray, most: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Return the excess of values over bounds ``(n,)``, relative to the larger of both."""
    both = np.abs([low, high])
    sizes = np.where(np.isfinite(both), both, 0.0).max(axis=0)
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    return float((np.maximum(low - least, most - high) / sizes).max(initial=0.0))


def _jump(steps: Sequence[Step]) -> tuple[float, float]:
    """Return the largest jump between regions, and that relative to the derivative's size."""
    largest, relative = 0.0, 0.0
    for first, second in itertools.pairwise(steps):
        curves = [BezierCurve(0.0, 1.0, step.points) for step in (first, second)]
        for order in range(first.continuity + 1):
            a, b = (curve.derivative(order).control_points for curve in curves)
            end = a[-1] + first.offset if order == 0 else a[-1]
            size = max(_size(first), _size(second)) or 1.0
            off = float(np.abs(b[0] - end).max(initial=0.0))
            largest, relative = max(largest, off), max(relative, off / size)
    return largest, relative


def _velocity_excess(steps: Sequence[Step], trajectory: CompositeTrajectory | None) -> float:
    """Return the largest excess of velocities over their bounds, at all times: control points."""
    if trajectory is None:
        return 0.0
    moving = [step for step in steps if step.duration > 0.0]
    worst = 0.0
    for step, segment in zip(moving, trajectory.segments, strict=True):
        rates = segment.derivative().bounds()  # type: ignore[attr-defined]
        for low, high in step.subgraph.velocity_bounds:
            worst = max(worst, _beyond(rates[0], rates[1], low, high))
    return worst
