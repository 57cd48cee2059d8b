"""Polynomials of several variables with rational coefficients: exact, and few terms each.

Sums and products are those of whole numbers over a common denominator: fractions would be brought
to lowest terms after each addition, which takes longer than all else.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
import math
import operator
from typing import TypeAlias

__all__ = [
    "Exponents",
    "Polynomial",
    "constant",
    "fractions",
    "integers",
    "linear",
    "scaled",
    "sum_of_products",
    "total",
    "weighted_sum",
]

Exponents: TypeAlias = tuple[int, ...]
"""The power of each variable."""

Polynomial: TypeAlias = dict[Exponents, Fraction]
"""Coefficients that are not zero, by the powers of the variables."""


def constant(value: Fraction | int, variables: int) -> Polynomial:
    """Return a polynomial of degree 0."""
    return {(0,) * variables: Fraction(value)} if value else {}


def linear(offset: Fraction, slopes: Iterable[Fraction]) -> Polynomial:
    """Return ``offset + slopes . u``."""
    rates = tuple(slopes)
    result = constant(offset, len(rates))
    for i, rate in enumerate(rates):
        if rate:
            result[(0,) * i + (1,) + (0,) * (len(rates) - i - 1)] = rate
    return result


def scaled(p: Polynomial, factor: Fraction) -> Polynomial:
    """Return a polynomial times a number."""
    return {e: c * factor for e, c in p.items()} if factor else {}


def total(parts: Iterable[Polynomial]) -> Polynomial:
    """Return the sum of polynomials."""
    return weighted_sum((Fraction(1), part) for part in parts)


def weighted_sum(terms: Iterable[tuple[Fraction, Polynomial]]) -> Polynomial:
    """Return the sum of polynomials, each times a number."""
    found = [(factor, *integers(p)) for factor, p in terms if factor and p]
    common = math.lcm(*(factor.denominator * own for factor, _, own in found))
    result: dict[Exponents, int] = {}
    for factor, p, own in found:
        weight = factor.numerator * (common // (factor.denominator * own))
        for e, c in p.items():
            result[e] = result.get(e, 0) + weight * c
    return fractions(result, common)


def sum_of_products(terms: Iterable[tuple[int, Polynomial, Polynomial]]) -> Polynomial:
    """Return the sum of products of two polynomials, each times a whole number."""
    found = [(factor, *integers(p), *integers(q)) for factor, p, q in terms if p and q]
    common = math.lcm(*(first * second for _, _, first, _, second in found))
    result: dict[Exponents, int] = {}
    for factor, p, first, q, second in found:
        weight = factor * (common // (first * second))
        for e, c in p.items():
            own = weight * c
            for f, d in q.items():
                both = tuple(map(operator.add, e, f))
                result[both] = result.get(both, 0) + own * d
    return fractions(result, common)


def integers(p: Polynomial) -> tuple[dict[Exponents, int], int]:
    """Return a polynomial's coefficients times their common denominator, and that."""
    common = math.lcm(*(c.denominator for c in p.values()))
    return {e: c.numerator * (common // c.denominator) for e, c in p.items()}, common


def fractions(p: dict[Exponents, int], common: int) -> Polynomial:
    """Return a polynomial of coefficients over a common denominator."""
    return {e: Fraction(c, common) for e, c in p.items() if c}
