"""Proofs that a step and the braking after it keep pairs apart: the pairs near by, and kernels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.edges.edge_kernels import prove_edges
from scene_graph_ros.planning.edges.edge_proofs import edge_scratch, EdgeProofs
from scene_graph_ros.planning.edges.edge_stretches import EdgeRules, FREE
from scene_graph_ros.planning.pairs.bodies import CheckedTables, PairTable
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.clearance_kernels import near_distances
from scene_graph_ros.planning.pairs.near_pairs import NearDesk, NearPairs
from scene_graph_ros.planning.pairs.static_tree import no_nodes
from scene_graph_ros.planning.velocities.moving_kernels import (
    closing_rates,
    MOST_WAITING,
    MovingBodies,
    Profile,
    prove_moving,
)
from scene_graph_ros.planning.velocities.moving_obstacles import MovingObstacles
from scene_graph_ros.planning.velocities.reach_kernels import pair_reaches, set_influences

__all__ = ["UNKNOWN", "MotionProofs", "NearBy"]

UNKNOWN = -2
"""Instead of a pair: something else than a pair that can be named."""

_TOLERANCE = 5e-7
"""Metres beyond its padding that a pair must have where it is looked at."""

_MOST_LOOKS = 512
"""Configurations that are looked at for one motion; one that needs more is not proven."""


class NearBy(NamedTuple):
    """Pairs that are near enough to matter, as rows of the plan's pairs, and their tables."""

    rows: NDArray[np.int64]
    still: NDArray[np.intp]
    """Which of them do not move but by the robot."""
    moving: NDArray[np.intp]
    checked: CheckedTables
    """Of all."""
    obstacles: MovingBodies | None


class MotionProofs:
    """Proves motions of one plan; of one thread."""

    def __init__(self, plan: CheckerPlan) -> None:
        """Make the scratch."""
        self._plan = plan
        self._checked = plan.checked._replace(bodies=plan.bodies._replace(nodes=no_nodes()))
        self._scratch = edge_scratch(plan)
        self._waiting = np.empty((MOST_WAITING + 1, 2))
        self._joints = np.zeros((len(plan.tree.table.kinds), 3))
        self._proof = EdgeProofs(np.empty(1, np.int64), np.empty((1, 4)), np.empty(1, np.int64))
        self._stop = np.array([0, _MOST_LOOKS], dtype=np.int64)
        pairs = plan.pairs
        self._none = _chosen(pairs, np.empty(0, dtype=np.int64))
        self._influences = np.empty(len(pairs.bodies))
        self._both_joints = np.zeros((2, *self._joints.shape))
        # What the desk reads of paddings is written anew at each tick.
        self._paddings, self._most = pairs.paddings.copy(), pairs.most_paddings.copy()
        wide = pairs._replace(paddings=self._paddings, most_paddings=self._most)
        self._desk = NearDesk(plan._replace(pairs=wide))
        self._radii = plan.bodies.radii[pairs.bodies].sum(axis=1)
        self._still = np.zeros(len(plan.bodies.rows))

    def near_pairs(
        self,
        edge: NDArray[np.float64],
        changes: NDArray[np.float64],
        rules: tuple[float, float, float],
        obstacles: MovingObstacles | None,
    ) -> NearPairs:
        """Return the pairs that a motion may bring too near, with their distances at its start.

        It goes along an edge ``(2, nq)`` or beside it; see ``set_influences`` for ``changes``
        ``(4, nq)`` and the rules.
        """
        plan, desk = self._plan, self._desk
        fastest = self._still
        if obstacles is not None:
            fastest = np.zeros(len(fastest))
            moving = obstacles.table
            fastest[moving.bodies] = moving.fastest + moving.bounds
        influences = self._influences
        set_influences(
            self._checked,
            self._none,
            edge,
            changes,
            rules,
            fastest,
            self._both_joints,
            influences,
            self._scratch,
        )
        np.add(plan.pairs.paddings, influences, out=self._paddings)
        np.add(self._radii, self._paddings, out=desk.table.reaches)
        self._most[:] = plan.pairs.most_paddings + influences.max(initial=0.0)
        near_distances(desk.shapes, desk.written, edge[:1], 0.0, desk.count)
        table, count = desk.table, desk.count.item()
        rows = table.rows[:count].copy()
        jacobians = table.gradients[:count].copy()
        jacobians[:, plan.other_positions] = 0.0
        return NearPairs(rows, table.distances[:count] + influences[rows], jacobians, plan)

    def near_by(self, rows: NDArray[np.int64], obstacles: MovingObstacles | None) -> NearBy:
        """Return the tables of pairs ``(k,)``."""
        pairs = _chosen(self._plan.pairs, rows)
        checked = self._checked._replace(pairs=pairs)
        none = np.empty(0, dtype=np.intp)
        if obstacles is None or not len(obstacles.table.bodies):
            return NearBy(rows, np.arange(len(rows)), none, checked, None)
        which = obstacles.row_of_body[pairs.bodies[:, 1]]
        moving, still = np.flatnonzero(which >= 0), np.flatnonzero(which < 0)
        table = obstacles.table._replace(which=which[moving])
        return NearBy(rows, still, moving, checked, table if len(moving) else None)

    def reaches(
        self, near: NearBy, q: NDArray[np.float64], way: NDArray[np.float64],
        changes: NDArray[np.float64],
    ) -> NDArray[np.float64]:  # fmt: skip
        """Return the ways by which pairs come nearer at most, ``(k,)`` m.

        Positions are on an edge that leads from q by ``way`` ``(nq,)``, and change by up to
        ``changes`` ``(nq,)``.
        """
        ways = np.empty(len(near.rows))
        if not len(ways):
            return ways
        more = np.abs(way) + changes
        pair_reaches(near.checked, q - more, q + more, changes, self._joints, ways)
        return ways

    def closing_rates(self, near: NearBy, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rates at which obstacles change all pairs' distances, ``(k,)`` m/s."""
        rates = np.zeros(len(near.rows))
        if near.obstacles is not None:
            of_moving = np.empty(len(near.moving))
            checked = self._some(near, near.moving, near.checked.pairs.paddings[near.moving])
            closing_rates(checked, near.obstacles, q, self._scratch, of_moving)
            rates[near.moving] = of_moving
        return rates

    def first_open(
        self,
        near: NearBy,
        q: NDArray[np.float64],
        way: NDArray[np.float64],
        keeps: NDArray[np.float64],
        profile: Profile | None,
    ) -> int:
        """Return a pair near by that is not proven to keep its distance, NO_PAIR for none.

        UNKNOWN where the proof took too long.

        The robot goes from q ``(nq,)`` straight on by ``way`` ``(nq,)``; ``keeps`` ``(k,)`` (m)
        are beyond the pairs' paddings. Without a profile obstacles stand still.
        """
        edge = np.stack([q, q + way])
        # Only what moves can come nearer.
        still = np.arange(len(near.rows)) if profile is None else near.still
        if len(still) and way.any():
            paddings = near.checked.pairs.paddings[still] + keeps[still]
            checked = self._some(near, still, paddings)
            rules = EdgeRules(measures=False, part=1.0, tolerance=_TOLERANCE)
            edges, proof = edge[np.newaxis], self._proof
            prove_edges(checked, edges, rules, self._stop, proof, self._scratch)
            if proof.statuses[0] != FREE:
                found = int(proof.pairs[0])
                return int(still[found]) if found != NO_PAIR else UNKNOWN
        if profile is not None and near.obstacles is not None:
            moving = near.moving
            paddings = near.checked.pairs.paddings[moving] + keeps[moving]
            checked = self._some(near, moving, paddings)
            found = prove_moving(
                checked, near.obstacles, edge, profile, _TOLERANCE, self._scratch, self._waiting
            )
            if found != NO_PAIR:
                return int(moving[found])
        return NO_PAIR

    def _some(
        self, near: NearBy, chosen: NDArray[np.intp], paddings: NDArray[np.float64]
    ) -> CheckedTables:
        pairs = near.checked.pairs
        if len(chosen) < len(near.rows):
            pairs = _chosen(pairs, chosen)
        return near.checked._replace(pairs=pairs._replace(paddings=paddings))


def _chosen(pairs: PairTable, rows: NDArray[np.int64]) -> PairTable:
    """Return some pairs, without the columns of the tree."""
    return pairs._replace(
        bodies=pairs.bodies[rows],
        swaps=pairs.swaps[rows],
        paddings=pairs.paddings[rows],
        touching=pairs.touching[rows],
        shared=pairs.shared[rows],
    )
