"""Constraints of a nonlinear program as conditions on configurations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.program_parts import ProgramParts
from scene_graph_ros.planning.regions.errors import RegionError

__all__ = ["ProgramConstraints"]


class ProgramConstraints:
    """Values ``(n, k)`` of a program's constraints, at most 0, at configurations ``(n, nq)``.

    Costs do not count. Raises RegionError for an object that is no program, has no constraints, or
    has one that holds on a set without volume.
    """

    def __init__(self, program: Any) -> None:
        name = "prog_with_additional_constraints"
        if not isinstance(program, ProgramParts):
            raise RegionError(f"{name} must be a NonlinearProgram, not {quoted(program)}")
        self.program: ProgramParts | None = program
        ca, rows = get_casadi(), []
        for each in program.constraints:
            if (each.lower == each.upper).any():
                raise RegionError(
                    f"{name}: {each.label!r} is an equation, which no region of configurations"
                    " keeps: give it bounds that differ"
                )
            for sign, bound in ((1.0, each.upper), (-1.0, each.lower)):
                finite = np.flatnonzero(np.isfinite(bound)).tolist()
                rows += [sign * (each.expression[k] - float(bound[k])) for k in finite]
        if not rows:
            raise RegionError(f"{name} has no constraints")
        stacked = ca.vertcat(*program.variables)
        self._count = int(program.num_variables)
        self._function = ca.Function("violations", [stacked], [ca.vertcat(*rows)])

    def __call__(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the values that must be at most 0."""
        if q.shape[1] != self._count:
            raise RegionError(
                f"prog_with_additional_constraints has {self._count} variables, and configurations"
                f" have {q.shape[1]} positions"
            )
        found = self._function.map(len(q))(q.T) if len(q) > 1 else self._function(q.T)
        result: NDArray[np.float64] = np.array(found.full().T)
        return result

    def __getstate__(self) -> dict[str, Any]:
        """Return the state for a worker: the function, without the program."""
        return {**self.__dict__, "program": None}
