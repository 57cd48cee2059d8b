"""The monomials of a pair's identities, numbered once for all geometries that move alike."""

from __future__ import annotations

from collections.abc import Iterable
import functools
import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.certified.polynomials import Exponents

__all__ = ["Monomials", "monomials_of", "triangle"]


class Monomials(NamedTuple):
    """Of a basis m and its products with itself, and of these times 1 and each variable.

    ``products`` are the exponents of products of two monomials of the basis, 1 first. ``base
    (m, m)`` numbers them, and ``shift (n + 1, q)`` all that an identity has: products times 1,
    which keep their numbers, then times each variable. ``is_square (k,)`` tells which of these
    have no odd power.
    """

    basis: tuple[Exponents, ...]
    products: tuple[Exponents, ...]
    base: NDArray[np.int64]
    shift: NDArray[np.int64]
    is_square: NDArray[np.bool_]

    @property
    def num_monomials(self) -> int:
        """How many monomials an identity has."""
        return len(self.is_square)

    @property
    def squares(self) -> NDArray[np.int64]:
        """The numbers of the squares of the basis's monomials."""
        return self.shift[0, np.diag(self.base)]


@functools.cache
def monomials_of(variables: int, moving: tuple[int, ...]) -> Monomials:
    """Return those of a geometry that some of the variables move.

    The basis has all products of different ones of these.
    """
    powers = [(0, 1) if k in moving else (0,) for k in range(variables)]
    basis = tuple(itertools.product(*powers))
    products: dict[Exponents, int] = {}
    both = [[_number(products, map(sum, zip(e, f, strict=True))) for f in basis] for e in basis]
    every: dict[Exponents, int] = {}
    shift = [
        [_number(every, (v + (i == k) for i, v in enumerate(e))) for e in products]
        for k in range(-1, variables)
    ]
    return Monomials(
        basis,
        tuple(products),
        np.array(both, dtype=np.int64),
        np.array(shift, dtype=np.int64),
        np.array([all(v % 2 == 0 for v in e) for e in every]),
    )


def _number(numbers: dict[Exponents, int], e: Iterable[int]) -> int:
    return numbers.setdefault(tuple(e), len(numbers))


@functools.cache
def triangle(order: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of an upper triangle, column after column."""
    j, i = np.tril_indices(order)
    return i, j
