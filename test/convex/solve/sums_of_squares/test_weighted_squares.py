"""Weighted sums of squares, against least values that are known and another solver's."""

import itertools

import numpy as np
import pytest

from scene_graph_ros.convex.solve.cones.cone_program import Cone, ConeProgram
from scene_graph_ros.convex.solve.sums_of_squares.weighted_squares import (
    Identities,
    minimize_over_squares,
)


def numbered(basis):
    """Return what `Identities` has of a basis, and the numbers of the monomials."""
    n = len(basis[0])
    products, monomials = {}, {}
    both = [[tuple(np.add(e, f).tolist()) for f in basis] for e in basis]
    base = [[products.setdefault(e, len(products)) for e in line] for line in both]
    units = np.vstack([np.zeros((1, n), dtype=int), np.eye(n, dtype=int)])
    shift = [
        [monomials.setdefault(tuple(np.add(e, one).tolist()), len(monomials)) for e in products]
        for one in units
    ]
    return np.array(base), np.array(shift), monomials


def box_rows(n):
    """Return 1, 1 + u and 1 - u of each variable."""
    rows = [np.eye(n + 1)[0]]
    for k, sign in itertools.product(range(n), (1.0, -1.0)):
        rows.append(np.eye(n + 1)[0] + sign * np.eye(n + 1)[k + 1])
    return np.array(rows)


def least_value(polynomials, basis, rows, **options):
    """Return the search for the largest x that all polynomials are shown to be above."""
    base, shift, monomials = numbered(basis)
    constants = np.zeros((len(polynomials), len(monomials)))
    for line, polynomial in zip(constants, polynomials, strict=True):
        for e, value in polynomial.items():
            line[monomials[e]] = value
    factors = np.zeros((len(polynomials), len(monomials), 1))
    factors[:, monomials[(0,) * len(basis[0])]] = -1.0
    part = Identities(base, shift, len(rows), constants, factors)
    options = {"gap": 1e-3, "least": 1e-9, **options}
    found = minimize_over_squares(rows, [part], np.array([-1.0]), **options)
    return found, part


LINE = [(0,), (1,)]
PLANE = [(0, 0), (1, 0), (0, 1), (1, 1)]


@pytest.mark.parametrize(
    ("polynomial", "basis", "least"),
    [
        ({(2,): 1.0, (1,): -1.0}, LINE, -0.25),  # at 1 / 2
        ({(3,): 1.0, (1,): -1.0}, LINE, -2.0 / 3.0**1.5),  # at the root of 1 / 3
        ({(0,): 2.0, (1,): 3.0}, LINE, -1.0),  # at -1
        ({(1, 1): 1.0}, PLANE, -1.0),  # in two corners
        (
            {(2, 0): 1.0, (0, 2): 1.0, (1, 1): 1.0, (1, 0): 1.0},
            PLANE,
            -1.0 / 3.0,
        ),  # at (-2, 1) / 3
    ],
)
def test_the_least_value_in_a_box(polynomial, basis, least):
    """Polynomials whose least value in [-1, 1] is known, with what shows it."""
    rows = box_rows(len(basis[0]))
    found, part = least_value([polynomial], basis, rows)
    assert found.is_solved and found.residual < 1e-8
    assert least - 2e-3 <= found.x[0] <= least + 1e-8
    assert least <= -found.bound + 1e-8 <= least + 2e-3
    (grams,) = found.grams
    assert np.linalg.eigvalsh(grams).min() > 0.0
    for u in np.random.default_rng(0).uniform(-1.0, 1.0, (20, len(basis[0]))):
        m = np.array([np.prod(u ** np.array(e)) for e in basis])
        shown = (rows @ [1.0, *u]) @ (m @ grams[0] @ m)
        value = sum(c * np.prod(u ** np.array(e)) for e, c in polynomial.items())
        assert shown == pytest.approx(value - found.x[0], abs=1e-7)
    assert part.num_entries == grams.size


def test_several_identities_share_what_is_free():
    """The least of two polynomials, between rows that tie their variables."""
    rows = np.vstack([box_rows(2), [0.5, -1.0, -1.0]])  # u + v <= 1 / 2
    polynomials = [{(1, 0): -1.0, (0, 1): -1.0}, {(1, 0): 1.0, (0, 1): -1.0, (0, 0): 1.0}]
    found, _ = least_value(polynomials, PLANE, rows)
    assert found.is_solved and found.x[0] == pytest.approx(-1.0, abs=1e-3)
    found, _ = least_value(polynomials[:1], PLANE, rows)
    assert found.x[0] == pytest.approx(-0.5, abs=1e-3)


def test_traces_may_have_a_cost():
    """Then less of them is found, and what the solver for all cones finds of the same program."""
    rows, polynomial = box_rows(1), {(0,): 1.0, (1,): -0.3, (2,): 0.5, (3,): -0.2}
    weights = np.array([0.05, 0.1, 0.2])
    found, part = least_value([polynomial], LINE, rows, weights=weights)
    program = ConeProgram()
    (x,) = program.variables(1)
    columns = program.variables(9).reshape(3, 3)
    for own, weight in zip(columns, weights, strict=True):
        root = np.array([1.0, np.sqrt(2.0), 1.0])
        program.add_rows(Cone.SEMIDEFINITE, [(own, np.diag(root))], np.zeros(3))
        program.add_cost(own[[0, 2]], np.full(2, weight))
    program.add_cost(np.array([x]), np.array([-1.0]))
    matrix = np.zeros((part.constants.shape[1], 9))
    for r, row in enumerate(rows):
        for k, (i, j) in enumerate([(0, 0), (0, 1), (1, 1)]):
            for c in range(2):
                matrix[part.shift[c, part.base[i, j]], 3 * r + k] += row[c] * (1 + (i != j))
    blocks = [(columns.reshape(-1), -matrix), (np.array([x]), part.factors[0])]
    program.add_rows(Cone.ZERO, blocks, part.constants[0])
    truth = program.solve("a truth").x
    grams = truth[columns]
    assert found.x[0] == pytest.approx(truth[x], abs=1e-3)
    np.testing.assert_allclose(found.grams[0][0][:, [0, 0, 1], [0, 1, 1]], grams, atol=1e-3)
    without, _ = least_value([polynomial], LINE, rows)
    spent = [np.trace(each.grams[0][0], axis1=1, axis2=2) @ weights for each in (found, without)]
    assert spent[0] < 0.9 * spent[1]


def test_what_has_no_end_is_not_solved():
    """No least value without rows that bound the variable, and none of an empty condition."""
    found, _ = least_value([{(1,): 1.0}], LINE, np.array([[1.0, 0.0]]))
    assert not found.is_solved
    base, shift, _ = numbered(LINE)
    part = Identities(base, shift, 3, -np.eye(4)[:1], np.zeros((1, 4, 1)))
    found = minimize_over_squares(box_rows(1), [part], np.zeros(1), gap=1e-6, least=1e-9)
    assert not found.is_solved
