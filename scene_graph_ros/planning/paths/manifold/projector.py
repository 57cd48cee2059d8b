"""Projections of configurations to where conditions on links are held with room to spare."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.constraints.constraint_table import BOX, ConstraintTable
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.projection_kernels import project
from scene_graph_ros.robots.tree_kernels import FLOATING, PLANAR, PRISMATIC

__all__ = ["Projector"]

Array = NDArray[np.float64]

_ROOM = 0.5
"""Of the way from the middle of a range to its bounds: what is kept from these."""

_MOST_ROOM = 0.05
"""rad or m: enough for long edges."""


class Projector:
    """Moves configurations to where all conditions hold, with room for straight edges."""

    def __init__(self, held: HeldConstraints, moves: NDArray[np.bool_]) -> None:
        """Take conditions, and a mask ``(nq,)`` of the positions that may move."""
        assert held.table is not None
        tree, table = held.tree, held.table
        self._table, nq = table, tree.num_positions
        self._inner = _inner_bounds(table)
        lower, upper, angles = tree.lower.copy(), tree.upper.copy(), np.ones(nq, np.int64)
        starts, kinds = tree.table.starts[1:], tree.table.kinds[1:]
        angles[starts[kinds == PRISMATIC]] = 0
        for start in starts[kinds == PLANAR]:
            angles[start : start + 2] = 0
        floating = starts[kinds == FLOATING]
        for start in floating:
            lower[start : start + 4], upper[start : start + 4] = -np.inf, np.inf
            angles[start + 4 : start + 7] = 0
        self._space = (moves.astype(np.int64), angles, lower, upper)
        self._quaternions = np.array([s for s in floating if moves[s]], dtype=np.int64)
        rows, elements = 3 * len(table.kinds), len(table.elements)
        self._work = (
            np.empty((rows, nq)),
            np.empty(rows),
            np.empty((elements, 3, 3)),
            np.empty((elements, 3)),
            np.empty((rows, rows)),
            np.empty(rows),
            np.empty(nq),
        )

    def projected(self, q: Array) -> Array | None:
        """Return a configuration ``(nq,)`` near by, or None where none was found."""
        result = q.copy()
        arguments = self._inner, self._space, self._quaternions, result, self._work
        return result if project(self._table, *arguments) else None


def _inner_bounds(table: ConstraintTable) -> tuple[Array, Array, Array]:
    """Return bounds ``(c, 3)`` inside of those of all conditions, and how far they are apart."""
    lower, upper = table.lower.copy(), table.upper.copy()
    is_turn = table.kinds != BOX
    # An angle is not below zero, nor above pi: nothing has to be kept from these.
    lower[is_turn & (lower[:, 0] <= 0.0), 0] = -np.inf
    upper[is_turn & (upper[:, 0] >= np.pi), 0] = np.inf
    most = np.where(is_turn[:, np.newaxis], np.minimum(table.upper, np.pi), table.upper)
    both = np.isfinite(lower) & np.isfinite(upper)
    room = np.minimum(_ROOM * (most - table.lower) * np.where(both, 0.5, 1.0), _MOST_ROOM)
    least = room.min(axis=1)
    return lower + room, upper - room, least
