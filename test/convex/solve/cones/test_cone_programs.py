"""Programs over cones whose optima, or the proofs that there are none, are known as they are made.

A point x and rows s on the border of the cones, multipliers z on the border of their duals with
``s . z = 0``: rows ``M x + (s - M x0)`` and the cost ``M' z`` have their optimum at x0, since
``cost . x = z . rows + cost . x0`` and no row of a cone makes ``z . rows`` negative.
"""

import importlib.util

import numpy as np
import pytest

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.cones.solver_choice import as_choice

HAS_SCS = importlib.util.find_spec("scs") is not None
ALL = (Cone.ZERO, Cone.NONNEGATIVE, Cone.SECOND_ORDER, Cone.SEMIDEFINITE, Cone.EXPONENTIAL)
LINEAR = (Cone.ZERO, Cone.NONNEGATIVE)
SCS = pytest.param(
    "scs", ALL, marks=pytest.mark.skipif(not HAS_SCS, reason="scs, a peer, is not installed")
)


def triangle(matrix):
    """Return the upper triangle, column after column, what is beside the diagonal times sqrt 2."""
    i, j = np.triu_indices(len(matrix))
    order = np.lexsort((i, j))
    i, j = i[order], j[order]
    return matrix[i, j] * np.where(i == j, 1.0, np.sqrt(2.0))


def complementary(cone, rng):
    """Return rows s of a cone and multipliers z of its dual with s . z = 0, both on the border."""
    if cone is Cone.ZERO:
        return np.zeros(2), rng.normal(size=2)
    if cone is Cone.NONNEGATIVE:
        is_met = rng.random(6) < 0.5
        return np.where(is_met, 0.0, rng.random(6)), np.where(is_met, rng.random(6), 0.0)
    if cone is Cone.SECOND_ORDER:
        u = rng.normal(size=3)
        u /= np.linalg.norm(u)
        return rng.random() * np.append(1.0, u), rng.random() * np.append(1.0, -u)
    if cone is Cone.SEMIDEFINITE:
        axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        s = axes[:, :1] * rng.random(1) @ axes[:, :1].T
        z = axes[:, 1:] * rng.random(2) @ axes[:, 1:].T
        return triangle(s), triangle(z)
    # v e^(u/v) = w at v = 1; the dual's border where a tangent plane touches there.
    u = rng.normal()
    return np.array([u, 1.0, np.exp(u)]), np.array([-np.exp(u), (u - 1.0) * np.exp(u), 1.0])


def is_in(cone, s, room):
    """Tell whether rows are in a cone to rounding."""
    if cone is Cone.ZERO:
        return np.abs(s).max() <= room
    if cone is Cone.NONNEGATIVE:
        return s.min() >= -room
    if cone is Cone.SECOND_ORDER:
        return np.linalg.norm(s[1:]) <= s[0] + room
    if cone is Cone.SEMIDEFINITE:
        M = np.zeros((3, 3))
        places = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
        for (i, j), value in zip(places, s, strict=True):
            M[i, j] = M[j, i] = value / (1.0 if i == j else np.sqrt(2.0))
        return np.linalg.eigvalsh(M)[0] >= -room
    return s[1] > -room and s[1] * np.exp(s[0] / max(s[1], 1e-12)) <= s[2] + room


def made(cones, seed, size):
    """Return a program, its blocks (cone, rows, M, constant, z), the cost and the optimum."""
    rng = np.random.default_rng(seed)
    n = 4
    x0 = rng.normal(size=n) * size
    program, cost, blocks, value = ConeProgram(), np.zeros(n), [], 0.0
    columns = program.variables(n)
    for cone in (*cones, Cone.NONNEGATIVE):
        s, z = complementary(cone, rng)
        M = rng.normal(size=(len(s), n))
        constant = s * size - M @ x0
        blocks.append((cone, program.add_rows(cone, [(columns, M)], constant), M, constant))
        cost += M.T @ z
    program.add_cost(columns, cost)
    value = float(cost @ x0)
    return program, blocks, cost, value


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("cones", [(cone,) for cone in ALL] + [ALL])
def test_the_optimum_is_found_with_its_multipliers(cones, seed, size):
    """Value, rows in their cones, and multipliers whose bound is checked here."""
    program, blocks, cost, value = made(cones, seed, size)
    found = program.solve("a test")
    assert found.is_feasible
    assert cost @ found.x == pytest.approx(value, abs=2e-6 * (abs(value) + size))
    assert program.cost_of(found.x) == pytest.approx(cost @ found.x)
    left, bound = cost.copy(), 0.0
    for cone, rows, M, constant in blocks:
        assert is_in(cone, M @ found.x + constant, 1e-6 * (size + np.abs(constant).max()))
        z = found.dual(rows)
        left -= M.T @ z
        bound -= float(z @ constant)
    # Whatever x: cost . x >= bound + left . x, and nothing is left.
    assert np.abs(left).max() <= 1e-6 * (1.0 + np.abs(cost).max())
    assert bound == pytest.approx(value, abs=2e-6 * (abs(value) + size))


@pytest.mark.parametrize(("solver", "cones"), [("highs", LINEAR), SCS])
def test_chosen_solvers_find_the_same(solver, cones):
    """To what each of them is known for."""
    for seed in range(3):
        program, _, cost, value = made(cones, seed, 1.0)
        found = program.solve("a test", is_rough=True, by=as_choice(solver, None, "solver"))
        assert cost @ found.x == pytest.approx(value, abs=1e-4 * (abs(value) + 1.0))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("cones", [(cone,) for cone in ALL] + [ALL])
def test_what_has_no_point_comes_with_weights(cones, seed):
    """Multipliers inside of the dual whose sum of rows has no variables and is negative."""
    rng = np.random.default_rng(seed)
    program, blocks = ConeProgram(), []
    columns = program.variables(3)
    for cone in (*cones, Cone.NONNEGATIVE):
        _, z = complementary(cone, rng)
        M = rng.normal(size=(len(z), 3))
        M -= np.outer(z, z @ M) / (z @ z)
        constant = rng.normal(size=len(z))
        constant -= z * ((z @ constant + 1.0) / (z @ z))
        rows = program.add_rows(cone, [(columns, M)], constant)
        blocks.append((M, constant, rows))
    program.add_cost(columns, rng.normal(size=3))
    found = program.solve("a test")
    assert not found.is_feasible
    weights = [found.dual(rows) for _, _, rows in blocks]
    total = sum(float(z @ constant) for z, (_, constant, _) in zip(weights, blocks, strict=True))
    left = sum(M.T @ z for z, (M, _, _) in zip(weights, blocks, strict=True))
    assert total < 0.0
    assert np.abs(left).max() <= 1e-6 * abs(total)


def test_a_cost_without_a_least_value_is_told():
    """Along an axis of the quadrant, and of a cone, the cost goes down."""
    program = ConeProgram()
    x = program.variables(2)
    program.add_rows(Cone.NONNEGATIVE, [(x, np.eye(2))], np.zeros(2))
    program.add_rows(Cone.SECOND_ORDER, [(x, np.array([[1.0, 0.0], [0.0, 0.5]]))], np.zeros(2))
    program.add_cost(x, np.array([-1.0, 0.0]))
    with pytest.raises(SolverError, match=r"a test: .* go down for ever"):
        program.solve("a test")


def test_what_a_chosen_solver_does_not_know_is_told():
    """HiGHS has rows alone; nobody has a solver of another name."""
    program = made((Cone.SECOND_ORDER,), 0, 1.0)[0]
    with pytest.raises(ConvexSetError, match="highs"):
        program.solve("a test", by=as_choice("highs", None, "solver"))
    with pytest.raises(ConvexSetError, match="must be one of 'clarabel', 'highs', 'scs'"):
        as_choice("simplex", None, "solver")
