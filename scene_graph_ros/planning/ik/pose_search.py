"""Tries to put one tool where poses say: where they begin, and where they end."""

from __future__ import annotations

import math
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.planning.ik.chain_kernels import goals_in_base
from scene_graph_ros.planning.ik.descent_kernels import descend, Descents
from scene_graph_ros.planning.ik.start_table import StartTable
from scene_graph_ros.planning.ik.tool_chain import carrying_positions, ToolChain
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["PoseSearch", "Tries", "pose_search", "which_move"]

_LONGEST = 0.8
"""rad: the change of an angle in a step at most."""

_CENTERED = 1e-6
"""rad or m: a larger tolerance is used up; with a smaller one the pose itself is looked for."""

_USED, _ENOUGH = 0.999, 0.9999
"""Of a tolerance that is used up: the part that is, and the part within which a try ends."""

_EXACT = 0.1
"""Of a tolerance that is not used up, the part within which a try ends: room for rounding, also of
whoever works out the tool's pose by other products."""

_PULL = 1e-3
"""Squared units or rad for each rad² or m² from home, at first: stronger pulls lead off the pose,
weaker ones leave what could be nearer."""

_STEPS, _PATIENT_STEPS = 60, 300
"""Of a try, and of the last ones, which only end where no step helps."""

_HURRIED = 8
"""So many tries are given up as soon as they hardly go on; later ones have hard poses left."""

_KEPT = 4
"""Searches of a tree that are kept, for whoever asks for one pose after another."""

_POLISHED = 8
"""So many of the nearest tries are taken up once more where none has reached a pose."""


class Tries(NamedTuple):
    """Where tries ended: k of each of m poses."""

    x: NDArray[np.float64]
    """``(m, k, n)``."""
    errors: NDArray[np.float64]
    """``(m, k, 2)`` m and rad."""
    reached: NDArray[np.bool_]
    """``(m, k)``: both are within their tolerances."""

    def of(self, rows: NDArray[np.intp]) -> Tries:
        """Return all tries of some poses."""
        return Tries(self.x[rows], self.errors[rows], self.reached[rows])

    def joined(self, more: Tries) -> Tries:
        """Return these tries of all poses, and others after them."""
        return Tries(
            np.concatenate([self.x, more.x], axis=1),
            np.concatenate([self.errors, more.errors], axis=1),
            np.concatenate([self.reached, more.reached], axis=1),
        )

    def at(self, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Tries:
        """Return some tries of some poses: ``rows`` ``(r,)``, ``columns`` ``(r, c)``."""
        place = rows[:, np.newaxis], columns
        return Tries(self.x[place], self.errors[place], self.reached[place])


def which_move(tree: KinematicTree, link: str, group: str | None) -> NDArray[np.bool_]:
    """Return a mask ``(nq,)`` of a group's positions, of those that carry a link.

    Raises KinematicTreeError for an unknown link or group.
    """
    carries = carrying_positions(tree, link)
    if group is None:
        return carries
    members = np.zeros_like(carries)
    members[tree.group_positions(group)] = True
    return carries & members


class PoseSearch:
    """Tries for one tool of a robot, whose other joints stay where they are."""

    def __init__(
        self,
        tree: KinematicTree,
        link: str,
        X_LT: NDArray[np.float64],
        moves: NDArray[np.bool_],
        q: NDArray[np.float64],
        *,
        tries: int,
        seed: int,
        tolerances: tuple[float, float] = (1e-9, 1e-9),
    ) -> None:
        """Take the mask ``moves`` ``(nq,)``, and ``q`` ``(nq,)`` for positions that do not.

        ``tolerances`` are those of the place (m) and of the turn (rad).
        """
        self.chain = chain = ToolChain.of(tree, link, X_LT, moves, q)
        position, rotation = tolerances
        is_open = rotation >= math.pi
        sizes = math.inf if is_open else 4.0 * math.tan(0.25 * rotation), position
        units = np.array([1.0, chain.unit])
        self._allowed = np.array([_USED * t if t > _CENTERED else 0.0 for t in sizes]) / units
        parts = np.array([_ENOUGH if t > _CENTERED else _EXACT for t in sizes])
        # No error is near the largest of these, whose square is finite.
        self._limits = np.minimum(parts * sizes / units, 1e150) ** 2
        self._tolerances = np.array([position, math.inf if is_open else rotation])
        self._longest = np.where(chain.is_turning, 1.0 / _LONGEST, 0.0)
        self._table = StartTable(chain, tries, seed, is_open=is_open)
        self._X_WB = np.ascontiguousarray(tree.X_WB)
        self._base = quaternions_from_poses(self._X_WB)[0]

    def goals(self, X_WTs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return poses ``(m, 4, 4)`` as descents read them, ``(m, 7)``."""
        result = np.empty((len(X_WTs), 7))
        quaternions, unit = quaternions_from_poses(X_WTs), self.chain.unit
        goals_in_base(X_WTs, quaternions, self._X_WB, self._base, unit, result)
        return result

    def tried(
        self,
        goals: NDArray[np.float64],
        homes: NDArray[np.float64],
        first: int,
        count: int,
        *,
        begins_at_home: bool,
        pulled: int,
    ) -> Tries:
        """Return tries ``first`` to ``first + count`` for goals ``(m, 7)``.

        Where they are to begin ``begins_at_home``, that of number 0 does, at ``homes`` ``(m, n)``.
        The first ``pulled`` of all tries end as near to home as they can.
        """
        own = int(begins_at_home and first == 0)
        shift = int(begins_at_home)
        starts = np.empty((len(goals), count, len(self.chain.lower)))
        if own:
            starts[:, 0] = np.clip(homes, self.chain.lower, self.chain.upper)
        if count > own:
            rest = first + own - shift, count - own
            starts[:, own:] = self._table.starts(goals, homes, *rest, is_near=pulled > 0)
        pulls = np.where(np.arange(first, first + count) < pulled, _PULL, 0.0)
        return self._descended(goals, homes, starts, pulls, _STEPS, first >= _HURRIED)

    def followed(self, goals: NDArray[np.float64], x: NDArray[np.float64]) -> Tries:
        """Return the ends of descents from ``x`` ``(m, n)`` to goals ``(m, 7)``, one for each."""
        return self._descended(goals, x, x[:, np.newaxis], np.zeros(1), _STEPS, True)

    def untried(self, goals: NDArray[np.float64], x: NDArray[np.float64]) -> Tries:
        """Return ``x`` ``(m, n)`` and the errors there, without a step."""
        return self._descended(goals, x, x[:, np.newaxis], np.zeros(1), 0, True)

    def polished(
        self, goals: NDArray[np.float64], homes: NDArray[np.float64], tries: Tries
    ) -> Tries:
        """Return the ends of the nearest of some tries that go on as long as it helps.

        Then some begin about the nearest of these: beside a limit a descent can end short of it.
        """
        rows = np.arange(len(goals))
        starts = tries.at(rows, self.nearest(tries)[:, :_POLISHED]).x
        ends = self._descended(
            goals, homes, starts, np.zeros(starts.shape[1]), _PATIENT_STEPS, True
        )
        about = ends.at(rows, self.nearest(ends)[:, :1]).x + self._table.shakes
        starts = np.clip(about, self.chain.lower, self.chain.upper)
        shaken = self._descended(goals, homes, starts, np.zeros(starts.shape[1]), _STEPS, True)
        return ends.joined(shaken)

    def nearest(self, tries: Tries) -> NDArray[np.intp]:
        """Return the indices of the nearest tries, in order, ``(m, k)``.

        A unit of the chain beyond the tolerance counts as a radian.
        """
        beyond = np.maximum(tries.errors - self._tolerances, 0.0) / (self.chain.unit, 1.0)
        return np.argsort((beyond**2).sum(axis=2), axis=1, kind="stable")

    def _descended(
        self,
        goals: NDArray[np.float64],
        homes: NDArray[np.float64],
        starts: NDArray[np.float64],
        pulls: NDArray[np.float64],
        steps: int,
        is_patient: bool,
    ) -> Tries:
        m, count, n = starts.shape
        ends, errors = np.empty((m * count, n)), np.empty((m * count, 2))
        task = Descents(
            goals,
            np.repeat(np.arange(m), count),
            starts.reshape(m * count, n),
            np.repeat(homes, count, axis=0),
            np.tile(pulls, m),
            self.chain.units**2,
            self.chain.lower,
            self.chain.upper,
            self._longest,
            self._allowed,
            self._limits,
            steps,
            is_patient,
        )
        descend(self.chain.table, task, ends, errors)
        errors[:, 0] *= self.chain.unit
        ends = self.chain.nearest_turns(ends, task.homes)
        reached = (errors <= self._tolerances).all(axis=1)
        return Tries(
            ends.reshape(m, count, n), errors.reshape(m, count, 2), reached.reshape(m, count)
        )


_searches: WeakKeyDictionary[KinematicTree, dict[object, PoseSearch]] = WeakKeyDictionary()


def pose_search(
    tree: KinematicTree,
    link: str,
    X_LT: NDArray[np.float64],
    moves: NDArray[np.bool_],
    q: NDArray[np.float64],
    *,
    tries: int,
    seed: int,
    tolerances: tuple[float, float] = (1e-9, 1e-9),
) -> PoseSearch:
    """Return a `PoseSearch` of these arguments, one that was made before if there is one."""
    stays = q[~moves].tobytes()
    key = link, X_LT.tobytes(), moves.tobytes(), stays, tries, seed, tolerances
    kept = _searches.setdefault(tree, {})
    found = kept.get(key)
    if found is None:
        found = PoseSearch(
            tree, link, X_LT, moves, q, tries=tries, seed=seed, tolerances=tolerances
        )
        # One assignment: whoever reads in another thread sees the old ones or the new ones.
        _searches[tree] = {**dict(list(kept.items())[1 - _KEPT :]), key: found}
    return found
