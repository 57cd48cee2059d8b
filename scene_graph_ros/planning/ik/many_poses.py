"""Configurations for many poses of one tool."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.poses import as_pose, as_poses
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.ik.arguments import first_configurations, whole_number
from scene_graph_ros.planning.ik.pose_search import pose_search, PoseSearch, Tries, which_move
from scene_graph_ros.planning.ik.pose_target import InverseKinematicsError
from scene_graph_ros.planning.ik.tool_chain import carrying_positions
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["PosesReached", "inverse_kinematics_of_poses"]

_CHUNK = 1024
"""Poses that are worked on together."""

_NEAR_TRIES = 8
"""Tries of which the nearest to a configuration is chosen."""

_LANES = 8
"""Tries that take as long as one."""

_CHECKED = 64
"""Configurations that are checked for collisions at once, though the first may do."""


@one_line("num_poses", "num_reached")
@dataclass(frozen=True, eq=False)
class PosesReached:
    """A configuration for each pose that was asked for.

    Where ``is_success`` ``(m,)`` is true, ``configurations`` ``(m, nq)`` reach the pose, within
    limits, and free of collisions where a checker was asked. Elsewhere they are the nearest that
    was found: the errors say how near. Errors within 1e-9 without success mean that all that
    reach it, of those found, collide. ``position_errors`` ``(m,)`` are in m, ``rotation_errors``
    ``(m,)`` in rad. ``is_tried`` ``(m,)`` is false where the time was over before all tries that a
    pose may have, and none of them had reached it.
    """

    is_success: NDArray[np.bool_]
    configurations: NDArray[np.float64]
    position_errors: NDArray[np.float64]
    rotation_errors: NDArray[np.float64]
    is_tried: NDArray[np.bool_]

    @property
    def num_poses(self) -> int:
        """How many poses were asked for."""
        return len(self.is_success)

    @property
    def num_reached(self) -> int:
        """How many of them have a configuration."""
        return int(self.is_success.sum())


def inverse_kinematics_of_poses(
    checker: SceneGraphCollisionChecker | KinematicTree,
    link: str,
    X_WTs: ArrayLike,
    X_LT: ArrayLike | None = None,
    near: ArrayLike | None = None,
    group: str | None = None,
    tries: int = 64,
    seed: int = 0,
    *,
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> PosesReached:
    """Return configurations that put a tool T where each of many poses says, to 1e-9 m and rad.

    T is fixed to ``link`` at ``X_LT`` ``(4, 4)``; ``X_WTs`` is ``(m, 4, 4)``. ``checker`` is a
    checker, whose collisions are then avoided, or a tree of links alone. At most so many ``tries``
    are made for a pose. Without ``near`` they begin where the tool is near the pose, and the first
    that reaches it is the answer. With ``near``, ``(nq,)`` or one for each pose ``(m, nq)``, the
    first begins there, all go on along the pose's null space to where they are nearest to it,
    and the nearest of eight is the answer, or of the next eight. ``group`` names the group of
    joints that may move; all others stay at ``near``, by default zero, and so do those that do not
    carry the link. A pose has the same answer, bit for bit, with any poses beside it, unless the
    time is over: after ``timeout`` (s) no tries are begun. ``watch`` is called now and then and
    may raise.

    Raises InverseKinematicsError naming the argument, InvalidPoseError for a pose that is not
    rigid, and KinematicTreeError for an unknown link or group, and for ``near`` with numbers that
    mean nothing.
    """
    free = None if isinstance(checker, KinematicTree) else checker
    tree = checker if isinstance(checker, KinematicTree) else checker.plan.tree
    tries, seed = whole_number("tries", tries, least=1), whole_number("seed", seed)
    moves = which_move(tree, link, group)
    poses = as_poses(X_WTs, "X_WTs")
    X = as_pose(np.eye(4) if X_LT is None else X_LT, "X_LT")
    q = first_configurations(tree, near, len(poses))
    deadline = Deadline.of(timeout, watch, InverseKinematicsError)
    is_none = np.zeros(len(poses), dtype=np.bool_)
    ways, turns = np.empty((2, len(poses)))
    result = PosesReached(is_none, q, ways, turns, ~is_none)
    stays = carrying_positions(tree, link) & ~moves
    for rows in _alike(q[:, stays]):
        search = pose_search(tree, link, X, moves, q[rows[0]], tries=tries, seed=seed)
        for first in range(0, len(rows), _CHUNK):
            part = rows[first : first + _CHUNK]
            chunk = _Chunk(search, poses[part], q[part], near is not None, tries, free)
            chunk.solve(result, part, deadline)
    return result


def _alike(values: NDArray[np.float64]) -> list[NDArray[np.intp]]:
    """Return groups of the rows that are equal."""
    if not len(values):
        return []
    if not values.shape[1] or (values == values[0]).all():
        return [np.arange(len(values))]
    _, which = np.unique(values, axis=0, return_inverse=True)
    return [np.flatnonzero(which.ravel() == k) for k in range(int(which.max()) + 1)]


class _Chunk:
    """Some poses that are worked on together."""

    def __init__(
        self,
        search: PoseSearch,
        poses: NDArray[np.float64],
        q: NDArray[np.float64],
        is_near: bool,
        tries: int,
        checker: SceneGraphCollisionChecker | None,
    ) -> None:
        self._search, self._q, self._checker = search, q, checker
        self._is_near, self._count = is_near, tries
        self._goals, self._homes = search.goals(poses), search.chain.coordinates(q)
        m, n = len(poses), self._homes.shape[1]
        self._tries = Tries(
            np.empty((m, tries, n)),
            np.full((m, tries, 2), np.inf),
            np.zeros((m, tries), dtype=np.bool_),
        )

    def solve(self, result: PosesReached, rows: NDArray[np.intp], deadline: Deadline) -> None:
        """Write the answers into rows of a result."""
        is_open, tries, first = np.ones(len(rows), dtype=np.bool_), self._tries, 0
        while first < self._count and is_open.any():
            if deadline.is_over():
                break
            at = np.flatnonzero(is_open)
            count = min(self._next(first, len(at)), self._count - first)
            made = self._search.tried(
                self._goals[at],
                self._homes[at],
                first,
                count,
                begins_at_home=self._is_near,
                pulled=self._count if self._is_near else 0,
            )
            for kept, new in zip(tries, made, strict=True):
                kept[at, first : first + count] = new
            chosen = self._chosen(made, at)
            is_open[at] = chosen < 0
            self._write(made, chosen, at, result, rows, is_success=True)
            first += count
        left = np.flatnonzero(is_open)
        if first < self._count and len(left):
            result.is_tried[rows[left]] = False
            self._write_unfinished(left, first, result, rows)
        else:
            self._write_failures(left, result, rows)

    def _next(self, first: int, count: int) -> int:
        """Return the number of next tries of each of so many poses."""
        if self._is_near:
            return _NEAR_TRIES
        return max(-(-_LANES // count), first // 2, 1)

    def _write_failures(
        self, at: NDArray[np.intp], result: PosesReached, rows: NDArray[np.intp]
    ) -> None:
        """Take up the nearest tries once more, and write the nearest then."""
        if not len(at):
            return
        tries = self._tries.of(at)
        blocked = np.where(tries.reached.any(axis=1), self._order(tries, at)[:, 0], -1)
        self._write(tries, blocked, at, result, rows, is_success=False)
        open_ones = np.flatnonzero(blocked < 0)
        at = at[open_ones]
        made = self._search.polished(self._goals[at], self._homes[at], tries.of(open_ones))
        self._write(made, self._search.nearest(made)[:, 0], at, result, rows, is_success=False)
        self._write(made, self._chosen(made, at), at, result, rows, is_success=True)

    def _write_unfinished(
        self, at: NDArray[np.intp], count: int, result: PosesReached, rows: NDArray[np.intp]
    ) -> None:
        """Write the nearest of so many tries, or where they would have begun."""
        tries = self._tries.of(at)
        if count:
            x, errors, reached = tries
            tries = Tries(x[:, :count], errors[:, :count], reached[:, :count])
        else:
            tries = self._search.untried(self._goals[at], self._homes[at])
        blocked = np.where(tries.reached.any(axis=1), self._order(tries, at)[:, 0], -1)
        nearest = np.where(blocked < 0, self._search.nearest(tries)[:, 0], blocked)
        self._write(tries, nearest, at, result, rows, is_success=False)

    def _order(self, tries: Tries, at: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return tries in the order in which they are answers; those that reach nothing last."""
        if not self._is_near:
            return np.argsort(~tries.reached, axis=1, kind="stable")
        chain, (m, count, n) = self._search.chain, tries.x.shape
        homes = np.repeat(self._homes[at], count, axis=0)
        ways = chain.changes(homes, tries.x.reshape(m * count, n)) * chain.units
        distances = np.where(tries.reached, (ways**2).sum(axis=1).reshape(m, count), np.inf)
        return np.argsort(distances, axis=1, kind="stable")

    def _chosen(self, tries: Tries, at: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the first try of each pose that reaches it and is free; else -1."""
        order = self._order(tries, at)
        reached = np.take_along_axis(tries.reached, order, axis=1)
        if self._checker is None:
            return np.where(reached[:, 0], order[:, 0], -1)
        result, rank = np.full(len(at), -1), 0
        while rank < order.shape[1]:
            left = np.flatnonzero((result < 0) & reached[:, rank])
            if not len(left):
                break
            after = rank + max(1, _CHECKED // len(left))
            columns, is_free = order[left, rank:after], reached[left, rank:after]
            row, column = np.nonzero(is_free)
            x = tries.x[left[row], columns[row, column]]
            q = self._search.chain.configurations(x, self._q[at[left[row]]])
            is_free[row, column] = self._checker.check_configs_collision_free(q)
            has = np.flatnonzero(is_free.any(axis=1))
            result[left[has]] = columns[has, is_free[has].argmax(axis=1)]
            rank = after
        return result

    def _write(
        self,
        tries: Tries,
        chosen: NDArray[np.intp],
        at: NDArray[np.intp],
        result: PosesReached,
        rows: NDArray[np.intp],
        *,
        is_success: bool,
    ) -> None:
        """Write the chosen tries of poses ``at``; nothing where that is -1."""
        which = np.flatnonzero(chosen >= 0)
        place = which, chosen[which]
        to, q = rows[at[which]], self._q[at[which]]
        result.configurations[to] = self._search.chain.configurations(tries.x[place], q)
        result.position_errors[to], result.rotation_errors[to] = tries.errors[place].T
        result.is_success[to] = is_success
