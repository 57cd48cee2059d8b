"""Polynomials of several variables with rational coefficients: exact, and few terms each.

Coefficients are whole numbers over one common denominator, and so are sums and products: fractions
would be brought to lowest terms one by one after each operation, which takes longer than all else.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
import math
import operator
from typing import TypeAlias

__all__ = [
    "Exponents",
    "Polynomial",
    "constant",
    "linear",
    "scaled",
    "sum_of_products",
    "total",
    "weighted_sum",
]

Exponents: TypeAlias = tuple[int, ...]
"""The power of each variable."""


class Polynomial(Mapping[Exponents, Fraction]):
    """Coefficients that are not zero, by the powers of the variables.

    ``whole`` are the coefficients times ``common``, in lowest terms all together.
    """

    __slots__ = ("common", "whole")

    def __init__(self, coefficients: dict[Exponents, int], common: int = 1) -> None:
        whole = {e: c for e, c in coefficients.items() if c}
        shared = math.gcd(common, *whole.values())
        if shared > 1:
            whole = {e: c // shared for e, c in whole.items()}
        self.whole, self.common = whole, common // shared

    def __getitem__(self, e: Exponents) -> Fraction:
        return Fraction(self.whole[e], self.common)

    def __iter__(self) -> Iterator[Exponents]:
        return iter(self.whole)

    def __len__(self) -> int:
        return len(self.whole)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Polynomial):
            return NotImplemented
        return self.common == other.common and self.whole == other.whole

    __hash__ = None  # type: ignore[assignment]


def constant(value: Fraction | int, variables: int) -> Polynomial:
    """Return a polynomial of degree 0."""
    exact = Fraction(value)
    return Polynomial({(0,) * variables: exact.numerator}, exact.denominator)


def linear(offset: Fraction, slopes: Iterable[Fraction]) -> Polynomial:
    """Return ``offset + slopes . u``."""
    rates = tuple(slopes)
    count = len(rates)
    common = math.lcm(offset.denominator, *(rate.denominator for rate in rates))
    result = {(0,) * count: offset.numerator * (common // offset.denominator)}
    for i, rate in enumerate(rates):
        e = (0,) * i + (1,) + (0,) * (count - i - 1)
        result[e] = rate.numerator * (common // rate.denominator)
    return Polynomial(result, common)


def scaled(p: Polynomial, factor: Fraction) -> Polynomial:
    """Return a polynomial times a number."""
    up = factor.numerator
    return Polynomial({e: c * up for e, c in p.whole.items()}, p.common * factor.denominator)


def total(parts: Iterable[Polynomial]) -> Polynomial:
    """Return the sum of polynomials."""
    return weighted_sum((Fraction(1), part) for part in parts)


def weighted_sum(terms: Iterable[tuple[Fraction, Polynomial]]) -> Polynomial:
    """Return the sum of polynomials, each times a number."""
    found = [(factor, p) for factor, p in terms if factor and p]
    common = math.lcm(*(factor.denominator * p.common for factor, p in found))
    result: dict[Exponents, int] = {}
    for factor, p in found:
        weight = factor.numerator * (common // (factor.denominator * p.common))
        for e, c in p.whole.items():
            result[e] = result.get(e, 0) + weight * c
    return Polynomial(result, common)


def sum_of_products(terms: Iterable[tuple[int, Polynomial, Polynomial]]) -> Polynomial:
    """Return the sum of products of two polynomials, each times a whole number."""
    found = [(factor, p, q) for factor, p, q in terms if p and q]
    common = math.lcm(*(p.common * q.common for _, p, q in found))
    result: dict[Exponents, int] = {}
    for factor, p, q in found:
        weight = factor * (common // (p.common * q.common))
        for e, c in p.whole.items():
            own = weight * c
            for f, d in q.whole.items():
                both = tuple(map(operator.add, e, f))
                result[both] = result.get(both, 0) + own * d
    return Polynomial(result, common)
