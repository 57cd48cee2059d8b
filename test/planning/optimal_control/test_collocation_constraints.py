"""One step of collocation in a program of one's own."""

from fractions import Fraction

import casadi as ca
import numpy as np
import pytest

from scene_graph_ros.planning import (
    add_direct_collocation_constraint,
    DirectCollocation,
    DirectCollocationConstraint,
    Dynamics,
    DynamicsError,
    NonlinearProgram,
    TrajectoryOptimizationError,
)

DOUBLE = Dynamics(lambda x, u, t, p: [x[1], u[0]], 2, 1)
CURVED = Dynamics(lambda x, u, t, p: [x[1] * x[0] + t, u[0] * x[1] - x[0] * x[0]], 2, 1)


def rational_defect(h, x0, x1, u0, u1, t):
    """Return the defect of CURVED in fractions, by the cubic's slope in the middle.

    The cubic of ends x0, x1 and slopes f0, f1 has the slope 1.5 (x1 - x0) / h - (f0 + f1) / 4 in
    the middle; less the dynamics there, times 2 h / 3, that is the defect of Simpson's rule.
    """

    def f(x, u, at):
        return [x[1] * x[0] + at, u * x[1] - x[0] * x[0]]

    f0, f1 = f(x0, u0, t), f(x1, u1, t + h)
    middle = [(a + b) / 2 + h / 8 * (c - d) for a, b, c, d in zip(x0, x1, f0, f1, strict=True)]
    slope = [
        Fraction(3, 2) * (b - a) / h - (c + d) / 4
        for a, b, c, d in zip(x0, x1, f0, f1, strict=True)
    ]
    wanted = f(middle, (u0 + u1) / 2, t + h / 2)
    return [Fraction(2, 3) * h * (a - b) for a, b in zip(slope, wanted, strict=True)]


NUMBERS = [Fraction(k, 7) for k in (2, 3, -4, 5, 1, 6, -2)]


def split(values):
    """Return h, x0, x1, u0 and u1 of the variables in their order."""
    h, a, b, c, d, u0, u1 = values
    return h, [a, b], [c, d], u0, u1


def test_a_defect_is_that_of_the_cubic_in_rational_numbers():
    """To rounding, also where the dynamics depend on time."""
    t = Fraction(1, 3)
    h, x0, x1, u0, u1 = split(NUMBERS)
    wanted = [float(v) for v in rational_defect(h, x0, x1, u0, u1, t)]
    constraint = DirectCollocationConstraint(CURVED)
    given = [float(h), [float(v) for v in x0], [float(v) for v in x1], [float(u0)], [float(u1)]]
    found = constraint(*given, time=float(t))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-15)
    assert (constraint.num_constraints, constraint.num_vars) == (2, 7)


def test_derivatives_are_those_of_rational_differences():
    """A central difference of 1e-12 in fractions is off by its square alone."""
    t, step = Fraction(1, 3), Fraction(1, 10**12)
    wanted = np.empty((2, 7))
    for k in range(7):
        ends = []
        for sign in (1, -1):
            moved = list(NUMBERS)
            moved[k] += sign * step
            ends.append(rational_defect(*split(moved), t))
        wanted[:, k] = [float((a - b) / (2 * step)) for a, b in zip(*ends, strict=True)]
    h, x0, x1, u0, u1 = split([float(v) for v in NUMBERS])
    found = DirectCollocationConstraint(CURVED).jacobian(h, x0, x1, [u0], [u1], time=float(t))
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-14)


def test_a_program_of_ones_own_finds_what_the_ready_made_one_does():
    """From rest to rest over 1 m in 1 s the least effort is 12, on lines of inputs."""
    prog, count = NonlinearProgram(), 6
    h = prog.new_variables(1, "h")
    states = [prog.new_variables(2, f"x{k}") for k in range(count)]
    inputs = [prog.new_variables(1, f"u{k}") for k in range(count)]
    prog.add_constraint(h == 1.0 / (count - 1))
    prog.set_initial_guess(h, 0.3)
    prog.add_constraint(states[0] == 0.0)
    prog.add_constraint(states[-1] == ca.DM([1.0, 0.0]))
    constraint = DirectCollocationConstraint(DOUBLE)
    for k in range(count - 1):
        added = add_direct_collocation_constraint(
            constraint, h, states[k], states[k + 1], inputs[k], inputs[k + 1], prog
        )
        assert added.label == "dynamics"
        middle = 0.5 * (inputs[k] + inputs[k + 1])
        prog.add_cost(h / 6.0 * (inputs[k] ** 2 + 4.0 * middle**2 + inputs[k + 1] ** 2))
    found = prog.solve()
    assert found.is_success, found.reason
    assert found.cost == pytest.approx(12.0, rel=1e-8)
    made = DirectCollocation(DOUBLE, count, 0.2, 0.2)
    made.prog().add_constraint(made.initial_state() == 0.0)
    made.prog().add_constraint(made.final_state() == ca.DM([1.0, 0.0]))
    made.add_running_cost(made.input()[0] ** 2)
    assert made.solve().cost == pytest.approx(found.cost, rel=1e-8)


def test_dynamics_without_second_derivatives_have_approximated_ones():
    """A function of NumPy arrays reaches the program as it is."""
    made = Dynamics(
        lambda x, u, t, p: np.array([u[0]]),
        1,
        1,
        jacobian=lambda x, u, t, p: (np.zeros((1, 1)), np.ones((1, 1))),
    )
    prog = NonlinearProgram()
    x, u = prog.new_variables(1, "x"), prog.new_variables(1, "u")
    add_direct_collocation_constraint(DirectCollocationConstraint(made), 0.5, [1.0], x, u, u, prog)
    assert not prog.has_second_derivatives
    prog.add_constraint(x == 4.0)
    found = prog.solve()
    assert found.is_success, found.reason
    assert float(prog.evaluate(u, found.x)[0, 0]) == pytest.approx(6.0, abs=1e-7)


def test_what_makes_no_step_is_refused():
    """By the argument's name."""
    constraint, prog = DirectCollocationConstraint(DOUBLE), NonlinearProgram()
    x = prog.new_variables(2, "x")
    with pytest.raises(TrajectoryOptimizationError, match="next_state must have 2 entries, not 3"):
        add_direct_collocation_constraint(constraint, 0.1, x, [1.0, 2.0, 3.0], 0.0, 0.0, prog)
    with pytest.raises(TrajectoryOptimizationError, match="no variable of this program"):
        add_direct_collocation_constraint(
            constraint, 0.1, x, NonlinearProgram().new_variables(2, "y"), 0.0, 0.0, prog
        )
    with pytest.raises(TrajectoryOptimizationError, match="prog must be"):
        add_direct_collocation_constraint(constraint, 0.1, x, x, 0.0, 0.0, None)
    with pytest.raises(TrajectoryOptimizationError, match="time_step must be positive"):
        constraint(0.0, [0.0, 0.0], [0.0, 0.0], [0.0], [0.0])
    with pytest.raises(DynamicsError, match="DirectTranscription"):
        DirectCollocationConstraint(Dynamics(lambda x, u, t, p: x, 1, 0, discrete_step=0.1))
    with pytest.raises(DynamicsError, match="dynamics must be Dynamics"):
        DirectCollocationConstraint(3)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"time_step": -0.1}, r"time_step must be positive, not -0\.1"),
        ({"time_step": 0.0}, r"time_step must be positive, not 0\.0"),
        ({"time_step": np.inf}, r"time_step must be finite, not \[inf\]"),
        ({"state": [0.0, np.nan]}, r"state must be finite, not \[0\.0, nan\]"),
        ({"time": np.nan}, r"time must be finite, not \[nan\]"),
    ],
)
def test_numbers_that_no_program_can_hold_are_refused(changed, says):
    """As a call of the constraint refuses them: no row of NaN comes to a solver."""
    prog = NonlinearProgram()
    x, u = prog.new_variables(2, "x"), prog.new_variables(1, "u")
    given = {"time_step": 0.1, "state": x, "next_state": x, "input": u, "next_input": u}
    with pytest.raises(TrajectoryOptimizationError, match=says):
        add_direct_collocation_constraint(
            DirectCollocationConstraint(CURVED), prog=prog, **(given | changed)
        )
