"""Cone programs by SCS, a first-order method, which comes with the package scs.

O'Donoghue, Chu, Parikh and Boyd, "Conic optimization via operator splitting and homogeneous
self-dual embedding", 2016.
"""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.solver_choice import check_names
from scene_graph_ros.convex.solve.cones.standard_form import Cone, Reply, StandardForm, Status

__all__ = ["ask_scs"]

_OPTIONS = (
    "acceleration_interval",
    "acceleration_lookback",
    "adaptive_scale",
    "alpha",
    "eps_abs",
    "eps_infeas",
    "eps_rel",
    "max_iters",
    "normalize",
    "rho_x",
    "scale",
    "time_limit_secs",
    "use_indirect",
    "verbose",
)

_DEFAULTS = {"verbose": False, "eps_abs": 1e-10, "eps_rel": 1e-10, "max_iters": 200_000}

_STATUS = {
    1: Status.SOLVED,
    -1: Status.UNBOUNDED,
    -2: Status.INFEASIBLE,
    -6: Status.UNBOUNDED,
    -7: Status.INFEASIBLE,
}
"""By the numbers that SCS gives them; -6 and -7 are found inaccurately."""


def ask_scs(
    form: StandardForm,
    options: Mapping[str, Any],
    what: str,
) -> Reply:
    """Solve a program. Raises ConvexSetError for options that are none.

    Raises SolverError where the solver fails.
    """
    check_names(options, _OPTIONS, "solver 'scs'")
    import scs

    A, b, q, _, sizes = form
    equal, least = form.linear
    balls, matrices = sizes[Cone.SECOND_ORDER], sizes[Cone.SEMIDEFINITE]
    first = equal + least + sum(balls)
    order = np.arange(len(b))
    for size in matrices:
        order[first : first + size] = first + _columns_of_lower(math.isqrt(2 * size))
        first += size
    data = {"A": A[order].tocsc(), "b": b[order], "c": q}
    cone = {
        "z": equal,
        "l": least,
        "q": list(balls),
        "s": form.orders,
        "ep": len(sizes[Cone.EXPONENTIAL]),
    }
    try:
        found = scs.SCS(data, cone, **{**_DEFAULTS, **options}).solve()
    except (ValueError, RuntimeError, TypeError) as error:
        raise SolverError(f"{what}: solver 'scs' failed: {error}") from error
    back = np.argsort(order)
    info = found["info"]
    status = _STATUS.get(info["status_val"], Status.UNSURE)
    z, s = (np.asarray(found[name])[back] for name in ("y", "s"))
    return Reply(np.asarray(found["x"]), z, s, status, str(info["status"]))


def _columns_of_lower(order: int) -> np.ndarray:
    """Return the indices of the lower triangle, column after column, in the upper one."""
    place = np.zeros((order, order), dtype=np.int64)
    j, i = np.tril_indices(order)
    place[i, j] = place[j, i] = np.arange(len(i))
    return np.array([place[r, c] for c in range(order) for r in range(c, order)])
