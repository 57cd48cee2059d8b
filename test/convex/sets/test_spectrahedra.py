"""Spectrahedra: known bodies, proofs either way, what touches, what goes on for ever."""

from fractions import Fraction
import math

import numpy as np
import pytest

from scene_graph_ros.convex.solve.cutting.cones import (
    cut_row,
    is_cut,
    is_semidefinite,
    shortened,
)
from scene_graph_ros.geometry.optimization import (
    AffineSubspace,
    CartesianProduct,
    ConicProgram,
    ConvexHull,
    ConvexSetError,
    GraphOfConvexSets,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    iris,
    MinkowskiSum,
    norm,
    Point,
    Spectrahedron,
)

UP, FLIP, SWAP, DOWN = (
    np.diag([1.0, 0.0]),
    np.diag([1.0, -1.0]),
    np.eye(2)[::-1],
    np.diag([0.0, 1]),
)
DISC = Spectrahedron(np.array([np.eye(2), FLIP, SWAP]))
"""``[[1 + x, y], [y, 1 - x]]`` is semidefinite where x^2 + y^2 <= 1."""
ABOVE_A_PARABOLA = Spectrahedron(np.array([UP, SWAP, DOWN]))
"""``[[1, x], [x, y]]`` where y >= x^2."""


def elliptope(order):
    """Return all correlation matrices, by what is beside their diagonals."""
    matrices = [np.eye(order)]
    for j in range(order):
        for i in range(j):
            unit = np.zeros((order, order))
            unit[i, j] = unit[j, i] = 1.0
            matrices.append(unit)
    return Spectrahedron(np.array(matrices))


def of_unit_trace(order):
    """Return all semidefinite matrices of trace 1, in order (order + 1) / 2 dimensions."""
    program = ConicProgram()
    X = program.add_symmetric_matrix(order)
    program.add_semidefinite_matrix(X)
    program.add_linear_equations([np.ones(order)], [1.0], np.diag(X))
    return Spectrahedron(program)


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, -1e-9, -1e-6, -1e-3])
def test_a_disc_beside_a_half_plane(size, gap):
    """``0.6 x + 0.8 y >= 1 + gap``: proven either way, as for an ellipsoid."""
    disc = Spectrahedron(np.array([size * np.eye(2), FLIP, SWAP]))
    half = HPolyhedron([[-0.6, -0.8]], [-(1.0 + gap) * size])
    decision = disc.intersects_with(half, certificate=True)
    assert decision.value == (gap < 0.0)
    assert decision.certificate.kind == ("point" if gap < 0.0 else "farkas")
    assert decision.certificate.verify(disc, half)


def test_touching_is_undecided():
    """With a gap that rounding leaves."""
    decision = DISC.intersects_with(HPolyhedron([[-0.6, -0.8]], [-1.0]), certificate=True)
    assert decision.value
    assert decision.certificate.kind == "undecided"
    assert decision.certificate.gap < 1e-9
    assert not decision.certificate.verify()


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_a_disc_answers_as_an_ellipsoid(size):
    """Supports, nearest points, boxes, membership near to the border."""
    disc = Spectrahedron(np.array([size * np.eye(2), FLIP, SWAP]))
    ball = Hyperellipsoid.make_hypersphere(size, [0.0, 0.0])
    for angle in (0.3, 4.0):
        way = np.array([math.cos(angle), math.sin(angle)])
        reached = disc.support(3.0 * way)
        assert reached.value == pytest.approx(3.0 * size, abs=1e-9 * size)
        assert reached.value + reached.gap >= 3.0 * size * (1.0 - 1e-15)
        points = size * np.outer([0.5, 1.0 - 1e-6, 1.0 + 1e-6, 5.0], way)
        mine, truth = disc.projection(points), ball.projection(points)
        np.testing.assert_allclose(mine.distances, truth.distances, atol=1e-9 * size)
        np.testing.assert_allclose(mine.points, truth.points, atol=1e-8 * size)
        assert mine.gaps.max() < 2e-9 * size
        assert disc.point_in_set(points[:3], 1e-5 * size).tolist() == [True, True, True]
        assert disc.point_in_set(points[:3], 1e-8 * size).tolist() == [True, True, False]
    bounds = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(disc)
    np.testing.assert_allclose(bounds.ub, [size, size], rtol=1e-9)
    assert AffineSubspace(disc).affine_dimension() == 2


@pytest.mark.parametrize("order", [2, 3, 4])
def test_matrices_of_unit_trace_reach_the_largest_eigenvalue(order):
    """The most of ``<C, X>``; their dimension, and that they are bounded and flat."""
    of = of_unit_trace(order)
    n = of.ambient_dimension
    assert n == order * (order + 1) // 2
    bounded = of.is_bounded(certificate=True)
    assert bounded.value
    assert bounded.certificate.kind == "multipliers"
    assert bounded.certificate.verify(of)
    rng = np.random.default_rng(order)
    c = rng.normal(size=n)
    C = np.zeros((order, order))
    j, i = np.tril_indices(order)
    C[i, j] = C[j, i] = np.where(i == j, c, 0.5 * c)
    reached = of.support(c)
    assert reached.value == pytest.approx(np.linalg.eigvalsh(C)[-1], abs=1e-9)
    assert reached.gap < 1e-9


def test_all_semidefinite_matrices_go_on_for_ever():
    """In three dimensions: a direction inside, and by half-spaces that it breaks a bounded one."""
    program = ConicProgram()
    X = program.add_symmetric_matrix(2)
    program.add_semidefinite_matrix(X)
    cone = Spectrahedron(program)
    decision = cone.is_bounded(certificate=True)
    assert not decision.value
    assert decision.certificate.kind == "recession"
    assert decision.certificate.verify(cone)
    program.add_linear_inequalities([[1.0, 0.0, 1.0]], [5.0], X[np.triu_indices(2)])
    assert Spectrahedron(program).is_bounded()
    assert cone.support([1.0, 0.0, 0.0]).value == np.inf
    assert cone.support([-1.0, 0.0, -1.0]).value == pytest.approx(0.0, abs=1e-9)


def test_above_a_parabola():
    """Its only direction is at the border; the most of ``x - y`` is 1/4, at (1/2, 1/4)."""
    decision = ABOVE_A_PARABOLA.is_bounded(certificate=True)
    assert (decision.value, decision.certificate.kind) == (False, "recession")
    assert decision.certificate.verify()
    reached = ABOVE_A_PARABOLA.support([1.0, -1.0])
    assert reached.value == pytest.approx(0.25, abs=1e-9)
    assert reached.gap <= 1e-12
    np.testing.assert_allclose(reached.point, [0.5, 0.25], atol=1e-4)
    assert ABOVE_A_PARABOLA.support([0.0, 1.0]).value == np.inf
    # The nearest point to (0, -1) is the vertex.
    found = ABOVE_A_PARABOLA.projection([[0.0, -1.0]])
    assert found.distances[0] == pytest.approx(1.0, abs=1e-9)


def test_flat_and_empty_ones():
    """Only the zero matrix has no trace; no matrix has a negative one."""
    units = np.array([np.zeros((2, 2)), UP, SWAP, DOWN])
    alone = Spectrahedron(units, E=[[1.0, 0.0, 1.0]], f=[0.0])
    assert alone.is_empty(certificate=True).certificate.verify()
    assert not alone.is_empty()
    assert alone.is_bounded(certificate=True).certificate.verify()
    nothing = Spectrahedron(units, A=[[1.0, 0.0, 1.0]], b=[-1e-9])
    decision = nothing.is_empty(certificate=True)
    assert (decision.value, decision.certificate.kind) == (True, "farkas")
    assert decision.certificate.verify(nothing)
    assert nothing.projection([[0.0, 0.0, 0.0]]) is None
    assert not nothing.point_in_set([0.0, 0.0, 0.0])
    with pytest.raises(ConvexSetError, match="the set is empty"):
        nothing.support([1.0, 0.0, 0.0])


def test_what_no_weights_contradict_is_undecided():
    """``[[x, 1], [1, y]]`` with y <= 0 is empty, but comes as near to a point as one likes."""
    weak = Spectrahedron(np.array([SWAP, UP, DOWN]), A=[[0.0, 1.0]], b=[0.0])
    decision = weak.is_empty(certificate=True)
    assert decision.certificate.kind == "undecided"
    assert decision.certificate.gap < 1e-9


def test_volume_of_correlation_matrices():
    """Of order 3 it is pi^2 / 2 (Joe 2006)."""
    of = elliptope(3)
    found = of.calc_volume_via_sampling(np.random.default_rng(3))
    assert found.volume == pytest.approx(0.5 * math.pi**2, rel=3.0 * found.rel_accuracy)
    assert not of.has_exact_volume
    with pytest.raises(ConvexSetError, match="calc_volume_via_sampling"):
        of.calc_volume()


@pytest.mark.parametrize(
    ("of", "way", "truth"),
    [
        (MinkowskiSum([DISC, Hyperrectangle([-1, -1], [1, 1])]), [3.0, 4.0], 12.0),
        (ConvexHull([DISC, Point([0.0, 3.0])]), [3.0, 4.0], 12.0),
        (ConvexHull([DISC, Point([0.0, 3.0])]), [4.0, 3.0], 9.0),
        # Two discs of radius 1, centres 1 apart, meet at (1/2, sqrt(3)/2).
        (
            Intersection([DISC, Hyperellipsoid.make_hypersphere(1.0, [1.0, 0.0])]),
            [0.0, 2.0],
            math.sqrt(3.0),
        ),
        (CartesianProduct([DISC], A=0.5 * np.eye(2), b=[-1.0, 0.0]), [3.0, 4.0], 16.0),
    ],
)
def test_parts_of_other_sets(of, way, truth):
    """As an ellipsoid is, with their proofs."""
    assert of.support(way).value == pytest.approx(truth, abs=1e-8)
    for decision in (of.is_empty(certificate=True), of.is_bounded(certificate=True)):
        assert decision.certificate.verify(of)
    assert not of.is_empty()
    assert of.is_bounded()


def test_an_obstacle_of_a_region():
    """Its face is proven to keep the disc out; a path through a graph ends in it."""
    moved = CartesianProduct([DISC], A=np.eye(2), b=[-2.0, 0.0])
    found = iris([moved], [0.0, 0.0], HPolyhedron.make_unit_box(2), certificate=True)
    assert found.separations[0].certificate.verify()
    graph = GraphOfConvexSets()
    start, goal = graph.add_vertex(Point([3.0, 4.0])), graph.add_vertex(DISC)
    edge = graph.add_edge(start, goal)
    edge.add_cost(norm(edge.xv - edge.xu))
    result = graph.solve_shortest_path(start, goal)
    assert result.lower_bound <= 4.0 + 1e-12
    assert result.cost == pytest.approx(4.0, rel=1e-7)
    assert result.gap <= 1e-6


def test_no_dimensions():
    """The whole space, which is not empty."""
    of = Spectrahedron()
    assert (of.ambient_dimension, of.is_empty(), of.is_bounded()) == (0, False, True)
    assert of.point_in_set([])


@pytest.mark.parametrize("seed", range(20))
def test_planes_and_matrices_in_fractions(seed):
    """A plane of a matrix is what it says, exactly; elimination knows eigenvalues' signs."""
    rng = np.random.default_rng(seed)
    order = int(rng.integers(1, 5))
    u = shortened(rng.normal(size=order) * 10.0 ** rng.integers(-20, 1, size=order))
    block = elliptope(order).lift().cones[0] if order > 1 else None
    if block is not None:
        assert is_cut(block, u)
        row, side = cut_row(block, u, int(block.columns.max()) + 1)
        matrix = rng.integers(-3, 4, size=(order, order))
        matrix = matrix + matrix.T
        x = np.zeros(len(row), dtype=object)
        x[block.columns] = matrix
        exact = [Fraction(v) for v in u.tolist()]
        form = sum(
            exact[i] * exact[j] * int(matrix[i, j]) for i in range(order) for j in range(order)
        )
        assert sum(Fraction(r) * int(v) for r, v in zip(row.tolist(), x, strict=True)) == -form
        assert side == 0.0
        assert not is_cut(block, np.full(order, 1.0 / 3.0))
    factor = rng.integers(-3, 4, size=(order, int(rng.integers(0, order + 1))))
    square = factor @ factor.T
    as_fractions = [[Fraction(int(v)) for v in row] for row in square]
    assert is_semidefinite(as_fractions)
    as_fractions[0][0] -= Fraction(int(square[0, 0])) + Fraction(1, 10**30)
    assert not is_semidefinite(as_fractions)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Spectrahedron(np.eye(2)), r"F must have the shape \(k, N, N\), not \(2, 2\)"),
        (lambda: Spectrahedron([[[0.0, 1.0], [2.0, 0.0]]]), r"F\[0\] must be symmetric"),
        (lambda: Spectrahedron([np.zeros((2, 1, 1)), np.zeros((3, 1, 1))]), "length 2, one more"),
        (lambda: Spectrahedron(np.zeros((2, 1, 1)), A=[[1.0]]), "A and b belong together"),
        (lambda: Spectrahedron(np.zeros((2, 1, 1)), E=[[1.0, 2.0]], f=[0]), r"E must .* \(m, 1\)"),
        (lambda: Spectrahedron(np.full((2, 1, 1), np.nan)), "finite numbers"),
        (DISC.to_shape_with_pose, "shapes have 3 dimensions"),
    ],
)
def test_errors_name_argument_value_and_remedy(make, message):
    """What makes no spectrahedron."""
    with pytest.raises(ConvexSetError, match=message):
        make()


def test_programs_of_other_cones_are_refused():
    """A second-order cone is another set's."""
    program = ConicProgram()
    x = program.add_variables(2)
    program.add_second_order_cone(np.eye(2), np.zeros(2), x)
    with pytest.raises(ConvexSetError, match="not SECOND_ORDER; intersect"):
        Spectrahedron(program)
