"""Derivatives that are put together from steps, beside those of the whole by CasADi."""

import casadi as ca
import numpy as np
import pytest

from benchmarks.swing_ups import problem, SWING_UPS
from scene_graph_ros.planning import DirectCollocation, Dynamics
from scene_graph_ros.planning.optimal_control.program_for_ipopt import ProgramForIpopt


def of_the_whole(given):
    """Return Jacobian and upper Hessian of the Lagrangian as CasADi derives them, as functions."""
    x, f, g = (given.problem[key] for key in ("x", "f", "g"))
    of_f, of_g = ca.SX.sym("of_f"), ca.SX.sym("of_g", g.shape[0])
    H = ca.triu(ca.hessian(of_f * f + ca.dot(of_g, g), x)[0])
    return ca.Function("J", [x], [ca.jacobian(g, x)]), ca.Function("H", [x, of_f, of_g], [H])


def compare(made, seed=0):
    """Compare both at a random point with random multipliers."""
    given = ProgramForIpopt(made.prog())
    rng = np.random.default_rng(seed)
    x, of_f, of_g = (rng.standard_normal(k) for k in (made.prog().num_variables, 1, 0))
    of_g = rng.standard_normal(len(given.rows))
    J, H = of_the_whole(given)
    g, found = given.options["jac_g"](x, [])
    np.testing.assert_allclose(g, given.values(x)[1].full()[given.rows], rtol=1e-12, atol=1e-12)
    truth = J(x).full()
    np.testing.assert_allclose(found.full(), truth, rtol=1e-11, atol=1e-11 * abs(truth).max())
    truth, found = H(x, of_f, of_g).full(), given.options["hess_lag"](x, [], of_f, of_g).full()
    assert abs(truth).max() > 1.0
    np.testing.assert_allclose(found, truth, rtol=1e-11, atol=1e-11 * abs(truth).max())


@pytest.mark.parametrize("name", sorted(SWING_UPS))
def test_of_swing_ups(name):
    """Dynamics and effort are blocks, steps and time are not."""
    made = problem(name, 6)
    assert len(made.prog().blocks) == 2
    compare(made)


def test_where_steps_are_fixed_and_a_cost_has_time():
    """A running cost with time is no block, the dynamics still are."""
    system = Dynamics(lambda x, u, t, p: [x[1], u[0] * np.cos(x[0]) + u[1] ** 3], 2, 2)
    made = DirectCollocation(system, 5, 0.3, 0.3)
    made.add_running_cost(made.time() * made.input()[0] ** 2 * made.state()[1])
    made.add_constraint_to_all_knot_points(made.state()[0] * made.input()[1], -1.0, 1.0)
    assert len(made.prog().blocks) == 1
    compare(made)


def test_dynamics_that_have_time_are_derived_as_a_whole():
    """What depends on all earlier steps is no block."""
    system = Dynamics(lambda x, u, t, p: [u[0] + t * x[0]], 1, 1)
    made = DirectCollocation(system, 5, 0.1, 0.3)
    assert not made.prog().blocks
    assert "hess_lag" not in ProgramForIpopt(made.prog()).options


def test_rows_of_one_variable_are_its_bounds():
    """The narrowest counts; two that leave no room stay rows, and are told to IPOPT."""
    made = problem("pendulum", 4)
    prog, u = made.prog(), made.input(1)
    prog.add_constraint(u, -1.0, 2.0)
    prog.add_constraint(u, 2.5, 9.0, label="too much")
    given = ProgramForIpopt(prog)
    k = int(np.flatnonzero(given.most == 2.0).item())
    assert given.least[k] == -1.0
    assert given.rows[-1] == len(given.lower) - 1
    result = made.solve()
    assert not result.is_success
    assert "too much" in result.reason or "dynamics" in result.reason
    assert result.program_result.x[k] <= 2.5
