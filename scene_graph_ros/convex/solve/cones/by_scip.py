"""Mixed-integer programs over rows and second-order cones by SCIP, of the package pyscipopt.

Bolusani et al., "The SCIP Optimization Suite 9.0", 2024.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.solve.cones.standard_form import Cone, StandardForm

__all__ = ["MixedReply", "ask_scip"]


class MixedReply(NamedTuple):
    """A solution, or SCIP's status without one, and its lower bound of all solutions."""

    x: np.ndarray | None
    bound: float


def ask_scip(
    form: StandardForm,
    binary: np.ndarray,
    options: Mapping[str, Any],
    what: str,
) -> MixedReply:
    """Solve a program of linear rows and second-order cones, with ``binary (k,)`` in {0, 1}.

    Raises ConvexSetError for options that are none, SolverError where SCIP ends without an answer.
    """
    from pyscipopt import Model, quicksum

    model = Model()
    model.hideOutput()
    # Of short lengths |w|^2 <= t^2 says little unless it is kept well.
    model.setParam("limits/gap", 1e-9)
    model.setParam("numerics/feastol", 1e-9)
    for name, value in options.items():
        try:
            model.setParam(name, value)
        except (KeyError, ValueError, TypeError, LookupError) as error:
            raise ConvexSetError(f"solver 'scip': option {name!r}: {error}") from error
    q = form.q
    is_binary = np.zeros(len(q), dtype=bool)
    is_binary[binary] = True
    x = [model.addVar(vtype="B") if each else model.addVar(lb=None) for each in is_binary]
    is_possible = _add_rows(model, form, x)
    if not is_possible:
        return MixedReply(None, np.inf)
    model.setObjective(quicksum(float(v) * each for v, each in zip(q, x, strict=True) if v))
    try:
        model.optimize()
    except Exception as error:
        raise SolverError(f"{what}: solver 'scip' failed: {error}") from error
    status = model.getStatus()
    if status == "infeasible":
        return MixedReply(None, np.inf)
    if not model.getNSols():
        raise SolverError(f"{what}: solver 'scip' ended without a solution: {status}")
    values = np.array([model.getVal(each) for each in x])
    return MixedReply(values, float(model.getDualbound()))


def _add_rows(model: Any, form: StandardForm, x: Sequence[Any]) -> bool:
    """Ask that ``b - A x`` is in the cones; False where a row without variables contradicts."""
    from pyscipopt import quicksum

    A, b = form.A.tocsr(), form.b

    def row(k: int) -> Any:
        entries = range(A.indptr[k], A.indptr[k + 1])
        terms = (-float(A.data[e]) * x[A.indices[e]] for e in entries)
        return quicksum(terms) + float(b[k])

    equal, least = form.linear
    for k in range(equal + least):
        if A.indptr[k] == A.indptr[k + 1]:
            if b[k] < 0.0 or (b[k] > 0.0 and k < equal):
                return False
            continue
        model.addCons(row(k) == 0.0 if k < equal else row(k) >= 0.0)
    at = equal + least
    for size in form.sizes[Cone.SECOND_ORDER]:
        parts = [model.addVar(lb=0.0), *(model.addVar(lb=None) for _ in range(size - 1))]
        for k, part in enumerate(parts):
            model.addCons(row(at + k) - part == 0.0)
        model.addCons(quicksum(p * p for p in parts[1:]) - parts[0] * parts[0] <= 0.0)
        at += size
    return True
