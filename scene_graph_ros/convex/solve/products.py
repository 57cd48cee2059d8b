"""Products of rows and powers of rows, their sums, and derivatives of both."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

__all__ = ["Product", "Products", "Sum", "curvature_of", "joined", "values_of"]


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

    def within(self, y: np.ndarray, Z: np.ndarray) -> Product:
        """Return it of z, for y + Z @ z."""
        L, l, which, P, p, N = self  # noqa: E741
        return Product(L @ Z, L @ y + l, which, P @ Z, P @ y + p, N)

    def scaled(self, sizes: np.ndarray) -> Product:
        """Return it divided by sizes ``(k,)``."""
        return self._replace(L=self.L / sizes[:, None], l=self.l / sizes)

    def at(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return values ``(k,)`` and slopes ``(k, n)``."""
        a = self.L @ z + self.l
        if not self.N:
            return a, self.L
        b = self.P @ z + self.p
        before = _power(b, self.N - 1)
        power = self.which @ (before * b)
        slopes = (self.which * (self.N * a)[:, None]) @ (before[:, None] * self.P)
        return a * power, slopes + self.L * power[:, None] if self.L.any() else slopes

    def curvature(self, z: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the second derivative ``(n, n)`` of the values' sum, by weights ``(k,)``."""
        if not self.N:
            return np.zeros((len(z), len(z)))
        a, b = self.L @ z + self.l, self.P @ z + self.p
        twice = 0.5 * self.N * (self.N - 1) * ((weights * a) @ self.which) * _power(b, self.N - 2)
        mixed = twice[:, None] * self.P
        if self.L.any():
            along = self.which.T @ (self.L * weights[:, None])
            mixed += self.N * _power(b, self.N - 1)[:, None] * along
        half = mixed.T @ self.P
        found: np.ndarray = half + half.T
        return found


def _power(base: np.ndarray, exponent: int) -> np.ndarray:
    """Return powers by a whole number; those by a negative one, which nothing needs, are 1."""
    result = np.ones(len(base))
    for _ in range(exponent):
        result = result * base
    return result


Products = Sequence[tuple[Product, ...]]
"""Sums of products, each ``(k,)``."""

Sum = list[Product]


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
            together.append(Product(*Ll, block_diag(*which), *Pp, N).within(y, Z))
        slopes = np.linalg.norm(values_of([together], np.zeros(Z.shape[1]))[1], axis=1)
        found.append([each.scaled(np.where(slopes > 0.0, slopes, 1.0)) for each in together])
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
    found, first = np.zeros((len(z), len(z))), 0
    for some in sums:
        last = first + len(some[0].l)
        for each in some:
            found += each.curvature(z, weights[first:last])
        first = last
    return found
