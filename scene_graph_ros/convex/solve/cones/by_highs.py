"""Linear programs by HiGHS (Huangfu and Hall, "Parallelizing the dual revised simplex method").

As SciPy has it. Second-order cones of two rows are linear, too: ``|w| <= t``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.solve.cones.solver_choice import check_names
from scene_graph_ros.convex.solve.cones.standard_form import Cone, Reply, StandardForm, Status

__all__ = ["ask_highs"]

_OPTIONS = (
    "method",
    "presolve",
    "maxiter",
    "time_limit",
    "dual_feasibility_tolerance",
    "primal_feasibility_tolerance",
    "ipm_optimality_tolerance",
    "simplex_dual_edge_weight_strategy",
)
"""Those of scipy.optimize.linprog, and which of its methods by HiGHS is taken."""


def ask_highs(
    form: StandardForm,
    options: Mapping[str, Any],
    what: str,
) -> Reply:
    """Solve a program of linear rows and cones of at most two.

    Raises ConvexSetError for larger cones and others, and for options that are none.
    """
    from scipy import sparse

    check_names(options, _OPTIONS, "solver 'highs'")
    A, b, q, _, sizes = form
    balls = sizes[Cone.SECOND_ORDER]
    if any(size > 2 for size in balls) or sizes[Cone.SEMIDEFINITE] or sizes[Cone.EXPONENTIAL]:
        raise ConvexSetError(
            f"{what}: solver 'highs' solves linear programs alone, and this has cones; take"
            " 'clarabel', or norm1 and norm_inf in the place of norm"
        )
    equal, least = form.linear
    # Rows r of each inequality as entries of s: of |s1| <= s0 the sum and the difference.
    rows, columns, signs, at = [*range(least)], [*range(equal, equal + least)], [1.0] * least, 0
    count, at = least, equal + least
    for size in balls:
        for sign in (1.0, -1.0)[:size]:
            rows += [count] * size
            columns += [at + k for k in range(size)]
            signs += [1.0, sign][:size]
            count += 1
        at += size
    T = sparse.csr_matrix((signs, (rows, columns)), shape=(count, len(b)))
    below, sides = (T @ A).tocsr(), T @ b
    even, values = A[:equal].tocsr(), b[:equal]
    found = _linprog(q, below, sides, even, values, options)
    if found.status == 2:
        return _ray(A, b, (below, sides, even, values), T, options)
    if found.status == 3:
        nothing = np.zeros(len(b))
        return Reply(np.zeros(len(q)), nothing, nothing, Status.UNBOUNDED, "unbounded")
    if found.status != 0:
        raise SolverError(f"{what}: solver 'highs' ended without an answer: {found.message}")
    z = -(T.T @ found.ineqlin.marginals)
    z[:equal] = -found.eqlin.marginals
    return Reply(found.x, z, b - A @ found.x, Status.SOLVED, "optimal")


def _linprog(
    q: np.ndarray, below: Any, sides: Any, even: Any, values: Any, options: Mapping[str, Any]
) -> Any:
    from scipy.optimize import linprog

    settings = {name: value for name, value in options.items() if name != "method"}
    return linprog(
        q,
        A_ub=below if below.shape[0] else None,
        b_ub=sides if below.shape[0] else None,
        A_eq=even if even.shape[0] else None,
        b_eq=values if even.shape[0] else None,
        bounds=(None, None),
        method=options.get("method", "highs"),
        options=settings,
    )


def _ray(A: Any, b: np.ndarray, rows: Any, T: Any, options: Mapping[str, Any]) -> Reply:
    """Return weights that show that there is no point: of the least by which rows are broken."""
    from scipy import sparse

    below, sides, even, values = rows
    n, equal = A.shape[1], even.shape[0]
    wide = sparse.vstack([below, even, -even]).tocsr()
    wide = sparse.hstack([wide, -np.ones((wide.shape[0], 1))]).tocsr()
    found = _linprog(
        np.append(np.zeros(n), 1.0),
        wide,
        np.concatenate([sides, values, -values]),
        sparse.csr_matrix((0, n + 1)),
        np.zeros(0),
        options,
    )
    if found.status != 0:
        raise SolverError(
            f"solver 'highs' found no point, and no weights that show it: {found.message}"
        )
    weights = -found.ineqlin.marginals
    count = below.shape[0]
    z = T.T @ weights[:count]
    z[:equal] = weights[count : count + equal] - weights[count + equal :]
    return Reply(np.zeros(n), z, np.zeros(len(b)), Status.INFEASIBLE, "infeasible")
