"""Programs of linear rows, norms, squares and products: closed forms, and what has no answer."""

import numpy as np
import pytest

from scene_graph_ros.convex.solve.interior_point import (
    Costs,
    FAR,
    InteriorPoint,
    LinearRows,
    NEAR,
)
from scene_graph_ros.convex.solve.products import (
    curvature_of,
    joined,
    Product,
    values_of,
    with_larger_bases,
)


def no_rows(n):
    """Return no rows of n variables."""
    return np.zeros((0, n)), np.zeros(0)


def power_of(n, base, power, factor):
    """Return ``factor * y[base] ** power`` of n variables."""
    return Product(np.zeros((1, n)), np.array([factor]), np.ones((1, 1)), np.eye(n)[[base]],
                   np.zeros(1), power)  # fmt: skip


def row_of(row, constant=0.0):
    """Return ``row @ y + constant`` as a product."""
    row = np.array([row])
    zero = np.zeros(1)
    return Product(row, np.array([constant]), np.ones((1, 1)), 0.0 * row, zero, 0)


def squares(p):
    """Return the cost of the squared distance from p."""
    return Costs(np.zeros(len(p)), [], [(np.eye(len(p)), -np.asarray(p, float), 1.0)])


@pytest.mark.parametrize("search", [NEAR, FAR])
@pytest.mark.parametrize("power", [2, 3])
def test_the_shortest_time_under_a_bound_of_a_derivative(search, power):
    """The least h with 2 h^N >= x, x >= 16: the root of 8, from a start that keeps neither."""
    linear = no_rows(2), (np.array([[1.0, 0.0], [0.0, 1.0]]), np.array([-16.0, 0.0]))
    products = [], [(power_of(2, 1, power, 2.0), row_of([-1.0, 0.0]))]
    program = InteriorPoint(
        np.array([1.0, 1.0]), LinearRows(*linear), products, Costs(np.array([0.0, 1.0]), [], [])
    )
    y, is_optimal = program.solve(search)
    assert is_optimal
    np.testing.assert_allclose(y, [16.0, 8.0 ** (1.0 / power)], rtol=1e-7)


def test_an_equation_of_a_product_is_kept():
    """The point of x y = 1/4 that is nearest to the origin, beside x = y + 0 z and z = 3 twice."""
    equations = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]), np.array([-3.0, -6.0])
    product = Product(np.array([[1.0, 0.0, 0.0]]), np.zeros(1), np.ones((1, 1)),
                      np.array([[0.0, 1.0, 0.0]]), np.zeros(1), 1)  # fmt: skip
    program = InteriorPoint(
        np.array([2.0, 0.5, 0.0]),
        LinearRows(equations, (np.eye(3), np.zeros(3))),
        ([(product, row_of([0.0, 0.0, 0.0], -0.25))], []),
        squares([0.0, 0.0, 0.0]),
    )
    y, is_optimal = program.solve(NEAR)
    assert is_optimal
    np.testing.assert_allclose(y, [0.5, 0.5, 3.0], atol=1e-7)


@pytest.mark.parametrize(
    ("corners", "expected"),
    [
        # Angles below 120 degrees: all corners are seen under 120 degrees from inside.
        ([[0.0, 0.0], [1.0, 0.0], [0.5, np.sqrt(3.0) / 2.0]], [0.5, np.sqrt(3.0) / 6.0]),
        # At the first corner the angle is more: it is the point, where its own norm vanishes.
        ([[0.0, 0.0], [1.0, 0.2], [-1.0, 0.2]], [0.0, 0.0]),
    ],
)
def test_a_sum_of_norms_is_least_where_one_vanishes_too(corners, expected):
    """The point of the least sum of distances from the corners of a triangle."""
    norms = [(np.eye(2), -np.array(p), 1.0, 1.0) for p in corners]
    box = np.concatenate([np.eye(2), -np.eye(2)]), np.full(4, 9.0)
    program = InteriorPoint(
        np.array([0.3, 0.4]), LinearRows(no_rows(2), box), ([], []), Costs(np.zeros(2), norms, [])
    )
    y, is_optimal = program.solve(NEAR)
    assert is_optimal
    np.testing.assert_allclose(y, expected, atol=2e-6)


def test_no_point_is_no_optimum():
    """Two rows, an equation and a row, or a product and a row that leave nothing; and an end."""
    first, second = np.array([[1.0]]), np.array([[1.0], [-1.0]])
    nothing = no_rows(1)
    apart = (second, np.array([-1.0, -1.0]))
    on_row = [(power_of(1, 0, 2, 1.0), row_of([0.0], -4.0))]
    for linear, products in (
        ((nothing, apart), ([], [])),
        (((first, np.zeros(1)), (first, np.array([-1.0]))), ([], [])),
        ((nothing, (second, np.ones(2))), ([], on_row)),
    ):
        program = InteriorPoint(np.zeros(1), LinearRows(*linear), products, squares([0.3]))
        point, is_optimal = program.solve(NEAR)
        assert not is_optimal
        assert np.isfinite(point).all()
    fine = InteriorPoint(
        np.zeros(1), LinearRows(nothing, (second, np.ones(2))), ([], []), squares([0.3])
    )
    assert not fine.solve(NEAR, lambda: True)[1]
    assert fine.solve(NEAR)[0] == pytest.approx(0.3, abs=1e-7)


@pytest.mark.parametrize(("side", "is_kept"), [(2.0, True), (3.0, False)])
def test_equations_may_leave_no_choice(side, is_kept):
    """Of y = 2 alone it is seen whether y^2 >= 2 y + 0 and y >= side are kept."""
    one = np.array([[1.0]])
    program = InteriorPoint(
        np.zeros(1),
        LinearRows((one, np.array([-2.0])), (one, np.array([-side]))),
        ([], [(power_of(1, 0, 2, 1.0), row_of([-2.0]))]),
        squares([0.0]),
    )
    y, is_optimal = program.solve(NEAR)
    assert y == pytest.approx(2.0)
    assert is_optimal is is_kept


def test_products_have_their_derivatives():
    """Sums of products of several powers, by central differences at a point."""
    generator = np.random.default_rng(0)
    n = 4

    def product(power):
        L, P = generator.normal(size=(2, n)), generator.normal(size=(1, n))
        return Product(L, generator.normal(size=2), np.ones((2, 1)), P, np.array([2.0]), power)

    sums = [tuple(map(product, powers)) for powers in ((2, 2), (3, 0), (2, 2), (1, 3))]
    together = joined(sums, generator.normal(size=n), generator.normal(size=(n, n)))
    assert len(together) == 3
    z, weights, step = generator.normal(size=n), generator.normal(size=8), 1e-5
    values, slopes = values_of(together, z)
    assert values.shape == (8,)
    # At the origin, which is the start, sums have slopes of length 1.
    np.testing.assert_allclose(np.linalg.norm(values_of(together, 0.0 * z)[1], axis=1), 1.0)
    curvature = curvature_of(together, z, weights)
    for k in range(n):
        ahead, behind = (values_of(together, z + s * step * np.eye(n)[k]) for s in (1.0, -1.0))
        np.testing.assert_allclose(
            (ahead[0] - behind[0]) / (2.0 * step), slopes[:, k], rtol=1e-6, atol=1e-6
        )
        np.testing.assert_allclose(
            weights @ (ahead[1] - behind[1]) / (2.0 * step), curvature[k], rtol=1e-6, atol=1e-6
        )


def test_longer_durations_keep_accelerations():
    """Of 3 h^2 >= x and h^2 >= 2 x the larger h, and of a second duration its own; no others."""
    y = np.array([8.0, 1.0, 2.0])
    sums = [
        (power_of(3, 1, 2, 3.0), row_of([-1.0, 0.0, 0.0])),
        (power_of(3, 1, 2, 1.0), row_of([-2.0, 0.0, 0.0])),
        (power_of(3, 2, 3, 1.0), row_of([-8.0, 0.0, 0.0])),
        (power_of(3, 1, 2, -1.0), row_of([-1.0, 0.0, 0.0])),
        (power_of(3, 1, 2, 1.0), power_of(3, 2, 2, 1.0), row_of([-99.0, 0.0, 0.0])),
    ]
    np.testing.assert_allclose(with_larger_bases(sums, y), [8.0, 4.0, 4.0], rtol=1e-12)
    # Bases that keep what is asked stay, and those that are not above 0.
    for at in (np.array([0.1, 1.0, 2.0]), np.array([8.0, -1.0, 99.0])):
        np.testing.assert_array_equal(with_larger_bases(sums, at), at)
