"""Convex functions of an edge's cost: in programs as cones, and their affine minorants."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization.graphs.expressions import value_of
from scene_graph_ros.geometry.optimization.solve.cone_program import Cone, ConeProgram, Rows
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["lower_atom", "minorant_of", "size_of", "slope_of", "weights_of"]

Blocks = Callable[[Any], tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]]
"""Columns and matrices of the vector times a factor, a number or ``(k, 1)``, and its constant."""


def size_of(kind: str, most: np.ndarray, constant: np.ndarray) -> float:
    """Return about what an atom costs, from bounds of the vector ``(k,)`` and its central value.

    Of norms and squares no vector costs more; quotients are those of the largest divisor.
    """
    if kind == "exponential":
        return value_of(kind, constant)
    if kind == "quotient":
        return value_of(kind, np.append(max(float(most[0]), 1e-300), most[1:]))
    return value_of(kind, most)


def _sizes(kind: str, most: np.ndarray) -> float:
    """Return what a quotient's divisor is measured in."""
    return float(most[0]) or 1.0 if kind == "quotient" else 1.0


def lower_atom(
    program: ConeProgram,
    kind: str,
    blocks_of: Blocks,
    scale: np.ndarray | None,
    unit: float,
    most: np.ndarray,
) -> Rows:
    """Add an atom in units as a variable's cost; with ``scale``, a column, its perspective."""
    t = program.variables(1)
    program.add_cost(t, np.ones(1))
    if kind == "norm_inf":
        blocks, constant = blocks_of(1.0 / unit)
        both = [(columns, np.concatenate([-m, m])) for columns, m in blocks]
        both.append((t, np.ones((2 * len(constant), 1))))
        return program.add_rows(Cone.NONNEGATIVE, both, np.append(-constant, constant))
    if kind == "exponential":
        # exp(w) <= unit t as exp(w - log(unit)) <= t.
        blocks, constant = blocks_of(1.0)
        first = np.array([[1.0], [0.0], [0.0]])
        rows = [(columns, first * m) for columns, m in blocks]
        sides = np.array([float(constant[0]), 0.0, 0.0])
        ones = np.array([-math.log(unit), 1.0, 0.0])
        if scale is None:
            sides = sides + ones
        else:
            rows.append((scale, ones[:, None]))
        rows.append((t, first[::-1]))
        return program.add_rows(Cone.EXPONENTIAL, rows, sides)
    if kind == "quotient":
        # |w|^2 <= s t as |(t - s, 2 w)| <= t + s.
        size = _sizes(kind, most)
        factors = np.full((len(most), 1), 1.0 / math.sqrt(unit * size))
        factors[0] = 1.0 / size
        blocks, constant = blocks_of(factors)
        rows = [(columns, np.concatenate([m[:1], -m[:1], 2.0 * m[1:]])) for columns, m in blocks]
        sides = np.concatenate([constant[:1], -constant[:1], 2.0 * constant[1:]])
        rows.append((t, np.eye(len(sides))[:, :2].sum(axis=1, keepdims=True)))
        return program.add_rows(Cone.SECOND_ORDER, rows, sides)
    head = 1 if kind == "norm" else 2
    factor = 1.0 / unit if kind == "norm" else 2.0 / np.sqrt(unit)
    blocks, constant = blocks_of(factor)
    k = len(constant)
    rows = [(columns, np.concatenate([np.zeros((head, m.shape[1])), m])) for columns, m in blocks]
    constant = np.append(np.zeros(head), constant)
    rows.append((t, np.eye(k + head)[:, :head].sum(axis=1, keepdims=True)))
    if kind == "squares":
        # t scale >= |w|^2 as |(t - scale, 2 w)| <= t + scale.
        signs = np.zeros((k + 2, 1))
        signs[0], signs[1] = 1.0, -1.0
        if scale is None:
            constant = constant + signs[:, 0]
        else:
            rows.append((scale, signs))
    return program.add_rows(Cone.SECOND_ORDER, rows, constant)


def weights_of(kind: str, z: np.ndarray, unit: float, most: np.ndarray) -> np.ndarray:
    """Return the slope ``(k,)`` that multipliers of `lower_atom`'s rows stand for."""
    if kind == "norm_inf":
        k = len(z) // 2
        return np.asarray(z[:k] - z[k:])
    if kind == "norm":
        return -z[1:]
    if kind == "exponential":
        return -unit * z[:1]
    if kind == "quotient":
        size = _sizes(kind, most)
        return np.append(
            -unit * (z[0] - z[1]) / size, -2.0 * math.sqrt(unit / size) * np.asarray(z[2:])
        )
    return np.asarray(-2.0 * np.sqrt(unit) * z[2:])


def slope_of(kind: str, w: np.ndarray) -> np.ndarray:
    """Return a subgradient of an atom at a vector."""
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


def minorant_of(kind: str, y: np.ndarray) -> tuple[np.ndarray, float]:
    """Return (y, c) with ``y . w - c`` at most the atom of w for every w, y near the given one."""
    if kind == "squares":
        # |w|^2 - y . w is least at y / 2; rounded up.
        return y, 0.25 * float(y @ y) * (1.0 + (len(y) + 4) * EPSILON)
    if kind == "exponential":
        # exp(w) - y w is least at log(y).
        slope = max(float(y[0]), 0.0)
        if slope == 0.0:
            return np.zeros(1), 0.0
        power = math.log(slope)
        rounding = 8.0 * EPSILON * slope * (1.0 + abs(power))
        return np.array([slope]), slope * power - slope + rounding
    if kind == "quotient":
        # |w|^2 / s - q . w is least at q s / 2, where it is -|q|^2 s / 4.
        below = -0.25 * float(y[1:] @ y[1:]) * (1.0 + (len(y) + 4) * EPSILON)
        return np.append(min(float(y[0]), below), y[1:]), 0.0
    length = float(np.abs(y).sum() if kind == "norm_inf" else np.linalg.norm(y))
    most = 1.0 - 4.0 * (len(y) + 2) * EPSILON
    return (y * (most / length) if length > most else y), 0.0
