"""Linear programs: every answer comes with its proof, at every scale, also on the boundary."""

from fractions import Fraction

from exact_checks import assert_shows, exact_rows, largest_at_vertices
from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest

from scene_graph_ros.convex.solve.exact.feasibility import find_deepest, find_point
from scene_graph_ros.convex.solve.exact.maximize import maximize, prove_bound
from scene_graph_ros.convex.solve.exact.rational_simplex import RationalSimplex
from scene_graph_ros.convex.solve.exact.recession import recession
from scene_graph_ros.convex.solve.exact.rows import is_inside, Rows

BOX = np.vstack([np.eye(3), -np.eye(3)])
seeds = st.integers(0, 2**32 - 1)


def random_rows(seed, most=7):
    """Return some rows in some variables: whole numbers half of the time, so that rows meet."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, most)), int(rng.integers(0, 25))
    A = rng.normal(size=(m, n))
    b = rng.normal(size=m) + rng.choice([0.0, 0.5, 2.0])
    if seed % 2:
        A, b = np.round(A), np.round(b)
    A = A * 10.0 ** rng.uniform(-10, 10, size=(m, 1))
    return Rows(A, b, int(rng.integers(0, min(m, 3) + 1))), rng


def shows(proof, rows):
    """Check a proof about rows."""
    n = rows.A.shape[1]
    assert_shows(proof.kind, proof.vector, rows.A, rows.b, rows.num_equalities, n)


@settings(deadline=None, derandomize=True)
@given(seeds)
def test_each_answer_is_proven(seed):
    """Rows of all kinds and scales: a point or Farkas weights, a ray or weights against one."""
    rows, _ = random_rows(seed)
    proof = find_point(rows)
    assert proof.kind in ("point", "farkas")
    shows(proof, rows)
    proof = recession(rows)
    assert proof.kind in ("recession", "multipliers")
    shows(proof, rows)


@settings(deadline=None, derandomize=True)
@given(seeds)
def test_bounds_are_proven_or_broken_by_a_point(seed):
    """A bound that is the optimum itself holds; one a bit below has a point beyond it."""
    rows, rng = random_rows(seed, most=5)
    start = find_point(rows)
    if start.kind != "point":
        return
    c = rng.normal(size=rows.A.shape[1])
    optimum = maximize(rows, c, np.array([float(v) for v in start.vector]))
    A, b = exact_rows(rows.A, rows.b)
    for bound in (0.0, optimum.value, np.nextafter(optimum.value, np.inf), optimum.value - 0.1):
        bound = Fraction(bound if np.isfinite(bound) else 1e9)
        proof = prove_bound(rows, c, bound, start)
        exact = [Fraction(v) for v in c.tolist()]
        if proof.kind == "point":
            shows(proof, rows)
            assert sum(a * v for a, v in zip(exact, proof.vector, strict=True)) > bound
        else:
            y = proof.vector
            assert all(v >= 0 for v in y[rows.num_equalities :])
            for k, goal in enumerate(exact):
                assert sum(v * row[k] for v, row in zip(y, A, strict=True)) == goal
            assert sum(v * s for v, s in zip(y, b, strict=True)) <= bound


@settings(deadline=None, derandomize=True)
@given(seeds)
def test_optimum_is_that_of_the_best_vertex(seed):
    """In a box with faces cut off: all vertices are looked at in fractions; gap 1e-12 and less."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 4))
    cuts = rng.normal(size=(4, n))
    factors = 10.0 ** rng.uniform(-10, 10, size=2 * n + 4)
    A = np.vstack([np.eye(n), -np.eye(n), cuts])
    b = np.concatenate([np.ones(2 * n), 0.9 * np.linalg.norm(cuts, axis=1)])
    rows = Rows(A * factors[:, None], b * factors)
    c = rng.normal(size=n)
    optimum = maximize(rows, c, np.zeros(n))
    truth = float(largest_at_vertices(rows.A, rows.b, c))
    assert optimum.value == pytest.approx(truth, abs=1e-13)
    assert optimum.gap < 1e-12
    assert optimum.upper >= truth - 1e-15


@pytest.mark.parametrize("exponent", range(-16, 0))
@pytest.mark.parametrize("size", [1e-8, 1.0, 1e8])
def test_gaps_of_all_widths(exponent, size):
    """Two opposite faces apart by 10^exponent of the size: below rounding they coincide."""
    for sign in (-1.0, 1.0):
        b = np.array([1.0, 1.0, 1.0, 1.0, 1.0, -1.0 - sign * 10.0**exponent]) * size
        rows = Rows(BOX, b)
        proof = find_point(rows)
        shows(proof, rows)
        assert proof.kind == ("farkas" if -b[5] > b[2] else "point")


@settings(deadline=None, derandomize=True)
@given(seeds)
def test_scaling_repeating_and_permuting_rows_changes_nothing(seed):
    """Also where the set is a single point; powers of two are exact, and so is the answer."""
    rng = np.random.default_rng(seed)
    A = np.vstack([BOX, [[1.0, 1.0, 1.0]]])
    for corner, kind in ((-3.0, "point"), (np.nextafter(-3.0, -4.0), "farkas")):
        b = np.array([1.0] * 6 + [corner])
        chosen = np.concatenate([rng.permutation(7), rng.integers(0, 7, size=20)])
        factors = 2.0 ** rng.integers(-33, 34, size=len(chosen))
        size = 2.0 ** int(rng.integers(-27, 28))
        rows = Rows(A[chosen] * factors[:, None], b[chosen] * factors * size)
        proof = find_point(rows)
        assert proof.kind == kind
        shows(proof, rows)
        assert recession(rows).kind == "multipliers"


@pytest.mark.parametrize("exponent", [-3, -6, -9, -12, -15])
def test_a_wedge_of_any_angle(exponent):
    """Two almost opposite half planes leave a cone; with the angle's sign changed, a bounded set.

    ``y <= t x``, ``y >= -t x`` and ``x <= 1``, or ``x >= -1``: a triangle, or a cone with its end
    cut off.
    """
    t = 10.0**exponent
    for sign, kind in ((1.0, "multipliers"), (-1.0, "recession")):
        rows = Rows(np.array([[-t, 1.0], [-t, -1.0], [sign, 0.0]]), np.array([0.0, 0.0, 1.0]))
        proof = recession(rows)
        assert proof.kind == kind
        shows(proof, rows)


def test_a_set_far_away_and_thin():
    """A slab of width 1e-12 at 1e6, bounded 1e9 away: its points are exact."""
    low, high = 1e6, np.nextafter(1e6, 2e6)
    turned = np.array([[0.6, 0.8], [-0.6, -0.8], [-0.8, 0.6], [0.8, -0.6]])
    rows = Rows(turned, np.array([high, -low, 1e9, 1e9]))
    proof = find_point(rows)
    assert proof.kind == "point"
    shows(proof, rows)
    assert recession(rows).kind == "multipliers"


@pytest.mark.parametrize(
    ("b", "kind"), [(0.0, "point"), (-0.0, "point"), (1.0, "point"), (-1e-300, "farkas")]
)
@pytest.mark.parametrize("n", [0, 1, 3])
def test_rows_without_variables(n, b, kind):
    """``0 <= b`` holds or not, in any dimension."""
    for num_equalities in (0, 1):
        rows = Rows(np.zeros((1, n)), np.array([b]), num_equalities)
        proof = find_point(rows)
        assert proof.kind == ("farkas" if num_equalities and b != 0.0 else kind)
        shows(proof, rows)


@pytest.mark.parametrize("n", [0, 1, 3])
def test_no_rows(n):
    """Without rows everything is inside, and everything but a point is unbounded."""
    rows = Rows(np.zeros((0, n)), np.zeros(0))
    shows(find_point(rows), rows)
    assert recession(rows).kind == ("recession" if n else "multipliers")


def test_equations_that_contradict_each_other():
    """By the last digit, between equations of which the third is the sum of the others."""
    A = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 1.0], [1.0, 3.0, 1.0]])
    for last, kind in ((3.0, "point"), (np.nextafter(3.0, 4.0), "farkas")):
        rows = Rows(A, np.array([1.0, 2.0, last]), 3)
        proof = find_point(rows)
        assert proof.kind == kind
        shows(proof, rows)


def test_deepest_point_of_a_box():
    """A box of 2 x 4 x 8 about (1, 2, 3): the ball has radius 1, and its centre x = 1."""
    b = np.array([2.0, 4.0, 7.0, 0.0, 0.0, 1.0])
    factors = np.array([1e-10, 1.0, 1e10, 1.0, 3.0, 1e5])
    deepest = find_deepest(Rows(BOX * factors[:, None], b * factors))
    assert deepest.radius == pytest.approx(1.0, abs=1e-15)
    assert deepest.gap < 1e-15
    assert deepest.x[0] == pytest.approx(1.0, abs=1e-15)


def test_points_are_judged_exactly():
    """0.1 + 0.2 > 0.3 for these floats: 0.1 and 0.2 are above, 0.3 below what is written."""
    for x, y, b in ((0.1, 0.2, 0.3), (0.1, 0.2, 0.1 + 0.2), (0.5, 0.25, 0.75)):
        inside = Fraction(x) + Fraction(y) <= Fraction(b)
        assert is_inside(Rows(np.ones((1, 2)), np.array([b])), np.array([x, y])) == inside


def test_exact_walk_ends_at_a_degenerate_corner():
    """Beale's example (1955), on which the simplex method with steepest descent goes in circles.

    Its optimum is 1/20.
    """
    A = np.array([[0.25, -60.0, -1 / 25, 9.0], [0.5, -90.0, -1 / 50, 3.0], [0.0, 0.0, 1.0, 0.0]])
    rows = Rows(np.vstack([A, -np.eye(4)]), np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    c = np.array([0.75, -150.0, 0.02, -6.0])
    exact = RationalSimplex(rows.A, rows.b, 0)
    goal = np.array([Fraction(v) for v in c.tolist()], dtype=object)
    found = exact.climb(goal)
    assert float(exact.bound(found)) == pytest.approx(0.05, abs=1e-15)
    assert maximize(rows, c, np.zeros(4)).value == pytest.approx(0.05, abs=1e-15)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_rows_of_entries_far_apart_get_a_length():
    """From 1/2 to 1, as the scaling promises; of a turn by 1e-300 rad, and less than normal."""
    A = np.array([[1.0, 1e-300, 0.0], [-1e-300, 1.0, 3.0], [1e-320, 0.0, 5e-324], [0.0, 0.0, 0.0]])
    scaled, _ = Rows(A, np.zeros(4)).scaled
    lengths = np.sqrt((scaled**2).sum(axis=1))
    assert ((lengths[:3] >= 0.5) & (lengths[:3] <= 1.0)).all() and lengths[3] == 0.0
