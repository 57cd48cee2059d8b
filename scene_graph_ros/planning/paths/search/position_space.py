"""The configurations among which a path is looked for: their limits, and random ones."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.elementary import arc_sines
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.paths.search.space_kernels import SpaceTable
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC, REVOLUTE

__all__ = [
    "PositionSpace",
    "get_continuous_revolute_joint_indices",
    "moving_positions",
    "normalized",
]

_TURN = 2.0 * math.pi

_STEPS = 8.0
"""Longest steps that lead from one corner of the space to the opposite one."""


@dataclass(frozen=True, eq=False)
class PositionSpace:
    """Boxes of positions, full turns and rotations.

    Random configurations are uniform: of a position between its limits, of a joint that turns
    without an end over one turn, of a quaternion over all rotations. Other positions without a
    limit are as far from start and goals at most as things in the scene are from each other.
    """

    lower: NDArray[np.float64]
    """``(nq,)``: finite; where a position stays as it is, that."""
    upper: NDArray[np.float64]
    """``(nq,)``."""
    least: NDArray[np.float64]
    """``(nq,)``: what positions may be, without limits infinite."""
    most: NDArray[np.float64]
    """``(nq,)``."""
    quaternions: NDArray[np.int64]
    """``(k,)``: where quaternions begin that may turn."""
    table: SpaceTable

    @classmethod
    def of(
        cls, plan: CheckerPlan, ends: NDArray[np.float64], moves: NDArray[np.bool_]
    ) -> PositionSpace:
        """Return the space for paths between ``ends`` ``(n, nq)``; ``moves`` ``(nq,)`` is a mask.

        Positions that do not move must be the same in all ends.
        """
        tree = plan.tree
        kinds, starts = tree.table.kinds[1:], tree.table.starts[1:]
        is_plain = (kinds <= PRISMATIC).all() and np.isfinite([tree.lower, tree.upper]).all()
        if is_plain:
            return cls._within_limits(tree, ends[0], moves)
        quaternions = starts[kinds == FLOATING]
        periods = _periods(tree)
        lower, upper = tree.lower.copy(), tree.upper.copy()
        without_end = periods > 0.0
        lower[without_end], upper[without_end] = -0.5 * _TURN, 0.5 * _TURN
        if not np.isfinite([lower, upper]).all():
            far = _extents(tree, _size_of_scene(plan))
            lower = np.where(np.isfinite(lower), lower, np.minimum(ends.min(axis=0), upper) - far)
            upper = np.where(np.isfinite(upper), upper, np.maximum(ends.max(axis=0), lower) + far)
        least, most = tree.lower.copy(), tree.upper.copy()
        for limits in (lower, upper, least, most):
            limits[~moves] = ends[0, ~moves]
        weights = np.ones(tree.num_positions)
        for s in quaternions:
            weights[s : s + 4] = 0.0
        turning = quaternions[moves[quaternions]]
        table = SpaceTable(weights, np.where(moves, periods, 0.0), quaternions)
        return cls(lower, upper, least, most, turning, table)

    @classmethod
    def _within_limits(
        cls, tree: KinematicTree, start: NDArray[np.float64], moves: NDArray[np.bool_]
    ) -> PositionSpace:
        """Return the space of a tree whose joints have one position each, and limits."""
        lower, upper = np.where(moves, [tree.lower, tree.upper], start)
        table = SpaceTable(np.ones(len(start)), np.zeros(len(start)), np.empty(0, np.int64))
        return cls(lower, upper, lower, upper, table.quaternions, table)

    @property
    def longest_step(self) -> float:
        """How far (rad and m) a tree grows at once."""
        spans = np.where(self.table.periods > 0.0, 0.5 * _TURN, self.upper - self.lower)
        squares = float((self.table.weights * spans**2).sum()) + len(self.quaternions) * math.pi**2
        return math.sqrt(squares) / _STEPS

    def samples(self, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
        """Return random configurations ``(count, nq)``."""
        q = self.lower + rng.random((count, len(self.lower))) * (self.upper - self.lower)
        for s in self.quaternions:
            # Normal in four dimensions has no direction that it likes better than others.
            turns = rng.standard_normal((count, 4))
            q[:, s : s + 4] = turns / np.linalg.norm(turns, axis=1)[:, np.newaxis]
        return q

    def settled(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a path ``(n, nq)`` without the rounding between two of its numbers."""
        if len(path) == 2:
            return path.copy()
        return np.concatenate([path[:1], path[1:-1].clip(self.least, self.most), path[-1:]])

    def length(self, path: NDArray[np.float64]) -> float:
        """Return the length of a path ``(n, nq)`` whose turns have been counted, rad and m."""
        squares = (self.table.weights * np.diff(path, axis=0) ** 2).sum(axis=1)
        for s in self.table.quaternions:
            a, b = path[:-1, s : s + 4], path[1:, s : s + 4]
            apart = np.minimum(*(np.linalg.norm(a - sign * b, axis=1) for sign in (1.0, -1.0)))
            squares += (4.0 * arc_sines(np.minimum(1.0, 0.5 * apart))) ** 2
        return float(np.sqrt(squares).sum())

    def distances(
        self, q: NDArray[np.float64], others: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the distances ``(n,)`` from q ``(nq,)`` to others ``(n, nq)``, the short way."""
        ways = others - q
        periods = np.where(self.table.periods > 0.0, self.table.periods, math.inf)
        ways -= np.where(np.isfinite(periods), periods, 0.0) * np.round(ways / periods)
        squares = (self.table.weights * ways**2).sum(axis=1)
        for s in self.table.quaternions:
            a, b = q[s : s + 4], others[:, s : s + 4]
            apart = np.minimum(*(np.linalg.norm(a - sign * b, axis=1) for sign in (1.0, -1.0)))
            squares += (4.0 * arc_sines(np.minimum(1.0, 0.5 * apart))) ** 2
        return np.asarray(np.sqrt(squares))

    def turns(self, q: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the full turns ``(nq,)`` that bring another configuration nearest to q."""
        periods, turns = self.table.periods, np.zeros_like(q)
        np.divide(q - other, periods, out=turns, where=periods > 0.0)
        return np.asarray(np.round(turns) * periods)

    def unwound(self) -> SpaceTable:
        """Return the comparable positions of a path, whose turns have been counted."""
        return self.table._replace(periods=np.zeros_like(self.table.periods))


def normalized(tree: KinematicTree, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return configurations ``(n, nq)`` with quaternions of length 1."""
    result = q.copy()
    if FLOATING not in tree.table.kinds[1:]:
        return result
    for s in tree.table.starts[tree.table.kinds == FLOATING]:
        result[:, s : s + 4] /= np.linalg.norm(q[:, s : s + 4], axis=1)[:, np.newaxis]
    return result


def moving_positions(tree: KinematicTree, group: str | None) -> NDArray[np.bool_]:
    """Return ``(nq,)`` which positions may change: all, or those of a group of the SRDF."""
    moves = np.full(tree.num_positions, group is None)
    if group is not None:
        moves[tree.group_positions(group)] = True
    return moves


def get_continuous_revolute_joint_indices(tree: KinematicTree) -> list[int]:
    """Return the entries of configurations that a full turn changes without moving anything.

    Those of revolute joints without limits, and the angles of planar joints.
    """
    return [int(k) for k in np.flatnonzero(_periods(tree))]


def _periods(tree: KinematicTree) -> NDArray[np.float64]:
    """Return ``(nq,)`` a full turn where that moves nothing, else 0.

    Joints that follow one without limits turn by a multiple: also that must be full turns.
    """
    periods = np.zeros(tree.num_positions)
    kinds, starts = tree.table.kinds[1:], tree.table.starts[1:]
    endless = np.isinf(tree.lower) & np.isinf(tree.upper)
    turning = starts[kinds == REVOLUTE]
    periods[turning[endless[turning]]] = _TURN
    periods[starts[kinds == PLANAR] + 2] = _TURN
    multipliers = tree.table.multipliers[1:]
    is_whole = (kinds == REVOLUTE) & (multipliers == np.round(multipliers))
    periods[starts[((kinds == REVOLUTE) | (kinds == PRISMATIC)) & ~is_whole]] = 0.0
    return periods


def _extents(tree: KinematicTree, size: float) -> NDArray[np.float64]:
    """Return ``(nq,)`` how far positions without limits may lead away: a turn, or the scene."""
    result = np.full(tree.num_positions, size)
    kinds, starts = tree.table.kinds[1:], tree.table.starts[1:]
    for kind, start in zip(kinds, starts, strict=True):
        if kind == REVOLUTE:
            result[start] = _TURN
        elif kind == FLOATING:
            result[start : start + 4] = 0.0
    return result


def _size_of_scene(plan: CheckerPlan) -> float:
    """Return the diagonal of the box around all that stands still, plus the robots' reach, m."""
    bodies, robots = plan.bodies, len(plan.bodies.joints)
    radii = bodies.radii[robots:]
    X_WG = bodies.X_WG[np.isfinite(radii)]
    centers = np.einsum("nij,nj->ni", X_WG[:, :, :3], bodies.centers[robots:][np.isfinite(radii)])
    corners = centers + X_WG[:, :, 3]
    reach = float(plan.reaches.max(initial=0.0))
    if not len(corners):
        return 1.0 + reach
    around = radii[np.isfinite(radii)][:, np.newaxis]
    return float(np.linalg.norm((corners + around).max(0) - (corners - around).min(0))) + reach
