"""Polynomials of several variables with rational coefficients: exact, and few terms each."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TypeAlias

__all__ = ["Exponents", "Polynomial", "add_product", "constant", "linear", "scaled", "total"]

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
    result: Polynomial = {}
    for part in parts:
        for e, c in part.items():
            result[e] = result.get(e, 0) + c
    return {e: c for e, c in result.items() if c}


def add_product(
    result: Polynomial, p: Polynomial, q: Polynomial, factor: Fraction | int = 1
) -> None:
    """Add ``factor p q`` to a polynomial; what cancels stays as a zero."""
    for e, c in p.items():
        for f, d in q.items():
            both = tuple(map(sum, zip(e, f, strict=True)))
            result[both] = result.get(both, 0) + factor * c * d
