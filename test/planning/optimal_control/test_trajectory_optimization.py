"""Collocation and transcription: known solutions, swing-ups, and what is said of failures."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from benchmarks.swing_ups import problem, SWING_UPS
from scene_graph_ros.planning import (
    DirectCollocation,
    DirectTranscription,
    Dynamics,
    DynamicsError,
    MultipleShooting,
    SolverOptions,
    SolveStatus,
    TrajectoryOptimizationError,
)
from scene_graph_ros.planning.trajectories import PiecewisePolynomial

FALLING = Dynamics(lambda x, u, t, p: [-(x[0] ** 2)], 1, 0)
"""From 1 it is 1 / (1 + t)."""
DOUBLE = Dynamics(lambda x, u, t, p: [x[1], u[0]], 2, 1)


def slopes(errors):
    """Return how often errors halve where steps halve."""
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize("name", sorted(SWING_UPS))
def test_swing_ups_from_a_straight_line(name):
    """Solved, at rest upright, within the effort; Simpson's rule holds by the plain function."""
    system, made = SWING_UPS[name], problem(name)
    result = made.solve()
    assert result.is_success, result.reason
    assert result.status is SolveStatus.SOLVED
    assert result.program_result.starts == 1
    np.testing.assert_allclose(result.states[0], 0.0, atol=1e-7)
    np.testing.assert_allclose(result.states[-1], system.goal, atol=1e-7)
    assert abs(result.inputs).max() <= system.effort * (1.0 + 1e-9)
    h, x, u = result.sample_times[1], result.states, result.inputs

    def f(state, effort):
        found = system.f(state, effort, 0, 0)
        return np.array(ca.vertcat(*found) if name == "pendulum" else found).ravel()

    for k in range(len(x) - 1):
        a, b = f(x[k], u[k]), f(x[k + 1], u[k + 1])
        middle = f(0.5 * (x[k] + x[k + 1]) + h / 8 * (a - b), 0.5 * (u[k] + u[k + 1]))
        np.testing.assert_allclose(x[k] + h / 6 * (a + 4 * middle + b), x[k + 1], atol=1e-6)
    # The curve obeys the dynamics at knots, and is measured between them.
    assert result.residual_between_knots > 0.0
    worst = result.residual_time
    there = f(result.trajectory.value(worst), result.input_trajectory.value(worst))
    off = abs(result.trajectory.derivative().value(worst) - there).max()
    assert off == pytest.approx(result.residual_between_knots, rel=1e-9)
    assert result.program_result.solver_status == "Solve_Succeeded"
    k = int(0.5 * len(x))
    t = result.sample_times[k]
    np.testing.assert_allclose(
        result.trajectory.derivative().value(t), f(x[k], u[k]), atol=1e-6 * abs(x).max() ** 2
    )


def falling(kind, samples):
    """Return the error at knots, of rates between them, and the residual, for 1 / (1 + t)."""
    step = 2.0 / (samples - 1)
    steps = (step, step) if kind is DirectCollocation else (step,)
    made = kind(FALLING, samples, *steps)
    made.prog().add_constraint(made.initial_state() == 1.0)
    result = made.solve()
    assert result.is_success, result.reason
    t = result.sample_times
    between = np.linspace(0.0, 2.0, 8 * samples)
    rates = result.trajectory.derivative().value(between)[:, 0] + 1.0 / (1.0 + between) ** 2
    error = abs(result.states[:, 0] - 1.0 / (1.0 + t)).max()
    return error, abs(rates).max(), result.residual_between_knots


def test_collocation_is_of_third_order():
    """States at knots are exact to fourth order, rates and the residual between them to third."""
    errors = np.array([falling(DirectCollocation, n) for n in (11, 21, 41)])
    assert (slopes(errors[:, 0]) > 3.7).all()
    assert (slopes(errors[:, 1]) > 2.7).all()
    assert (slopes(errors[:, 2]) > 2.7).all()
    assert errors[-1, 0] < 1e-7


def test_transcription_is_of_first_order():
    """Errors and residuals halve with the step."""
    errors = np.array([falling(DirectTranscription, n) for n in (21, 41, 81)])
    assert (abs(slopes(errors[:, 0]) - 1.0) < 0.1).all()
    assert (abs(slopes(errors[:, 2]) - 1.0) < 0.1).all()


def test_an_optimum_with_a_known_cost():
    """For x' = u the least integral of x^2 + u^2 over 1 s is tanh(1): to fourth order."""
    errors = []
    for samples in (3, 5, 9):
        step = 1.0 / (samples - 1)
        made = DirectCollocation(Dynamics(lambda x, u, t, p: u, 1, 1), samples, step, step)
        made.prog().add_constraint(made.initial_state() == 1.0)
        made.add_running_cost(made.state()[0] ** 2 + made.input()[0] ** 2)
        errors.append(abs(made.solve().cost - np.tanh(1.0)))
    assert (slopes(errors) > 3.5).all()


def test_the_fastest_way_from_rest_to_rest():
    """A metre at 1 m/s^2 takes two seconds: full speed ahead, and back from the middle on."""
    made = DirectCollocation(DOUBLE, 7, 0.05, 1.0)
    made.add_constraint_to_all_knot_points([made.input()[0] <= 1.0, made.input()[0] >= -1.0])
    made.prog().add_constraint(made.initial_state() == 0.0)
    made.prog().add_constraint(made.final_state() == ca.DM([1.0, 0.0]))
    made.add_final_cost(made.time())
    result = made.solve()
    assert result.is_success, result.reason
    # Inputs are linear between knots: the switch takes one step, at least 0.05 s.
    assert 2.0 <= result.sample_times[-1] < 2.01
    assert result.cost == pytest.approx(result.sample_times[-1], abs=1e-9)
    made.add_duration_bounds(3.0, 3.5)
    longer = made.solve(warm_start=result)
    assert longer.is_success
    assert longer.sample_times[-1] == pytest.approx(3.0, abs=1e-6)
    made.add_equal_time_intervals_constraints()
    np.testing.assert_allclose(np.diff(made.solve().sample_times), 0.5, atol=1e-7)


def test_placeholders_stand_for_each_knot():
    """Integrals of time, states and sequential variables; final costs are the last's."""
    made = DirectCollocation(DOUBLE, 4, 0.5, 0.5)
    extra = made.new_sequential_variable(2, "extra")
    made.add_constraint_to_all_knot_points(made.input() == 0.0)
    made.add_constraint_to_all_knot_points(extra == ca.vertcat(made.time(), made.state()[0]))
    made.prog().add_constraint(made.initial_state() == ca.DM([1.0, 2.0]))
    made.add_running_cost(made.time() ** 2 + extra[1])
    made.add_final_cost(100.0 * made.state()[0] + 1000.0 * extra[0])
    result = made.solve()
    # Over 1.5 s: of t^2 and 1 + 2 t; in the end x = 4, t = 1.5.
    assert result.cost == pytest.approx(1.125 + 1.5 + 2.25 + 400.0 + 1500.0, rel=1e-9)
    values = made.get_sequential_variable_samples(result, "extra")
    np.testing.assert_allclose(values[:, 0], result.sample_times, atol=1e-9)
    one = made.get_sequential_variable_at_index("extra", 2)
    np.testing.assert_allclose(result.value(one).ravel(), values[2], atol=1e-12)
    np.testing.assert_allclose(result.value(made.state(1)).ravel(), [2.0, 2.0], atol=1e-9)
    assert isinstance(made, MultipleShooting)
    assert made.fixed_time_step() == 0.5


def test_costs_may_have_variables_of_the_program():
    """The integral of (u - c)^2 over a variable c is least at the mean of u."""
    made = DirectCollocation(DOUBLE, 9, 0.25, 0.25)
    c = made.prog().new_variables(1, "c")
    made.prog().add_constraint(made.initial_state() == 0.0)
    made.prog().add_constraint(made.final_state(), [1.0, 0.6], [1.0, 0.6])
    made.add_running_cost((made.input()[0] - c) ** 2 + made.time() * made.input()[0] ** 2)
    result = made.solve()
    assert result.is_success
    u = result.inputs[:, 0]
    mean = 0.5 * (u[:-1] + u[1:]).sum() * 0.25 / 2.0
    assert mean == pytest.approx(0.3, abs=1e-8)  # the speed of 0.6 m/s after 2 s
    np.testing.assert_allclose(result.program_result.value(c), mean, atol=1e-8)
    assert abs(u - mean).max() > 0.1


def test_discrete_systems_and_their_regulator():
    """A sum over steps is least for the control of the discrete Riccati equation."""
    A, B = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]])
    system = Dynamics(lambda x, u, t, p: A @ x + B @ u, 2, 1, discrete_step=0.1)
    made = DirectTranscription(system, 31)
    S = solve_discrete_are(A, B, 0.1 * np.eye(2), 0.1 * np.eye(1))
    made.prog().add_constraint(made.initial_state() == ca.DM([1.0, -0.5]))
    made.add_running_cost(ca.sumsqr(made.state()) + ca.sumsqr(made.input()))
    made.add_final_cost(ca.bilin(ca.DM(S), made.state()))
    result = made.solve()
    x0 = np.array([1.0, -0.5])
    assert result.cost == pytest.approx(x0 @ S @ x0, rel=1e-8)
    assert result.input_trajectory.value(0.05) == result.inputs[0]
    assert result.sample_times[-1] == pytest.approx(3.0)


def test_a_function_of_numpy_with_its_jacobian():
    """Without second derivatives the same optimum is found."""
    results = []

    def slope(x, u, t, p):
        return [[0.0, 1.0], [-np.cos(x[0]), 0.0]], [[0.0], [1.0]]

    def plain(x, u, t, p):
        assert isinstance(x, np.ndarray)
        return [x[1], u[0] - np.sin(x[0])]

    for system in (
        Dynamics(lambda x, u, t, p: [x[1], u[0] - ca.sin(x[0])], 2, 1),
        Dynamics(plain, 2, 1, jacobian=slope),
    ):
        made = DirectCollocation(system, 9, 0.25, 0.25)
        made.prog().add_constraint(made.initial_state() == 0.0)
        made.prog().add_constraint(made.final_state() == ca.DM([1.0, 0.0]))
        made.add_running_cost(made.input()[0] ** 2)
        results.append(made.solve())
        assert results[-1].is_success, results[-1].reason
    assert results[1].cost == pytest.approx(results[0].cost, rel=1e-6)


def test_callbacks_see_each_iteration():
    """All three kinds get arrays of the right shapes; what they raise stops the search."""
    made = problem("pendulum", 11)
    seen = []
    slack = made.new_sequential_variable(1, "slack")
    made.add_constraint_to_all_knot_points(slack == 1.0)
    made.add_state_trajectory_callback(lambda t, x: seen.append((t.shape, x.shape)))
    made.add_input_trajectory_callback(lambda t, u: seen.append((t.shape, u.shape)))
    made.add_complete_trajectory_callback(
        lambda t, x, u, values: seen.append((x.shape, values[0].shape)), ["slack"]
    )
    result = made.solve()
    assert seen[:3] == [((11,), (11, 2)), ((11,), (11, 1)), ((11, 2), (11, 1))]
    assert len(seen) >= 3 * result.iterations

    def stop(t, x):
        raise KeyboardInterrupt

    made.add_state_trajectory_callback(stop)
    with pytest.raises(KeyboardInterrupt):
        made.solve()


def test_who_stops_early_gives_the_best():
    """After few iterations it is no success; what lacks most is named with its time."""
    result = problem("acrobot").solve(SolverOptions(max_iterations=5))
    assert not result.is_success
    assert result.status is SolveStatus.ITERATION_LIMIT
    worst = result.violations[0]
    assert worst.label == "dynamics"
    assert worst.time == result.sample_times[worst.knots[0]]
    assert worst.amount == pytest.approx(result.largest_violation)
    assert "iterations were used up; dynamics, row" in result.reason
    assert "at t = " in result.reason
    assert result.trajectory.value(0.0).shape == (4,)


def test_derivatives_that_are_no_numbers_are_no_success():
    """The length of (x, u) has none where both are 0: that is said, other starts get away."""
    system = Dynamics(lambda x, u, t, p: [u[0] + ca.sqrt(x[0] ** 2 + u[0] ** 2)], 1, 1)
    made = DirectCollocation(system, 5, 0.25, 0.25)
    made.prog().add_constraint(made.final_state() == 1.0)
    made.add_running_cost(made.input()[0] ** 2)
    result = made.solve(SolverOptions(restarts=0))
    assert not result.is_success
    assert result.status is SolveStatus.INVALID_NUMBER
    assert "is no number" in result.reason
    assert np.isfinite(result.states).all()
    again = made.solve()
    assert again.is_success, again.reason
    assert again.program_result.starts > 1


def test_what_can_not_be_says_which_when_and_by_how_much():
    """A wall at 0.5 between 0 and 1: something has to give."""
    made = DirectCollocation(DOUBLE, 5, 0.25, 0.25)
    made.prog().add_constraint(made.initial_state() == 0.0, label="start")
    made.prog().add_constraint(made.final_state()[0] == 1.0, label="goal", knots=[4])
    made.add_constraint_to_all_knot_points(made.state()[0] ** 3 <= 0.125, label="wall")
    result = made.solve(SolverOptions(restarts=1))
    assert not result.is_success
    assert result.status is SolveStatus.INFEASIBLE
    assert {v.label for v in result.violations} & {"wall", "goal", "dynamics"}
    worst = result.violations[0]
    assert worst.time is not None
    assert f"{worst.label}, row {worst.row}, at t = {worst.time:.6g} s" in result.reason
    assert f"by {worst.amount:.3g}" in result.reason
    assert worst.amount > 0.05


def test_a_warm_start_is_sooner_done():
    """With multipliers the same problem takes a fraction of the iterations."""
    made = problem("cart-pole")
    cold = made.solve()
    warm = made.solve(warm_start=cold)
    assert warm.is_success
    assert warm.cost == pytest.approx(cold.cost, rel=1e-6)
    assert warm.iterations < 0.5 * cold.iterations


def line(*rows, end=1.0):
    """Return a straight line."""
    return PiecewisePolynomial.first_order_hold([0.0, end], rows)


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda m: m.prog().add_cost(m.state()[0]), r"state\(\) is a placeholder"),
        (lambda m: m.prog().add_constraint(m.time() <= 1.0), r"time\(\) is a placeholder"),
        (lambda m: m.add_running_cost(m.state()), "must be one expression"),
        (lambda m: m.add_running_cost(ca.MX.sym("w")), "'w' is no variable of this program"),
        (lambda m: m.state(5), "index must be below 5"),
        (lambda m: m.add_constraint_to_all_knot_points(m.state()[0]), "must be a comparison"),
        (lambda m: m.add_constraint_to_all_knot_points(m.input(), 2.0, 1.0), r"lb\[0\] = 2.0"),
        (lambda m: m.add_duration_bounds(2.0, 1.0), r"lb\[0\] = 2.0 must not be above"),
        (lambda m: m.get_sequential_variable_at_index("z", 0), "no sequential variable 'z'"),
        (lambda m: m.set_initial_trajectory(None, line([0.0], [1.0])), "2 rows, not one of 1"),
        (
            lambda m: m.set_initial_trajectory(line([0], [1]), line([0, 0], [1, 1], end=2.0)),
            "scale or shift one",
        ),
        (
            lambda m: m.set_initial_trajectory(
                None, PiecewisePolynomial([0.0, 1.0, 2.0], [[[0.0, 0.0]], [[1.0, 0.0]]])
            ),
            "traj_init_x jumps by 1 at t = 1 s",
        ),
        (lambda m: DirectCollocation(DOUBLE, 5, 0.2, 0.1), "must not be above maximum_time_step"),
        (lambda m: DirectCollocation(DOUBLE, 1, 0.1, 0.1), "num_time_samples must be a whole"),
        (lambda m: DirectCollocation(3, 5, 0.1, 0.1), "dynamics must be Dynamics"),
        (lambda m: DirectTranscription(DOUBLE, 5), "fixed_time_step must be given"),
        (lambda m: DirectTranscription(DOUBLE, 5, 0.1).time_step(0), "steps that are variables"),
        (lambda m: m.fixed_time_step(), "steps are variables here"),
    ],
)
def test_what_makes_no_sense_is_refused(act, words):
    """The message names the argument, and what to do."""
    with pytest.raises(TrajectoryOptimizationError, match=words):
        act(DirectCollocation(DOUBLE, 5, 0.1, 0.5))


def test_discrete_systems_are_not_collocated():
    """They have no rates."""
    system = Dynamics(lambda x, u, t, p: x, 1, 1, discrete_step=0.1)
    with pytest.raises(DynamicsError, match="take DirectTranscription"):
        DirectCollocation(system, 5, 0.1, 0.1)
    with pytest.raises(TrajectoryOptimizationError, match=r"have a discrete_step of 0\.1 s"):
        DirectTranscription(system, 5, 0.1)


def test_a_guess_without_numbers_is_refused():
    """The constraint is named, and the knot."""
    made = DirectCollocation(Dynamics(lambda x, u, t, p: [ca.log(x[0])], 1, 0), 5, 0.1, 0.1)
    made.set_initial_trajectory(None, line([-1.0], [-1.0]))
    with pytest.raises(TrajectoryOptimizationError, match=r"dynamics, row 0, .* at knot 0: give"):
        made.solve()
