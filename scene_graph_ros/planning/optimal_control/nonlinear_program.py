"""A thin layer over CasADi and IPOPT: variables, costs, named constraints, and violations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array, whole_array
from scene_graph_ros.planning.optimal_control.arguments import as_bounds, as_count
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.errors import TrajectoryOptimizationError
from scene_graph_ros.planning.optimal_control.ipopt import IpoptRun
from scene_graph_ros.planning.optimal_control.program_parts import Block, Constraint, ProgramParts
from scene_graph_ros.planning.optimal_control.program_result import ProgramResult
from scene_graph_ros.planning.optimal_control.solver_options import SolverOptions
from scene_graph_ros.planning.parallel.deadline import Deadline

__all__ = ["Constraint", "NonlinearProgram"]


@one_line("num_variables")
class NonlinearProgram(ProgramParts):
    """Variables, costs and constraints as expressions of CasADi's MX, solved by IPOPT.

    First and second derivatives are exact, wherever expressions are. IPOPT is an interior-point
    method with a filter line search (Waechter and Biegler, 2006); it finds local optima.
    """

    def __init__(self) -> None:
        super().__init__()
        self._ca = get_casadi()
        self._known: dict[int, int] = {}
        """Variables' symbols by their hash, and their places."""
        self.placeholders: dict[int, str] = {}
        """Symbols that stand for others, by their hash, and what they are called."""
        self._owners: dict[int, object] = {}
        """Whose knots variables are at, by their hash."""

    # What it is made of.

    def new_variables(self, rows: int, name: str) -> Any:
        """Return ``rows`` new variables as a column of symbols; their guess is zero."""
        count = as_count("rows", rows, 0)
        symbol = self._ca.MX.sym(name, count)
        self._known[symbol.__hash__()] = len(self.variables)
        self.variables.append(symbol)
        self._guesses.append(np.zeros(count))
        return symbol

    def own(self, owner: object, variables: Sequence[Any]) -> None:
        """Say at whose knots variables are, where several share the program."""
        self._owners.update((symbol.__hash__(), owner) for symbol in variables)

    def is_owned(self, owner: object, expression: Any) -> bool:
        """Tell whether an expression has no variables at knots of others."""
        symbols = self._ca.symvar(expression)
        return all(self._owners.get(each.__hash__(), owner) is owner for each in symbols)

    def add_cost(self, expression: Any) -> None:
        """Add an expression ``(1, 1)`` to the cost."""
        self.costs.append(self._as_cost(expression))

    def _as_cost(self, expression: Any) -> Any:
        cost = self._checked("cost", expression)
        if cost.shape != (1, 1):
            raise TrajectoryOptimizationError(
                f"a cost must be one expression, not of shape {cost.shape}"
            )
        return cost

    def add_block_cost(
        self, expression: Any, function: Any, steps: Sequence[Sequence[Any]]
    ) -> None:
        """Add a cost that is the sum over steps of a function, of scalar operations, of variables.

        ``steps`` has for each step the variables, as `new_variables` returned them, that are the
        function's argument one below the other.
        """
        self.block_costs.append(self._as_cost(expression))
        columns = self._columns(steps)
        self.blocks.append(Block(function, columns, np.zeros((len(columns), 0), dtype=np.int64)))

    def add_block_constraint(
        self, added: Constraint, function: Any, steps: Sequence[Sequence[Any]]
    ) -> None:
        """Say that the constraint added last has the rows of a function, step after step."""
        size = len(added.lower)
        start = sum(len(constraint.lower) for constraint in self.constraints) - size
        rows = start + np.arange(size).reshape(len(steps), -1)
        self.blocks.append(Block(function, self._columns(steps), rows))

    def _columns(self, steps: Sequence[Sequence[Any]]) -> NDArray[np.int64]:
        sizes = [symbol.shape[0] for symbol in self.variables]
        starts = np.concatenate([[0], np.cumsum(sizes)])
        where = [[self._known[symbol.__hash__()] for symbol in step] for step in steps]
        return np.array(
            [np.concatenate([np.arange(starts[k], starts[k + 1]) for k in step]) for step in where]
        )

    def add_constraint(
        self,
        expression: Any,
        lb: ArrayLike | None = None,
        ub: ArrayLike | None = None,
        *,
        label: str = "constraint",
        knots: ArrayLike | None = None,
    ) -> Constraint:
        """Add ``lb <= expression <= ub``, or a formula such as ``x[0] <= 1`` without bounds.

        Bounds are numbers, or one for each row; infinite where nothing is asked. ``label`` is its
        name in a result. Raises TrajectoryOptimizationError for bounds that hold nothing, and for
        placeholders.
        """
        rows, lower, upper = self.rows_of(expression, lb, ub, label=label)
        self._check_symbols(label, rows)
        about = np.zeros((rows.shape[0], 0), dtype=np.int64)
        if knots is not None:
            given, size = _as_knots(knots), rows.shape[0]
            if given.ndim not in (1, 2) or (given.ndim == 2 and len(given) not in (1, size)):
                raise TrajectoryOptimizationError(
                    f"knots must have shape (k,) or ({size}, k), not {given.shape}"
                )
            about = np.broadcast_to(given, (size, given.shape[-1]))
        made = Constraint(rows, lower, upper, label, about)
        self.constraints.append(made)
        return made

    def add_constraint_for_each(
        self, columns: Sequence[Any], lb: ArrayLike, ub: ArrayLike, *, label: str, knots: ArrayLike
    ) -> list[Constraint]:
        """Add ``lb <= column <= ub`` for columns of one size, about ``knots``, a row for each."""
        if not len(columns):
            return []
        self._check_symbols(label, self._ca.vertcat(*columns))
        size = columns[0].shape[0]
        lower, upper, given = *as_bounds(lb, ub, size), _as_knots(knots)
        if given.ndim != 2 or len(given) != len(columns):
            raise TrajectoryOptimizationError(
                f"knots must have shape ({len(columns)}, k), not {given.shape}"
            )
        made = [
            Constraint(column, lower, upper, label, np.broadcast_to(own, (size, len(own))))
            for column, own in zip(columns, given, strict=True)
        ]
        self.constraints += made
        return made

    def rows_of(
        self,
        expression: Any,
        lb: ArrayLike | None,
        ub: ArrayLike | None,
        *,
        label: str = "constraint",
    ) -> tuple[Any, NDArray[np.float64], NDArray[np.float64]]:
        """Return the arguments of `add_constraint` as a column of expressions, and its bounds."""
        if lb is None and ub is None:
            parts = self._of_formula(expression)
        else:
            parts = [(expression, -np.inf if lb is None else lb, np.inf if ub is None else ub)]
        columns, lower, upper = [], [], []
        for part, low, high in parts:
            column = self._ca.vec(self._as_expression(label, part))
            bounds = as_bounds(low, high, column.shape[0])
            columns.append(column)
            lower.append(bounds[0])
            upper.append(bounds[1])
        return self._ca.vertcat(*columns), np.concatenate(lower), np.concatenate(upper)

    def _of_formula(self, formula: Any) -> list[tuple[Any, Any, Any]]:
        """Return expressions with bounds of a comparison, or of several joined by and."""
        ca = self._ca
        if isinstance(formula, (list, tuple, np.ndarray)):
            return [part for each in formula for part in self._of_formula(each)]
        if isinstance(formula, ca.MX):
            if formula.is_op(ca.OP_AND):
                return self._of_formula(formula.dep(0)) + self._of_formula(formula.dep(1))
            if formula.is_op(ca.OP_EQ) or formula.is_op(ca.OP_LE) or formula.is_op(ca.OP_LT):
                is_equal = formula.is_op(ca.OP_EQ)
                left, right = formula.dep(0), formula.dep(1)
                if right.is_constant():
                    high = _numbers(ca, right, left)
                    return [(left, high if is_equal else -np.inf, high)]
                if left.is_constant():
                    low = _numbers(ca, left, right)
                    return [(right, low, low if is_equal else np.inf)]
                return [(left - right, 0.0 if is_equal else -np.inf, 0.0)]
        raise TrajectoryOptimizationError(
            "a constraint without bounds must be a comparison of expressions, such as"
            f" state()[0] <= 1, not {quoted(str(formula))}"
        )

    def _checked(self, label: str, expression: Any) -> Any:
        """Return an expression of this program's variables."""
        found = self._as_expression(label, expression)
        self._check_symbols(label, found)
        return found

    def _as_expression(self, label: str, expression: Any) -> Any:
        ca = self._ca
        try:
            if isinstance(expression, (list, tuple, np.ndarray)):
                flat = np.asarray(expression, dtype=object).ravel()
                expression = ca.vertcat(*flat)
            return ca.MX(expression)
        except (TypeError, NotImplementedError, RuntimeError) as error:
            raise TrajectoryOptimizationError(
                f"{label} must be an expression of casadi's, not {quoted(str(expression))}"
            ) from error

    def _check_symbols(self, label: str, expression: Any) -> None:
        """Raise where an expression has other symbols than this program's variables."""
        for symbol in self._ca.symvar(expression):
            key = symbol.__hash__()
            if key in self._known:
                continue
            if key in self.placeholders:
                raise TrajectoryOptimizationError(
                    f"{label}: {self.placeholders[key]} is a placeholder for any knot: name one,"
                    " as in state(0), or add it to all knots"
                )
            raise TrajectoryOptimizationError(
                f"{label}: {symbol.name()!r} is no variable of this program; make it by"
                " new_variables()"
            )

    # Guesses and solutions.

    def set_initial_guess(self, variables: Any, values: ArrayLike) -> None:
        """Set the initial value of the variables of one call: a number, or ``(rows,)``."""
        k = self._known.get(variables.__hash__())
        if k is None:
            raise TrajectoryOptimizationError(
                "a guess is for all variables that one call of new_variables() made"
            )
        symbol = self.variables[k]
        rule = f"the guess of {symbol.name()!r} must be numbers"
        given = real_array(values, rule, TrajectoryOptimizationError)
        if given.ndim > 1 or given.size not in (1, symbol.shape[0]):
            raise TrajectoryOptimizationError(
                f"the guess of {symbol.name()!r} must be a number, or {symbol.shape[0]}, not of"
                f" shape {given.shape}"
            )
        array = np.broadcast_to(given, symbol.shape[:1])
        if not np.isfinite(array).all():
            raise TrajectoryOptimizationError(
                f"the guess of {symbol.name()!r} must be finite, not {array}"
            )
        self._guesses[k] = array.copy()

    def solve(
        self,
        options: SolverOptions | None = None,
        *,
        warm_start: ProgramResult | None = None,
        timeout: float | None = None,
        watch: Callable[[], object] | None = None,
    ) -> ProgramResult:
        """Return the best point that IPOPT finds from the guess, or from an earlier result.

        ``warm_start`` is a result of this program, perhaps before bounds or costs were added to
        it: its point and its multipliers are where the search begins. After ``timeout`` (s), for
        all starts together, the best point by then is returned with the status ``TIME_LIMIT``;
        ``watch`` is called at iterations now and then, and may raise. Raises
        TrajectoryOptimizationError where a cost or constraint is no number at the guess.
        """
        deadline = Deadline.of(timeout, watch, TrajectoryOptimizationError)
        run = IpoptRun(self, options or SolverOptions(), self.evaluate, deadline)
        return run.solved(warm_start)

    def evaluate(self, expression: Any, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the value of an expression of the variables at a point ``(n,)``."""
        ca = self._ca
        checked = self._checked("expression", expression)
        stacked = ca.vertcat(*self.variables)
        return np.array(ca.Function("value", [stacked], [checked])(x))


def _numbers(ca: Any, constant: Any, like: Any) -> NDArray[np.float64]:
    values = np.array(ca.evalf(constant)).ravel(order="F")
    return np.broadcast_to(values, (like.numel(),)) if values.size == 1 else values


def _as_knots(knots: ArrayLike) -> NDArray[np.int64]:
    return whole_array(knots, "knots must be whole numbers", TrajectoryOptimizationError)
