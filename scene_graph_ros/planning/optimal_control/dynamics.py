"""The dynamics of a system: a trajectory optimization takes them where others take a plant."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any
import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.optimal_control.arguments import (
    as_count,
    as_positive,
    as_vector,
)
from scene_graph_ros.planning.optimal_control.casadi_backend import get_casadi
from scene_graph_ros.planning.optimal_control.errors import DynamicsError
from scene_graph_ros.planning.optimal_control.numpy_function import NumpyFunction
from scene_graph_ros.robots.robot_model import RobotModel

__all__ = ["Dynamics"]

_REMEDY = (
    "write it with operators and functions of casadi or numpy and without branches on values"
    " (casadi.if_else), or give its jacobian= and it may do anything"
)


@one_line("num_states", "num_inputs", "discrete_step")
class Dynamics:
    """How a state x ``(n,)`` changes under an input u ``(m,)``: ``x' = f(x, u, t, p)``.

    ``f`` is traced once, with symbols of CasADi: ``x``, ``u`` and ``p`` are column vectors of them
    (where that fails, arrays of symbols, which can be unpacked), ``t`` is one. It returns n
    entries. Then all derivatives are exact, up to second ones. Or it takes NumPy arrays and may do
    anything; then ``jacobian(x, u, t, p)`` returns ``(df/dx, df/du)``, or ``(df/dx, df/du,
    df/dt)`` where it depends on t, and second derivatives are approximated.

    With ``discrete_step``, in s, f returns the next state instead. ``parameters`` ``(k,)`` are the
    values p of everything that is constant in time.

    Raises DynamicsError for functions that can't be traced or return another size.
    """

    def __init__(
        self,
        f: Callable[..., Any],
        num_states: int,
        num_inputs: int,
        *,
        discrete_step: float | None = None,
        parameters: ArrayLike | None = None,
        jacobian: Callable[..., Any] | None = None,
    ) -> None:
        if not callable(f):
            raise DynamicsError(f"f must be a function of x, u, t and p, not {quoted(f)}")
        self.num_states = as_count("num_states", num_states, 1)
        self.num_inputs = as_count("num_inputs", num_inputs, 0)
        self.parameters = as_vector("parameters", [] if parameters is None else parameters)
        self.discrete_step = (
            None if discrete_step is None else as_positive("discrete_step", discrete_step)
        )
        self._numpy: NumpyFunction | None = None
        if jacobian is None:
            self.function = self._traced(f)
        else:
            self._numpy = self._wrapped(f, jacobian)
            self.function = self._numpy.function
        self._derivatives: Any = None
        self.equations: Any = None
        """Of a robot: its `RobotEquations`."""

    @classmethod
    def of_robot(
        cls,
        model: RobotModel | str | Path,
        *,
        actuated: Sequence[str] | None = None,
        gravity: ArrayLike = (0.0, 0.0, -9.81),
        floating_base: str = "",
    ) -> Dynamics:
        """Return the motion of a robot, or of a URDF: x is q and v, u are forces of its joints.

        q and v are those of the robot's `KinematicTree`; ``floating_base`` names a joint by which
        the root link floats. ``actuated`` are names of velocities, in the order of u ``(m,)`` in
        N m and N; default: all. ``gravity`` ``(3,)`` in m/s^2. Friction and limits have no part in
        it. Raises DynamicsError for unknown names, and for a joint that moves no mass.
        """
        from scene_graph_ros.planning.optimal_control.robot_system import robot_system

        system = robot_system(model, actuated, gravity, floating_base)
        result = cls(system.f, system.num_states, system.num_inputs)
        result.equations = system.equations
        return result

    @property
    def is_discrete(self) -> bool:
        """Whether f returns the next state."""
        return self.discrete_step is not None

    @property
    def has_second_derivatives(self) -> bool:
        """Whether f was traced, so that Hessians are exact."""
        return self._numpy is None

    def __call__(
        self, x: ArrayLike, u: ArrayLike = (), t: float = 0.0, p: ArrayLike | None = None
    ) -> NDArray[np.float64]:
        """Return the rate, or the next state, ``(n,)`` of numbers.

        Raises DynamicsError for other sizes, and for a value that is no finite number.
        """
        given = self._given(x, u, t, p)
        value = np.array(self.evaluated(*given)).ravel()
        if not np.isfinite(value).all():
            k = int(np.argmin(np.isfinite(value)))
            raise DynamicsError(
                f"f[{k}] must be finite, not {value[k]}, at x = {given[0].tolist()},"
                f" u = {given[1].tolist()}, t = {given[2]}: keep states and inputs where it is"
            )
        return value

    def linearized(
        self, x: ArrayLike, u: ArrayLike = (), t: float = 0.0, p: ArrayLike | None = None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return df/dx ``(n, n)`` and df/du ``(n, m)``, exact. Raises like a call."""
        given = self._given(x, u, t, p)
        if self._derivatives is None:
            ca = get_casadi()
            sizes = self.num_states, self.num_inputs, 1, len(self.parameters)
            names = [ca.MX.sym(f"v{k}", size) for k, size in enumerate(sizes)]
            out = self.function(*names)
            rates = [ca.jacobian(out, names[0]), ca.jacobian(out, names[1])]
            self._derivatives = ca.Function("linearized", names, rates)
        A, B = self._called(self._derivatives, given)
        return np.array(A), np.array(B).reshape(self.num_states, self.num_inputs)

    def evaluated(self, *given: Any) -> Any:
        """Return f of numbers as CasADi's; raises the errors of f."""
        return self._called(self.function, given)

    def _called(self, function: Any, given: tuple[Any, ...]) -> Any:
        try:
            return function(*given)
        except Exception:
            self.raise_error()
            raise

    def raise_error(self) -> None:
        """Raise the error of a function of NumPy arrays inside CasADi, if there was one."""
        if self._numpy is not None:
            self._numpy.raise_error()

    def _given(
        self, x: ArrayLike, u: ArrayLike, t: float, p: ArrayLike | None
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float, NDArray[np.float64]]:
        return (
            as_vector("x", x, self.num_states),
            as_vector("u", u, self.num_inputs),
            float(as_vector("t", [t], 1)[0]),
            self.parameters if p is None else as_vector("p", p, len(self.parameters)),
        )

    def _traced(self, f: Callable[..., Any]) -> Any:
        """Return f as a function of CasADi. Raises DynamicsError."""
        ca = get_casadi()
        x, u = ca.SX.sym("x", self.num_states), ca.SX.sym("u", self.num_inputs)
        t, p = ca.SX.sym("t"), ca.SX.sym("p", len(self.parameters))
        failures = []
        for given in ((x, u, t, p), (_unpacked(x), _unpacked(u), t, _unpacked(p))):
            try:
                with warnings.catch_warnings():
                    warnings.filterwarnings("ignore", message="\\s*casadi: a numpy function")
                    value = _as_column(ca, f(*given))
            except Exception as error:  # noqa: BLE001 - what f is given is not its own to name
                failures.append(error)
                continue
            if value.shape != (self.num_states, 1):
                raise DynamicsError(
                    f"f must return num_states = {self.num_states} entries, not {value.shape}"
                )
            return ca.Function("f", [x, u, t, p], [ca.densify(value)])
        raise DynamicsError(
            f"f can't be traced: {type(failures[0]).__name__}: {failures[0]}; {_REMEDY}"
        ) from failures[0]

    def _wrapped(self, f: Callable[..., Any], jacobian: Callable[..., Any]) -> NumpyFunction:
        """Return f, called as it is, with its Jacobian."""
        n, m, k = self.num_states, self.num_inputs, len(self.parameters)

        def value(*given: Any) -> NDArray[np.float64]:
            x, u, t, p = given
            rates = f(x, u, float(t[0]), p)
            found = real_array(rates, f"f must return {n} numbers", DynamicsError)
            if found.shape != (n,):
                raise DynamicsError(f"f must return shape ({n},), not {found.shape}")
            return found

        def parts(*given: Any) -> list[NDArray[np.float64]]:
            x, u, t, p = given
            found = [
                real_array(each, "jacobian must return matrices of numbers", DynamicsError)
                for each in jacobian(x, u, float(t[0]), p)
            ]
            shapes = [(n, n), (n, m), (n, 1)][: len(found)]
            if len(found) < 2 or [each.size for each in found] != [a * b for a, b in shapes]:
                raise DynamicsError(
                    f"jacobian must return matrices of shapes ({n}, {n}), ({n}, {m}) and, where f"
                    f" depends on t, ({n},), not {[each.shape for each in found]}"
                )
            found += [np.zeros((n, 1))] * (3 - len(found))
            of_x, of_u, of_t = found
            return [of_x.reshape(n, n), of_u.reshape(n, m), of_t.reshape(n, 1), np.zeros((n, k))]

        return NumpyFunction("f", (n, m, 1, k), n, value, parts)


def _unpacked(symbols: Any) -> NDArray[Any]:
    """Return an array of symbols."""
    result = np.empty(symbols.shape[0], dtype=object)
    for k in range(len(result)):
        result[k] = symbols[k]
    return result


def _as_column(ca: Any, value: Any) -> Any:
    """Return the answer of f as one column of expressions."""
    if isinstance(value, (ca.SX, ca.DM)):
        return ca.SX(value)
    parts = [value] if np.isscalar(value) else list(np.asarray(value, dtype=object).ravel())
    return ca.SX(ca.vertcat(*parts))
