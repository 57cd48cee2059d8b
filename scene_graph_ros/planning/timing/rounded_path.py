"""A path whose corners are rounded as far as that is proven free."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.configuration_checks import first_pairs
from scene_graph_ros.planning.edges.edge_stretches import FREE
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.parallel.stoppable import Turns
from scene_graph_ros.planning.timing.timing_problem import TimingProblem
from scene_graph_ros.trajectories.bernstein import evaluated
from scene_graph_ros.trajectories.corners import CornerPath, PathPieces
from scene_graph_ros.trajectories.even_waypoints import even_points
from scene_graph_ros.trajectories.motion_ends import AT_REST, MotionEnds, moving_end
from scene_graph_ros.trajectories.piecewise_polynomial import PiecewisePolynomial
from scene_graph_ros.trajectories.sample_along import averages
from scene_graph_ros.trajectories.straight_motion import duration_with_rests
from scene_graph_ros.trajectories.waypoints import rounding_of, telling_points

__all__ = ["RoundedPath"]

Array = NDArray[np.float64]

_KEPT = 20.0
"""Times the checker's tolerance, what is left beside a rounded corner: what runs through points is
not quite on it."""

_PLACES = np.arange(1.0, 9.0) / 9.0
"""Of a rounded corner: where it is looked whether it is free."""

_SMALLEST = 1.0 / 64.0
"""Of the largest: corners that would have to be rounded less are stopped at."""

_LEFT_OUT, _ROUNDED = 0.1, 0.85
"""Shares of a deviation: of points that are left out, and of rounded corners. The rest is for the
polynomials through points, which are not quite on the curve."""


class RoundedPath:
    """The path of a problem without points that are only rounding, and how far it is rounded."""

    def __init__(self, problem: TimingProblem, *, leaves_out: bool = True) -> None:
        self._problem = problem
        q, units = problem.path[:, problem.rows], problem.limits.velocities
        through = problem.through
        if leaves_out and len(q) > 2:
            tolerance, left = rounding_of(q, units), None
            if problem.deviation is not None:
                left = _LEFT_OUT * problem.deviation
                tolerance = np.minimum(tolerance, left)
            kept = telling_points(q, tolerance, through)
            q, through = even_points(q[kept], units, through[kept], left)
        self._corners = CornerPath(q, units, through=through)
        self._ends = AT_REST
        if len(self._corners.points) > 1:
            self._lead(q, through)
        deviation = problem.deviation
        own = not problem.retimer.stops_at_corners
        self._is_smooth = own and problem.limits.jerks is not None
        self._largest = self._corners.largest_sizes(
            None if deviation is None else _ROUNDED * deviation, is_smooth=self._is_smooth
        )
        if averages(problem.limits, problem.rise_time, problem.retimer):
            # The mean of a while around a point is somewhere else, unless it rests there.
            self._largest[self._corners.through] = 0.0
        self._sizes = self._largest.copy()
        if problem.retimer.stops_at_corners:
            self._sizes[:] = 0.0
        self._own: PathPieces | None = None
        self._curve = problem.retimer.curve(self._corners.points, units)

    def _lead(self, q: NDArray[np.float64], through: NDArray[np.bool_]) -> None:
        """Have it begin and end as the problem's motion does."""
        start, end, units = self._problem.start, self._problem.end, self._corners.units
        if start.is_rest and end.is_rest:
            return
        edges = self._corners.directions
        first, start_speeds = moving_end(start, edges[0], units, 1.0)
        last, end_speeds = moving_end(end, edges[-1], units, -1.0)
        self._ends = MotionEnds(start_speeds, end_speeds, (start, end))
        self._corners = CornerPath(q, units, through=through, start=first, end=last)

    @property
    def points(self) -> NDArray[np.float64]:
        """Its points ``(m, k)``."""
        return self._corners.points

    @property
    def num_points(self) -> int:
        """How many there are."""
        return len(self._corners.points)

    @property
    def duration_with_rests(self) -> float:
        """The least one with rests at all corners, s; infinite where it follows another curve."""
        problem = self._problem
        if self._curve is not None or problem.rise_time > 0.0 or not self._sizes.any():
            return np.inf
        return duration_with_rests(self._corners.points, problem.limits)

    def sample_sizes(self, turns: Turns) -> None:
        """Round each corner as far as some configurations on it are free, by halves.

        That all are is for a proof to say; most that are not are found so.
        """
        if self._curve is None:
            self._settle(self._collide, turns)

    def prove_sizes(self, turns: Turns) -> bool:
        """Round each corner as far as that is proven free; tell whether any is rounded less."""
        if self._curve is not None:
            return False
        before = self._sizes.copy()
        self._settle(lambda curves: self._are_unproven(curves, turns), turns)
        return bool((self._sizes != before).any())

    def _settle(self, are_bad: Callable[[Array], NDArray[np.bool_]], turns: Turns) -> None:
        """Round corners less until none of their curves is bad, or there is no time."""
        untried = self._sizes.max(axis=1) > 0.0
        while untried.any() and turns.stops.looking[0] == 0:
            pieces = self._pieces()
            tried = np.flatnonzero((pieces.corners >= 0) & untried[pieces.corners])
            bad = are_bad(pieces.control_points(tried, is_smooth=self._is_smooth))
            untried[:] = False
            untried[pieces.corners[tried][bad]] = True
            self._halve(untried)
            untried &= self._sizes.max(axis=1) > 0.0
            turns.pause()
        if untried.any():
            self._sizes[untried] = 0.0
            self._own = None

    def _collide(self, curves: Array) -> NDArray[np.bool_]:
        """Tell which curves by their control points ``(m, d, k)`` have places that collide."""
        places = np.tile(_PLACES, len(curves))
        q = evaluated(np.repeat(curves, len(_PLACES), axis=0), places)
        hits = first_pairs(self._problem.checker.plan, self._problem.whole(q), 1) != NO_PAIR
        result: NDArray[np.bool_] = hits.reshape(len(curves), len(_PLACES)).any(axis=1)
        return result

    def _are_unproven(self, curves: Array, turns: Turns) -> NDArray[np.bool_]:
        """Tell which curves are not proven free."""
        tolerance = _KEPT * self._problem.checker.tolerance
        proofs = self._problem.prove(curves, turns, tolerance=tolerance, may_wait=True)
        result: NDArray[np.bool_] = proofs.statuses != FREE
        return result

    def _pieces(self) -> PathPieces:
        """Return the pieces of the path as it is rounded now."""
        if self._own is None:
            self._own = self._corners.pieces(self._sizes)
        return self._own

    def _halve(self, chosen: NDArray[np.bool_]) -> None:
        """Round some corners half as far, or not at all."""
        if not chosen.any():
            return
        self._sizes[chosen] *= 0.5
        self._sizes[self._sizes < _SMALLEST * self._largest] = 0.0
        self._own = None

    def curve(self) -> tuple[PiecewisePolynomial, MotionEnds]:
        """Return the curve as it is rounded now, and how its motion begins and ends."""
        if self._curve is not None:
            return self._curve, self._ends
        return self._pieces().curve(is_smooth=self._is_smooth), self._ends

    def shrink(self, places: NDArray[np.float64]) -> bool:
        """Round the corners next to some places on the curve less; tell whether there was one."""
        if self._curve is not None or not self._sizes.any():
            return False
        chosen, pieces = np.zeros(len(self._sizes), dtype=np.bool_), self._pieces()
        for s in places:
            chosen[pieces.corner_at(float(s))] = True
        self._halve(chosen)
        return True

    def rest(self) -> bool:
        """Rest at each corner; tell whether that is another path."""
        if self._curve is not None or not self._sizes.any():
            return False
        self._sizes[:] = 0.0
        self._own = None
        return True

    def passed(self) -> NDArray[np.float64]:
        """Return ``(c,)`` how far each corner is rounded; none along a retimer's own curve."""
        return np.empty(0) if self._curve is not None else self._sizes.max(axis=1, initial=0.0)
