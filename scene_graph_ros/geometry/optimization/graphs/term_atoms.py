"""Convex functions of edges' costs: in programs as cones, and their affine minorants.

Everything is for G atoms of one kind at once, of as many edges.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.expressions import value_of
from scene_graph_ros.geometry.optimization.graphs.term_kernels import KINDS, shorten_all
from scene_graph_ros.geometry.optimization.solve.cone_program import Cone, ConeProgram, Rows
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["lower_atoms", "minorants_of", "sizes_of_atoms", "slope_of", "values_of", "weights_of"]

Blocks = Callable[[Any], tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]]
"""Columns ``(G, c)`` and matrices ``(G, k, c)`` of the vectors times a factor, a number or such
that broadcasts to ``(G, k)``, and their constants ``(G, k)``."""

_LEAST = 1e-300
"""In place of 0, where it is divided by."""


def sizes_of_atoms(kind: str, most: np.ndarray, constant: np.ndarray) -> np.ndarray:
    """Return about what atoms cost ``(G,)``, from bounds of their vectors and central values.

    Both are ``(G, k)``. Of norms and squares no vector costs more; quotients are those of the
    largest divisor.
    """
    if kind == "exponential":
        return values_of(kind, constant)
    if kind == "quotient":
        most = np.concatenate([np.maximum(most[:, :1], _LEAST), most[:, 1:]], axis=1)
    return values_of(kind, most)


def values_of(kind: str, w: np.ndarray) -> np.ndarray:
    """Return atoms ``(G,)`` of vectors ``(G, k)``."""
    if kind == "norm_inf":
        return np.max(np.abs(w), axis=1, initial=0.0)
    if kind in ("exponential", "quotient"):
        return np.array([value_of(kind, each) for each in w])
    squares = np.sum(w * w, axis=1)
    return np.sqrt(squares) if kind == "norm" else squares


def _divisors(most: np.ndarray) -> np.ndarray:
    """Return what divisors of quotients are measured in ``(G,)``."""
    return np.where(most[:, 0] > 0.0, most[:, 0], 1.0)


def lower_atoms(
    program: ConeProgram,
    kind: str,
    blocks_of: Blocks,
    scale: np.ndarray | None,
    unit: float,
    most: np.ndarray,
) -> Rows:
    """Add atoms in units as variables' costs; with ``scale``, columns ``(G,)``, perspectives."""
    count, k = most.shape
    t = program.variables(count)
    program.add_cost(t, np.ones(count))

    def each(rows: np.ndarray) -> np.ndarray:
        return np.ones((count, 1, 1)) * rows[:, None]

    if kind == "norm_inf":
        blocks, constant = blocks_of(1.0 / unit)
        both = [(columns, np.concatenate([-m, m], axis=1)) for columns, m in blocks]
        both.append((t[:, None], each(np.ones(2 * k))))
        constants = np.concatenate([-constant, constant], axis=1)
        return program.add_blocks(Cone.NONNEGATIVE, both, constants)
    if kind == "exponential":
        # exp(w) <= unit t as exp(w - log(unit)) <= t.
        blocks, constant = blocks_of(1.0)
        first = np.array([[1.0], [0.0], [0.0]])
        rows = [(columns, first * m) for columns, m in blocks]
        sides = np.concatenate([constant, np.zeros((count, 2))], axis=1)
        ones = np.array([-np.log(unit), 1.0, 0.0])
        if scale is None:
            sides = sides + ones
        else:
            rows.append((scale[:, None], each(ones)))
        rows.append((t[:, None], each(first[::-1, 0])))
        return program.add_blocks(Cone.EXPONENTIAL, rows, sides)
    if kind == "quotient":
        # |w|^2 <= s t as |(t - s, 2 w)| <= t + s.
        size = _divisors(most)
        factors = np.repeat(1.0 / np.sqrt(unit * size)[:, None], k, axis=1)
        factors[:, 0] = 1.0 / size
        blocks, constant = blocks_of(factors)
        rows = [
            (columns, np.concatenate([m[:, :1], -m[:, :1], 2.0 * m[:, 1:]], axis=1))
            for columns, m in blocks
        ]
        sides = np.concatenate([constant[:, :1], -constant[:, :1], 2.0 * constant[:, 1:]], axis=1)
        rows.append((t[:, None], each(np.arange(k + 1) < 2)))
        return program.add_blocks(Cone.SECOND_ORDER, rows, sides)
    head = 1 if kind == "norm" else 2
    factor = 1.0 / unit if kind == "norm" else 2.0 / np.sqrt(unit)
    blocks, constant = blocks_of(factor)
    rows = [
        (columns, np.concatenate([np.zeros((count, head, m.shape[2])), m], axis=1))
        for columns, m in blocks
    ]
    sides = np.concatenate([np.zeros((count, head)), constant], axis=1)
    rows.append((t[:, None], each(np.arange(k + head) < head)))
    if kind == "squares":
        # t scale >= |w|^2 as |(t - scale, 2 w)| <= t + scale.
        signs = np.zeros(k + 2)
        signs[0], signs[1] = 1.0, -1.0
        if scale is None:
            sides = sides + signs
        else:
            rows.append((scale[:, None], each(signs)))
    return program.add_blocks(Cone.SECOND_ORDER, rows, sides)


def weights_of(kind: str, z: np.ndarray, unit: float, most: np.ndarray) -> np.ndarray:
    """Return the slopes ``(G, k)`` that multipliers of `lower_atoms`'s rows stand for."""
    z = z.reshape(len(most), -1)
    if kind == "norm_inf":
        k = z.shape[1] // 2
        return np.asarray(z[:, :k] - z[:, k:])
    if kind == "norm":
        return -z[:, 1:]
    if kind == "exponential":
        return -unit * z[:, :1]
    if kind == "quotient":
        size = _divisors(most)[:, None]
        along = -unit * (z[:, :1] - z[:, 1:2]) / size
        return np.concatenate([along, -2.0 * np.sqrt(unit / size) * z[:, 2:]], axis=1)
    return np.asarray(-2.0 * np.sqrt(unit) * z[:, 2:])


def slope_of(kind: str, w: np.ndarray) -> np.ndarray:
    """Return a subgradient ``(k,)`` of one atom at a vector."""
    if kind == "squares":
        return 2.0 * w
    if kind == "exponential":
        return np.array([value_of(kind, w)])
    if kind == "quotient":
        if not w[0] > 0.0:
            return np.zeros(len(w))
        q = w[1:] / w[0]
        return np.append(-float(q @ q), 2.0 * q)
    if kind == "norm":
        length = float(np.linalg.norm(w))
        return w / length if length else w
    largest = int(np.abs(w).argmax())
    return np.asarray(np.sign(w[largest]) * (np.arange(len(w)) == largest))


def minorants_of(kind: str, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (y, c), ``(G, k)`` and ``(G,)``, with ``y . w - c`` at most the atom of any w.

    The slopes are near the given ones.
    """
    if kind == "exponential":
        # exp(w) - y w is least at log(y).
        slope = np.maximum(y[:, 0], 0.0)
        power = np.log(np.where(slope > 0.0, slope, 1.0))
        rounding = 8.0 * EPSILON * slope * (1.0 + np.abs(power))
        return slope[:, None], slope * power - slope + rounding
    slopes, conjugates = np.array(y), np.zeros(len(y))
    shorten_all(KINDS[kind], slopes, conjugates)
    return slopes, conjugates
