"""Bring a program over cones to a size of 1: rows, variables, right sides, by powers of two."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.convex.solve.cones.blocks import Block
from scene_graph_ros.convex.solve.cones.cone_program import Cone

__all__ = ["equilibrated", "widened_blocks"]

_MOST_PASSES = 32
"""Of geometric means, which end where they change nothing: after two or three for most (Fulkerson
and Wolfe 1962)."""

_RANGE = 4.0
"""Bits: an entry that is smaller than the largest one of its row, or cone, by more counts as if it
were not. Noise in place of 0 would have rows and columns be of a size that they are not; where
variables are of sizes that differ by more, each pass finds some of it."""


def equilibrated(
    blocks: Sequence[Block], size: int
) -> tuple[list[Block], np.ndarray, list[np.ndarray]]:
    """Return the same blocks of variables ``x / sizes``, the sizes ``(size,)``, rows' factors.

    Each linear row, and each block of another cone as a whole, times a power of two. Cones stay
    unchanged: also where all constants are divided by one number, which is the largest
    right side of a row of size 1.
    """
    logs = [_logarithms(matrix) for _, _, matrix, _ in blocks]
    columns = np.zeros(size)
    for _ in range(_MOST_PASSES):
        high, low = np.full(size, -np.inf), np.full(size, np.inf)
        for (cone, numbers, _, _), log in zip(blocks, logs, strict=True):
            scaled = _without_noise(cone, log + columns[numbers])
            scaled = scaled - _row_sizes(cone, scaled, is_middle=True)[:, None]
            finite = np.isfinite(scaled)
            np.maximum.at(high, numbers, np.where(finite, scaled, -np.inf).max(0, initial=-np.inf))
            np.minimum.at(low, numbers, np.where(finite, scaled, np.inf).min(0, initial=np.inf))
        with np.errstate(invalid="ignore"):
            change = np.rint(np.where(np.isfinite(high), 0.5 * (high + low), 0.0))
        columns -= change
        if not change.any():
            break
    result: list[Block] = []
    factors, largest = [], 0.0
    for (cone, numbers, matrix, constant), log in zip(blocks, logs, strict=True):
        rows = np.exp2(-np.rint(_row_sizes(cone, log + columns[numbers])))
        scaled = matrix * rows[:, None] * np.exp2(columns[numbers])
        result.append((cone, numbers, scaled, constant * rows))
        factors.append(rows)
        named = (
            scaled.any(axis=1) if cone <= Cone.NONNEGATIVE else np.full(len(rows), scaled.any())
        )
        largest = max(largest, float(np.abs(constant * rows)[named].max(initial=0.0)))
    extent = np.exp2(np.ceil(np.log2(largest))) if largest > 0.0 else 1.0
    result = [(cone, numbers, matrix, side / extent) for cone, numbers, matrix, side in result]
    return result, np.exp2(columns) * extent, [rows / extent for rows in factors]


def widened_blocks(
    blocks: Sequence[Block], size: int, narrowest: float = 0.0
) -> tuple[list[Block], np.ndarray]:
    """Return blocks that all have points, of one more variable, and its goal ``(size + 1,)``.

    The last variable is by how much each row, radius, eigenvalue or exponential may be less than
    asked; its least value is at most 0 where the blocks themselves have a point, and no less than
    ``-narrowest``. Equations are not widened where it may be negative.
    """
    least = np.array([narrowest])
    widened: list[Block] = [(Cone.NONNEGATIVE, np.array([size]), np.ones((1, 1)), least)]
    for cone, columns, matrix, constant in blocks:
        if cone is Cone.ZERO and narrowest > 0.0:
            widened.append((cone, columns, matrix, constant))
            continue
        signs = (1.0, -1.0) if cone is Cone.ZERO else (1.0,)
        share = np.ones(len(constant))
        if cone is Cone.SECOND_ORDER:
            share[1:] = 0.0
        elif cone is Cone.SEMIDEFINITE:
            order = int(np.sqrt(2 * len(constant)))
            share[:] = 0.0
            share[np.cumsum(np.arange(1, order + 1)) - 1] = 1.0
        elif cone is Cone.EXPONENTIAL:
            share[:] = -1.0, 1.0, 1.0
        kind = Cone.NONNEGATIVE if cone is Cone.ZERO else cone
        widened += [
            (kind, np.append(columns, size), np.column_stack([s * matrix, share]), s * constant)
            for s in signs
        ]
    return widened, np.append(np.zeros(size), 1.0)


def _logarithms(matrix: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.log2(np.abs(matrix))


def _without_noise(cone: Cone, logs: np.ndarray) -> np.ndarray:
    """Return logarithms, of which none is below the largest of its row, or cone, by too much."""
    largest = logs.max(axis=1, initial=-np.inf)
    if cone > Cone.NONNEGATIVE:
        largest = np.full(len(largest), largest.max(initial=-np.inf))
    return np.where(np.isfinite(logs), np.maximum(logs, largest[:, None] - _RANGE), logs)


def _row_sizes(cone: Cone, logs: np.ndarray, *, is_middle: bool = False) -> np.ndarray:
    """Return the logarithm of the largest entry of each row, or of all rows of a cone.

    On request the mean of it and that of the smallest.
    """
    high = logs.max(axis=1, initial=-np.inf)
    low = np.where(np.isfinite(logs), logs, np.inf).min(axis=1, initial=np.inf)
    if cone > Cone.NONNEGATIVE:
        high = np.full(len(high), high.max(initial=-np.inf))
        low = np.full(len(low), low.min(initial=np.inf))
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(high), 0.5 * (high + low) if is_middle else high, 0.0)
