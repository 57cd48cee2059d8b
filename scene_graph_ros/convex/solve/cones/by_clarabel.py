"""Cone programs by Clarabel, an interior-point method.

Goulart and Chen, "Clarabel: An interior-point solver for conic programs with quadratic
objectives", 2024. The package is imported when the first program is solved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError, StoppedError
from scene_graph_ros.convex.solve.cones.solver_choice import check_names
from scene_graph_ros.convex.solve.cones.standard_form import Cone, Reply, StandardForm, Status
from scene_graph_ros.missing_package import not_installed

__all__ = ["ask_clarabel"]

_MOST_ITERATIONS = 200

_STATUS = {
    "Solved": Status.SOLVED,
    "PrimalInfeasible": Status.INFEASIBLE,
    "AlmostPrimalInfeasible": Status.INFEASIBLE,
    "DualInfeasible": Status.UNBOUNDED,
    "AlmostDualInfeasible": Status.UNBOUNDED,
}


class _Stops:
    """Asks at each iteration whether to stop; an error in that is raised when it has."""

    def __init__(self, is_over: Callable[[], bool] | None) -> None:
        self._is_over, self._has_stopped = is_over, False
        self._error: BaseException | None = None

    def __call__(self, info: Any) -> bool:
        assert self._is_over is not None
        try:
            self._has_stopped = bool(self._is_over())
        except BaseException as error:  # noqa: BLE001 - raised again when the solver ended
            self._error, self._has_stopped = error, True
        return self._has_stopped

    def look(self, what: str) -> None:
        """Raise what came up, or StoppedError."""
        if self._error is not None:
            raise self._error
        if self._has_stopped:
            raise StoppedError(f"{what}: it was ended before it was solved")


def ask_clarabel(
    form: StandardForm,
    tolerance: float,
    options: Mapping[str, Any],
    what: str,
    is_over: Callable[[], bool] | None = None,
) -> Reply:
    """Solve a program to a tolerance, relative and absolute.

    Raises ConvexSetError for options that are none, SolverError where the solver fails, and
    StoppedError where ``is_over``, which is asked at each iteration, says so.
    """
    from scipy import sparse

    try:
        import clarabel
    except ImportError:
        lack = not_installed(f"{what}: a program over cones", "clarabel")
        raise SolverError(lack) from None
    counts, sizes = form.counts, form.sizes
    cones = [clarabel.ZeroConeT(counts[Cone.ZERO])] if counts[Cone.ZERO] else []
    if counts[Cone.NONNEGATIVE]:
        cones.append(clarabel.NonnegativeConeT(counts[Cone.NONNEGATIVE]))
    cones += [clarabel.SecondOrderConeT(size) for size in sizes[Cone.SECOND_ORDER]]
    cones += [clarabel.PSDTriangleConeT(order) for order in form.orders]
    cones += [clarabel.ExponentialConeT() for _ in sizes[Cone.EXPONENTIAL]]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _MOST_ITERATIONS
    settings.max_threads = 1
    settings.presolve_enable = False
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        setattr(settings, name, tolerance)
    if options:
        check_names(options, [n for n in dir(settings) if n[0] != "_"], "solver 'clarabel'")
    try:
        for name, value in options.items():
            setattr(settings, name, value)
    except (TypeError, ValueError) as error:
        raise ConvexSetError(f"solver 'clarabel': option {name!r}: {error}") from error
    n = len(form.q)
    try:
        P = sparse.csc_matrix((n, n))
        solver = clarabel.DefaultSolver(P, form.q, form.A, form.b, cones, settings)
        stops = _Stops(is_over)
        if is_over is not None:
            solver.set_termination_callback(stops)
        found = solver.solve()
    except BaseException as error:
        # A panic of the solver's own language is no Exception; it must not end the process.
        if isinstance(error, (KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError)):
            raise
        raise SolverError(f"{what}: the solver failed: {error}") from error
    stops.look(what)
    x, z, s = (np.asarray(each) for each in (found.x, found.z, found.s))
    word = str(found.status)
    return Reply(x, z, s, _STATUS.get(word, Status.UNSURE), word)
