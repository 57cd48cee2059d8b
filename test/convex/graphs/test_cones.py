"""Cones of each kind as constraints and costs: constructed truths, and weights that can't err."""

from __future__ import annotations

from fractions import Fraction
import math

from graphs_of_sets import check, joined, RELAXED
import mpmath
import numpy as np
import pytest

from scene_graph_ros.convex.graphs.expressions.term_cones import into_dual
from scene_graph_ros.convex.graphs.expressions.term_kernels import KINDS, shorten
from scene_graph_ros.geometry.optimization import (
    CartesianProduct,
    Cone,
    ConvexSetError,
    exp,
    exponential_cone,
    FunctionConstraint,
    GraphOfConvexSets,
    Hyperrectangle,
    Intersection,
    norm,
    Point,
    positive_semidefinite,
    quad_over_lin,
    rotated_second_order_cone,
    second_order_cone,
    Spectrahedron,
    sum_squares,
    Transcription,
)

pytestmark = pytest.mark.usefixtures("both_ways_to_paths")

ROOT_2, ROOT_3 = math.sqrt(2.0), math.sqrt(3.0)


def by_way_of(middle, start, goal):
    """Return a graph of two points with a set between them, whose edges cost their lengths."""
    graph = GraphOfConvexSets()
    s, m, t = map(graph.add_vertex, (Point(start), middle, Point(goal)))
    return graph, (s, m, t), [joined(graph, s, m), joined(graph, m, t)]


DISC = np.array(
    [
        [[1.0, -2.0, -1.5], [-2.0, 1.0, 0.0], [-1.5, 0.0, 1.0]],
        [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
    ]
)
"""Semidefinite where (x, y) is within 1 of (2, 1.5), as the Schur complement says."""

DETOUR = 2.0 * math.hypot(2.0, 0.5)
"""From (0, 0) to (4, 0) by way of the disc's nearest point (2, 0.5)."""

PARABOLA = np.array([[[0.0, 0.0], [0.0, 1.0]], [[1.0, 0.0], [0.0, 0.0]], [[0.0, 1.0], [1.0, 0.0]]])
"""Semidefinite where x >= y^2."""


@pytest.mark.parametrize(
    ("constraint", "start", "goal", "truth"),
    [
        (lambda x: positive_semidefinite(DISC, x), (0.0, 0.0), (4.0, 0.0), DETOUR),
        # By symmetry over the parabola's tip.
        (lambda x: positive_semidefinite(PARABOLA, x), (-1.0, 1.0), (-1.0, -1.0), 2.0 * ROOT_2),
        # y >= exp(x) is nearest to (1, 0) at (0, 1), where its normal is (1, -1).
        (lambda x: exp(x[0]) <= x[1], (1.0, 0.0), (1.0, 0.0), 2.0 * ROOT_2),
        (lambda x: 2.0 * exp(x[0]) + 1.0 <= 2.0 * x[1] + 1.0, (1, 0), (1, 0), 2.0 * ROOT_2),
        # At (0, 1, 1) the gradient of v exp(u / v) - w is (1, 1, -1).
        (exponential_cone, (0.5, 1.5, 0.5), (0.5, 1.5, 0.5), ROOT_3),
        # The way from (2, 0) to the cone |x| <= y: to (1, 1).
        (lambda x: second_order_cone(x[::-1]), (2.0, 0.0), (2.0, 0.0), 2.0 * ROOT_2),
        # x y >= 1 is nearest to the origin at (1, 1).
        (
            lambda x: rotated_second_order_cone(np.eye(3)[:, :2] @ x + [0.0, 0.0, 1.0]),
            (0.0, 0.0),
            (0.0, 0.0),
            2.0 * ROOT_2,
        ),
        # y^2 / x <= 1, the parabola again.
        (lambda x: quad_over_lin(x[1], x[0]) <= 1.0, (-1.0, 1.0), (-1.0, -1.0), 2.0 * ROOT_2),
    ],
)
def test_each_cone_is_a_constraint(constraint, start, goal, truth):
    """Of a vertex or an edge, in the search, the relaxation and the restriction, with proofs."""
    box = Hyperrectangle(np.full(len(start), -4.0), np.full(len(start), 4.0))
    for of_edge in (False, True):
        graph, (s, m, t), edges = by_way_of(box, start, goal)
        if of_edge:
            edges[1].add_constraint(constraint(edges[1].xu))
        else:
            m.add_constraint(constraint(m.x))
        results = [graph.solve_shortest_path(s, t, options) for options in (None, RELAXED)]
        for result in (*results, graph.solve_convex_restriction(edges)):
            # Points keep cones to rounding of the solver, and cost less by as much.
            assert result.cost == pytest.approx(truth, rel=1e-7)
            assert truth * (1.0 - 1e-6) <= result.lower_bound <= truth * (1.0 + 1e-12)
            assert result.violation <= 1e-7
        assert all(result.relaxation_bound.verify() for result in results)


@pytest.mark.parametrize(
    ("constraint", "low", "high"),
    [
        # The determinant is x y - 1.
        (
            lambda x: positive_semidefinite(
                [[[0, 1], [1, 0]], [[1, 0], [0, 0]], [[0, 0], [0, 1]]], x
            ),
            (0.0, 0.0),
            (0.9, 0.9),
        ),
        (lambda x: exp(x[0]) <= x[1], (1.0, 0.0), (2.0, 2.7)),
        (
            # v exp(u / v) is at least e u.
            lambda x: exponential_cone(np.eye(3)[:, :2] @ x + [0.0, 0.0, 1.0]),
            (0.7, 0.5),
            (1.0, 4.0),
        ),
    ],
)
def test_cones_that_no_path_keeps_are_proven(constraint, low, high):
    """By weights that are in the dual cone for sure."""
    graph, (s, m, t), _ = by_way_of(Hyperrectangle(low, high), (0.0, 0.0), (1.0, 1.0))
    m.add_constraint(constraint(m.x))
    result = graph.solve_shortest_path(s, t)
    assert not result.is_success
    assert "proven" in result.reason


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize(
    ("cost", "low", "high", "truth"),
    [
        # a exp(-x) + x has its least value 1 + log(a) at log(a).
        (lambda x, a: a * (exp(-x[0]) + (x[0] + 5.0)), [-5.0], [5.0], 6.0),
        (
            lambda x, a: a * (7.0 * exp(-x[0]) + (x[0] + 5.0)),
            [-5.0],
            [5.0],
            6.0 + math.log(7.0),
        ),
        (lambda x, a: a * (exp(-x) + exp(x)), [-2.0, -3.0], [2.0, 3.0], 4.0),
        # |(3, 4)|^2 / T + T is least where T = 5.
        (
            lambda x, a: a * (quad_over_lin(np.array([[3.0], [4.0]]) @ x[:1], x[1]) + x[1]),
            [1.0, 0.0],
            [2.0, 90.0],
            10.0,
        ),
    ],
)
def test_each_convex_function_is_a_cost(cost, low, high, truth, scale):
    """Least values by calculus, in units of any size."""
    graph, (s, m, t), _ = by_way_of(Hyperrectangle(low, high), low, low)
    for edge in graph.edges:
        edge._costs.clear()
    m.add_cost(cost(m.x, scale))
    for options in (None, RELAXED):
        check(graph.solve_shortest_path(s, t, options), scale * truth)


def test_a_flow_that_is_split_keeps_cones_in_perspective():
    """Two ways of equal cost, each with a cone: the relaxation's bound is what either costs."""
    graph = GraphOfConvexSets()
    s, t = graph.add_vertex(Point([0.0, 0.0])), graph.add_vertex(Point([4.0, 0.0]))
    for sign in (1.0, -1.0):
        m = graph.add_vertex(Hyperrectangle([-4.0, -4.0], [4.0, 4.0]))
        joined(graph, s, m)
        joined(graph, m, t)
        m.add_constraint(positive_semidefinite(DISC, np.diag([1.0, sign]) @ m.x))
        m.add_cost(exp([0.0, sign] @ m.x - 0.5))
    # At (2, 0.5) and its mirror image, where y costs 0 and the exponential 1 - more further up.
    check(graph.solve_shortest_path(s, t, RELAXED), DETOUR + 1.0, 1e-6)


def test_cones_count_where_they_are_said_to():
    """In the restriction alone the bound of the relaxation is the straight way."""
    box = Hyperrectangle([-4.0, -4.0], [4.0, 4.0])
    graph, (s, m, t), _ = by_way_of(box, (0.0, 0.0), (4.0, 0.0))
    m.add_constraint(positive_semidefinite(DISC, m.x), Transcription.RESTRICTION)
    result = graph.solve_shortest_path(s, t, RELAXED)
    assert result.cost == pytest.approx(DETOUR, rel=1e-7)
    assert result.lower_bound == pytest.approx(4.0, rel=1e-7)
    assert graph.solve_shortest_path(s, t).cost == pytest.approx(4.0, rel=1e-7)


@pytest.mark.parametrize(
    ("constraint", "truth"),
    [
        (lambda x: positive_semidefinite(DISC, x), 0.5),
        # y >= exp(x - 2) / 2 at x = 2.
        (lambda x: exp(x[0] - 2.0) <= 2.0 * x[1], 0.5),
    ],
)
def test_cones_hold_beside_functions(constraint, truth):
    """A function that need not be convex puts x at 2; the cone bounds y there."""
    box = Hyperrectangle([-4.0, -4.0], [4.0, 4.0])
    graph, (_, m, _), edges = by_way_of(box, (0.0, 0.0), (4.0, 0.0))
    m.add_constraint(constraint(m.x))
    m.add_constraint(
        FunctionConstraint(lambda x: (x[0] - 2.0) ** 3, 0.0, 0.0), Transcription.RESTRICTION
    )
    found = graph.solve_convex_restriction(edges)
    # A cube is flat at its zero: what it keeps to 1e-7 it keeps to 5e-3 of x.
    assert found.cost == pytest.approx(2.0 * math.hypot(2.0, truth), abs=5e-3)
    assert found.violation <= 1e-7


@pytest.mark.parametrize("kind", range(3))
def test_spectrahedra_are_vertices(kind):
    """A disc that matrices describe, alone, in a product and in an intersection."""
    disc = Spectrahedron(DISC)
    if kind == 1:
        disc = CartesianProduct([disc, Hyperrectangle([0.0], [1.0])])
    if kind == 2:
        disc = Intersection(disc, Hyperrectangle([0.0, -1.0], [4.0, 1.0]))
    n = disc.ambient_dimension
    graph, (s, m, t), edges = by_way_of(disc, np.zeros(n), 4.0 * np.eye(n)[0])
    for options in (None, RELAXED):
        result = graph.solve_shortest_path(s, t, options)
        assert result.cost == pytest.approx(DETOUR, rel=1e-6)
        assert DETOUR * (1.0 - 1e-6) <= result.lower_bound <= DETOUR * (1.0 + 1e-12)
        np.testing.assert_allclose(result.points[1][:2], [2.0, 0.5], atol=1e-4)
    if kind == 0:
        m.add_constraint(FunctionConstraint(lambda x: x[1], 1.0, 2.0), Transcription.RESTRICTION)
        found = graph.solve_convex_restriction(edges)
        assert found.cost == pytest.approx(2.0 * math.hypot(2.0, 1.0), rel=1e-6)


def exact_in(cone, rng):
    """Return rows of a cone as fractions; of the exponential one to 60 digits above it."""
    if cone is Cone.SECOND_ORDER:
        # Pythagorean: a^2 + b^2 = c^2 of whole numbers.
        p, q = (int(v) for v in rng.integers(-30, 30, 2))
        return [Fraction(p * p + q * q), Fraction(p * p - q * q), Fraction(2 * p * q)]
    if cone is Cone.SEMIDEFINITE:
        G = rng.integers(-9, 9, (3, int(rng.integers(1, 4))))
        M = G @ G.T
        return [Fraction(int(M[i, j])) for j in range(3) for i in range(j + 1)]
    u, v = (float(x) for x in rng.uniform(-3.0, 3.0, 2))
    v = abs(v)
    with mpmath.workdps(60):
        w = mpmath.mpf(v) * mpmath.exp(mpmath.mpf(u) / mpmath.mpf(v))
        above = Fraction(int(mpmath.ceil(w * mpmath.mpf(10) ** 50)), 10**50)
    return [Fraction(u), Fraction(v), above]


@pytest.mark.parametrize("cone", [Cone.SECOND_ORDER, Cone.SEMIDEFINITE, Cone.EXPONENTIAL])
def test_weights_never_weigh_rows_of_the_cone_below_zero(cone):
    """Any numbers become weights of the dual cone, to the last bit; good ones stay as they are."""
    rng = np.random.default_rng(7)
    size = 6 if cone is Cone.SEMIDEFINITE else 3
    rows = [exact_in(cone, rng) for _ in range(60)]
    for trial in range(60):
        z = 10.0 ** rng.uniform(-6.0, 3.0) * rng.normal(size=size)
        if trial % 3 == 0:
            z[0] = 0.0
        weights = [Fraction(v) for v in into_dual(cone, z).tolist()]
        for each in rows:
            assert sum(a * b for a, b in zip(weights, each, strict=True)) >= 0
    inside = {
        Cone.SECOND_ORDER: [2.0, 1.0, 1.0],
        Cone.SEMIDEFINITE: [2.0, 1.0, 3.0, 0.0, 0.5, 1.0],
        Cone.EXPONENTIAL: [-1.0, 0.5, 1.0],
    }
    np.testing.assert_array_equal(into_dual(cone, np.array(inside[cone])), inside[cone])


def test_dual_weights_that_err_by_rounding_are_moved_by_rounding():
    """On the surface of the dual cone, off by what a solver is."""
    for v in (-30.0, -1.0, 0.0, 1.0, 20.0):
        exact = np.array([-1.0, v, math.exp(-v - 1.0)])
        wrong = exact * (1.0 - 1e-9 * np.array([0.0, np.sign(v), 1.0]))
        moved = into_dual(Cone.EXPONENTIAL, wrong)
        np.testing.assert_allclose(moved, exact, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("kind", ["exponential", "quotient", "squares"])
def test_minorants_are_below_for_every_point(kind):
    """``y . w - c`` is at most the function, computed with 50 digits."""
    rng = np.random.default_rng(3)
    with mpmath.workdps(50):
        for _ in range(300):
            size = 1 if kind == "exponential" else 3
            y = 10.0 ** rng.uniform(-3.0, 2.0) * rng.normal(size=size)
            c = shorten(KINDS[kind], y, 0, size)
            at = [mpmath.mpf(v) for v in rng.uniform(-5.0, 5.0, size).tolist()]
            if kind == "exponential":
                at = [mpmath.log(mpmath.mpf(float(y[0])))] if y[0] > 0.0 else at
                value = mpmath.exp(at[0])
            elif kind == "quotient":
                at[0] = abs(at[0]) + mpmath.mpf("1e-3")
                # As near as it comes: where the vector is the slope times half the divisor.
                at[1:] = [mpmath.mpf(v) * at[0] / 2 for v in y[1:].tolist()]
                value = sum(v * v for v in at[1:]) / at[0]
            else:
                at = [mpmath.mpf(v) / 2 for v in y.tolist()]
                value = sum(v * v for v in at)
            assert (
                sum(mpmath.mpf(v) * w for v, w in zip(y.tolist(), at, strict=True)) - float(c)
                <= value
            )


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (exponential_cone, "exponential_cone takes 3 entries, not 2"),
        (lambda x: second_order_cone([1.0]), "second_order_cone takes an expression"),
        (lambda x: rotated_second_order_cone(x[:1]), "takes at least 2 entries, not 1"),
        (lambda x: positive_semidefinite(DISC[:2], x), r"F must have the shape \(3, N, N\)"),
        (
            lambda x: positive_semidefinite([[[0, 1], [0, 0]]] * 3, x),
            r"F\[0\] must be symmetric",
        ),
        (lambda x: quad_over_lin(x, x), "divisor must be a number, not 2 entries"),
        (lambda x: exp(x) <= 1.0, "takes one norm or sum of squares, not 2"),
        (lambda x: exp(2.0), "exp takes an expression"),
    ],
)
def test_what_is_refused_is_named(wrong, message):
    """With who takes it."""
    graph = GraphOfConvexSets()
    m = graph.add_vertex(Hyperrectangle([0.0, 0.0], [1.0, 1.0]))
    with pytest.raises(ConvexSetError, match=message):
        wrong(m.x)


def test_functions_compute_as_numbers_do():
    """Values at points, of sums and multiples."""
    graph = GraphOfConvexSets()
    m = graph.add_vertex(Hyperrectangle([0.0, 0.0], [9.0, 9.0]))
    x = np.array([2.0, 3.0])
    cost = 2.0 * exp(m.x) + 3.0 * quad_over_lin(m.x, m.x[1]) + 0.0 * norm(m.x) + sum_squares(m.x)
    truth = 2.0 * (math.exp(2.0) + math.exp(3.0)) + 3.0 * 13.0 / 3.0 + 13.0
    assert cost.at({m.id: x}) == pytest.approx(truth, rel=1e-14)
    assert cost.at({m.id: np.zeros(2)}) == 4.0
    assert quad_over_lin(m.x, m.x[1]).at({m.id: np.array([1.0, 0.0])}) == np.inf
