"""Bring a program over cones to a size of 1: rows, variables, right sides, by powers of two."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.convex.solve.cones.cone_program import Added, Cone, ConeProgram, Rows

__all__ = ["Scaled", "equilibrated", "widened"]

_MOST_PASSES = 32
"""Of geometric means, which end where they change nothing: after two or three for most (Fulkerson
and Wolfe 1962)."""

_RANGE = 4.0
"""Bits: an entry that is smaller than the largest one of its row, or cone, by more counts as if it
were not. Noise in place of 0 would have rows and columns be of a size that they are not; where
variables are of sizes that differ by more, each pass finds some of it."""


class Scaled(NamedTuple):
    """A program of variables ``x / sizes``, with rows and cost of size 1."""

    program: ConeProgram
    sizes: np.ndarray
    """``(n,)``, powers of two."""
    length: float
    """The cost was divided by this number; 1 where it is zero."""
    factors: dict[Rows, np.ndarray]
    """Rows were multiplied by these powers of two, ``(m,)`` of each block."""


def equilibrated(program: ConeProgram) -> Scaled:
    """Return the same program of a size of 1.

    Each linear row, and each other cone as a whole, times a power of two. Cones stay unchanged:
    also where all constants are divided by one number, which is the largest right side of a row
    of size 1.
    """
    size, added = program.num_variables, program.added
    scales = _Scales(added)
    j, logs = scales.j, scales.logs
    columns = np.zeros(size)
    for _ in range(_MOST_PASSES):
        scaled = scales.without_noise(logs + columns[j])
        scaled = scaled - scales.sizes(scaled, is_middle=True)[scales.groups]
        high, low = _extremes(scaled, j, size)
        with np.errstate(invalid="ignore"):
            change = np.rint(np.where(np.isfinite(high), 0.5 * (high + low), 0.0))
        columns -= change
        if not change.any():
            break
    powers = np.exp2(-np.rint(scales.sizes(logs + columns[j])))
    by_column = np.exp2(columns)
    result, largest, factors = ConeProgram(size), 0.0, {}
    is_named = np.zeros(len(powers), dtype=bool)
    is_named[scales.groups[np.isfinite(logs)]] = True
    parts = []
    for each, groups in zip(added, scales.of_rows, strict=True):
        rows = powers[groups]
        constant = each.constant * rows
        entries = [(i, k, v * rows[i] * by_column[k]) for i, k, v in each.entries]
        largest = max(largest, float(np.abs(constant)[is_named[groups]].max(initial=0.0)))
        parts.append((entries, constant, rows))
    extent = np.exp2(np.ceil(np.log2(largest))) if largest > 0.0 else 1.0
    for each, (entries, constant, rows) in zip(added, parts, strict=True):
        result.add_entries(each.rows.cone, entries, constant / extent, each.sizes)
        factors[each.rows] = rows / extent
    sizes = by_column * extent
    goal = program.cost * sizes
    length = float(np.abs(goal).max(initial=0.0)) or 1.0
    result.add_cost(np.arange(size), goal / length)
    return Scaled(result, sizes, length, factors)


def widened(program: ConeProgram, narrowest: float = 0.0) -> ConeProgram:
    """Return a program whose rows all have points, of one more variable, which is its cost.

    The last variable is by how much each row, radius, eigenvalue or exponential may be less than
    asked; its least value is at most 0 where the program itself has a point, and no less than
    ``-narrowest``. Equations are not widened where it may be negative.
    """
    size = program.num_variables
    wide = ConeProgram(size + 1)
    last = np.array([size])
    wide.add_cost(last, np.ones(1))
    wide.add_rows(Cone.NONNEGATIVE, [(last, np.ones((1, 1)))], np.array([narrowest]))
    for rows, entries, constant, sizes in program.added:
        if rows.cone is Cone.ZERO and narrowest > 0.0:
            wide.add_entries(rows.cone, entries, constant)
            continue
        share = np.concatenate([_share(rows.cone, each) for each in sizes])
        at = np.flatnonzero(share)
        more = (at, np.full(len(at), size), share[at])
        if rows.cone is not Cone.ZERO:
            wide.add_entries(rows.cone, [*entries, more], constant, sizes)
            continue
        for sign in (1.0, -1.0):
            signed = [(i, j, sign * v) for i, j, v in entries]
            wide.add_entries(Cone.NONNEGATIVE, [*signed, more], sign * constant)
    return wide


def _share(cone: Cone, size: int) -> np.ndarray:
    """Return the factors ``(size,)`` of the last variable in the rows of one widened cone."""
    if cone <= Cone.NONNEGATIVE:
        return np.ones(size)
    if cone is Cone.EXPONENTIAL:
        return np.array([-1.0, 1.0, 1.0])
    share = np.zeros(size)
    if cone is Cone.SECOND_ORDER:
        share[0] = 1.0
    else:
        share[np.cumsum(np.arange(1, math.isqrt(2 * size) + 1)) - 1] = 1.0
    return share


class _Scales:
    """Logarithms of all entries, and the groups of rows that have one factor."""

    def __init__(self, added: list[Added]) -> None:
        self.of_rows: list[np.ndarray] = []
        self._count = 0
        for each in added:
            is_linear = each.rows.cone <= Cone.NONNEGATIVE
            sizes = [1] * each.rows.size if is_linear else each.sizes
            first, self._count = self._count, self._count + len(sizes)
            self.of_rows.append(np.repeat(np.arange(first, self._count), sizes))
        none = np.zeros(0, dtype=np.int64)
        joined = [each.joined() for each in added]
        pairs = zip(joined, self.of_rows, strict=True)
        self.groups = np.concatenate([none, *(groups[i] for (i, _, _), groups in pairs)])
        self.j = np.concatenate([none, *(j for _, j, _ in joined)])
        values = np.concatenate([np.zeros(0), *(v for _, _, v in joined)])
        with np.errstate(divide="ignore"):
            self.logs = np.log2(np.abs(values))

    def without_noise(self, logs: np.ndarray) -> np.ndarray:
        """Return logarithms, of which none is below the largest of its group by too much."""
        largest, _ = _extremes(logs, self.groups, self._count)
        least = largest[self.groups] - _RANGE
        return np.where(np.isfinite(logs), np.maximum(logs, least), logs)

    def sizes(self, logs: np.ndarray, *, is_middle: bool = False) -> np.ndarray:
        """Return the logarithm of the largest entry of each group.

        On request the mean of it and that of the smallest.
        """
        high, low = _extremes(logs, self.groups, self._count)
        with np.errstate(invalid="ignore"):
            return np.where(np.isfinite(high), 0.5 * (high + low) if is_middle else high, 0.0)


def _extremes(logs: np.ndarray, at: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the largest and the least finite logarithm of each row or column ``(count,)``."""
    high, low = np.full(count, -np.inf), np.full(count, np.inf)
    finite = np.isfinite(logs)
    np.maximum.at(high, at[finite], logs[finite])
    np.minimum.at(low, at[finite], logs[finite])
    return high, low
