"""Polyhedra inside others with fewer faces, and the largest images inside: what they keep."""

import math

import numpy as np
import pytest

from scene_graph_ros.convex.questions import affine_transformation
from scene_graph_ros.convex.solve.cones import equilibration
from scene_graph_ros.geometry.optimization import (
    ConicProgram,
    ConvexSetError,
    HPolyhedron,
    SolverError,
)

ANGLES = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False) + 0.01
ROUND = HPolyhedron(np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1), np.ones(24))
DOOR = HPolyhedron.make_box([0.9, -0.1], [2.0, 0.1])


def cut_cube(n):
    """Return a cube whose corners are cut off by 1e-3 of its edge."""
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * n, indexing="ij")).reshape(n, -1).T
    rows = np.concatenate([np.eye(n), -np.eye(n), corners])
    return HPolyhedron(rows, np.append(np.ones(2 * n), np.full(2**n, n - 2e-3)))


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("is_mapped", [False, True])
def test_fewer_faces_inside_with_a_share_of_the_volume(ratio, is_mapped):
    """Of 24 sides; the fewer, the less has to stay."""
    found = ROUND.simplify_by_incremental_face_translation(ratio, is_mapped)
    assert len(found.b) <= {0.1: 5, 0.5: 9, 0.9: 24}[ratio]
    assert found.contained_in(ROUND, 0.0, certificate=True).certificate.verify()
    assert found.contained_in(ROUND, 0.0)
    assert found.calc_volume() >= ratio * ROUND.calc_volume() * (1.0 - 1e-9)


@pytest.mark.parametrize("n", [2, 3])
def test_cut_corners_are_of_no_use(n):
    """A cube of which they took little is a cube again, at nearly its volume."""
    found = cut_cube(n).simplify_by_incremental_face_translation(0.9)
    assert len(found.b) == 2 * n
    assert found.contained_in(cut_cube(n), 0.0)
    assert found.calc_volume() > 0.98 * 2.0**n


def test_points_stay_inside():
    """Of which one is near to a side."""
    points = np.array([[0.98, 0.0], [-0.5, 0.5], [0.0, 0.0]])
    found = ROUND.simplify_by_incremental_face_translation(points_to_contain=points)
    assert found.point_in_set(points, 0.0).all()
    assert len(found.b) < 24


def test_polytopes_are_met_or_kept_whole():
    """A door on the right: it is met with some padding, or nothing of it is lost."""
    other = HPolyhedron.make_box([-2.0, 0.5], [-0.6, 0.7])
    for seed in range(3):
        met = ROUND.simplify_by_incremental_face_translation(
            intersecting_polytopes=[DOOR, other], random_seed=seed
        )
        assert met.intersects_with(DOOR)
        assert met.intersects_with(other)
        whole = ROUND.simplify_by_incremental_face_translation(
            do_affine_transformation=False,
            intersecting_polytopes=[DOOR],
            keep_whole_intersection=True,
            random_seed=seed,
        )
        assert ROUND.intersection(DOOR).contained_in(whole, 0.0)
        assert len(whole.b) < 24


def test_the_same_seed_simplifies_the_same():
    """And one round less may leave more faces."""
    one, other = (ROUND.simplify_by_incremental_face_translation(0.5) for _ in range(2))
    np.testing.assert_array_equal(one.A, other.A)
    np.testing.assert_array_equal(one.b, other.b)
    once = ROUND.simplify_by_incremental_face_translation(0.5, False, 1)
    assert len(once.b) >= len(ROUND.simplify_by_incremental_face_translation(0.5, False).b)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_largest_images(size):
    """A right triangle fills half of a square, a box all of one that is moved and stretched."""
    triangle = HPolyhedron([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
    square = HPolyhedron.make_box(size * np.array([9.0, 4.0]), size * np.array([11.0, 6.0]))
    found = triangle.maximum_volume_inscribed_affine_transformation(square)
    assert found.calc_volume() == pytest.approx(2.0 * size**2, rel=1e-6)
    assert found.contained_in(square, 0.0)
    wide = HPolyhedron.make_box(size * np.array([0.0, 5.0, 1.0]), size * np.array([4.0, 6.0, 3.0]))
    filled = HPolyhedron.make_unit_box(3).maximum_volume_inscribed_affine_transformation(wide)
    assert filled.calc_volume() == pytest.approx(8.0 * size**3, rel=1e-6)
    assert filled.contained_in(wide, 0.0)
    assert wide.contained_in(filled, 1e-6 * size)


def thin_polyhedron(rng, n):
    """Return a cut cube that is stretched along its axes by up to a thousand, and moved."""
    rows = rng.normal(size=(int(rng.integers(2, 16)), n))
    sides = np.linalg.norm(rows, axis=1) * rng.uniform(0.5, 1.5, len(rows))
    A = np.concatenate([rows, np.eye(n), -np.eye(n)]) / 10.0 ** rng.uniform(-1.5, 1.5, n)
    return HPolyhedron(A, np.append(sides, np.full(2 * n, 3.0)) + A @ rng.normal(size=n) * 10.0)


@pytest.mark.parametrize("seed", [*range(12), 59])
def test_images_of_thin_polyhedra(seed):
    """Inside without tolerance; the largest image of a set in itself is the set."""
    rng = np.random.default_rng(seed)
    n = 1 + seed % 4
    one, other = (thin_polyhedron(rng, n) for _ in range(2))
    assert one.maximum_volume_inscribed_affine_transformation(other).contained_in(other, 0.0)
    same = one.maximum_volume_inscribed_affine_transformation(one)
    assert same.calc_volume() == pytest.approx(one.calc_volume(), rel=1e-6)


def test_an_image_is_sought_again_where_it_is_about_as_large_as_the_set(monkeypatch):
    """Where the first attempt fails: in the other coordinates the map is near 1."""
    seen = []
    solve = affine_transformation._solve

    def fails_first(X, Y):
        seen.append((X, Y))
        if len(seen) == 1:
            raise SolverError("not solved")
        return solve(X, Y)

    monkeypatch.setattr(affine_transformation, "_solve", fails_first)
    flat = HPolyhedron.make_box([0.0, 5.0, 1.0], [4.0, 5.001, 300.0])
    filled = HPolyhedron.make_unit_box(3).maximum_volume_inscribed_affine_transformation(flat)
    assert filled.calc_volume() == pytest.approx(flat.calc_volume(), rel=1e-6)
    (_, b), (_, d) = seen[1]
    np.testing.assert_allclose(np.sort(b), np.sort(d), rtol=1e-3)


@pytest.mark.parametrize("ratio", [0.3, 0.4, 0.5, 0.6, 0.7])
def test_a_ball_of_many_faces_has_fewer(ratio):
    """Of 60 planes that touch a ball."""
    rows = np.random.default_rng(5).normal(size=(60, 3))
    whole = HPolyhedron(rows, np.linalg.norm(rows, axis=1))
    simple = whole.simplify_by_incremental_face_translation(ratio)
    assert len(simple.b) < len(whole.b)
    assert simple.calc_volume() >= ratio * whole.calc_volume()
    assert simple.contained_in(whole, 0.0)


@pytest.fixture(params=[1.0, -1.0])
def noisy(request, monkeypatch):
    """Return a function that leaves noise where rows about the middle of a set have a 0."""
    exact = affine_transformation._about_own_middle

    def add(noise):
        def about(of):
            (A, b), middle, size = exact(of)
            b = np.where(np.abs(b) < 1e-9, 0.0, b)
            b += request.param * noise * np.resize([1.0, -1.0, 0.3], len(b))
            return (A, b), middle, size

        monkeypatch.setattr(affine_transformation, "_about_own_middle", about)

    return add


@pytest.mark.parametrize("noise", [10.0**-k for k in range(8, 19)])
def test_rounding_in_place_of_nothing_makes_no_image_smaller(noise, noisy):
    """Of the hypotenuse the middle of the triangle's box is a point."""
    noisy(noise)
    triangle = HPolyhedron([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
    square = HPolyhedron.make_box([9.0, 4.0], [11.0, 6.0])
    found = triangle.maximum_volume_inscribed_affine_transformation(square)
    assert found.calc_volume() == pytest.approx(2.0, rel=max(1e-8, 10.0 * noise))
    assert found.contained_in(square, 0.0)


def test_an_image_that_is_not_the_largest_is_an_error(noisy, monkeypatch):
    """A program of such sizes that the solver's answer breaks it."""
    noisy(1e-14)
    monkeypatch.setattr(equilibration, "_RANGE", 1000.0)
    triangle = HPolyhedron([[-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]], [0.0, 0.0, 1.0])
    square = HPolyhedron.make_box([9.0, 4.0], [11.0, 6.0])
    with pytest.raises(SolverError, match=r"not (found: constraints are broken by|solved)"):
        triangle.maximum_volume_inscribed_affine_transformation(square)


def test_feasible_sets_of_programs():
    """Of linear rows in all variables; an equation is two rows."""
    program = ConicProgram()
    x = program.add_variables(2)
    program.add_linear_inequalities([[1.0], [-1.0]], [2.0, 1.0], x[1:])
    program.add_linear_equations([[1.0, -1.0]], [0.0], x)
    of = HPolyhedron(program)
    assert of.A.shape == (4, 2)
    assert of.support([1.0, 0.0]).value == 2.0
    assert of.point_in_set([[-1.0, -1.0], [0.5, 0.5], [0.5, 0.6]], 0.0).tolist() == [1, 1, 0]
    program.add_second_order_cone(np.eye(2), np.zeros(2), x)
    with pytest.raises(ConvexSetError, match="linear rows alone, not SECOND_ORDER"):
        HPolyhedron(program)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"min_volume_ratio": 0.0}, "min_volume_ratio must be above 0, up to 1, not 0.0"),
        ({"max_iterations": 0}, "max_iterations must be a whole number, at least 1, not 0"),
        ({"points_to_contain": [[2.0, 0.0]]}, r"must be in the set, which \[2.0, 0.0\] is not"),
        ({"points_to_contain": [[2.0]]}, "points_to_contain must be a point"),
        ({"intersection_padding": -1.0}, "intersection_padding must be a finite number"),
        (
            {"intersecting_polytopes": [HPolyhedron.make_box([5.0, 5.0], [6.0, 6.0])]},
            r"intersecting_polytopes\[0\] does not meet the set",
        ),
        ({"intersecting_polytopes": [HPolyhedron.make_unit_box(3)]}, "has 3 dimensions"),
    ],
)
def test_bad_options_are_named(options, message):
    """With their values."""
    with pytest.raises(ConvexSetError, match=message):
        ROUND.simplify_by_incremental_face_translation(**options)


def test_unbounded_and_flat_sets_are_refused():
    """As they have no volume to keep a share of."""
    half = HPolyhedron([[1.0, 0.0]], [0.0])
    flat = HPolyhedron.make_box([0.0, 0.0], [1.0, 0.0])
    with pytest.raises(ConvexSetError, match="must be bounded"):
        half.simplify_by_incremental_face_translation()
    with pytest.raises(ConvexSetError, match="circumbody must be bounded"):
        ROUND.maximum_volume_inscribed_affine_transformation(half)
    with pytest.raises(ConvexSetError, match="circumbody is flat"):
        ROUND.maximum_volume_inscribed_affine_transformation(flat)
