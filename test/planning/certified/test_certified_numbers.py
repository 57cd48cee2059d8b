"""Whole numbers over one denominator, of which certificates consist."""

from fractions import Fraction

import numpy as np
import pytest

from scene_graph_ros.planning.certified.exact_matrices import (
    are_positive_semidefinite,
    ExactMatrix,
    is_positive_semidefinite,
    summable,
)
from scene_graph_ros.planning.certified.identities import least_values
from scene_graph_ros.planning.certified.monomials import monomials_of
from scene_graph_ros.planning.certified.polynomials import (
    Polynomial,
    scaled,
    sum_of_products,
    total,
)


def test_whole_numbers_over_one_denominator_are_the_fractions():
    """Of matrices and polynomials, whatever the denominator; products beside plain fractions."""
    assert is_positive_semidefinite(ExactMatrix([[1, 1], [1, 1]], 7))
    assert not is_positive_semidefinite(ExactMatrix([[1, 2], [2, 1]], 7))
    assert not is_positive_semidefinite(ExactMatrix([[0, 0, 0], [0, 1, 2], [0, 2, 3]], 5))
    assert list(ExactMatrix([[2, 3], [3, 4]], 6)) == [
        [Fraction(1, 3), Fraction(1, 2)],
        [Fraction(1, 2), Fraction(2, 3)],
    ]
    p = {(0, 0): Fraction(1, 3), (1, 0): Fraction(-5, 4), (2, 1): Fraction(7)}
    q = {(0, 1): Fraction(2, 9), (1, 0): Fraction(3)}
    truth: dict[tuple[int, int], Fraction] = {}
    for e, c in p.items():
        for f, d in q.items():
            both = (e[0] + f[0], e[1] + f[1])
            truth[both] = truth.get(both, Fraction(0)) + 2 * c * d

    def exact_of(coefficients):
        return total(Polynomial({e: c.numerator}, c.denominator) for e, c in coefficients.items())

    first, second = exact_of(p), exact_of(q)
    assert dict(first) == p
    product = sum_of_products([(2, first, second)])
    assert dict(product) == truth
    assert product == exact_of(truth)
    assert not total([product, scaled(product, Fraction(-1))])
    assert dict(scaled(first, Fraction(3, 2))) == {e: c * Fraction(3, 2) for e, c in p.items()}
    assert Polynomial({(0, 0): 6, (1, 0): 0}, 4) == Polynomial({(0, 0): 3}, 2)


@pytest.mark.parametrize("size", [1, 2, 4, 7])
def test_many_matrices_are_decided_like_one(size):
    """Of whole factors L, L L' is semidefinite, singular or not; less a little it is not."""
    generator = np.random.default_rng(size)
    factors = generator.integers(-(2**20), 2**20, (30, size, size))
    factors[::3, :, -1] = 0
    products = factors.astype(object) @ factors.transpose(0, 2, 1).astype(object)
    assert are_positive_semidefinite(products)
    assert are_positive_semidefinite(products[1:2]) and are_positive_semidefinite(products[:1])
    for number in (0, 29):
        wrong = products.copy()
        least = np.linalg.eigvalsh(products[number].astype(float))[0]
        wrong[number] -= (abs(int(least)) + 10**6) * np.eye(size, dtype=int).astype(object)
        assert not are_positive_semidefinite(wrong)
    if size > 1:
        crooked = products.copy()
        crooked[5, 0, 1] += 1
        assert not are_positive_semidefinite(crooked)


def test_singular_matrices_are_decided_one_by_one():
    """A pivot of zero needs a line of zeros."""
    zeros = np.zeros((3, 3, 3), dtype=np.int64)
    assert are_positive_semidefinite(zeros)
    zeros[1, 2, 2] = -1
    assert not are_positive_semidefinite(zeros)
    zeros[1] = [[0, 1, 0], [1, 5, 0], [0, 0, 5]]
    assert not are_positive_semidefinite(zeros)
    zeros[1] = [[1, 1, 0], [1, 1, 0], [0, 0, 2**62]]
    assert are_positive_semidefinite(zeros)
    zeros[2] = [[1, 1, 0], [1, 1, 1], [0, 1, 5]]
    assert not are_positive_semidefinite(zeros)


def test_sums_that_machine_words_do_not_hold():
    """They are of whole numbers of any size then."""
    large = np.array([2**60, 2**60, 2**60, 2**60])
    assert summable(large, 2).sum() == 2**62
    assert summable(large, 4).sum() == 2**62 and summable(large, 4).dtype == object
    assert summable(-large, 4).sum() == -(2**62) and summable(-large, 8).dtype == object
    assert summable(large, 1).dtype == np.int64


def test_least_values_are_below_all_values():
    """Of random polynomials, at random places of the box; in a corner they are taken."""
    monomials = monomials_of(2, (0,))
    generator = np.random.default_rng(3)
    polynomials = generator.integers(-9, 10, (50, monomials.num_monomials))
    exponents = np.zeros((monomials.num_monomials, 2), dtype=int)
    units = [(0, 0), (1, 0), (0, 1)]
    for e, k in np.ndindex(len(monomials.products), 3):
        exponents[monomials.shift[k, e]] = np.add(monomials.products[e], units[k])
    assert (exponents[0] == 0).all()
    least = least_values(polynomials, monomials.is_square)
    for u in generator.uniform(-1.0, 1.0, (200, 2)):
        assert (polynomials @ np.prod(u**exponents, axis=1) >= least - 1e-9).all()
    single = np.zeros((2, monomials.num_monomials), dtype=np.int64)
    (place,) = np.flatnonzero((exponents == [1, 1]).all(axis=1))
    (square,) = np.flatnonzero((exponents == [2, 0]).all(axis=1))
    single[:, 0], single[0, place], single[1, square] = 5, 3, 3
    assert least_values(single, monomials.is_square).tolist() == [2, 5]
