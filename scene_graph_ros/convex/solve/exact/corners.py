"""Furthest corners of sets that sums and hulls of points and boxes make, in whole numbers.

All coordinates are multiplied by one power of two, so that they are whole.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["Corners", "Hull", "Points", "Sides", "Sum", "whole_numbers", "with_unit"]

Corner = tuple[Any, np.ndarray]
"""How far a set reaches along a direction, times its corner there ``(n,)``, of whole numbers."""


class Corners(ABC):
    """A bounded set that isn't empty, which is the hull of its corners."""

    @abstractmethod
    def along(self, d: np.ndarray, unit: int) -> Corner:
        """Return the furthest corner along whole numbers d ``(n,)``, times ``unit``."""

    @abstractmethod
    def nearly(self, d: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the same in floats, of a direction of floats."""

    @abstractmethod
    def numbers(self) -> Iterator[np.ndarray]:
        """Return all coordinates that it is made of."""


class _Listed(Corners):
    """Some coordinates ``(m, n)``, kept as whole numbers for the next question, too."""

    def __init__(self, values: np.ndarray) -> None:
        self._values = values
        self._kept: tuple[int, np.ndarray] = 0, values

    def numbers(self) -> Iterator[np.ndarray]:
        """Return the coordinates."""
        yield self._values

    def whole(self, unit: int) -> np.ndarray:
        """Return them times a unit."""
        kept = self._kept
        if kept[0] != unit:
            self._kept = kept = unit, whole_numbers(self._values, unit)
        return kept[1]


class Points(_Listed):
    """The hull of points ``(m, n)``."""

    def along(self, d: np.ndarray, unit: int) -> Corner:
        """Return the furthest point."""
        whole = self.whole(unit)
        reach = whole @ d
        k = max(range(len(reach)), key=reach.__getitem__)
        return reach[k], whole[k]

    def nearly(self, d: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the furthest point."""
        reach = product(self._values, d)
        k = int(reach.argmax())
        return float(reach[k]), self._values[k]


class Sides(_Listed):
    """The box between two corners ``(2, n)``."""

    def along(self, d: np.ndarray, unit: int) -> Corner:
        """Return the corner on the sides that d shows to."""
        lower, upper = self.whole(unit)
        corner = np.where(d > 0, upper, lower)
        return corner @ d, corner

    def nearly(self, d: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the corner on the sides that d shows to."""
        corner = np.where(d > 0.0, self._values[1], self._values[0])
        return float(product(corner, d)), corner


@dataclass(frozen=True, eq=False)
class Sum(Corners):
    """All sums of points of some sets."""

    terms: Sequence[Corners]

    def along(self, d: np.ndarray, unit: int) -> Corner:
        """Return the sum of the terms' corners."""
        found = [term.along(d, unit) for term in self.terms]
        return sum(each[0] for each in found), np.sum([each[1] for each in found], axis=0)

    def nearly(self, d: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the sum of the terms' corners."""
        found = [term.nearly(d) for term in self.terms]
        return sum(each[0] for each in found), np.sum([each[1] for each in found], axis=0)

    def numbers(self) -> Iterator[np.ndarray]:
        """Return those of all terms."""
        for term in self.terms:
            yield from term.numbers()


@dataclass(frozen=True, eq=False)
class Hull(Corners):
    """The hull of some sets."""

    members: Sequence[Corners]

    def along(self, d: np.ndarray, unit: int) -> Corner:
        """Return the furthest of the members' corners."""
        return max((each.along(d, unit) for each in self.members), key=lambda found: found[0])

    def nearly(self, d: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the furthest of the members' corners."""
        return max((each.nearly(d) for each in self.members), key=lambda found: found[0])

    def numbers(self) -> Iterator[np.ndarray]:
        """Return those of all members."""
        for each in self.members:
            yield from each.numbers()


def with_unit(*sets: Corners) -> int:
    """Return the least power of two by which all coordinates are whole numbers."""
    values = np.concatenate([each.ravel() for of in sets for each in of.numbers()])
    fractions, exponents = np.frexp(values[values != 0.0])
    if not len(exponents):
        return 1
    bits = np.ldexp(fractions, 53).astype(np.int64)
    # A double is a whole number of 53 bits times a power of two; its last zeros are taken off.
    zeros = np.log2(bits & -bits).astype(np.int64)
    return 1 << max(0, int((53 - exponents - zeros).max()))


def whole_numbers(values: np.ndarray, unit: int) -> np.ndarray:
    """Return coordinates times a unit that makes all of them whole."""
    whole = np.empty(values.shape, dtype=object)
    for at, value in np.ndenumerate(values):
        top, bottom = float(value).as_integer_ratio()
        whole[at] = top * (unit // bottom)
    return whole
