"""Whole numbers over one denominator, of which certificates consist."""

from fractions import Fraction

from scene_graph_ros.planning.certified.identities import ExactMatrix, is_positive_semidefinite
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
