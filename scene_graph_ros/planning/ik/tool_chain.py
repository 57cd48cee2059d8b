"""The joints between a robot's base and a tool, as descents of inverse kinematics read them.

A planar joint is two that slide and one that turns; a floating one is three that slide and four
that turn, about x, y, z and x again: with three there are turns at which two axes are one. So each
coordinate of a chain turns or slides along the z axis of some frame, and a chain of any joints is
one table of numbers. Lengths in it are in a unit of its own, a
power of two near its reach: so arms of any size are the same to a descent, and nothing is rounded.
"""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = ["ChainTable", "ToolChain", "carrying_positions"]

_POSITIONS = {PLANAR: 3, FLOATING: 7}
"""Of joints that have several."""


class ChainTable(NamedTuple):
    """The kernels' table of a chain: its joints, from the base on, and where the tool is.

    A joint turns about, or slides along, the z axis of its frame, by ``multiplier * x + offset``,
    where x is the coordinate in ``columns``; -1 is a joint that stays at its offset.
    """

    slides: NDArray[np.bool_]
    """``(k,)``; the others turn."""
    columns: NDArray[np.int64]
    """``(k,)``."""
    multipliers: NDArray[np.float64]
    """``(k,)``."""
    offsets: NDArray[np.float64]
    """``(k,)`` rad or units."""
    quaternions: NDArray[np.float64]
    """``(k + 1, 4)``, w first: frames in those before them; the last is the tool's."""
    places: NDArray[np.float64]
    """``(k + 1, 3)`` units."""


def _product(A: NDArray[np.float64], B: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the product of two poses ``(4, 4)``: the same bits everywhere, unlike BLAS's."""
    return np.asarray((A[:, :, np.newaxis] * B[np.newaxis]).sum(axis=1))


def _axis_frame(axis: int) -> NDArray[np.float64]:
    """Return a frame ``(4, 4)`` whose z axis is the axis of that number."""
    X = np.zeros((4, 4))
    for column in range(3):
        X[(axis + 1 + column) % 3, column] = 1.0
    X[3, 3] = 1.0
    return X


_ELEMENTS = {
    REVOLUTE: ((False, 2),),
    PRISMATIC: ((True, 2),),
    PLANAR: ((True, 0), (True, 1), (False, 2)),
    FLOATING: (
        *((True, 0), (True, 1), (True, 2)),
        *((False, 0), (False, 1), (False, 2), (False, 0)),
    ),
}
"""Of each kind of joint: what slides or turns, and along or about which axis."""

_TURNS = 4
"""Coordinates of a floating joint's turn."""

_STEEP = 0.5
"""Squared sine of the second turn: above it the fourth is a quarter turn, and the second less."""


def carrying_positions(tree: KinematicTree, link: str) -> NDArray[np.bool_]:
    """Return a mask ``(nq,)`` of the positions that move a link: those of joints above it.

    A joint that mimics another is at the other's position.
    """
    result, table = np.zeros(tree.num_positions, dtype=np.bool_), tree.table
    row = tree.joint_of_link[tree.link_index(link)]
    while row > 0:
        count = _POSITIONS.get(int(table.kinds[row]), 1)
        result[table.starts[row] : table.starts[row] + count] = True
        row = table.parents[row]
    return result


@dataclass(frozen=True, eq=False)
class ToolChain:
    """A chain whose coordinates x ``(n,)`` are the positions that may move, in rad or units.

    Of a floating joint they are its place and its turns about x, y, z and x, one after the other.
    """

    table: ChainTable
    unit: float
    """m."""
    units: NDArray[np.float64]
    """``(n,)``: a coordinate's, in rad or m."""
    positions: NDArray[np.intp]
    """``(n,)``: which position of q a coordinate is; -1 for turns of floating joints."""
    turns: tuple[tuple[int, int], ...]
    """Where quaternions begin in q, and their four turns in x."""
    lower: NDArray[np.float64]
    """``(n,)``."""
    upper: NDArray[np.float64]
    """``(n,)``."""
    is_turning: NDArray[np.bool_]
    """``(n,)``: it is an angle, in rad."""
    is_periodic: NDArray[np.bool_]
    """``(n,)``: a whole turn more is the same pose."""

    @classmethod
    def of(
        cls,
        tree: KinematicTree,
        link: str,
        X_LT: NDArray[np.float64],
        moves: NDArray[np.bool_],
        q: NDArray[np.float64],
    ) -> ToolChain:
        """Return the chain to a tool at ``X_LT`` of a link; all other positions stay at ``q``."""
        return _Builder(tree, moves, q).chain(tree.link_index(link), X_LT)

    def coordinates(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the coordinates ``(m, n)`` of configurations ``(m, nq)``."""
        x = q[:, np.maximum(self.positions, 0)] / self.units
        for start, column in self.turns:
            x[:, column : column + _TURNS] = _turns_of(q[:, start : start + 4])
        return x

    def regular(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return other coordinates ``(n,)`` of a configuration, from which it may turn any way."""
        result = x.copy()
        for _, column in self.turns:
            own = slice(column, column + _TURNS)
            result[own] = _turns_of(_quaternions_of(x[np.newaxis, own]))[0]
        return result

    def configurations(
        self, x: NDArray[np.float64], near: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return ``near`` ``(m, nq)`` with these coordinates ``(m, n)`` put in."""
        q = near.copy()
        linear = np.flatnonzero(self.positions >= 0)
        q[:, self.positions[linear]] = x[:, linear] * self.units[linear]
        for start, column in self.turns:
            Q, own = _quaternions_of(x[:, column : column + _TURNS]), slice(start, start + 4)
            # Of the two that are one turn, the nearer one.
            is_far = (Q * near[:, own]).sum(axis=1) < 0.0
            q[:, own] = np.where(is_far[:, np.newaxis], -Q, Q)
        return q

    def changes(self, x1: NDArray[np.float64], x2: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the changes ``(m, n)`` of coordinates along straight edges from some to others.

        There a floating joint turns about one axis: the first of its four is all of its turn.
        """
        result = x2 - x1
        for _, column in self.turns:
            own = slice(column, column + _TURNS)
            first, second = _quaternions_of(x1[:, own]), _quaternions_of(x2[:, own])
            apart = np.minimum(
                np.linalg.norm(second - first, axis=1), np.linalg.norm(second + first, axis=1)
            )
            result[:, own] = 0.0
            result[:, column] = 4.0 * np.arcsin(np.minimum(0.5 * apart, 1.0))
        return result

    def names(self, positions: tuple[str, ...]) -> list[str]:
        """Return the names of coordinates, by those of positions; a turn has its joint's."""
        result = [positions[p] for p in self.positions]
        for start, column in self.turns:
            result[column : column + _TURNS] = [positions[start].removesuffix(".qw")] * _TURNS
        return result

    def start_limits(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return limits ``(n,)`` to draw from: at most a turn of joints that may turn further.

        A slide without limits stays where it is: a descent finds its place in a step.
        """
        middle = np.clip(0.0, self.lower, self.upper)
        far = np.where(self.is_turning, np.pi, 0.0)
        is_narrow = np.isfinite(self.lower) & np.isfinite(self.upper) & ~self.is_periodic
        lower = np.where(is_narrow, self.lower, np.maximum(self.lower, middle - far))
        upper = np.where(is_narrow, self.upper, np.minimum(self.upper, middle + far))
        return lower, upper

    def nearest_turns(
        self, x: NDArray[np.float64], near: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return ``x`` ``(m, n)`` with whole turns added that bring it nearest to ``near``."""
        columns = np.flatnonzero(self.is_periodic)
        angles, turn = x[:, columns], 2.0 * np.pi
        lower, upper = self.lower[columns], self.upper[columns]
        result = x.copy()
        moved = angles - turn * np.rint((angles - near[:, columns]) / turn)
        moved = np.where(moved < lower, moved + turn, np.where(moved > upper, moved - turn, moved))
        fits = (moved >= lower) & (moved <= upper)
        result[:, columns] = np.where(fits, moved, angles)
        return result


class _Builder:
    """Collects the elements of a chain."""

    def __init__(
        self, tree: KinematicTree, moves: NDArray[np.bool_], q: NDArray[np.float64]
    ) -> None:
        self._tree, self._moves, self._q = tree, moves, q
        self._rows: list[tuple[bool, int, float, float]] = []
        self._frames: list[NDArray[np.float64]] = []
        self._columns: dict[tuple[int, int], int] = {}
        """Of a position in q and the number of a turn, or -1."""
        self._periods: dict[int, bool] = {}

    def chain(self, link: int, X_LT: NDArray[np.float64]) -> ToolChain:
        tree, table = self._tree, self._tree.table
        joints, row = [], int(tree.joint_of_link[link])
        while row > 0:
            joints.append(row)
            row = int(table.parents[row])
        X = np.eye(4)
        for row in reversed(joints):
            X = self._add_joint(row, X)
        frames = [*self._frames, _product(X, _product(tree.X_JL[link], X_LT))]
        return self._finished(np.array(frames))

    def _add_joint(self, row: int, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Add a joint; X is since the last one. Return the pose to the next."""
        table = self._tree.table
        X_PJ = np.eye(4)
        X_PJ[:3] = table.X_PJ[row]
        X, start, kind = _product(X, X_PJ), int(table.starts[row]), int(table.kinds[row])
        turns = np.zeros(_TURNS)
        if kind == FLOATING:
            turns = _turns_of(self._q[np.newaxis, start : start + 4])[0]
        for k, (slides, axis) in enumerate(_ELEMENTS[kind]):
            turn = k - 3 if kind == FLOATING and not slides else -1
            place = start if turn >= 0 else start + k + (4 if kind == FLOATING else 0)
            frame = _axis_frame(axis)
            self._frames.append(_product(X, frame))
            X = np.ascontiguousarray(frame.T)
            multiplier, offset = 1.0, 0.0
            if kind in (REVOLUTE, PRISMATIC):
                multiplier, offset = float(table.multipliers[row]), float(table.offsets[row])
            column = -1
            if self._moves[place]:
                column = self._column(place, turn)
                is_whole = not slides and multiplier.is_integer()
                self._periods[column] = self._periods.get(column, True) and is_whole
            else:
                value = turns[turn] if turn >= 0 else self._q[place]
                multiplier, offset = 0.0, multiplier * float(value) + offset
            self._rows.append((slides, column, multiplier, offset))
        return X

    def _column(self, place: int, turn: int) -> int:
        return self._columns.setdefault((place, turn), len(self._columns))

    def _finished(self, frames: NDArray[np.float64]) -> ToolChain:
        xyzw = quaternions_from_poses(frames)
        quaternions = np.ascontiguousarray(xyzw[:, [3, 0, 1, 2]])
        slides, columns, multipliers, offsets = (
            zip(*self._rows, strict=True) if self._rows else ((), (), (), ())
        )
        keys = list(self._columns)
        is_turning = np.zeros(len(keys), dtype=np.bool_)
        is_turning[[c for s, c, *_ in self._rows if c >= 0 and not s]] = True
        positions = np.array([p if turn < 0 else -1 for p, turn in keys], dtype=np.intp)
        is_linear, tree = positions >= 0, self._tree
        lower = np.where(is_linear, tree.lower[positions], -np.inf)
        upper = np.where(is_linear, tree.upper[positions], np.inf)
        unit = _unit(frames, (upper - lower)[~is_turning])
        units = np.where(is_turning, 1.0, unit)
        scales = np.where(slides, 1.0 / unit, 1.0)
        which = np.array(columns, dtype=np.int64)
        factors = np.array([units[c] if c >= 0 else 1.0 for c in which])
        table = ChainTable(
            np.array(slides, dtype=np.bool_),
            which,
            np.array(multipliers, dtype=np.float64) * factors * scales,
            np.array(offsets, dtype=np.float64) * scales,
            quaternions,
            np.ascontiguousarray(frames[:, :3, 3]) / unit,
        )
        turns = tuple((p, self._columns[p, turn]) for p, turn in keys if turn == 0)
        periods = np.array([self._periods[c] for c in range(len(keys))], dtype=np.bool_)
        return ToolChain(
            table, unit, units, positions, turns, lower / units, upper / units, is_turning, periods
        )


def _unit(frames: NDArray[np.float64], ranges: NDArray[np.float64]) -> float:
    """Return the power of two (m) below the lengths of a chain's parts and its slides' ranges."""
    lengths = np.sqrt((frames[:, :3, 3] ** 2).sum(axis=1)).sum()
    reach = float(lengths + ranges[np.isfinite(ranges)].sum())
    return 2.0 ** (math.frexp(reach)[1] - 1) if reach > 0.0 else 1.0


def _turns_of(quaternions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return turns ``(m, 4)`` about x, then the new y, z and x, of ``(m, 4)``, w first.

    The second is at most an eighth of a turn, so that three axes are never in one plane.
    """
    Q = quaternions / np.linalg.norm(quaternions, axis=1)[:, np.newaxis]
    w, x, y, z = Q.T
    is_steep = 4.0 * (x * z + w * y) ** 2 > _STEEP
    # A quarter turn back about x.
    back = math.sqrt(0.5) * np.stack([w + x, x - w, y - z, y + z])
    w, x, y, z = np.where(is_steep, back, Q.T)
    sine = np.clip(2.0 * (x * z + w * y), -1.0, 1.0)
    about_x = np.arctan2(2.0 * (w * x - y * z), 1.0 - 2.0 * (x * x + y * y))
    about_z = np.arctan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (y * y + z * z))
    last = np.where(is_steep, 0.5 * np.pi, 0.0)
    return np.stack([about_x, np.arcsin(sine), about_z, last], axis=1)


def _quaternions_of(turns: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quaternions ``(m, 4)``, w first, of turns ``(m, 4)`` as of `_turns_of`."""
    c, s = np.cos(0.5 * turns).T, np.sin(0.5 * turns).T
    w = c[0] * c[1] * c[2] - s[0] * s[1] * s[2]
    x = s[0] * c[1] * c[2] + c[0] * s[1] * s[2]
    y = c[0] * s[1] * c[2] - s[0] * c[1] * s[2]
    z = c[0] * c[1] * s[2] + s[0] * s[1] * c[2]
    last = c[3] * w - s[3] * x, c[3] * x + s[3] * w, c[3] * y + s[3] * z, c[3] * z - s[3] * y
    return np.stack(last, axis=1)
