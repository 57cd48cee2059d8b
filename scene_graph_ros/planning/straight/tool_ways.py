"""The way that a tool goes through poses: lines or screws, and the turns along them.

Notation: W is the world, T the tool.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions, quaternions_from_poses

__all__ = ["ToolWay"]

_STRAIGHT = 1e-9
"""rad: along a screw that turns by less the origin moves on a line."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """From one pose to the next, while s goes from 0 to 1."""

    p_WT: NDArray[np.float64]
    """Where the origin is at first, m."""
    way: NDArray[np.float64]
    """To where it is at last, m; along the axis of a screw only."""
    quaternion: NDArray[np.float64]
    """The orientation at first, x, y, z, w."""
    axis: NDArray[np.float64]
    """Of the turn, in W."""
    angle: float
    """rad, at most pi."""
    arm: NDArray[np.float64]
    """From a screw's axis to the origin at first, m; zero where the origin goes along a line."""
    length: float
    """m, of the origin's way."""

    def pose(self, s: float) -> NDArray[np.float64]:
        half = 0.5 * s * self.angle
        turn = np.append(math.sin(half) * self.axis, math.cos(half))
        q = _product(turn, self.quaternion)
        p = self.p_WT + s * self.way + _turned(self.axis, s * self.angle, self.arm) - self.arm
        return np.asarray(poses_from_quaternions(p[np.newaxis], q[np.newaxis])[0])


class ToolWay:
    """A way through poses, by its pieces, with a measure of how far one has come.

    A turn by a radian counts as ``unit`` metres.
    """

    def __init__(self, X_WTs: NDArray[np.float64], unit: float, *, is_screw: bool) -> None:
        """Take poses ``(n, 4, 4)``, the first of which is where the way begins."""
        pairs = pairwise(X_WTs)
        pieces = [_piece(A, B, is_screw=is_screw) for A, B in pairs]
        sizes = [piece.length + unit * piece.angle for piece in pieces]
        self.pieces = [piece for piece, size in zip(pieces, sizes, strict=True) if size > 0.0]
        self.sizes = [size for size in sizes if size > 0.0]

    def pose(self, piece: int, s: float) -> NDArray[np.float64]:
        """Return the tool's pose ``(4, 4)`` at s from 0 to 1 of a piece."""
        return self.pieces[piece].pose(s)

    def sagitta(self, piece: int, part: float) -> float:
        """Return the largest distance of a part of a piece from its chord, m."""
        each = self.pieces[piece]
        return float(np.linalg.norm(each.arm)) * (part * each.angle) ** 2 / 8.0

    def fraction(self, piece: int, s: float) -> float:
        """Return the share of the whole way up to a place."""
        total = sum(self.sizes)
        done = sum(self.sizes[:piece]) + (s * self.sizes[piece] if s > 0.0 else 0.0)
        return min(1.0, done / total) if total > 0.0 else 1.0


def _piece(X_WA: NDArray[np.float64], X_WB: NDArray[np.float64], *, is_screw: bool) -> _Piece:
    a, b = quaternions_from_poses(np.array([X_WA, X_WB]))
    x, y, z, w = _product(b, a * (-1.0, -1.0, -1.0, 1.0))
    v = np.array([x, y, z]) * (1.0 if w >= 0.0 else -1.0)
    sine = float(np.linalg.norm(v))
    angle = 2.0 * math.atan2(sine, abs(w))
    axis = v / sine if sine > 0.0 else np.array([0.0, 0.0, 1.0])
    way = X_WB[:3, 3] - X_WA[:3, 3]
    arm = np.zeros(3)
    if is_screw and angle > _STRAIGHT:
        along = (way @ axis) * axis
        across = way - along
        # The middle of the chord is tan(angle / 2) nearer to the axis than half the chord is long.
        center = 0.5 * across + np.cross(axis, across) * (0.5 / math.tan(0.5 * angle))
        arm, way = -center, along
    length = math.hypot(float(np.linalg.norm(way)), float(np.linalg.norm(arm)) * angle)
    return _Piece(X_WA[:3, 3].copy(), way, a, axis, angle, arm, length)


def _product(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product of quaternions x, y, z, w."""
    v = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.append(v, a[3] * b[3] - a[:3] @ b[:3])


def _turned(
    axis: NDArray[np.float64], angle: float, v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Turn a vector that is across an axis about it."""
    return np.asarray(math.cos(angle) * v + math.sin(angle) * np.cross(axis, v))
