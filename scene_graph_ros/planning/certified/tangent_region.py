"""A polytope of tangents of half angles, within bounds of each: the domain of a proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.rational_kinematics import (
    RationalForwardKinematics,
    Stretch,
)

__all__ = [
    "Row",
    "TangentRegion",
    "bounded_region",
    "checked_rows",
    "make_region",
    "power_of_two",
]

Row = tuple[Fraction, tuple[Fraction, ...]]
"""``offset + slopes . u``, which is not negative in the region."""

_OUTWARDS = 1e-9
"""Relative to the width: what bounds that a solver found are moved outwards by."""


@dataclass(frozen=True, eq=False)
class TangentRegion:
    """``{s: C s <= d, lower <= s <= upper}``, of just these floats; bounds are finite.

    With ``ties_all`` all pairs are looked at in all variables, also those that no row has.
    """

    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    C: NDArray[np.float64]
    d: NDArray[np.float64]
    ties_all: bool = False

    @property
    def polyhedron(self) -> HPolyhedron:
        """The region as a convex set."""
        unit = np.eye(len(self.lower))
        return HPolyhedron(
            np.concatenate([self.C, unit, -unit]),
            np.concatenate([self.d, self.upper, -self.lower]),
        )

    def without_redundant_rows(self) -> TangentRegion:
        """Return the same region without rows of C that bounds and other rows imply, exactly."""
        redundant = self.polyhedron.find_redundant(0.0)
        kept = [k for k in range(len(self.d)) if k not in redundant]
        return replace(self, C=self.C[kept], d=self.d[kept])

    def contains(self, s: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return a mask ``(m,)`` of the points ``(m, n)`` in the region."""
        rows = np.concatenate([self.lower - s, s - self.upper, s @ self.C.T - self.d], axis=1)
        return np.asarray((rows <= 0.0).all(axis=1))

    def stretches(self, variables: list[int]) -> tuple[Stretch, ...]:
        """Return the values of some variables: exactly from bound to bound."""
        ends = [(Fraction(self.lower[k]), Fraction(self.upper[k])) for k in variables]
        return tuple(Stretch((low + high) / 2, (high - low) / 2) for low, high in ends)

    def variables_with(self, variables: list[int]) -> list[int]:
        """Return some variables, and those that rows of C tie to them."""
        if self.ties_all:
            return list(range(len(self.lower)))
        chosen, before = set(variables), -1
        while len(chosen) != before:
            before = len(chosen)
            for row in self.C:
                tied = set(np.flatnonzero(row).tolist())
                if tied & chosen:
                    chosen |= tied
        return sorted(chosen)

    def rows(self, variables: list[int]) -> tuple[tuple[int, Fraction, Row], ...]:
        """Return the rows of C that are about some variables: number, scale, and the row in u.

        Each is divided by its scale, a power of two that is near its size.
        """
        stretches, result = self.stretches(variables), []
        for number, (row, side) in enumerate(zip(self.C, self.d, strict=True)):
            if not row[variables].any():
                continue
            factors = [Fraction(v) for v in row[variables].tolist()]
            offset = Fraction(side) - sum(
                (f * each.middle for f, each in zip(factors, stretches, strict=True)), Fraction(0)
            )
            slopes = [-f * each.half for f, each in zip(factors, stretches, strict=True)]
            size = abs(offset) + sum(map(abs, slopes))
            scale = power_of_two(size)
            result.append((number, scale, (offset / scale, tuple(v / scale for v in slopes))))
        return tuple(result)


def power_of_two(size: Fraction) -> Fraction:
    """Return a power of two that is at least a positive number, and less than four times it."""
    exponent = size.numerator.bit_length() - size.denominator.bit_length() + 1
    return Fraction(2) ** exponent


def make_region(
    kinematics: RationalForwardKinematics, C: ArrayLike, d: ArrayLike
) -> TangentRegion:
    """Return ``{s: C s <= d}`` within the joints' limits, with the narrowest bounds.

    Raises CertificateError for other shapes, numbers that are not finite, and regions that are
    empty, unbounded or without an inside.
    """
    return bounded_region(kinematics.tree.position_names, kinematics.s_limits(), C, d)


def bounded_region(
    names: Sequence[str],
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
    C: ArrayLike,
    d: ArrayLike,
) -> TangentRegion:
    """Return the same of positions with these names, and limits ``(n,)`` that may be infinite."""
    n = len(names)
    rows, sides = checked_rows(C, d, n)
    lower, upper = (each.copy() for each in limits)
    unit = np.eye(n)
    is_high, is_low = np.isfinite(upper), np.isfinite(lower)
    whole = HPolyhedron(
        np.concatenate([rows, unit[is_high], -unit[is_low]]),
        np.concatenate([sides, upper[is_high], -lower[is_low]]),
    )
    if whole.is_empty():
        raise CertificateError("C, d: the polytope and the joints' limits have no point in common")
    for k in range(n):
        for sign, ends in ((1.0, upper), (-1.0, lower)):
            found = whole.support(sign * unit[k]).value
            if not np.isfinite(found):
                raise CertificateError(f"C, d: the polytope must bound {names[k]!r}")
            ends[k] = min(ends[k], found) if sign > 0 else max(ends[k], -found)
    # Bounds that are no rows of their own are to cut nothing off.
    is_own = (np.count_nonzero(rows, axis=1) == 1)[:, np.newaxis] & (rows != 0)
    out = _OUTWARDS * (upper - lower)
    own = _own_ends(rows, sides, is_own, limits)
    lower, upper = np.maximum(lower - out, own[0]), np.minimum(upper + out, own[1])
    if not (upper > lower).all():
        name = names[int(np.argmin(upper - lower))]
        raise CertificateError(f"C, d: the polytope has no width along {name!r}")
    kept = ~is_own.any(axis=1)
    return TangentRegion(lower, upper, rows[kept].copy(), sides[kept].copy())


def _own_ends(
    rows: NDArray[np.float64],
    sides: NDArray[np.float64],
    is_own: NDArray[np.bool_],
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the joints' limits, tightened by rows with one entry."""
    lower, upper = (each.copy() for each in limits)
    for row, side, own in zip(rows, sides, is_own, strict=True):
        for k in np.flatnonzero(own):
            if row[k] > 0.0:
                upper[k] = min(upper[k], side / row[k])
            else:
                lower[k] = max(lower[k], side / row[k])
    return lower, upper


def checked_rows(
    C: ArrayLike, d: ArrayLike, n: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return C ``(m, n)`` and d ``(m,)``, finite, C without rows of zeros."""
    rows = real_array(C, "C must be numbers", CertificateError)
    sides = real_array(d, "d must be numbers", CertificateError)
    if rows.ndim != 2 or rows.shape[1] != n or sides.shape != (len(rows),):
        raise CertificateError(
            f"C and d must have the shapes (m, {n}) and (m,), not {rows.shape} and {sides.shape}"
        )
    for name, values in (("C", rows), ("d", sides)):
        if not np.isfinite(values).all():
            raise CertificateError(f"{name} must be finite, not {quoted(values)}")
    empty = np.flatnonzero(~rows.any(axis=1))
    if len(empty):
        raise CertificateError(f"C: row {empty[0]} is zero")
    return rows, sides
