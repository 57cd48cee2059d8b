"""A nonlinear program as IPOPT is given it: bounds of variables, rows, derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.program_parts import Block, ProgramParts
from scene_graph_ros.planning.optimal_control.separable import SeparableDerivatives

__all__ = ["ProgramForIpopt"]

_MOST_EXPANDED = 200_000
"""Operations of a program that is written out as one list of scalar ones, which runs faster."""


class ProgramForIpopt:
    """Cost f and rows g of a program, written out as scalar operations where they can be.

    Then rows that are one variable are its bounds, and no rows for IPOPT.
    """

    def __init__(self, program: ProgramParts) -> None:
        ca = self._ca = get_casadi()
        self.lower = np.concatenate([np.zeros(0), *(c.lower for c in program.constraints)])
        self.upper = np.concatenate([np.zeros(0), *(c.upper for c in program.constraints)])
        x = ca.vertcat(*program.variables)
        rows = [constraint.expression for constraint in program.constraints]
        g = ca.vertcat(*rows) if rows else ca.MX.zeros(0, 1)
        rest = sum(program.costs, ca.MX(0))
        f = sum(program.block_costs, rest)
        self.values = ca.Function("values", [x], [f, g])
        """Of all variables: f, and g with all rows."""
        self.problem: dict[str, Any] = {"x": x, "f": f, "g": g}
        self.options: dict[str, Any] = {"detect_simple_bounds": True}
        self.rows = np.arange(len(self.lower))
        """``(m,)``: rows of g that IPOPT is given."""
        self.least = np.full(program.num_variables, -np.inf)
        self.most = np.full(program.num_variables, np.inf)
        if not program.has_second_derivatives:
            return
        try:
            expanded = ca.Function("values", [x], [f, g, rest]).expand()
        except RuntimeError:  # a function of somebody's own: CasADi calls it as it is
            return
        if expanded.n_instructions() <= _MOST_EXPANDED:
            self._write_out(program, expanded)

    def _write_out(self, program: ProgramParts, expanded: Any) -> None:
        ca = self._ca
        x = ca.SX.sym("x", program.num_variables)
        f, g, rest = expanded(x)
        self.values = ca.Function("values", [x], [f, g])
        of_blocks = np.zeros(len(self.lower), dtype=bool)
        for block in program.blocks:
            of_blocks[block.rows.ravel()] = True
        self._bound_variables(x, g, of_blocks)
        g = g[self.rows.tolist()]
        self.problem, self.options = {"x": x, "f": f, "g": g}, {}
        if program.blocks:
            place = np.full(len(self.lower), -1)
            place[self.rows] = np.arange(len(self.rows))
            blocks = [Block(b.function, b.columns, place[b.rows]) for b in program.blocks]
            values = ca.Function("values", [x], [f, g])
            self.options = SeparableDerivatives(x, rest, g, blocks, values).functions()

    def _bound_variables(self, x: Any, g: Any, of_blocks: NDArray[np.bool_]) -> None:
        """Make bounds of the rows that are one variable, but for those that leave it no room."""
        places = {symbol.__hash__(): k for k, symbol in enumerate(x.nonzeros())}
        kept = []
        for row, entry in enumerate(self._ca.densify(g).nonzeros()):
            k = places.get(entry.__hash__())
            if k is not None and not of_blocks[row]:
                low, high = max(self.least[k], self.lower[row]), min(self.most[k], self.upper[row])
                if low <= high:
                    self.least[k], self.most[k] = low, high
                    continue
            kept.append(row)
        self.rows = np.array(kept, dtype=np.int64)

    def arguments(self) -> dict[str, Any]:
        """Return bounds, as IPOPT is given them."""
        return {
            "lbx": self.least,
            "ubx": self.most,
            "lbg": self.lower[self.rows],
            "ubg": self.upper[self.rows],
        }

    def multipliers(self, found: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return those of the variables' bounds ``(n,)``, and of all rows."""
        of_g = np.zeros(len(self.lower))
        of_g[self.rows] = np.array(found["lam_g"]).ravel()
        return np.array(found["lam_x"]).ravel(), of_g

    def beyond(self, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the excess of all rows over their bounds; infinite where one is no number."""
        excess = np.maximum(self.lower - rows, rows - self.upper)
        return np.where(np.isnan(rows), np.inf, np.maximum(excess, 0.0))

    def largest_beyond(self, x: NDArray[np.float64], g: NDArray[np.float64]) -> float:
        """Return a point's largest excess over a bound, of its rows ``(m,)`` that IPOPT has."""
        if self.options.get("detect_simple_bounds"):
            return float(self.beyond(self.values(x)[1].full().ravel()).max(initial=0.0))
        lower, upper = self.lower[self.rows], self.upper[self.rows]
        excess = np.concatenate([lower - g, g - upper, self.least - x, x - self.most])
        return np.inf if np.isnan(excess).any() else float(excess.max(initial=0.0))
