"""The best curve in time under bounds of its derivatives, clear of obstacles, and proven."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import pair_words
from scene_graph_ros.planning.edges.edge_measure import EdgeMeasure, EdgeStatus
from scene_graph_ros.planning.optimal_control.arguments import (
    as_count,
    as_nonnegative,
    as_positive,
)
from scene_graph_ros.planning.optimal_control.clearance_function import clearance_function
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.kinematic_bounds import (
    largest_excess,
    stretch_to_hold,
)
from scene_graph_ros.planning.optimal_control.kinematic_curve import KinematicCurve
from scene_graph_ros.planning.optimal_control.kinematic_result import KinematicTrajectoryResult
from scene_graph_ros.planning.optimal_control.numpy_function import NumpyFunction
from scene_graph_ros.planning.optimal_control.program_result import ProgramResult
from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.trajectories.bspline_trajectory import BsplineTrajectory

__all__ = ["KinematicTrajectoryOptimization"]

_EXCESS = 1e-9
"""Of a bound: what a result may be beyond."""


_WIDEST = 0.05
"""Of s: how far from a place that collides its neighbours are, at most."""

_LOOSER = SolverOptions(tolerance=1e-6, max_iterations=300)
"""With clearance, whose second derivatives are approximated: the last digits take long."""


_BEGINS_NEAR = SolverOptions(ipopt={"mu_init": 1e-2})
"""A line that may be too fast is near enough for a small barrier: a quarter of the iterations."""


class _Clear(NamedTuple):
    """A checker whose pairs are to keep a distance."""

    checker: SceneGraphCollisionChecker
    function: NumpyFunction
    least: float
    spacing: float
    """Of s: how far from a place that collides its neighbours are held, too."""


@one_line("num_positions", "num_control_points")
class KinematicTrajectoryOptimization(KinematicCurve):
    """Finds q(t) = r(t / T) of least cost, with a B-spline r over [0, 1] and a duration T.

    Its derivatives' bounds hold at all times, as control points keep them; that is measured again
    on the result. Clearance is held at places, and the whole curve is then proven free. Where it
    is not, the place that shows it is added, and the search goes on from there.
    """

    def __init__(
        self,
        num_positions: int | BsplineTrajectory,
        num_control_points: int | None = None,
        spline_order: int = 4,
        duration: float = 1.0,
    ) -> None:
        super().__init__(num_positions, num_control_points, spline_order, duration)
        self._clear: list[_Clear] = []

    def add_clearance_constraint(
        self,
        checker: SceneGraphCollisionChecker,
        minimum_clearance: float = 0.0,
        *,
        influence_distance: float | None = None,
        num_samples: int = 10,
    ) -> None:
        """Have a checker's robots keep ``minimum_clearance``, m, beyond padding from all else.

        It is held at ``num_samples`` places from start to goal, with exact derivatives, by a soft
        minimum of all pairs within ``influence_distance`` (default: 5 cm beyond the clearance).
        Second derivatives are then approximated, as distances have none.
        Raises TrajectoryOptimizationError for a checker of another number of positions.
        """
        if not isinstance(checker, SceneGraphCollisionChecker):
            raise TrajectoryOptimizationError(
                f"checker must be a SceneGraphCollisionChecker, not {quoted(checker)}"
            )
        count = checker.model.tree.num_positions
        if count != self.num_positions():
            raise TrajectoryOptimizationError(
                f"the checker's robots have {count} positions, the trajectory has"
                f" {self.num_positions()}"
            )
        least = as_nonnegative("minimum_clearance", minimum_clearance)
        reach = least + 0.05 if influence_distance is None else influence_distance
        reach = as_positive("influence_distance", reach)
        if reach <= least:
            raise TrajectoryOptimizationError(
                f"influence_distance = {reach} must be above minimum_clearance = {least}"
            )
        function = clearance_function(checker, reach, reach - least)
        places = np.linspace(0.0, 1.0, as_count("num_samples", num_samples, 2))
        clear = _Clear(checker, function, least, min(0.25 * float(places[1]), _WIDEST))
        self._clear.append(clear)
        self._prog.raise_error.append(function.raise_error)
        self._prog.has_second_derivatives = False
        for s in places:
            self._hold(clear, float(s))

    def _hold(self, clear: _Clear, s: float) -> None:
        distance = clear.function.function(self._at(s, 0))
        self._prog.add_constraint(distance, clear.least, np.inf, label=f"clearance, s = {s:.4g}")

    def solve(
        self,
        options: SolverOptions | None = None,
        *,
        warm_start: KinematicTrajectoryResult | None = None,
        max_rounds: int = 8,
        timeout: float | None = None,
        watch: Callable[[], object] | None = None,
    ) -> KinematicTrajectoryResult:
        """Return the best curve that is found from the guess, or from an earlier result.

        With clearance it is solved up to ``max_rounds`` times, until the curve is proven free, by
        default to a tolerance of 1e-6. ``warm_start`` is for the first. After ``timeout`` (s) the
        best curve by then is proven and returned, with the reason; ``watch`` is called now and
        then and may raise.
        Raises TrajectoryOptimizationError where something is no number at the guess.
        """
        rounds = as_count("max_rounds", max_rounds, 1)
        deadline = Deadline.of(timeout, watch, TrajectoryOptimizationError)
        if options is None:
            options = _LOOSER if self._clear else _BEGINS_NEAR
        before = None if warm_start is None else warm_start.program_result
        for k in range(1, rounds + 1):
            found = self._prog.solve(
                options, warm_start=before, timeout=deadline.left, watch=deadline.look
            )
            result = self.result_of(found, k)
            places = self._places(result)
            is_last = k == rounds or deadline.is_over()
            if not result.program_result.is_success or not places or is_last:
                break
            for clear, s in places:
                for near in (s - clear.spacing, s, s + clear.spacing):
                    self._hold(clear, min(max(near, 0.0), 1.0))
            # From the guess again: what collides may be on the wrong side of all it meets.
            before = None
        return result

    def result_of(self, found: ProgramResult, rounds: int = 1) -> KinematicTrajectoryResult:
        """Return the curve's result from a solution of the program."""
        curve = self.reconstruct_trajectory(found)
        excess, bound = largest_excess(self._bounds, curve)
        measures = tuple(
            measure
            for clear in self._clear
            for measure in clear.checker.measure_edges(curve.piecewise_polynomial().control_points)
        )
        found = self._with_times(found, curve)
        more = sum(float(found.value(each).item()) for each in self._rounded_off)
        found = replace(found, cost=found.cost + more)
        reason = found.reason
        if not reason and excess > _EXCESS and bound is not None:
            reason = f"the {bound.label} is beyond its bounds by {excess:.3g} of them"
        if not reason:
            reason = self._collision(measures, curve)
        return KinematicTrajectoryResult(
            found, not reason, reason, curve, excess, measures, rounds
        )

    def _with_times(self, found: ProgramResult, curve: BsplineTrajectory) -> ProgramResult:
        """Return a result that says when bounds of derivatives are violated, by control points."""
        orders = {bound.label: bound.order for bound in self._bounds}
        violations = tuple(
            replace(each, time=float(curve.derivative(orders[each.label]).centers[each.knots[0]]))
            if each.knots and each.label in orders
            else each
            for each in found.violations
        )
        reason = found.reason
        if reason and violations:
            reason = f"{found.status.value}; {violations[0]}"
        return replace(found, violations=violations, reason=reason)

    def reconstruct_trajectory(self, result: Any) -> BsplineTrajectory:
        """Return q(t) over [0, T] of a result.

        It is slower than the program's by at most 1e-5, where bounds of derivatives are otherwise
        exceeded by the solver's rounding.
        """
        found = result.program_result if hasattr(result, "program_result") else result
        points = found.value(self.control_points())
        T = float(found.value(self._T)[0, 0])
        curve = BsplineTrajectory(self._basis.knots * T, points)
        longest = min(
            (float(c.upper.min()) for c in self._prog.constraints if c.label == "duration"),
            default=np.inf,
        )
        return stretch_to_hold(self._bounds, curve, longest)

    def _places(self, result: KinematicTrajectoryResult) -> list[tuple[_Clear, float]]:
        """Return the conditions and times, from 0 to 1, at which a curve is not proven free."""
        breaks = result.trajectory.piecewise_polynomial().breaks / result.trajectory.duration
        count = len(breaks) - 1
        found = []
        for k, measure in enumerate(result.measures):
            if not measure.completely_free and measure.at is not None:
                low, high = breaks[k % count], breaks[k % count + 1]
                found.append((self._clear[k // count], float(low + measure.at * (high - low))))
        return found

    def _collision(self, measures: tuple[EdgeMeasure, ...], curve: BsplineTrajectory) -> str:
        """Return the obstacle of the first polynomial that isn't proven free; empty if none."""
        breaks = curve.piecewise_polynomial().breaks
        count = len(breaks) - 1
        for k, measure in enumerate(measures):
            if not measure.completely_free:
                word = "collides" if measure.status is EdgeStatus.COLLIDES else "is too near"
                checker = self._clear[k // count].checker
                pair = "" if measure.pair is None else f": {pair_words(checker, measure.pair)}"
                low, high = breaks[k % count], breaks[k % count + 1]
                t = low + (0.0 if measure.at is None else measure.at) * (high - low)
                return f"the curve {word} at t = {t:.6g} s{pair}"
        return ""
