"""The best motion after a zero-moment point: its equation, a dense optimum, bad input."""

import numpy as np
from numpy.polynomial import legendre
import pytest
from scipy.linalg import expm, solve_continuous_are

from scene_graph_ros.planning import ZmpPlanner, ZmpPlannerError
from scene_graph_ros.planning.trajectories import (
    BsplineTrajectory,
    PiecewisePolynomial,
    TrajectoryError,
)

QY = np.array([[2.0, 0.3], [0.3, 1.0]])
R = np.array([[0.2, -0.05], [-0.05, 0.1]])
X0 = np.array([0.3, -0.2, 0.1, 0.4])
HEIGHT = 0.9


def cubics(seed=0, widths=(0.4, 0.3, 0.7, 0.5)):
    """Return a desired point that turns and jumps at the breaks."""
    points = np.random.default_rng(seed).uniform(-1.0, 1.0, (len(widths), 4, 2))
    return PiecewisePolynomial(np.cumsum([0.3, *widths]), points)


def planned(zmp=None, Qy=QY, R=R, x0=X0):
    """Return a planner that has planned."""
    planner = ZmpPlanner()
    planner.plan(zmp or cubics(), x0, HEIGHT, Qy=Qy, R=R)
    return planner


def residual(planner, t, x, Qy=QY, R=R):
    """Return what the Hamilton-Jacobi-Bellman equation leaves, by differences of order 6."""
    stencil = np.array([-1 / 60, 3 / 20, -3 / 4, 0, 3 / 4, -3 / 20, 1 / 60])
    steps = np.arange(-3, 4)
    V_t = sum(
        c * planner.compute_optimal_cost(t + 1e-3 * k, x)
        for c, k in zip(stencil, steps, strict=True)
    )
    # The value function is quadratic in x: central differences of any step are exact.
    ends = [[planner.compute_optimal_cost(t, x + s * e) for s in (0.5, -0.5)] for e in np.eye(4)]
    V_x = np.array([high - low for high, low in ends])
    u = planner.compute_optimal_comdd(t, x)
    y = planner.comdd_to_cop(x, u) - planner.get_desired_zmp(t)
    moved = planner.get_A() @ x + planner.get_B() @ u
    return V_t / 1e-3 + y @ Qy @ y + u @ R @ u + V_x @ moved, V_x


@pytest.mark.parametrize("t", [0.5, 0.85, 1.2, 2.0])
def test_the_hamilton_jacobi_bellman_equation(t):
    """Finite differences satisfy it to 1e-9, and the control is where its gradient is zero."""
    planner = planned()
    x = np.random.default_rng(int(100 * t)).normal(size=4)
    left, V_x = residual(planner, t, x)
    assert abs(left) < 1e-9
    u = planner.compute_optimal_comdd(t, x)
    y = planner.comdd_to_cop(x, u) - planner.get_desired_zmp(t)
    slope = 2.0 * (R @ u + planner.get_D().T @ QY @ y) + planner.get_B().T @ V_x
    assert abs(slope).max() < 1e-12


def test_the_quadratic_part_solves_the_riccati_equation():
    """It is scipy's solution of the same linear-quadratic regulator."""
    planner = planned()
    B, C, D = planner.get_B(), planner.get_C(), planner.get_D()
    S = solve_continuous_are(planner.get_A(), B, C.T @ QY @ C, R + D.T @ QY @ D, s=C.T @ QY @ D)
    assert abs(planner.get_Vxx() - S).max() < 1e-12


def dense_optimum(zmp, planner, degree=12):
    """Return the least cost, nodes, coefficients of u, and Legendre polynomials at nodes."""
    nodes, weights = legendre.leggauss(24)
    S, Q, D = planner.get_Vxx(), planner.get_Qy(), planner.get_D()
    basis = np.eye(degree + 1)
    u_at = legendre.legval(nodes, basis.T)
    once = legendre.legint(basis, axis=1, lbnd=-1)
    twice = legendre.legint(once, axis=1, lbnd=-1)
    twice_at = legendre.legval(nodes, twice.T)
    once_end, twice_end = legendre.legval(1.0, once.T), legendre.legval(1.0, twice.T)
    size = zmp.num_segments * (degree + 1)
    # Position and velocity of one axis at a segment's start: affine in x0 and the coefficients.
    position, velocity = np.zeros(2 + size), np.zeros(2 + size)
    position[0], velocity[1] = 1.0, 1.0
    rows, rights = [], []
    root_Q, root_R = np.linalg.cholesky(Q).T, np.linalg.cholesky(planner.get_R()).T
    times = []
    for j, (low, high) in enumerate(zip(zmp.breaks[:-1], zmp.breaks[1:], strict=True)):
        half = 0.5 * (high - low)
        own = slice(2 + j * (degree + 1), 2 + (j + 1) * (degree + 1))
        t = low + half * (1.0 + nodes)
        c = position + np.outer(half * (1.0 + nodes), velocity)
        c[:, own] += half**2 * twice_at.T
        u = np.zeros_like(c)
        u[:, own] = u_at.T
        desired = zmp.value(t)
        for k, weight in enumerate(np.sqrt(half * weights)):
            y = np.kron(np.eye(2), c[k]) + D[0, 0] * np.kron(np.eye(2), u[k])
            rows += [weight * root_Q @ y, weight * root_R @ np.kron(np.eye(2), u[k])]
            rights += [weight * root_Q @ desired[k], np.zeros(2)]
        times.append(t)
        position = position + 2.0 * half * velocity
        velocity = velocity.copy()
        position[own] += half**2 * twice_end
        velocity[own] += half * once_end
    end = np.concatenate([np.kron(np.eye(2), position), np.kron(np.eye(2), velocity)])
    root_S = np.linalg.cholesky(S).T
    rows.append(root_S @ end)
    rights.append(root_S @ np.concatenate([planner.get_final_desired_zmp(), [0.0, 0.0]]))
    A, b = np.concatenate(rows), np.concatenate(rights)
    given = np.array([X0[0], X0[2], *np.zeros(size), X0[1], X0[3], *np.zeros(size)])
    free = np.tile(np.arange(2 + size) >= 2, 2)
    solution = np.linalg.lstsq(A[:, free], b - A @ given, rcond=None)[0]
    left = b - A @ given - A[:, free] @ solution
    u = solution.reshape(2, zmp.num_segments, degree + 1)
    return float(left @ left), np.concatenate(times), u, u_at


def test_it_is_the_optimum_of_a_dense_problem():
    """Cost and control are those of a least-squares problem over polynomials of degree 12."""
    zmp, planner = cubics(), planned()
    cost, times, u, u_at = dense_optimum(zmp, planner)
    assert planner.compute_optimal_cost(zmp.start_time, X0) == pytest.approx(cost, rel=1e-11)
    found = np.concatenate([(u[:, j] @ u_at).T for j in range(zmp.num_segments)])
    assert abs(planner.get_nominal_comdd().value(times) - found).max() < 1e-8


def test_the_nominal_motion_is_what_the_controller_does():
    """It starts at x0, has no jumps where the desired point jumps, and obeys the policy."""
    planner, zmp = planned(), cubics()
    com, comd = planner.get_nominal_com(), planner.get_nominal_comd()
    start = np.concatenate([com.value(zmp.start_time), comd.value(zmp.start_time)])
    np.testing.assert_allclose(start, X0, atol=1e-13)
    for t in zmp.breaks[1:-1]:
        for curve in (com, comd, planner.get_Vx()):
            np.testing.assert_allclose(curve.value(t - 1e-13), curve.value(t), atol=1e-11)
    for t in np.linspace(0.3, 2.2, 23):
        x = np.concatenate([planner.get_nominal_com(t), planner.get_nominal_comd(t)])
        np.testing.assert_allclose(
            planner.compute_optimal_comdd(t, x), planner.get_nominal_comdd(t), atol=1e-12
        )
    np.testing.assert_allclose(planner.get_Vx(zmp.end_time), 0.0, atol=1e-14)


def test_long_segments_lose_nothing():
    """Through two segments of 500 s it rests above the point, and nothing overflows."""
    zmp = PiecewisePolynomial.first_order_hold(
        [0.0, 500.0, 1000.0], [[0.0, 0.0], [1.0, 0.5], [1.0, -0.5]]
    )
    planner = planned(zmp, np.eye(2), 1e-3 * np.eye(2))
    np.testing.assert_allclose(planner.get_nominal_com(250.0), [0.5, 0.25], atol=1e-12)
    np.testing.assert_allclose(planner.get_nominal_comd(750.0), [0.0, -0.002], atol=1e-14)
    left, _ = residual(planner, 499.0, X0, np.eye(2), 1e-3 * np.eye(2))
    assert abs(left) < 1e-9


def test_after_the_end_it_regulates_about_the_last_point():
    """The policy is linear, and V that of the infinite horizon."""
    planner = planned()
    final = planner.get_final_desired_zmp()
    resting = planner.compute_optimal_comdd(9.0, [*final, 0.0, 0.0])
    np.testing.assert_allclose(resting, 0.0, atol=1e-13)
    x = np.array([0.1, 0.2, -0.3, 0.4])
    cost = planner.compute_optimal_cost(9.0, [*(final + x[:2]), *x[2:]])
    assert cost == pytest.approx(x @ planner.get_Vxx() @ x, rel=1e-12)


def test_the_nominal_motion_goes_on_after_the_end():
    """As the regulator's closed loop, whose matrix exponential SciPy has; without a jump."""
    planner = planned()
    end = cubics().end_time
    final = planner.get_final_desired_zmp()
    x = np.concatenate([planner.get_nominal_com(end), planner.get_nominal_comd(end)])
    xbar = x - [*final, 0.0, 0.0]
    S = solve_continuous_are(
        planner.get_A(),
        planner.get_B(),
        planner.get_C().T @ QY @ planner.get_C(),
        R + planner.get_D().T @ QY @ planner.get_D(),
        s=planner.get_C().T @ QY @ planner.get_D(),
    )
    weight = R + planner.get_D().T @ QY @ planner.get_D()
    K = np.linalg.solve(weight, planner.get_B().T @ S + planner.get_D().T @ QY @ planner.get_C())
    closed = planner.get_A() - planner.get_B() @ K
    for after in (1e-9, 0.1, 1.0, 7.5):
        wanted = expm(closed * after) @ xbar
        t = end + after
        np.testing.assert_allclose(planner.get_nominal_com(t), final + wanted[:2], atol=1e-10)
        np.testing.assert_allclose(planner.get_nominal_comd(t), wanted[2:], atol=1e-10)
        np.testing.assert_allclose(planner.get_nominal_comdd(t), -K @ wanted, atol=1e-10)
    np.testing.assert_allclose(planner.get_nominal_com(1e300), final, atol=0)
    np.testing.assert_allclose(planner.get_nominal_comd(1e300), 0.0, atol=0)


def test_a_plan_of_the_reference_ends_where_its_own_does():
    """One second after three (the reference's answer to five digits)."""
    planner = ZmpPlanner()
    points = [[0.0, 0.0], [0.2, -0.1], [0.4, 0.1], [0.4, 0.1]]
    zmp = PiecewisePolynomial.first_order_hold([0, 1, 2, 3], points)
    planner.plan(zmp, np.zeros(4), 1.0)
    np.testing.assert_allclose(planner.get_nominal_com(4.0), [0.40372, 0.10180], atol=5e-6)
    np.testing.assert_allclose(planner.get_nominal_comd(4.0), [-0.00317, -0.00039], atol=5e-6)


def test_any_curve_that_becomes_polynomials_may_be_followed():
    """A B-spline's plan is that of its polynomials."""
    spline = BsplineTrajectory.clamped_uniform(np.random.default_rng(1).normal(size=(6, 2)), 3)
    first, second = planned(spline), planned(spline.piecewise_polynomial())
    assert (first.get_nominal_com(0.4) == second.get_nominal_com(0.4)).all()


def test_nothing_is_answered_before_there_is_a_plan():
    """Each question names the remedy."""
    planner = ZmpPlanner()
    assert not planner.has_planned()
    for name in ("get_A", "get_D", "get_Vxx", "get_nominal_com", "get_desired_zmp", "get_R"):
        with pytest.raises(ZmpPlannerError, match="call plan"):
            getattr(planner, name)()
    assert planned().has_planned()


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"height": 0.0}, "height must be positive"),
        ({"gravity": -9.81}, "gravity must be positive"),
        ({"x0": [0.0, 0.0]}, r"x0 must have shape \(4,\), not \(2,\)"),
        ({"x0": [0.0, np.nan, 0.0, 0.0]}, r"x0\[1\] must be finite, not nan"),
        ({"Qy": np.eye(3)}, r"Qy must have shape \(2, 2\)"),
        ({"R": [[1.0, 0.1], [0.0, 1.0]]}, "R must be symmetric"),
        ({"Qy": [[1.0, 2.0], [2.0, 1.0]]}, "Qy must be positive definite"),
        ({"R": np.zeros((2, 2))}, "R must be positive definite"),
        ({"R": 1e-20 * np.eye(2)}, "Qy and R differ too much"),
        ({"zmp_d": PiecewisePolynomial([0.0, 1.0], np.zeros((1, 2, 3)))}, "x and y, not 3 rows"),
        ({"zmp_d": 3}, "must be a PiecewisePolynomial"),
    ],
)
def test_what_makes_no_sense_is_refused(changed, words):
    """The message names the argument and its value."""
    given = {"zmp_d": cubics(), "x0": X0, "height": HEIGHT} | changed
    with pytest.raises((ZmpPlannerError, TrajectoryError), match=words):
        ZmpPlanner().plan(**given)


def test_planning_again_is_as_planning_anew():
    """With the same weights, others, and another height: what is kept belongs to its plan."""
    zmp = PiecewisePolynomial.first_order_hold([0.0, 1.0, 2.0], [[0, 0], [0.3, 0.1], [0.4, 0.0]])
    state, again = np.array([0.1, 0.0, 0.2, -0.1]), ZmpPlanner()
    weights = np.array([[2.0, 0.5], [0.5, 1.0]])
    for height, Qy, R in (
        (0.8, weights, np.eye(2)),
        (0.8, weights, np.eye(2)),
        (0.9, weights, np.eye(2)),
        (0.9, weights, 0.5 * np.eye(2)),
        (0.9, np.eye(2), 0.5 * np.eye(2)),
    ):
        anew = ZmpPlanner()
        for planner in (again, anew):
            planner.plan(zmp, state, height, Qy=Qy, R=R)
        for t in (0.0, 0.7, 1.9, 3.0):
            np.testing.assert_array_equal(again.get_nominal_com(t), anew.get_nominal_com(t))
            np.testing.assert_array_equal(again.get_Vx(t), anew.get_Vx(t))
        np.testing.assert_array_equal(again.get_Vxx(), anew.get_Vxx())
        np.testing.assert_array_equal(
            again.compute_optimal_comdd(0.4, state), anew.compute_optimal_comdd(0.4, state)
        )
        assert again.get_D()[0, 0] == pytest.approx(-height / 9.81, rel=1e-15)
