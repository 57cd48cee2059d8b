"""Points and optima of rows, balls and matrices by planes: exact proofs, bounds that hold."""

from fractions import Fraction

from exact_checks import assert_shows
import numpy as np
import pytest

from scene_graph_ros.convex.solve.cones.lift import Ball, Lift, Semidefinite
from scene_graph_ros.convex.solve.cutting.cones import cut_row, is_cut
from scene_graph_ros.convex.solve.cutting.cutting import (
    find_in_cones,
    maximize_in_cones,
    rows_with_cuts,
)
from scene_graph_ros.convex.solve.cutting.recession_in_cones import recession_in_cones

NONE = np.zeros((0, 3)), np.zeros(0)


def lens(apart):
    """Return two balls in the plane of which the centres are so far apart: x, y, and x moved."""
    E = np.array([[1.0, 0.0, -1.0]])
    return Lift(E, np.array([apart]), *NONE, (Ball(np.array([0, 1])), Ball(np.array([2, 1]))))


def checked(lift, found):
    """Check a point in fractions, or weights of rows and cuts; cuts are checked to be cuts."""
    rows = rows_with_cuts(lift, found.cuts)
    for cut in found.cuts:
        cone = lift.cones[cut.cone]
        assert is_cut(cone, cut.u)
        row, side = cut_row(cone, cut.u, lift.num_variables)
        if isinstance(cone, Ball) and cone.scale < 0:
            assert sum(Fraction(v) ** 2 for v in row.tolist()) <= 1
            assert side == 1.0
    n = lift.num_variables
    assert_shows(found.kind, found.vector, rows.A, rows.b, rows.num_equalities, n)
    if found.kind == "point":
        for cone in lift.balls:
            reach = 1 if cone.scale < 0 else found.vector[cone.scale]
            assert reach >= 0
            assert sum(found.vector[k] ** 2 for k in cone.columns) <= reach**2


@pytest.mark.parametrize("apart", [0.0, 0.5, 1.9, 1.999999, 2.000001, 2.1, 7.0, 1e6])
def test_balls_that_meet_or_not(apart):
    """Up to a millionth of their radius from touching."""
    lift = lens(apart)
    found = find_in_cones(lift)
    assert found.kind == ("point" if apart < 2.0 else "farkas")
    checked(lift, found)


@pytest.mark.parametrize("seed", range(6))
def test_a_ball_among_rows(seed):
    """Rows at known distances from its centre cut it, leave a lens, or are beyond."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=3)
    u /= np.linalg.norm(u)
    ball = (Ball(np.arange(3)),)
    for side, kind in ((-0.999, "point"), (-1.001, "farkas"), (-0.5, "point"), (-20.0, "farkas")):
        lift = Lift(*NONE, u[np.newaxis], np.array([side]), ball)
        found = find_in_cones(lift)
        assert found.kind == kind
        checked(lift, found)


@pytest.mark.parametrize("c", [(1.0, 0.0), (0.0, 1.0), (0.6, -0.8), (-3.0, 0.1)])
@pytest.mark.parametrize("apart", [0.2, 1.0, 1.9])
def test_optima_of_lenses(apart, c):
    """The tip, or a point of one of the arcs: what is inside is reached, the bound is near."""
    lift = lens(apart)
    c, inner = np.array([*c, 0.0]), np.array([0.5 * apart, 0.0, -0.5 * apart])
    found = find_in_cones(lift)
    best = maximize_in_cones(lift, c, inner, found.cuts)
    # The tips, and where each arc has its normal along c.
    tip, unit = np.sqrt(1.0 - 0.25 * apart**2), c[:2] / np.linalg.norm(c)
    points = [np.array([0.5 * apart, sign * tip]) for sign in (1.0, -1.0)]
    points += [unit] * int(unit[0] >= 0.5 * apart)
    points += [unit + np.array([apart, 0.0])] * int(unit[0] <= -0.5 * apart)
    truth = max(float(c[:2] @ point) for point in points)
    assert best.value == pytest.approx(truth, abs=1e-9)
    assert best.value <= best.upper + 1e-15
    assert best.upper >= truth - 1e-10
    assert np.linalg.norm(best.x[:2]) <= 1.0 + 1e-12
    assert best.upper - best.value <= 1e-9


def test_optima_over_matrices():
    """The largest entry beside the diagonal of a semidefinite one with ones on it is 1."""
    E = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    lift = Lift(E, np.ones(2), *NONE, (Semidefinite(np.array([[0, 1], [1, 2]])),))
    found = find_in_cones(lift)
    assert found.kind == "point"
    inner = np.array([1.0, 0.0, 1.0])
    best = maximize_in_cones(lift, np.array([0.0, 1.0, 0.0]), inner, found.cuts)
    assert best.value == pytest.approx(1.0, abs=1e-8)
    assert best.upper >= 1.0 - 1e-12


def test_matrices_that_no_equation_allows():
    """A diagonal entry below 0; and two of which the product is less than what is beside them."""
    for sides in ((-1.0, 0.0, 1.0), (1.0, 1.1, 1.0)):
        lift = Lift(np.eye(3), np.array(sides), *NONE, (Semidefinite(np.array([[0, 1], [1, 2]])),))
        found = find_in_cones(lift)
        assert found.kind == "farkas"
        checked(lift, found)


def test_directions_that_lead_on_for_ever():
    """A ball has none, a cylinder has one, and so has what matrices leave."""
    ball = Lift(*NONE, *NONE, (Ball(np.arange(3)),))
    proof, _, _ = recession_in_cones(ball)
    assert proof.kind == "multipliers"
    cylinder = Lift(*NONE, *NONE, (Ball(np.array([0, 1])),))
    proof, _, _ = recession_in_cones(cylinder)
    assert proof.kind == "recession"
    assert list(proof.vector[:2]) == [0, 0]
    assert proof.vector[2] != 0
    matrix = Lift(*NONE, *NONE, (Semidefinite(np.array([[0, 1], [1, 2]])),))
    proof, _, _ = recession_in_cones(matrix)
    assert proof.kind == "recession"
    x, y, z = proof.vector
    assert x >= 0
    assert z >= 0
    assert x * z >= y * y
    fixed = Lift(np.array([[1.0, 0.0, 1.0]]), np.ones(1), *NONE, matrix.cones)
    proof, cuts, _ = recession_in_cones(fixed)
    assert proof.kind == "multipliers"
    assert all(is_cut(fixed.cones[cut.cone], cut.u) for cut in cuts)
