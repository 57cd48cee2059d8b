"""Configurations that put a tool where it is to be, of many tries in batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import find_troubles
from scene_graph_ros.planning.ik.pose_descent import Descents, PoseDescent
from scene_graph_ros.planning.ik.pose_target import (
    InverseKinematicsError,
    PoseTarget,
)
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_kernels import FLOATING, REVOLUTE

__all__ = ["InverseKinematics", "InverseKinematicsFailure", "inverse_kinematics"]

_TOGETHER = 32
"""Tries that are worked on side by side."""

_SAME = 1e-6
"""rad or m: configurations that differ by less are one."""


class InverseKinematicsFailure(enum.Enum):
    """Why there is no configuration."""

    UNREACHED = 1
    """No try came near enough."""
    COLLIDES = 2
    """All that did collide."""


@one_line()
@dataclass(frozen=True, eq=False)
class InverseKinematics:
    """Configurations that reach a target, or how near tries came.

    ``configurations`` ``(n, nq)`` are within limits, free where a checker was asked, and the
    nearest to where it was looked first; none without success. ``nearest`` ``(nq,)`` is the first
    of them, or else what came nearest; ``position_error`` (m) and ``rotation_error`` (rad) are of
    the try that came nearest. ``failure`` and ``reason`` say why there are none.
    """

    configurations: NDArray[np.float64]
    nearest: NDArray[np.float64]
    position_error: float
    rotation_error: float
    failure: InverseKinematicsFailure | None
    reason: str | None
    tries: int

    @property
    def is_success(self) -> bool:
        """Whether there is a configuration."""
        return self.failure is None


def inverse_kinematics(
    robots: SceneGraphCollisionChecker | KinematicTree,
    target: PoseTarget,
    *,
    near: ArrayLike | None = None,
    group: str | None = None,
    solutions: int = 1,
    tries: int = 256,
    seed: int = 0,
    is_over: Callable[[], bool] | None = None,
) -> InverseKinematics:
    """Return configurations that put a target's tool where it is to be, or why there are none.

    ``robots`` is a checker, whose collisions are then avoided, or a tree of links alone. The first
    of the ``tries`` begins at ``near`` ``(nq,)``, by default zero, the others at random within
    limits; joints without limits stay within half a turn of ``near``, or as far away as the target
    is. They end when there are so many different ``solutions``. ``group`` names the group of
    joints that may move; all others stay at ``near``. The same ``seed`` gives the same, unless
    ``is_over``, which is asked after every 32 tries, ends them.

    Raises InverseKinematicsError naming the argument, and KinematicTreeError for an unknown link
    or group, and for ``near`` of another shape or with numbers that mean nothing.
    """
    is_checked = isinstance(robots, SceneGraphCollisionChecker)
    tree = robots.plan.tree if isinstance(robots, SceneGraphCollisionChecker) else robots
    counts = {"solutions": solutions, "tries": tries, "seed": seed}
    for name, value in counts.items():
        number, least = as_float(value), 0.0 if name == "seed" else 1.0
        if number is None or number < least or not number.is_integer():
            raise InverseKinematicsError(
                f"{name} must be a whole number from {least:g} on, not {quoted(value)}"
            )
    tree.link_index(target.link)
    first, moves = _first(tree, near, group)
    lower, upper = _box(tree, first, target)
    descent = PoseDescent(tree, target, lower, upper, moves)
    rng, found, done = np.random.default_rng(int(seed)), _Found.nothing(first), 0
    while done < tries and len(found.free) < solutions:
        count = min(_TOGETHER, int(tries) - done)
        begin = _samples(tree, rng, lower, upper, count)
        begin[:, ~moves] = first[~moves]
        if done == 0:
            begin[0] = np.clip(first, lower, upper)
        found = found.with_more(descent.descend(begin), robots if is_checked else None, first)
        done += count
        if is_over is not None and is_over():
            break
    return found.answer(robots, target, int(solutions), done)


@dataclass(frozen=True, eq=False)
class _Found:
    """What all tries up to now came to."""

    free: NDArray[np.float64]
    blocked: NDArray[np.float64]
    best: tuple[NDArray[np.float64], float, float]
    """The try that came nearest: its configuration, and its errors in m and rad."""

    @classmethod
    def nothing(cls, first: NDArray[np.float64]) -> _Found:
        none = np.empty((0, len(first)))
        return cls(none, none, (first, np.inf, np.inf))

    def with_more(
        self,
        tried: Descents,
        checker: SceneGraphCollisionChecker | KinematicTree | None,
        first: NDArray[np.float64],
    ) -> _Found:
        reached = tried.q[tried.reached]
        is_free = np.ones(len(reached), dtype=np.bool_)
        if isinstance(checker, SceneGraphCollisionChecker) and len(reached):
            is_free = checker.check_configs_collision_free(reached)
        sizes = np.hypot(tried.position_errors, tried.rotation_errors)
        row, best = int(np.argmin(sizes)), self.best
        if sizes[row] < np.hypot(best[1], best[2]):
            errors = float(tried.position_errors[row]), float(tried.rotation_errors[row])
            best = tried.q[row], *errors
        return _Found(
            _distinct(np.concatenate([self.free, reached[is_free]]), first),
            _distinct(np.concatenate([self.blocked, reached[~is_free]]), first),
            best,
        )

    def answer(
        self,
        robots: SceneGraphCollisionChecker | KinematicTree,
        target: PoseTarget,
        solutions: int,
        tries: int,
    ) -> InverseKinematics:
        none, (nearest, position, rotation) = self.free[:0], self.best
        if len(self.free):
            rows = self.free[:solutions]
            return InverseKinematics(rows, rows[0], position, rotation, None, None, tries)
        if len(self.blocked) and isinstance(robots, SceneGraphCollisionChecker):
            nearest = self.blocked[0]
            (trouble,) = find_troubles(robots, nearest[np.newaxis], robots.tolerance, new_stop())
            words = trouble.words if trouble is not None else "collides"
            count = len(self.blocked)
            kind = InverseKinematicsFailure.COLLIDES
            reason = (
                f"all {count} configurations that reach the target collide; the nearest {words}"
                if count > 1
                else f"the only configuration that reaches the target {words}"
            )
            return InverseKinematics(none, nearest, position, rotation, kind, reason, tries)
        kind = InverseKinematicsFailure.UNREACHED
        reason = (
            f"none of {tries} tries brings {target.link!r} to the target: the nearest is"
            f" {1e3 * position:.4g} mm and {rotation:.4g} rad off"
        )
        return InverseKinematics(none, nearest, position, rotation, kind, reason, tries)


def _first(
    tree: KinematicTree, near: ArrayLike | None, group: str | None
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return where tries begin ``(nq,)``, and which positions may move ``(nq,)``."""
    zero = tree.zero_configuration()
    first = np.clip(zero, tree.lower, tree.upper) if near is None else near
    if np.ndim(first) != 1:
        raise InverseKinematicsError(f"near must have shape (nq,), not {np.shape(first)}")
    q = tree.checked_configurations(first)[0].copy()
    for s in tree.table.starts[1:][tree.table.kinds[1:] == FLOATING]:
        q[s : s + 4] /= np.linalg.norm(q[s : s + 4])
    moves = np.ones(tree.num_positions, dtype=np.bool_)
    if group is not None:
        moves[:] = False
        moves[tree.group_positions(group)] = True
    return q, moves


def _box(
    tree: KinematicTree, first: NDArray[np.float64], target: PoseTarget
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return limits ``(nq,)`` that are finite; those of quaternions have no meaning."""
    far = np.full(tree.num_positions, 1.0 + float(np.abs(target.X_WT[:3, 3]).sum()))
    for kind, s in zip(tree.table.kinds[1:], tree.table.starts[1:], strict=True):
        if kind == REVOLUTE:
            far[s] = np.pi
    lower = np.where(np.isfinite(tree.lower), tree.lower, np.minimum(first, tree.upper) - far)
    upper = np.where(np.isfinite(tree.upper), tree.upper, np.maximum(first, tree.lower) + far)
    return lower, upper


def _samples(
    tree: KinematicTree,
    rng: np.random.Generator,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    count: int,
) -> NDArray[np.float64]:
    q = lower + rng.random((count, len(lower))) * (upper - lower)
    for s in tree.table.starts[1:][tree.table.kinds[1:] == FLOATING]:
        turns = rng.standard_normal((count, 4))
        q[:, s : s + 4] = turns / np.linalg.norm(turns, axis=1)[:, np.newaxis]
    return q


def _distinct(q: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows that differ, the nearest to ``first`` ``(nq,)`` first."""
    order = np.argsort(np.linalg.norm(q - first, axis=1), kind="stable")
    kept: list[int] = []
    for row in order:
        if all(np.abs(q[row] - q[other]).max(initial=0.0) > _SAME for other in kept):
            kept.append(int(row))
    return q[kept]
