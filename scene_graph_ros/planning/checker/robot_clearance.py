"""Distances of robots' bodies to all others, and how configurations change them."""

from __future__ import annotations

from collections.abc import Callable
import enum
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.planning.checker.checker_state import CheckerState
from scene_graph_ros.planning.errors import CollisionCheckerError, finite_number
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.near_pairs import (
    near_pairs,
    near_pairs_at,
    near_rows,
    NearPairs,
)

__all__ = [
    "ClearanceColumns",
    "RobotClearance",
    "RobotCollisionType",
    "clearance_columns",
    "collision_types",
    "poses_of_rows",
    "robot_clearance",
    "robot_clearances",
]


class RobotCollisionType(enum.Enum):
    """Whether a robot's body collides with its surroundings, with robots' bodies, or both."""

    NO_COLLISION = 0
    ENVIRONMENT_COLLISION = 1
    SELF_COLLISION = 2
    ENVIRONMENT_AND_SELF_COLLISION = 3

    def make_updated(
        self,
        *,
        in_environment_collision: bool | None = None,
        in_self_collision: bool | None = None,
    ) -> RobotCollisionType:
        """Return the type with one or both told anew; None leaves the present one."""
        around, own = bool(self.value & 1), bool(self.value & 2)
        if in_environment_collision is not None:
            around = in_environment_collision
        if in_self_collision is not None:
            own = in_self_collision
        return RobotCollisionType(int(around) + 2 * int(own))


@one_line("size", "num_positions")
class RobotClearance:
    """A table of padded distances: one row for each pair of geometries.

    Rows may be appended; columns are given as arrays that nobody writes to, but for
    ``mutable_jacobians``.
    """

    def __init__(self, num_positions: int) -> None:
        """Make an empty table for configurations of this length.

        Raises CollisionCheckerError where that is no whole number from 0 on.
        """
        if isinstance(num_positions, bool) or not isinstance(num_positions, (int, np.integer)):
            raise CollisionCheckerError(
                f"num_positions must be a whole number, not {quoted(num_positions)}"
            )
        if num_positions < 0:
            raise CollisionCheckerError(f"num_positions must not be negative: {num_positions}")
        self._names = _Names([], [], [])
        self._told: Callable[[], _Names] | None = None
        self._size = 0
        self._distances = np.empty(0)
        self._jacobians = np.empty((0, int(num_positions)))

    @property
    def size(self) -> int:
        """How many rows there are."""
        return self._size

    @property
    def num_positions(self) -> int:
        """How many columns the Jacobians have."""
        return self._jacobians.shape[1]

    @property
    def pairs(self) -> tuple[Any, ...]:
        """Geometry ids; the first in the scene's order. None for a row appended without."""
        return tuple(self._named().pairs)

    @property
    def robot_indices(self) -> tuple[int, ...]:
        """The index of each row's robot's body R."""
        return tuple(robot for robot, _ in self._named().bodies)

    @property
    def other_indices(self) -> tuple[int, ...]:
        """The index of the other body O, of a robot or around it."""
        return tuple(other for _, other in self._named().bodies)

    @property
    def collision_types(self) -> tuple[RobotCollisionType, ...]:
        """SELF_COLLISION where the other is of a robot, ENVIRONMENT_COLLISION where not."""
        return tuple(self._named().types)

    @property
    def distances(self) -> NDArray[np.float64]:
        """``(k,)`` metres; negative where a pair is nearer than its padding."""
        return _read_only(self._distances[: self.size])

    @property
    def jacobians(self) -> NDArray[np.float64]:
        """``(k, nq)``: derivative of the distance, m per unit of each position."""
        return _read_only(self._jacobians[: self.size])

    @property
    def mutable_jacobians(self) -> NDArray[np.float64]:
        """The same to be written to, until rows are appended."""
        return self._jacobians[: self.size]

    def reserve(self, size: int) -> None:
        """Make room for as many rows, so that appending them copies nothing."""
        more = int(size) - len(self._distances)
        if more > 0:
            self._distances = np.concatenate([self._distances, np.empty(more)])
            room = np.empty((more, self.num_positions))
            self._jacobians = np.concatenate([self._jacobians, room])

    def append(
        self,
        robot_index: int,
        other_index: int,
        collision_type: RobotCollisionType,
        distance: float,
        jacobian: ArrayLike,
        *,
        pair: tuple[Any, Any] | None = None,
    ) -> None:
        """Append a row; ``jacobian`` is ``(nq,)``, the distance in m.

        Raises CollisionCheckerError for another shape, values that are not numbers and unknown
        types.
        """
        row = real_array(jacobian, "jacobian must be numbers", CollisionCheckerError)
        if row.shape != (self.num_positions,):
            raise CollisionCheckerError(
                f"jacobian must have shape ({self.num_positions},), not {row.shape}"
            )
        if not isinstance(collision_type, RobotCollisionType):
            raise CollisionCheckerError(
                f"collision_type must be a RobotCollisionType, not {quoted(collision_type)}"
            )
        number, names = finite_number("distance", distance), self._named()
        if self.size == len(self._distances):
            self.reserve(max(8, 2 * self.size))
        self._distances[self.size] = number
        self._jacobians[self.size] = row
        names.bodies.append((int(robot_index), int(other_index)))
        names.pairs.append(pair)
        names.types.append(collision_type)
        self._size += 1

    def _named(self) -> _Names:
        """Return the names of the rows' bodies, made when they are first asked for."""
        told = self._told
        if told is not None:
            self._names = told()
            self._told = None
        return self._names

    @classmethod
    def _of(cls, near: NearPairs, told: Callable[[], _Names]) -> RobotClearance:
        """Return a table of rows that are right; ``told`` names their bodies."""
        result = cls.__new__(cls)
        result._distances, result._jacobians = near.distances, near.jacobians
        result._told, result._size = told, len(near.distances)
        return result


@one_line()
class ClearanceColumns(NamedTuple):
    """Padded distances of pairs of geometries at many configurations, as arrays."""

    configuration: NDArray[np.int64]
    """``(k,)``: which row of those asked about it is; not decreasing."""
    id_A: NDArray[np.int64]
    """``(k,)``: values of geometry ids, A the smaller one of the pair."""
    id_B: NDArray[np.int64]
    """``(k,)``."""
    collision_type: NDArray[np.uint8]
    """``(k,)``: values of `RobotCollisionType`, as in `RobotClearance.collision_types`."""
    distance: NDArray[np.float64]
    """``(k,)`` metres; negative where a pair is nearer than its padding."""
    jacobian: NDArray[np.float64]
    """``(k, nq)``: derivative of the distance, m per unit of each position."""


class _Names(NamedTuple):
    """The bodies of the rows of a table."""

    pairs: list[Any]
    bodies: list[tuple[int, int]]
    types: list[RobotCollisionType]


class _Near(NamedTuple):
    pairs: NDArray[np.intp]
    """Rows of the plan's pairs."""
    padded: NDArray[np.float64]


def robot_clearances(
    state: CheckerState, q: NDArray[np.float64], influence: float
) -> list[RobotClearance]:
    """Return the padded distances at each of q ``(n, nq)`` up to a distance, with derivatives."""
    return [_table(state, near) for near in near_pairs(state.plan, q, influence)]


def robot_clearance(
    state: CheckerState, q: NDArray[np.float64], influence: float
) -> RobotClearance:
    """Return the same at one configuration ``(1, nq)``."""
    return _table(state, near_pairs_at(state.plan, q, influence))


def clearance_columns(
    state: CheckerState, q: NDArray[np.float64], influence: float
) -> ClearanceColumns:
    """Return the same as arrays."""
    plan, robots = state.plan, state.bodies.num_robot_bodies
    near = near_rows(plan, q, influence)
    values = np.array([int(each) for each in plan.geometry_ids], dtype=np.int64)
    ids = np.sort(values[plan.pairs.bodies[near.rows]], axis=1)
    own, around = RobotCollisionType.SELF_COLLISION, RobotCollisionType.ENVIRONMENT_COLLISION
    is_own = state.body_of[near.rows, 1] < robots
    return ClearanceColumns(
        np.repeat(np.arange(len(q)), near.counts),
        ids[:, 0],
        ids[:, 1],
        np.where(is_own, own.value, around.value).astype(np.uint8),
        near.distances,
        near.jacobians,
    )


def _table(state: CheckerState, near: NearPairs) -> RobotClearance:
    return RobotClearance._of(near, partial(_names_of, state, near))


def _names_of(state: CheckerState, near: NearPairs) -> _Names:
    own, around = RobotCollisionType.SELF_COLLISION, RobotCollisionType.ENVIRONMENT_COLLISION
    bodies = [(robot, other) for robot, other in state.body_of[near.rows].tolist()]
    robots = state.bodies.num_robot_bodies
    types = [own if other < robots else around for _, other in bodies]
    return _Names(list(near.pairs), bodies, types)


def collision_types(state: CheckerState, q: NDArray[np.float64]) -> list[RobotCollisionType]:
    """Return the type of each body's collisions at q ``(nq,)``, by all pairs."""
    plan, robots = state.plan, state.bodies.num_robot_bodies
    found = _near(plan, poses_of_rows(plan, q), 0.0)
    collides = found.padded < -plan.pairs.touching[found.pairs]
    around, own = np.zeros((2, len(state.bodies)), dtype=np.bool_)
    for robot, other in state.body_of[found.pairs[collides]]:
        if other < robots:
            own[robot] = own[other] = True
        else:
            around[robot] = True
    return [RobotCollisionType(a + 2 * b) for a, b in zip(around, own, strict=True)]


def poses_of_rows(plan: CheckerPlan, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the poses ``(n, 4, 4)`` of all rows of the plan's table at q."""
    robots = len(plan.X_LG)
    X_WG = plan.shapes.X_WG.copy()
    X_WL = plan.tree.link_poses(q)
    X_WG[plan.bodies.rows[:robots]] = product(X_WL[plan.owners[:robots]], plan.X_LG)
    return X_WG


def _near(plan: CheckerPlan, X_WG: NDArray[np.float64], influence: float) -> _Near:
    """Return the distances of all pairs that may be nearer than a padded distance (m)."""
    paddings = plan.pairs.paddings
    rows = plan.bodies.rows[plan.pairs.bodies]
    rows[plan.pairs.swaps] = rows[plan.pairs.swaps, ::-1]
    near = np.flatnonzero(plan.least_distances(X_WG) <= influence + paddings)
    reach = max(influence + float(paddings.max(initial=-np.inf)), 0.0)
    rows_of_found, distances = plan.shapes.solve(X_WG, rows[near], reach)
    pair_of = {(int(a), int(b)): int(pair) for pair, (a, b) in zip(near, rows[near], strict=True)}
    found = np.array([pair_of[int(a), int(b)] for a, b in rows_of_found], dtype=np.intp)
    return _Near(found, distances - paddings[found])


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    view = array.view()
    view.setflags(write=False)
    return view
