"""One step of direct collocation as a constraint: for programs of one's own, too."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.optimal_control.arguments import as_positive, as_vector
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.dynamics import Dynamics
from scene_graph_ros.planning.optimal_control.errors import (
    DynamicsError,
    TrajectoryOptimizationError,
)
from scene_graph_ros.planning.optimal_control.nonlinear_program import NonlinearProgram
from scene_graph_ros.planning.optimal_control.program_parts import Constraint

__all__ = [
    "DirectCollocationConstraint",
    "add_direct_collocation_constraint",
    "ends_of_step",
    "require_continuous",
    "step_function",
]


@one_line("dynamics")
class DirectCollocationConstraint:
    """The dynamics over one step: a cubic of the states, an input that is linear in time.

    The defect ``x1 - x0 - h / 6 (f0 + 4 f_m + f1)`` ``(n,)``, of Simpson's rule, is zero just
    where the cubic's slope in the middle is that of the dynamics (Hargraves and Paris, "Direct
    trajectory optimization using nonlinear programming and collocation", 1987).
    """

    def __init__(self, dynamics: Dynamics) -> None:
        """Raise DynamicsError for dynamics that are discrete."""
        if not isinstance(dynamics, Dynamics):
            raise DynamicsError(f"dynamics must be Dynamics, not {quoted(dynamics)}")
        require_continuous(dynamics)
        self.dynamics = dynamics
        self._step = step_function(dynamics)
        self._jacobian: Any = None

    @property
    def num_constraints(self) -> int:
        """How many rows it has: one for each state."""
        return self.dynamics.num_states

    @property
    def num_vars(self) -> int:
        """How many variables it is about: the step, and state and input at both ends."""
        return 1 + 2 * (self.dynamics.num_states + self.dynamics.num_inputs)

    def __call__(
        self,
        time_step: float,
        state: ArrayLike,
        next_state: ArrayLike,
        input: ArrayLike = (),  # noqa: A002 - the field's name
        next_input: ArrayLike = (),
        *,
        time: float = 0.0,
    ) -> NDArray[np.float64]:
        """Return the defect ``(n,)`` of numbers; the step is in s, and begins at ``time``.

        Raises TrajectoryOptimizationError for other sizes.
        """
        given = self._numbers(time_step, state, next_state, input, next_input, time)
        defect = np.array(self._step(*given)[0]).reshape(-1)
        self.dynamics.raise_error()
        return defect

    def jacobian(
        self,
        time_step: float,
        state: ArrayLike,
        next_state: ArrayLike,
        input: ArrayLike = (),  # noqa: A002 - the field's name
        next_input: ArrayLike = (),
        *,
        time: float = 0.0,
    ) -> NDArray[np.float64]:
        """Return the defect's exact derivatives ``(n, num_vars)``.

        By the step, state, next state, input and next input, in this order. Raises as a call.
        """
        ca = get_casadi()
        if self._jacobian is None:
            h, t = ca.MX.sym("h"), ca.MX.sym("t")
            x0, u0, x1, u1 = ends_of_step(ca.MX, self.dynamics)
            defect, _ = self._step(h, t, x0, u0, x1, u1)
            rows = ca.horzcat(*(ca.jacobian(defect, v) for v in (h, x0, x1, u0, u1)))
            self._jacobian = ca.Function("jacobian", [h, t, x0, u0, x1, u1], [ca.densify(rows)])
        given = self._numbers(time_step, state, next_state, input, next_input, time)
        found = np.array(self._jacobian(*given)).reshape(self.num_constraints, self.num_vars)
        self.dynamics.raise_error()
        return found

    def of_symbols(self, h: Any, t: Any, x0: Any, u0: Any, x1: Any, u1: Any) -> Any:
        """Return the defect of a program's expressions, columns of these sizes."""
        return self._step(h, t, x0, u0, x1, u1)[0]

    def _numbers(
        self, h: float, x0: ArrayLike, x1: ArrayLike, u0: ArrayLike, u1: ArrayLike, t: float
    ) -> tuple[Any, ...]:
        n, m = self.dynamics.num_states, self.dynamics.num_inputs
        return (
            as_positive("time_step", h),
            float(as_vector("time", [t], 1)[0]),
            as_vector("state", x0, n),
            as_vector("input", u0, m),
            as_vector("next_state", x1, n),
            as_vector("next_input", u1, m),
        )


def add_direct_collocation_constraint(
    constraint: DirectCollocationConstraint,
    time_step: Any,
    state: Any,
    next_state: Any,
    input: Any,  # noqa: A002 - the field's name
    next_input: Any,
    prog: NonlinearProgram,
    *,
    time: Any = 0.0,
) -> Constraint:
    """Add a step's defect, which has to be zero, to a program of one's own, and return it.

    ``time_step`` ``(1,)``, states ``(n,)`` and inputs ``(m,)`` are variables of the program,
    expressions of these, or numbers; ``time`` is when the step begins. Raises
    TrajectoryOptimizationError for other sizes, and for variables of other programs.
    """
    if not isinstance(constraint, DirectCollocationConstraint):
        raise TrajectoryOptimizationError(
            f"constraint must be a DirectCollocationConstraint, not {quoted(constraint)}"
        )
    if not isinstance(prog, NonlinearProgram):
        raise TrajectoryOptimizationError(f"prog must be a NonlinearProgram, not {quoted(prog)}")
    n, m = constraint.dynamics.num_states, constraint.dynamics.num_inputs
    given = [
        _column(name, value, size)
        for name, value, size in (
            ("time_step", time_step, 1),
            ("time", time, 1),
            ("state", state, n),
            ("input", input, m),
            ("next_state", next_state, n),
            ("next_input", next_input, m),
        )
    ]
    if not constraint.dynamics.has_second_derivatives:
        prog.has_second_derivatives = False
    return prog.add_constraint(constraint.of_symbols(*given), 0.0, 0.0, label="dynamics")


def _column(name: str, value: Any, size: int) -> Any:
    """Return a column of a size. Raises TrajectoryOptimizationError."""
    ca = get_casadi()
    try:
        column = ca.vertcat(*value) if isinstance(value, (list, tuple)) else ca.MX(value)
        column = ca.MX(column)
    except (TypeError, NotImplementedError, RuntimeError) as error:
        raise TrajectoryOptimizationError(
            f"{name} must be {size} variables or numbers, not {quoted(str(value))}"
        ) from error
    if column.numel() != size:
        raise TrajectoryOptimizationError(f"{name} must have {size} entries, not {column.numel()}")
    numbers = np.zeros(0) if ca.symvar(column) else np.array(ca.evalf(column))
    if not np.isfinite(numbers).all():
        raise TrajectoryOptimizationError(f"{name} must be finite, not {numbers.ravel().tolist()}")
    if name == "time_step" and not (numbers > 0.0).all():
        raise TrajectoryOptimizationError(f"{name} must be positive, not {numbers.item()}")
    return ca.reshape(column, size, 1)


def require_continuous(dynamics: Dynamics) -> None:
    """Raise DynamicsError where the dynamics are discrete."""
    if dynamics.is_discrete:
        raise DynamicsError(
            "collocation is for continuous dynamics, these have a discrete_step: take"
            " DirectTranscription"
        )


def ends_of_step(kind: Any, dynamics: Dynamics) -> list[Any]:
    """Return symbols of state and input at both ends of a step."""
    n, m = dynamics.num_states, dynamics.num_inputs
    return [kind.sym("x0", n), kind.sym("u0", m), kind.sym("x1", n), kind.sym("u1", m)]


def step_function(dynamics: Dynamics) -> Any:
    """Return a function of a step to its defect, and to the state in the middle.

    Its arguments are the step's length and its begin, then state and input at both ends.
    """
    ca = get_casadi()
    kind = ca.SX if dynamics.has_second_derivatives else ca.MX
    f, h, t = dynamics.function, kind.sym("h"), kind.sym("t")
    x0, u0, x1, u1 = ends_of_step(kind, dynamics)
    p = kind(dynamics.parameters)
    f0, f1 = f(x0, u0, t, p), f(x1, u1, t + h, p)
    middle = 0.5 * (x0 + x1) + h / 8.0 * (f0 - f1)
    between = f(middle, 0.5 * (u0 + u1), t + 0.5 * h, p)
    # Simpson's rule; the cubic's slope in the middle is the dynamics' exactly where this is zero.
    defect = x1 - x0 - h / 6.0 * (f0 + 4.0 * between + f1)
    return ca.Function("collocation", [h, t, x0, u0, x1, u1], [defect, middle])
