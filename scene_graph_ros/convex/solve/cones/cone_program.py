"""Sparse programs over cones, and the wall behind which they are solved.

The solver is Clarabel, unless another is chosen (Goulart and Chen, "Clarabel: An interior-point
solver for conic programs with quadratic objectives", 2024), an interior-point method without a
licence; it is imported when the first program is solved. Its word is no answer: points are checked
by the caller, and bounds are computed from its multipliers alone, for any values.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import enum
import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.solve.cones.by_highs import ask_highs
from scene_graph_ros.convex.solve.cones.by_scip import ask_scip, MixedReply
from scene_graph_ros.convex.solve.cones.by_scs import ask_scs
from scene_graph_ros.convex.solve.cones.solver_choice import check_names, SolverChoice
from scene_graph_ros.convex.solve.linear_algebra.sparse_kernels import compress_columns, products

__all__ = ["Cone", "ConeProgram", "ConeSolution", "Rows"]

_TOLERANCES = (1e-10, 1e-8, 1e-6)
"""What the solver is asked for in turn, relative and absolute: programs come scaled to a size of
1. It may lose its way where more is asked than rounding allows."""

_ACCEPTED = 1e-5
"""Largest residual of a solution that is passed on."""

_ACCEPTED_ROUGH = 1e-3
"""The same of programs whose solutions only suggest what to look at, and whose bounds are computed
from the multipliers, whatever they are."""

_TRUSTED_ROUGH = 1e-8
"""The largest residual of such a program that is not solved again with refined steps: refining
them takes as long as finding them. What the solver says of its solution does not matter here."""

_UNREFINED = SolverChoice("clarabel", {"iterative_refinement_enable": False})

_CAREFUL = SolverChoice("clarabel", {"equilibrate_enable": False, "max_step_fraction": 0.9})
"""Where it lost its way: steps end further from the border, exponential cones' above all."""

_MOST_ITERATIONS = 200


class Cone(enum.IntEnum):
    """The cone of a program's rows."""

    ZERO = 0
    NONNEGATIVE = 1
    SECOND_ORDER = 2
    """The first row is no shorter than all the others together."""
    SEMIDEFINITE = 3
    """The upper triangle of a symmetric matrix without negative eigenvalues, column after column,
    what is beside the diagonal times the root of 2."""
    EXPONENTIAL = 4
    """Three rows (u, v, w) with ``v exp(u / v) <= w`` and v > 0, and limits of such."""


class Rows(NamedTuple):
    """Some rows of a program: which of their cone's."""

    cone: Cone
    first: int
    size: int


@dataclass(frozen=True)
class ConeSolution:
    """An optimum, or a proof in floats that there is none.

    ``is_feasible`` is False for the latter: the multipliers then are such that no x has
    ``-sum of multipliers times rows`` at most 0. ``x (n,)``. ``residual`` is the largest of
    those of equations, cones, stationarity and the gap.
    """

    is_feasible: bool
    x: np.ndarray
    duals: tuple[np.ndarray, ...]
    residual: float

    def dual(self, rows: Rows) -> np.ndarray:
        """Return multipliers z ``(size,)``: the cost less ``z . rows`` has its least value at x.

        They are in the dual of the rows' cone to rounding of the solver.
        """
        return self.duals[rows.cone][rows.first : rows.first + rows.size]


class ConeProgram:
    """Minimize ``cost . x`` where blocks of affine rows are in cones."""

    def __init__(self) -> None:
        self._size = 0
        self._costs: list[tuple[np.ndarray, np.ndarray]] = []
        # Row indices, columns, values and constants of each cone's rows.
        self._entries: dict[Cone, list[tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
            cone: [] for cone in Cone
        }
        self._constants: dict[Cone, list[np.ndarray]] = {cone: [] for cone in Cone}
        self._counts = dict.fromkeys(Cone, 0)
        # How many rows each of the other cones has.
        self._sizes: dict[Cone, list[int]] = {cone: [] for cone in Cone if cone > Cone.NONNEGATIVE}

    def variables(self, count: int) -> np.ndarray:
        """Return the indices ``(count,)`` of new variables."""
        self._size += count
        return np.arange(self._size - count, self._size)

    def add_cost(self, columns: np.ndarray, values: np.ndarray) -> None:
        """Add ``values . x[columns]`` to the cost."""
        self._costs.append((columns, values))

    def bound_cost(self, most: float) -> None:
        """Ask that the cost is at most a number, and forget it as a cost."""
        entries = [(np.zeros(len(c), dtype=np.int64), c, -v) for c, v in self._costs]
        self.add_entries(Cone.NONNEGATIVE, entries, np.array([most]))
        self._costs.clear()

    def add_rows(
        self,
        cone: Cone,
        blocks: Sequence[tuple[np.ndarray, np.ndarray]],
        constant: np.ndarray,
    ) -> Rows:
        """Ask that ``sum of matrix @ x[columns] + constant`` is in a cone.

        ``blocks`` are columns ``(k,)`` and matrices ``(m, k)``; ``constant (m,)``.
        """
        entries = []
        for columns, matrix in blocks:
            i, j = np.nonzero(matrix)
            entries.append((i, columns[j], matrix[i, j]))
        return self.add_entries(cone, entries, constant)

    def add_entries(
        self,
        cone: Cone,
        entries: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
        constant: np.ndarray,
        sizes: Sequence[int] | None = None,
    ) -> Rows:
        """Ask for the same of rows given by entries: their rows, columns and values, ``(k,)``.

        They are in cones behind one another of so many rows, by default in one.
        """
        first, count = self._counts[cone], len(constant)
        if not count:
            return Rows(cone, first, 0)
        for i, columns, values in entries:
            self._entries[cone].append((i + first, columns, values))
        self._constants[cone].append(constant)
        self._counts[cone] += count
        if cone in self._sizes:
            self._sizes[cone] += [count] if sizes is None else sizes
        return Rows(cone, first, count)

    @property
    def num_variables(self) -> int:
        """How many variables there are."""
        return self._size

    @property
    def num_equations(self) -> int:
        """How many rows have to be zero: the first ones."""
        return self._counts[Cone.ZERO]

    def cost_of(self, x: np.ndarray) -> float:
        """Return the cost at a point ``(n,)``."""
        return sum(float(values @ x[columns]) for columns, values in self._costs)

    def matrices(self) -> tuple[Any, np.ndarray, np.ndarray]:
        """Return A, b and q of ``min q x`` with ``b - A x`` in the cones, these in order."""
        from scipy import sparse

        offsets = np.cumsum([0, *(self._counts[cone] for cone in Cone)])
        none = np.zeros(0, dtype=np.int64)
        entries = [(none, none, np.zeros(0))]  # a program may have no rows
        first: list[np.ndarray] = [none]
        for cone, offset in zip(Cone, offsets[:-1], strict=True):
            if self._entries[cone]:
                entries += self._entries[cone]
                first.append(np.concatenate([i for i, _, _ in self._entries[cone]]) + offset)
        shape = (int(offsets[-1]), self._size)
        i = np.concatenate(first)
        j, v = (np.concatenate([e[k] for e in entries]) for k in (1, 2))
        # Entries of one place add up, as columns may come several times.
        A = sparse.csc_matrix(compress_columns(i, j, -v, *shape), shape)
        b = np.concatenate([np.zeros(0), *(c for cone in Cone for c in self._constants[cone])])
        q = np.zeros(self._size)
        for columns, values in self._costs:
            np.add.at(q, columns, values)
        return A, b, q

    def solve(
        self,
        what: str,
        *,
        is_rough: bool = False,
        by: SolverChoice | None = None,
        tolerance: float = _TOLERANCES[0],
    ) -> ConeSolution:
        """Return the optimum, or that there is none, by the solver that is chosen.

        Raises SolverError, which names ``what`` was asked for, where neither was found;
        ``is_rough`` accepts larger residuals, and is asked for ``tolerance`` first, relative and
        absolute. Raises ConvexSetError for programs that the chosen solver does not solve, and for
        options that it has not.
        """
        A, b, q = self.matrices()
        offsets = np.cumsum([0, *(self._counts[cone] for cone in Cone)])
        best: tuple[float, Any] = (np.inf, None)
        found: Any = None
        accepted = max(_ACCEPTED, _ACCEPTED_ROUGH) if is_rough else _ACCEPTED
        ways = [(tolerance, by) for tolerance in _tolerances(by)]
        if is_rough and by is None:
            ways.insert(0, (tolerance, _UNREFINED))
        if by is None:
            ways.append((tolerance, _CAREFUL))
        for asked, way in ways:
            if way is _CAREFUL and (best[0] <= accepted or "Dual" in str(found.status)):
                break
            found = _ask(A, b, q, (self._counts, self._sizes), asked, what, way)
            x, z, s = (np.asarray(each) for each in (found.x, found.z, found.s))
            is_ray = "PrimalInfeasible" in str(found.status)
            residual = _residual(A, b, q, (x, z, s), is_ray)
            if residual < best[0] and (is_ray or "DualInfeasible" not in str(found.status)):
                best = residual, (is_ray, x, z)
            enough = max(_TRUSTED_ROUGH, 10.0 * asked) if way is _UNREFINED else _ACCEPTED
            is_sure = is_ray or is_rough or str(found.status) == "Solved"
            if residual <= enough and is_sure:
                break
        # What it gave up on may be as near: its residuals say so, not its word.
        residual = best[0]
        if not residual <= accepted:
            endless = "; its cost may go down for ever" if "Dual" in str(found.status) else ""
            off = f"largest residual {residual:.1e}, accepted {accepted:g}"
            raise SolverError(
                f"{what}: the program of {A.shape[1]} variables and {A.shape[0]} rows was not"
                f" solved ({found.status}, {off}){endless}"
            )
        is_ray, x, z = best[1]
        duals = tuple(np.split(z, offsets[1:-1]))
        return ConeSolution(not is_ray, x, duals, residual)

    def solve_mixed_integer(self, binary: np.ndarray, what: str, by: SolverChoice) -> MixedReply:
        """Return the optimum where some variables ``(k,)`` are 0 or 1, as the solver says.

        Raises ConvexSetError for cones that it does not know.
        """
        unknown = [
            cone.name for cone in (Cone.SEMIDEFINITE, Cone.EXPONENTIAL) if self._sizes[cone]
        ]
        if unknown:
            raise ConvexSetError(
                f"{what}: solver {by.name!r} knows rows and second-order cones, not {unknown[0]};"
                " leave the solver out"
            )
        A, b, q = self.matrices()
        rows = self._counts[Cone.ZERO], self._counts[Cone.NONNEGATIVE]
        return ask_scip(A, b, q, rows, self._sizes[Cone.SECOND_ORDER], binary, by.options, what)


def _tolerances(by: SolverChoice | None) -> Sequence[float]:
    """Return the tolerances in turn; one, where the caller has given it."""
    is_given = by is not None and (
        by.name != "clarabel" or any(name.startswith("tol_") for name in by.options)
    )
    return _TOLERANCES[:1] if is_given else _TOLERANCES


def _residual(A: Any, b: np.ndarray, q: np.ndarray, found: Any, is_ray: bool) -> float:
    """Return the largest residual of a solution's equations, stationarity and gap."""
    x, z, s = found
    if not all(np.isfinite(each).all() for each in ((z,) if is_ray else found)):
        return np.inf
    if is_ray:
        size = abs(float(b @ z))
        return float(np.abs(A.T @ z).max(initial=0.0)) / size if size else np.inf
    size = 1.0 + float(np.abs(b).max(initial=0.0))
    along, across = products(A.data, A.indices, A.indptr, x, z)
    equations = float(np.abs(along + s - b).max(initial=0.0)) / size
    stationarity = float(np.abs(across + q).max(initial=0.0)) / (1.0 + np.abs(q).max(initial=0.0))
    gap = abs(float(q @ x + b @ z)) / (1.0 + abs(float(q @ x)))
    return max(equations, stationarity, gap)


def _ask(
    A: Any,
    b: np.ndarray,
    q: np.ndarray,
    cones: Any,
    tolerance: float,
    what: str,
    by: SolverChoice | None,
) -> Any:
    """Solve ``min q x`` with ``b - A x`` in the cones, by the solver that is chosen."""
    if by is None:
        return _ask_clarabel(A, b, q, cones, tolerance, what)
    counts, sizes = cones
    rows = counts[Cone.ZERO], counts[Cone.NONNEGATIVE]
    if by.name == "highs":
        others = [*sizes[Cone.SEMIDEFINITE], *sizes[Cone.EXPONENTIAL]]
        balls = [*sizes[Cone.SECOND_ORDER], *(size + 2 for size in others)]
        return ask_highs(A, b, q, rows, balls, by.options, what)
    if by.name == "scs":
        powers = len(sizes[Cone.EXPONENTIAL])
        bodies = sizes[Cone.SECOND_ORDER], sizes[Cone.SEMIDEFINITE]
        return ask_scs(A, b, q, (*rows, powers), bodies, by.options, what)
    return _ask_clarabel(A, b, q, cones, tolerance, what, by.options)


def _ask_clarabel(
    A: Any,
    b: np.ndarray,
    q: np.ndarray,
    cones: Any,
    tolerance: float,
    what: str,
    options: Mapping[str, Any] | None = None,
) -> Any:
    """Solve ``min q x`` with ``b - A x`` in the cones. Raises SolverError where that fails."""
    from scipy import sparse

    try:
        import clarabel
    except ImportError:
        raise SolverError(
            f"{what}: programs over cones are solved by the package clarabel, which is not"
            " installed; pip install clarabel"
        ) from None
    counts, sizes = cones
    asked = [clarabel.ZeroConeT(counts[Cone.ZERO])] if counts[Cone.ZERO] else []
    if counts[Cone.NONNEGATIVE]:
        asked.append(clarabel.NonnegativeConeT(counts[Cone.NONNEGATIVE]))
    asked += [clarabel.SecondOrderConeT(size) for size in sizes[Cone.SECOND_ORDER]]
    orders = [math.isqrt(2 * size) for size in sizes[Cone.SEMIDEFINITE]]
    asked += [clarabel.PSDTriangleConeT(order) for order in orders]
    asked += [clarabel.ExponentialConeT() for _ in sizes[Cone.EXPONENTIAL]]
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_iter = _MOST_ITERATIONS
    settings.max_threads = 1
    settings.presolve_enable = False
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        setattr(settings, name, tolerance)
    given = {} if options is None else options
    if given and options not in (_UNREFINED.options, _CAREFUL.options):
        check_names(given, [n for n in dir(settings) if n[0] != "_"], "solver 'clarabel'")
    try:
        for name, value in given.items():
            setattr(settings, name, value)
    except (TypeError, ValueError) as error:
        raise ConvexSetError(f"solver 'clarabel': option {name!r}: {error}") from error
    try:
        P = sparse.csc_matrix((len(q), len(q)))
        return clarabel.DefaultSolver(P, q, A, b, asked, settings).solve()
    except BaseException as error:
        # A panic of the solver's own language is no Exception; it must not end the process.
        if isinstance(error, (KeyboardInterrupt, SystemExit, GeneratorExit, MemoryError)):
            raise
        raise SolverError(f"{what}: the solver failed: {error}") from error
