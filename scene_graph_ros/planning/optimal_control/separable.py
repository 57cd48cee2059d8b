"""Derivatives of programs that are sums over steps: made once for a step, and put together."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.program_parts import Block

__all__ = ["SeparableDerivatives"]


class _Entries(NamedTuple):
    """Expressions that are added at rows and columns of a matrix, in this order."""

    values: Any
    """``(count,)``."""
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]


class SeparableDerivatives:
    """Jacobian of g and Hessian of the Lagrangian, of f and g that are blocks and a rest.

    A block is a function of few variables, the same for each step. Its derivatives are those of
    one step, mapped over all; all outside of blocks is differentiated as it is. Found this way
    they are the same, but made sooner than from the whole list of operations, and faster to
    evaluate.
    """

    def __init__(self, x: Any, f: Any, g: Any, blocks: list[Block], values: Any) -> None:
        """Take expressions of ``x`` ``(n,)``, f without the blocks of costs; ``values`` has g."""
        self.ca = get_casadi()
        self.x, self.f, self.g, self.blocks, self.values = x, f, g, blocks, values

    def functions(self) -> dict[str, Any]:
        """Return the functions that IPOPT takes in place of those it would derive."""
        ca = self.ca
        n, m = self.x.shape[0], self.g.shape[0]
        x, p = ca.MX.sym("x", n), ca.MX.sym("p", 0)
        of_f, of_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)
        jacobian = self._assembled(self._jacobian(x), (m, n))
        hessian = self._assembled(self._hessian(x, of_f, of_g), (n, n))
        # grad:f is left to CasADi: it is one sweep over the whole.
        _, g = self.values(x)
        return {
            "jac_g": ca.Function("jac_g", [x, p], [g, jacobian]),
            "hess_lag": ca.Function("hess_lag", [x, p, of_f, of_g], [hessian]),
        }

    def _jacobian(self, x: Any) -> list[_Entries]:
        ca = self.ca
        of_blocks = {row for block in self.blocks for row in block.rows.ravel().tolist()}
        rest = [row for row in range(self.g.shape[0]) if row not in of_blocks]
        found = [self._plain(ca.jacobian(self.g[rest], self.x), [self.x], [x], rest)]
        for block in self.blocks:
            if block.rows.size:
                z = ca.SX.sym("z", block.function.size1_in(0))
                J = ca.jacobian(block.function(z), z)
                found.append(self._mapped(block, J, [z], [x], block.rows, block.columns))
        return found

    def _hessian(self, x: Any, of_f: Any, of_g: Any) -> list[_Entries]:
        ca = self.ca
        lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", self.g.shape[0])
        kept = np.ones(self.g.shape[0])
        for block in self.blocks:
            kept[block.rows.ravel()] = 0.0
        rest = lam_f * self.f + ca.dot(ca.sparsify(ca.DM(kept)) * lam_g, self.g)
        H = ca.triu(ca.hessian(rest, self.x)[0])
        found = [self._plain(H, [self.x, lam_f, lam_g], [x, of_f, of_g])]
        for block in self.blocks:
            z = ca.SX.sym("z", block.function.size1_in(0))
            value = block.function(z)
            lam = ca.SX.sym("lam", value.shape[0])
            H = ca.cse(ca.hessian(ca.dot(lam, value), z)[0])
            given = ca.repmat(of_f, 1, block.count)
            if block.rows.size:
                given = ca.reshape(of_g[block.rows.ravel().tolist()], *block.rows.shape[::-1])
            own = self._mapped(block, H, [z, lam], [x, given], block.columns, block.columns)
            found.append(self._upper(own))
        return found

    def _plain(
        self, matrix: Any, symbols: list[Any], given: list[Any], named: list[int] | None = None
    ) -> _Entries:
        """Return a matrix of the rest; ``named`` are its rows in the whole."""
        rows, columns = matrix.sparsity().get_triplet()
        function = self.ca.Function("rest", symbols, [_column(self.ca, matrix)])
        at = np.array(rows, dtype=np.int64)
        if named is not None:
            at = np.array(named, dtype=np.int64)[at]
        return _Entries(function(*given), at, np.array(columns, dtype=np.int64))

    def _mapped(
        self,
        block: Block,
        matrix: Any,
        symbols: list[Any],
        given: list[Any],
        named_rows: NDArray[np.int64],
        named_columns: NDArray[np.int64],
    ) -> _Entries:
        """Return a matrix of each step; its rows and columns have names for each step."""
        ca = self.ca
        rows, columns = matrix.sparsity().get_triplet()
        function = ca.Function("step", symbols, [_column(ca, matrix)]).map(block.count)
        x, *more = given
        z = ca.reshape(x[block.columns.ravel().tolist()], *block.columns.shape[::-1])
        values = ca.vec(function(z, *more))
        return _Entries(values, named_rows[:, rows].ravel(), named_columns[:, columns].ravel())

    def _upper(self, entries: _Entries) -> _Entries:
        """Return the entries on and above the diagonal."""
        kept = np.flatnonzero(entries.rows <= entries.columns)
        return _Entries(entries.values[kept.tolist()], entries.rows[kept], entries.columns[kept])

    def _assembled(self, parts: list[_Entries], shape: tuple[int, int]) -> Any:
        """Return the sparse matrix in which entries at one place are added."""
        ca = self.ca
        rows = np.concatenate([part.rows for part in parts])
        columns = np.concatenate([part.columns for part in parts])
        places, which = np.unique(columns * shape[0] + rows, return_inverse=True)
        pattern = ca.Sparsity.triplet(
            *shape, (places % shape[0]).tolist(), (places // shape[0]).tolist()
        )
        count = len(rows)
        if not count:
            return ca.MX(*shape)
        sums = ca.DM.triplet(
            which.tolist(), list(range(count)), ca.DM.ones(count), len(places), count
        )
        return ca.MX(pattern, ca.mtimes(sums, ca.vertcat(*(part.values for part in parts))))


def _column(ca: Any, matrix: Any) -> Any:
    """Return the entries of a sparse matrix, column by column."""
    return ca.densify(ca.vertcat(ca.SX(0, 1), *matrix.nonzeros()))
