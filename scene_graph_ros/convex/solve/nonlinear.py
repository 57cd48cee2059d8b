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


def minimize_nonlinear(
    cost: Callable[[np.ndarray], tuple[float, np.ndarray]],
    start: np.ndarray,
    equal: Sequence[Differentiable],
    least: Sequence[Differentiable],
) -> tuple[np.ndarray, bool]:
    """Return a point ``(n,)`` near which no allowed one costs less, and whether it converged.

    ``equal`` are to be 0 and ``least`` at least 0; nothing is said of whether they are. ``cost``
    returns its gradient ``(n,)``, too.
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
    return np.asarray(found.x), bool(found.success)
