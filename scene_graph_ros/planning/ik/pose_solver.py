"""Configurations that put a tool where it is to be, of many tries in batches."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import find_troubles
from scene_graph_ros.planning.ik.arguments import first_configurations, whole_number
from scene_graph_ros.planning.ik.pose_search import pose_search, PoseSearch, Tries, which_move
from scene_graph_ros.planning.ik.pose_target import InverseKinematicsError, PoseTarget
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.parallel.stoppable import new_stop
from scene_graph_ros.robots.kinematic_tree import KinematicTree

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
    TIMEOUT = 3
    """None was found in time."""


@one_line()
@dataclass(frozen=True, eq=False)
class InverseKinematics:
    """Configurations that reach a target, or how near tries came.

    ``configurations`` ``(n, nq)`` are within limits, free where a checker was asked, and the
    nearest to where it was looked first; none without success. ``nearest`` ``(nq,)`` is the first
    of them, or else the nearest try's; ``position_error`` (m) and ``rotation_error`` (rad) are of
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
    timeout: float | None = None,
    watch: Callable[[], object] | None = None,
) -> InverseKinematics:
    """Return configurations that put a target's tool where it is to be, or why there are none.

    ``robots`` is a checker, whose collisions are then avoided, or a tree of links alone. The first
    of the ``tries`` begins at ``near`` ``(nq,)``, by default zero, and ends as near to it as it
    can; then 16 begin where the tool is near the target, the others at random within limits.
    Joints without limits end within half a turn of ``near``. They end when there are so many
    different ``solutions``. ``group`` names the group of
    joints that may move; all others stay at ``near``, and so do those that do not carry the link.
    The same ``seed`` gives the same, unless the time is over before: ``timeout`` (s) ends the
    tries, and what was found by then is the answer. ``watch`` is called now and then and may
    raise.

    Raises InverseKinematicsError naming the argument, and KinematicTreeError for an unknown link
    or group, and for ``near`` of another shape or with numbers that mean nothing.
    """
    checker = robots if isinstance(robots, SceneGraphCollisionChecker) else None
    tree = robots if isinstance(robots, KinematicTree) else robots.plan.tree
    solutions = whole_number("solutions", solutions, least=1)
    tries, seed = whole_number("tries", tries, least=1), whole_number("seed", seed)
    moves = which_move(tree, target.link, group)
    first = first_configurations(tree, near)
    deadline = Deadline.of(timeout, watch, InverseKinematicsError)
    search = pose_search(
        tree,
        target.link,
        target.X_LT,
        moves,
        first[0],
        tries=tries,
        seed=seed,
        tolerances=(target.position_tolerance, target.rotation_tolerance),
    )
    goals, homes = search.goals(target.X_WT[np.newaxis]), search.chain.coordinates(first)
    found, done = _Found(search, first, checker), 0
    is_late = deadline.is_over()
    while done < tries and len(found.free) < solutions and not is_late:
        count = min(_TOGETHER, tries - done)
        found.add(search.tried(goals, homes, done, count, begins_at_home=True, pulled=1))
        done += count
        is_late = deadline.is_over()
    if not done:
        found.add(search.untried(goals, homes))
    elif not len(found.free) + len(found.blocked) and not is_late:
        found.add(search.polished(goals, homes, found.made))
    return found.answer(target, solutions, done, deadline if is_late and done < tries else None)


class _Found:
    """All that tries came to up to now."""

    def __init__(
        self,
        search: PoseSearch,
        first: NDArray[np.float64],
        checker: SceneGraphCollisionChecker | None,
    ) -> None:
        self._search, self._first, self._checker = search, first, checker
        self.free = self.blocked = np.empty((0, first.shape[1]))
        n = len(search.chain.lower)
        self.made = Tries(
            np.empty((1, 0, n)), np.empty((1, 0, 2)), np.empty((1, 0), dtype=np.bool_)
        )

    def add(self, tries: Tries) -> None:
        """Sort in where tries ended."""
        self.made = self.made.joined(tries)
        reached = self._configurations(tries.x[tries.reached])
        is_free = np.ones(len(reached), dtype=np.bool_)
        if self._checker is not None and len(reached):
            is_free = self._checker.check_configs_collision_free(reached)
        first = self._first[0]
        self.free = _distinct(np.concatenate([self.free, reached[is_free]]), first)
        self.blocked = _distinct(np.concatenate([self.blocked, reached[~is_free]]), first)

    def _configurations(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._search.chain.configurations(x, np.repeat(self._first, len(x), axis=0))

    def answer(
        self, target: PoseTarget, solutions: int, tries: int, late: Deadline | None
    ) -> InverseKinematics:
        """Return it, after so many tries; ``late`` is the deadline that has ended them."""
        row = int(self._search.nearest(self.made)[0, 0])
        position, rotation = map(float, self.made.errors[0, row])
        if len(self.free):
            rows = self.free[:solutions]
            return InverseKinematics(rows, rows[0], position, rotation, None, None, tries)
        none = self.free
        when = "" if late is None else f" within {late.timeout:.10g} s"
        if len(self.blocked) and self._checker is not None:
            nearest, kind = self.blocked[0], InverseKinematicsFailure.COLLIDES
            reason = self._why_blocked(self._checker, when)
            kind = kind if late is None else InverseKinematicsFailure.TIMEOUT
            return InverseKinematics(none, nearest, position, rotation, kind, reason, tries)
        kind = InverseKinematicsFailure.UNREACHED
        if late is not None:
            kind = InverseKinematicsFailure.TIMEOUT
        reason = (
            f"none of {tries} tries{when} brings {target.link!r} to the target: the nearest is"
            f" {1e3 * position:.4g} mm and {rotation:.4g} rad off"
        )
        (nearest,) = self._configurations(self.made.x[0, row : row + 1])
        return InverseKinematics(none, nearest, position, rotation, kind, reason, tries)

    def _why_blocked(self, checker: SceneGraphCollisionChecker, when: str) -> str:
        (trouble,) = find_troubles(checker, self.blocked[:1], checker.tolerance, new_stop())
        words = trouble.words if trouble is not None else "collides"
        if len(self.blocked) == 1:
            return f"the only configuration that reaches the target{when} {words}"
        return (
            f"all {len(self.blocked)} configurations that reach the target{when} collide; the"
            f" nearest {words}"
        )


def _distinct(q: NDArray[np.float64], first: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return rows that differ, the nearest to ``first`` ``(nq,)`` first."""
    order = np.argsort(np.linalg.norm(q - first, axis=1), kind="stable")
    kept: list[int] = []
    for row in order:
        if all(np.abs(q[row] - q[other]).max(initial=0.0) > _SAME for other in kept):
            kept.append(int(row))
    return q[kept]
