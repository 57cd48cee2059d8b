"""Programs over cones, and membership in every kind of set by them."""

import math

import numpy as np
import pytest

from scene_graph_ros.convex.solve.cones import optimum as wall
from scene_graph_ros.convex.solve.cones.standard_form import Status
from scene_graph_ros.geometry.optimization import (
    AffineBall,
    AffineSubspace,
    CartesianProduct,
    Cone,
    ConicProgram,
    ConvexHull,
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    MinkowskiSum,
    Point,
    SolverError,
    Spectrahedron,
    VPolytope,
)

BALL = Hyperellipsoid([[2.0, 0.0], [1.0, 1.0]], [0.3, -0.2])
BOX = Hyperrectangle([-1.0, 0.0], [0.5, 2.0])
TRIANGLE = VPolytope([[0.0, 0.0], [2.0, 0.5], [0.5, 2.0]])
QUADRANT = HPolyhedron([[-1.0, 0.0], [0.0, -1.0]], [-1.0, 0.5])
RAY = HPolyhedron([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0]], [0.0, 0.0, 0.0])

BOUNDED = {
    "point": Point([0.5, -1.0]),
    "box": BOX,
    "hull of points": TRIANGLE,
    "ellipsoid": BALL,
    "affine ball": AffineBall([[1.0, 0.5], [0.0, 0.7]], [1.0, 1.0]),
    "flat ball": AffineBall([[1.0, 0.5], [2.0, 1.0]], [1.0, 1.0]),
    "sum": MinkowskiSum([BALL, TRIANGLE]),
    "product": CartesianProduct([Hyperrectangle([-1.0], [1.0]), Hyperrectangle([0.0], [3.0])]),
    "mapped product": CartesianProduct([BALL], A=[[1.0, 0.5], [0.0, 2.0]], b=[0.1, 0.2]),
    "intersection": Intersection([BALL, BOX]),
    "hull": ConvexHull([BALL, Point([3.0, 3.0])]),
    "spectrahedron": Spectrahedron([[[1, 0], [0, 2]], [[1, 0], [0, -1]], [[0, 1], [1, 0]]]),
    "hull of a hull": ConvexHull([ConvexHull([BALL, Point([3.0, 3.0])]), TRIANGLE]),
}
# Sets that go on for ever, with ways in which they do and others.
UNBOUNDED = {
    "polyhedron": (QUADRANT, [[1.0, 0.0], [2.0, 3.0]], [[-1.0, 0.0], [1.0, -0.01]]),
    "strip": (Hyperellipsoid([[1.0, 1.0]], [1.0, 2.0]), [[1.0, -1.0], [-3.0, 3.0]], [[1.0, 0.0]]),
    "line": (AffineSubspace([[1.0], [2.0]], [5.0, 0.0]), [[1.0, 2.0], [-2.0, -4.0]], [[1.0, 0.0]]),
    "sum": (MinkowskiSum([BALL, RAY]), [[1.0, 0.0]], [[-1.0, 0.0], [0.0, 1.0]]),
    "intersection": (Intersection([QUADRANT, RAY]), [[1.0, 0.0]], [[0.0, 1.0]]),
    "closed hull": (ConvexHull([Point([0.0, 5.0]), RAY]), [[1.0, 0.0]], [[-1.0, 0.0], [1.0, 1.0]]),
    "above a parabola": (
        Spectrahedron([[[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]]]),
        [[0.0, 1.0]],
        [[0.0, -1.0], [1.0, 1.0]],
    ),
    "product": (
        CartesianProduct([HPolyhedron([[1.0]], [0.0]), Hyperrectangle([0.0], [1.0])]),
        [[-1.0, 0.0]],
        [[1.0, 0.0], [-1.0, 0.1]],
    ),
}
EVERY = {**BOUNDED, **{f"endless {name}": each for name, (each, _, _) in UNBOUNDED.items()}}


def fixed(program, values):
    """Add variables of given values."""
    x = program.add_variables(len(values))
    program.add_linear_equations(np.eye(len(values)), values, x)
    return x


def is_member(of, point, scale=None):
    """Ask a program whether a point is in a set, or in a multiple of it."""
    program = ConicProgram()
    x = fixed(program, point)
    if scale is None:
        of.add_point_in_set_constraints(program, x)
    else:
        of.add_point_in_nonnegative_scaling_constraints(program, x, fixed(program, [scale])[0])
    return program.solve().is_feasible


def points_about(of, seed):
    """Return points just inside, just outside, and anywhere, of a set in the plane."""
    rng = np.random.default_rng(seed)
    far = 4.0 * rng.normal(size=(4, 2))
    distances, nearest, _ = of.projection(far)
    ways = (far - nearest) / np.maximum(distances, 1e-9)[:, None]
    inner = of.maybe_get_feasible_point()
    outside = (nearest + 1e-4 * ways)[distances > 1e-3]
    inside = inner + (1.0 - 1e-4) * (nearest - inner)
    return np.concatenate([far, outside, inside])


@pytest.mark.parametrize("kind", EVERY)
def test_membership_by_a_program_is_point_in_set(kind):
    """Of points anywhere and 1e-4 on either side of the border."""
    of = EVERY[kind]
    points = points_about(of, len(kind))
    truth = of.point_in_set(points, 1e-6)
    assert truth.any()
    assert not truth.all()
    assert [is_member(of, point) for point in points] == truth.tolist()


@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("scale", [0.25, 3.0])
def test_multiples_hold_the_multiples_of_points(kind, scale):
    """``t y`` is in t times a set where y is in the set."""
    of = EVERY[kind]
    points = points_about(of, 1)[::2]
    truth = of.point_in_set(points, 1e-6)
    assert [is_member(of, scale * point, scale) for point in points] == truth.tolist()
    assert not is_member(of, scale * points[0], -0.1)


@pytest.mark.parametrize("kind", BOUNDED)
def test_no_times_a_bounded_set_is_the_origin(kind):
    """Alone."""
    assert is_member(BOUNDED[kind], [0.0, 0.0], 0.0)
    assert not is_member(BOUNDED[kind], [1e-3, 0.0], 0.0)
    assert not is_member(BOUNDED[kind], [0.0, -1e-3], 0.0)


@pytest.mark.parametrize("kind", UNBOUNDED)
def test_no_times_an_unbounded_set_is_its_recession_cone(kind):
    """The ways in which it goes on for ever, which were given by hand."""
    of, ways, others = UNBOUNDED[kind]
    assert all(is_member(of, way, 0.0) for way in [*ways, [0.0, 0.0]])
    assert not any(is_member(of, way, 0.0) for way in others)


@pytest.mark.parametrize("kind", EVERY)
def test_affine_scaling(kind):
    """``A x + b`` in ``c . t + d`` times a set, x and t with a single solution each."""
    of = EVERY[kind]
    A, b = np.array([[2.0, 0.0, 1.0], [0.0, -1.0, 0.0]]), np.array([0.5, 0.25])
    c, d = [1.0, 2.0], -1.0  # 2 at t = (1, 1)
    for point in points_about(of, 2)[1::3]:
        program = ConicProgram()
        solution = np.append(np.linalg.solve(A[:, :2], 2.0 * point - b), 0.0)
        x, t = fixed(program, solution), fixed(program, [1.0, 1.0])
        added = of.add_point_in_nonnegative_scaling_constraints(program, A, b, c, d, x, t)
        assert set(added) <= set(program.constraints)
        assert program.solve().is_feasible == of.point_in_set(point, 1e-6)


@pytest.mark.parametrize("kind", BOUNDED)
@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_optima_are_supports(kind, size):
    """A set at any size, as a mapped product: the most of ``(2, -3) . x``, to 1e-7 of it."""
    of = CartesianProduct([BOUNDED[kind]], A=np.eye(2) / size, b=np.zeros(2))
    program = ConicProgram()
    x = program.add_variables(2)
    new_variables, new_constraints = of.add_point_in_set_constraints(program, x)
    assert program.num_variables == 2 + len(new_variables)
    assert len(program.constraints) == len(new_constraints)
    program.add_linear_cost([-2.0, 3.0], x)
    solution = program.solve()
    truth = BOUNDED[kind].support([2.0, -3.0]).value * size
    assert -solution.cost == pytest.approx(truth, abs=1e-7 * 4.0 * size)
    assert BOUNDED[kind].point_in_set(solution.value(x) / size, 1e-6)


def test_no_dimensions_no_constraints():
    """As there is no point to constrain."""
    with pytest.raises(ConvexSetError, match=r"HPolyhedron\.add_point_in_set.* no dimensions"):
        HPolyhedron().add_point_in_set_constraints(ConicProgram(), [])
    program = ConicProgram()
    with pytest.raises(ConvexSetError, match="no dimensions"):
        Point().add_point_in_nonnegative_scaling_constraints(program, [], program.add_variables(1))


def test_second_order_cone():
    """The least t with ``|(x - 3, 4)| <= t`` and x <= 0 is 5."""
    program = ConicProgram()
    x, t = program.add_variables(1), program.add_variables(1)
    program.add_linear_inequalities([[1.0]], [0.0], x)
    cone = program.add_second_order_cone([[1, 0], [0, 1], [0, 0]], [0, -3, 4], [t[0], x[0]])
    program.add_linear_cost([1.0], t)
    solution = program.solve()
    assert solution.cost == pytest.approx(5.0, abs=1e-8)
    assert solution.violation < 1e-8
    assert solution.gap < 1e-8
    assert cone.violation(np.array([0.0, 4.0])) == pytest.approx(1.0)


def test_exponential_cone():
    """The least ``w`` with ``exp(u) <= w`` and u >= 2 is e squared; ``v exp(0) <= w`` is v."""
    program = ConicProgram()
    u = program.add_variables(3)
    cone = program.add_exponential_cone(np.eye(3), np.zeros(3), u)
    program.add_linear_equations([[0.0, 1.0, 0.0]], [1.0], u)
    program.add_linear_inequalities([[-1.0, 0.0, 0.0]], [-2.0], u)
    program.add_linear_cost([0.0, 0.0, 1.0], u)
    assert program.solve().cost == pytest.approx(math.exp(2.0), rel=1e-7)
    assert cone.violation(np.array([0.0, 2.0, 1.5])) == pytest.approx(0.5)
    assert cone.violation(np.array([-1.0, 0.0, 0.0])) == 0.0
    assert cone.violation(np.array([0.5, 0.0, 1.0])) == 0.5


def test_semidefinite_matrices():
    """The least trace of X with ``X >= [[1, 2], [2, 1]]`` is 3 for X >= 0: its positive part.

    Its eigenvalues are 3 and -1, so that the positive part has the trace 3.
    """
    program = ConicProgram()
    X = program.add_symmetric_matrix(2)
    assert X.tolist() == [[0, 1], [1, 2]]
    program.add_semidefinite_matrix(X)
    units = [[[1, 0], [0, 0]], [[0, 1], [1, 0]], [[0, 0], [0, 1]]]
    above = program.add_positive_semidefinite([[[-1, -2], [-2, -1]], *units], [0, 1, 2])
    program.add_linear_cost([1.0, 1.0], np.diag(X))
    solution = program.solve()
    assert solution.cost == pytest.approx(3.0, abs=1e-7)
    np.testing.assert_allclose(solution.value(X), [[1.5, 1.5], [1.5, 1.5]], atol=1e-5)
    assert above.cone is Cone.SEMIDEFINITE
    # Moving the bound by d moves the least trace by d . multipliers.
    dual = solution.dual(above)
    np.testing.assert_allclose(dual, [0.5, 1.0, 0.5], atol=1e-6)
    assert above.violation(np.zeros(3)) == pytest.approx(3.0)


def test_what_has_no_least_cost_is_an_error():
    """With the solver's word for it."""
    program = ConicProgram()
    x = program.add_variables(1)
    program.add_linear_inequalities([[1.0]], [0.0], x)
    program.add_linear_cost([1.0], x)
    with pytest.raises(SolverError, match="may go down for ever"):
        program.solve()


def refused(program):
    """Name what is refused, with its message."""
    x = program.add_variables(2)
    ball = BALL.add_point_in_nonnegative_scaling_constraints
    return [
        (lambda: program.add_variables(-1), "count must be a whole number"),
        (lambda: program.add_linear_cost([1.0], x), r"c must have the shape \(2,\)"),
        (lambda: program.add_linear_equations([[1.0]], [0.0], [7]), "which has 2, not"),
        (lambda: program.add_linear_cost([1.0], [0.5]), r"numbers of variables \(k,\)"),
        (lambda: program.add_exponential_cone([[1, 1]], [0], x), "must have 3 rows, not 1"),
        (lambda: program.add_second_order_cone(np.zeros((0, 2)), [], x), "at least a row"),
        (lambda: program.add_positive_semidefinite(np.ones((3, 1, 2)), x), "must have the shape"),
        (
            lambda: program.add_positive_semidefinite([[[0, 1], [0, 0]]] * 3, x),
            r"F\[0\] must be symmetric",
        ),
        (lambda: program.add_semidefinite_matrix([[0, 1], [0, 1]]), "must be a symmetric matrix"),
        (lambda: BALL.add_point_in_set_constraints(program, x[:1]), r"numbers of variables \(2,"),
        (lambda: BALL.add_point_in_set_constraints(None, x), "must be a ConicProgram, not None"),
        (lambda: ball(program, x), "takes"),
        (lambda: ball(program, x, x), r"t must be numbers of variables \(1,"),
        (lambda: ball(program, np.eye(2), [0, 0], [1], np.nan, x, x[:1]), "d must be a finite"),
        (lambda: ball(program, np.ones((3, 2)), [0, 0], [1], 0, x, x[:1]), r"shape \(2, k\)"),
    ]


def test_bad_arguments_are_named():
    """With their values."""
    for ask, message in refused(ConicProgram()):
        with pytest.raises(ConvexSetError, match=message):
            ask()


def test_a_solver_that_loses_its_way_is_asked_to_take_shorter_steps(monkeypatch):
    """Once more, and only where nothing near was found; what it says then is measured alike."""
    asked = []
    ask = wall.ask_clarabel

    def lost(form, tolerance, options, what, is_over):
        asked.append(dict(options))
        found = ask(form, tolerance, options, what, is_over)
        if "max_step_fraction" in asked[-1]:
            return found
        return found._replace(z=found.z + 1.0, status=Status.UNSURE, word="NumericalError")

    def solve():
        program = ConicProgram()
        x = program.add_variables(2)
        program.add_linear_inequalities(-np.eye(2), [-1.0, -2.0], x)
        program.add_linear_cost([1.0, 1.0], x)
        return program.solve()

    assert solve().cost == pytest.approx(3.0, abs=1e-7)
    monkeypatch.setattr(wall, "ask_clarabel", lost)
    assert solve().cost == pytest.approx(3.0, abs=1e-7)
    assert ["max_step_fraction" in options for options in asked][-1:] == [True]
    assert sum("max_step_fraction" in options for options in asked) == 1
