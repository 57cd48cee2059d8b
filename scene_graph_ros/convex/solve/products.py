"""Products of rows and powers of rows, their sums, and derivatives of both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

__all__ = [
    "Product",
    "Products",
    "Sum",
    "curvature_of",
    "joined",
    "values_of",
    "with_larger_bases",
]


class Product(NamedTuple):
    """``(L @ y + l) * base ** N``, entry by entry ``(k,)``, for some of the bases ``P @ y + p``.

    ``which (k, b)`` is 1 at the base of each entry, else 0.
    """

    L: np.ndarray
    l: np.ndarray  # noqa: E741  the constant of L
    which: np.ndarray
    P: np.ndarray
    p: np.ndarray
    N: int


def _power(base: np.ndarray, exponent: int) -> np.ndarray:
    """Return powers by a whole number; those by a negative one, which nothing needs, are 1."""
    result = np.ones(len(base))
    for _ in range(exponent):
        result = result * base
    return result


Products = Sequence[tuple[Product, ...]]
"""Sums of products, each ``(k,)``."""


class _Placed:
    """A product of z, for y + Z @ z, divided by sizes."""

    def __init__(self, of: Product, y: np.ndarray, Z: np.ndarray) -> None:
        self.N, self._has_L = of.N, bool(of.L.any())
        self.L, self.l = of.L @ Z, of.L @ y + of.l
        self.P, self.p = of.P @ Z, of.P @ y + of.p
        self._base = of.which.argmax(axis=1)
        self._P, self._which = self.P[self._base], of.which.T

    def divide(self, sizes: np.ndarray) -> None:
        """Divide it by sizes ``(k,)``."""
        self.L, self.l = self.L / sizes[:, None], self.l / sizes

    def at(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values ``(k,)`` and slopes ``(k, n)``."""
        a = self.L @ z + self.l if self._has_L else self.l
        if not self.N:
            return a, self.L
        b = self.P @ z + self.p
        before = _power(b, self.N - 1)
        power = (before * b)[self._base]
        slopes = (a * (self.N * before)[self._base])[:, None] * self._P
        if self._has_L:
            slopes += power[:, None] * self.L
        return a * power, slopes

    def halves(self, z: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return H ``(b, n)`` and P ``(b, n)`` of the second derivative ``H.T @ P + P.T @ H``.

        Of the values' sum, by weights ``(k,)``.
        """
        a = self.L @ z + self.l if self._has_L else self.l
        b = self.P @ z + self.p
        twice = 0.5 * self.N * (self.N - 1) * (self._which @ (weights * a)) * _power(b, self.N - 2)
        half = twice[:, None] * self.P
        if self._has_L:
            along = (self._which * weights) @ self.L
            half += self.N * _power(b, self.N - 1)[:, None] * along
        return half, self.P


Sum = list[_Placed]


def joined(some: Products, y: np.ndarray, Z: np.ndarray) -> list[Sum]:
    """Return sums of products of z, those of the same powers as one, with slopes of length 1."""
    from scipy.linalg import block_diag

    alike: dict[tuple[int, ...], list[tuple[Product, ...]]] = {}
    for each in some:
        alike.setdefault(tuple(product.N for product in each), []).append(each)
    found = []
    for powers, group in alike.items():
        together = []
        for N, products in zip(powers, zip(*group, strict=True), strict=True):
            L, l, which, P, p, _ = zip(*products, strict=True)  # noqa: E741
            Ll, Pp = (np.concatenate(L), np.concatenate(l)), (np.concatenate(P), np.concatenate(p))
            together.append(_Placed(Product(*Ll, block_diag(*which), *Pp, N), y, Z))
        slopes = np.linalg.norm(values_of([together], np.zeros(Z.shape[1]))[1], axis=1)
        for placed in together:
            placed.divide(np.where(slopes > 0.0, slopes, 1.0))
        found.append(together)
    return found


def values_of(sums: list[Sum], z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the values ``(k,)`` of sums of products, and their slopes ``(k, n)``."""
    values, slopes = [np.zeros(0)], [np.zeros((0, len(z)))]
    for some in sums:
        (value, slope), *others = (each.at(z) for each in some)
        for more, other in others:
            value, slope = value + more, slope + other
        values.append(value)
        slopes.append(slope)
    return np.concatenate(values), np.concatenate(slopes)


def curvature_of(sums: list[Sum], z: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the second derivative ``(n, n)`` of sums of products, by weights ``(k,)``."""
    halves, first = [(np.zeros((0, len(z))), np.zeros((0, len(z))))], 0
    for some in sums:
        last = first + len(some[0].l)
        halves += [each.halves(z, weights[first:last]) for each in some if each.N]
        first = last
    H, P = (np.concatenate(each) for each in zip(*halves, strict=True))
    half: np.ndarray = H.T @ P
    return half + half.T


def with_larger_bases(some: Products, y: np.ndarray) -> np.ndarray:
    """Return y ``(n,)`` with larger bases of powers, so that sums are at least 0.

    Of sums of ``l * base ** N``, with l > 0 and one base above 0, and linear terms. Each base
    grows along its own row; other sums and rows are not looked at.
    """
    bases: dict[bytes, tuple[np.ndarray, float]] = {}
    factors: dict[bytes, float] = {}
    for each in some:
        powers = [product for product in each if product.N]
        if len(powers) != 1 or len(powers[0].P) != 1 or powers[0].L.any():
            continue
        (power,) = powers
        row, base = power.P[0], power.P @ y + power.p
        linear = sum((x.L @ y + x.l for x in each if not x.N), np.zeros(len(power.l)))
        grows = power.l > 0.0
        if base[0] <= 0.0 or not grows.any():
            continue
        least = float((-linear[grows] / power.l[grows]).max()) / float(_power(base, power.N)[0])
        key = row.tobytes()
        bases[key] = row, float(base[0])
        factors[key] = max(factors.get(key, 1.0), max(least, 0.0) ** (1.0 / power.N))
    moved = y.copy()
    for key, (row, base_here) in bases.items():
        moved += (factors[key] - 1.0) * base_here * row / float(row @ row)
    return moved
