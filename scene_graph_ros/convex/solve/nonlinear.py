"""Programs that need not be convex, solved nearby: SciPy's sequential least squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

__all__ = ["Differentiable", "minimize_nonlinear"]

Differentiable = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Returns values ``(m,)`` and slopes ``(m, n)`` at a point ``(n,)``."""

_MOST_ITERATIONS = 100

_TOLERANCE = 1e-10
"""Of the cost, which comes scaled to a size of 1."""

_JUST_KEPT = 1e-6
"""What is to be 0 is no more than this off it, and what is within it of 0 may push."""

_STATIONARY = 1e-5
"""Of the cost's slope: what may be left of it."""


def minimize_nonlinear(
    cost: Callable[[np.ndarray], tuple[float, np.ndarray]],
    start: np.ndarray,
    equal: Sequence[Differentiable],
    least: Sequence[Differentiable],
) -> tuple[np.ndarray, bool]:
    """Return a point ``(n,)`` near which no allowed one costs less, and whether it is one.

    ``equal`` are to be 0 and ``least`` at least 0; nothing is said of whether they are. ``cost``
    returns its gradient ``(n,)``, too. Where the method ended for another reason than success,
    a point is still one if its optimality conditions hold.
    """
    from scipy.optimize import minimize

    if not len(start):
        return start, True
    constraints = [
        {"type": kind, "fun": lambda y, f=f: f(y)[0], "jac": lambda y, f=f: f(y)[1]}
        for kind, functions in (("eq", equal), ("ineq", least))
        for f in functions
    ]
    options = {"maxiter": _MOST_ITERATIONS, "ftol": _TOLERANCE}
    with np.errstate(all="ignore"):
        found = minimize(
            cost, start, jac=True, method="SLSQP", constraints=constraints, options=options
        )
    if not np.isfinite(found.x).all():
        return start, False
    x = np.asarray(found.x)
    return x, bool(found.success) or _is_stationary(cost, x, equal, least)


def _is_stationary(
    cost: Callable[[np.ndarray], tuple[float, np.ndarray]],
    x: np.ndarray,
    equal: Sequence[Differentiable],
    least: Sequence[Differentiable],
) -> bool:
    """Tell whether the cost's slope is a sum of those of equations and of what is just kept.

    With weights that are at least 0 of the latter (Karush, Kuhn and Tucker).
    """
    from scipy.optimize import nnls

    slope = cost(x)[1]
    equations, rows = [f(x) for f in equal], [f(x) for f in least]
    off = [*(np.abs(values) for values, _ in equations), *(-values for values, _ in rows)]
    if not all((each <= _JUST_KEPT).all() for each in off):
        return False
    ties = [slopes for _, slopes in equations]
    active = [slopes[values <= _JUST_KEPT] for values, slopes in rows]
    columns = np.concatenate([np.zeros((0, len(x))), *ties, *(-each for each in ties), *active])
    if not (np.isfinite(columns).all() and np.isfinite(slope).all()):
        return False
    size = float(np.linalg.norm(slope))
    rest = float(nnls(columns.T, slope)[1]) if len(columns) else size
    return rest <= _STATIONARY * max(1.0, size)
