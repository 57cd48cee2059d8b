"""Cone programs by SCS, a first-order method, which comes with the package scs.

O'Donoghue, Chu, Parikh and Boyd, "Conic optimization via operator splitting and homogeneous
self-dual embedding", 2016.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import SolverError
from scene_graph_ros.convex.solve.cones.by_highs import Reply
from scene_graph_ros.convex.solve.cones.solver_choice import check_names

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

_STATUS = {1: "Solved", 2: "Solved inaccurately", -2: "PrimalInfeasible", -1: "DualInfeasible"}
_STATUS |= {-7: "PrimalInfeasible", -6: "DualInfeasible"}


def ask_scs(
    A: Any,
    b: np.ndarray,
    q: np.ndarray,
    counts: tuple[int, int, int],
    sizes: tuple[Sequence[int], Sequence[int]],
    options: Mapping[str, Any],
    what: str,
) -> Reply:
    """Solve it where cones are ``counts`` of equations, inequalities and exponential ones.

    ``sizes`` are those of balls and of matrices, as rows. Raises ConvexSetError for options that
    are none, SolverError where the solver fails.
    """
    check_names(options, _OPTIONS, "solver 'scs'")
    import scs

    equal, least, powers = counts
    balls, matrices = sizes
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
        "s": [math.isqrt(2 * size) for size in matrices],
        "ep": powers,
    }
    try:
        found = scs.SCS(data, cone, **{**_DEFAULTS, **options}).solve()
    except (ValueError, RuntimeError, TypeError) as error:
        raise SolverError(f"{what}: solver 'scs' failed: {error}") from error
    back = np.argsort(order)
    status = _STATUS.get(found["info"]["status_val"], found["info"]["status"])
    z, s = (np.asarray(found[name])[back] for name in ("y", "s"))
    return Reply(np.asarray(found["x"]), z, s, status)


def _columns_of_lower(order: int) -> np.ndarray:
    """Return the indices of the lower triangle, column after column, in the upper one."""
    place = np.zeros((order, order), dtype=np.int64)
    j, i = np.tril_indices(order)
    place[i, j] = place[j, i] = np.arange(len(i))
    return np.array([place[r, c] for c in range(order) for r in range(c, order)])
