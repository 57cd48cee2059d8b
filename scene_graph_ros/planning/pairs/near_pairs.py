"""The pairs of geometries that are near at configurations, by a plan alone."""

from __future__ import annotations

import threading
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.planning.pairs.bodies import BodyTable, Places
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.clearance_kernels import (
    near_distances,
    near_places,
    NearTable,
)
from scene_graph_ros.planning.pairs.separation_lanes import COVER, new_covers
from scene_graph_ros.robots.joint_chains import AXIS
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["NearPairs", "NearRows", "near_pairs", "near_pairs_at", "near_rows"]


class NearPairs(NamedTuple):
    """Pairs of geometries that are near at a configuration."""

    rows: NDArray[np.int64]
    """``(k,)``: of the plan's pairs."""
    distances: NDArray[np.float64]
    """``(k,)`` metres, less the padding."""
    jacobians: NDArray[np.float64]
    """``(k, nq)``: derivatives of the distances."""
    plan: CheckerPlan

    @property
    def pairs(self) -> tuple[GeometryPair, ...]:
        """With names."""
        return tuple(self.plan.ids(pair) for pair in self.rows.tolist())


class NearRows(NamedTuple):
    """Pairs of geometries that are near at many configurations, one after the other."""

    counts: NDArray[np.int64]
    """``(n,)``: how many rows each configuration has."""
    rows: NDArray[np.int64]
    """``(k,)``: of the plan's pairs."""
    distances: NDArray[np.float64]
    """``(k,)`` metres, less the padding."""
    jacobians: NDArray[np.float64]
    """``(k, nq)``: derivatives of the distances."""


_ROOM = 2048
"""Rows of a table, where all pairs need less: then it has several configurations' rows."""


class _Desk:
    """The arrays of one thread that looks for a plan's pairs."""

    def __init__(self, plan: CheckerPlan) -> None:
        tree, most = plan.tree, max(len(plan.pairs.bodies), _ROOM)
        places = plan.new_places()
        covers = _placed_covers(plan.bodies, places)
        swaps, bodies = plan.pairs.swaps[:, np.newaxis], plan.pairs.bodies
        ordered = np.where(swaps, bodies[:, ::-1], bodies).reshape(-1)
        joints = np.zeros(len(plan.bodies.rows), np.int64)
        joints[: len(plan.bodies.joints)] = plan.bodies.joints
        self.plan = plan
        self.table = NearTable(
            tree.table,
            tree.chains,
            np.empty(AXIS * len(tree.chains.joints)),
            plan.bodies,
            plan.pairs,
            tree.X_WB,
            places,
            covers,
            COVER * ordered,
            plan.bodies.rows[ordered],
            joints[ordered],
            plan.bodies.radii[plan.pairs.bodies].sum(axis=1) + plan.pairs.paddings,
            np.empty(len(plan.pairs.bodies) + LANES, np.int64),
            np.empty(LANES),
            np.empty(most, np.int64),
            np.empty(most),
            np.empty((most, tree.num_velocities)),
        )
        self.written, self.shapes = near_places(self.table), plan.held.places
        self.count = np.empty(1, np.int64)
        self.is_mapped = tree.num_velocities != tree.num_positions


_desks = threading.local()
"""Of each thread the one of the plan that it asked about last: they change seldom."""


def _desk(plan: CheckerPlan) -> _Desk:
    """Return this thread's desk for a plan."""
    desk: _Desk | None = getattr(_desks, "newest", None)
    if desk is None or desk.plan is not plan:
        desk = _desks.newest = _Desk(plan)
    return desk


def near_pairs_at(plan: CheckerPlan, q: NDArray[np.float64], influence: float) -> NearPairs:
    """Return the pairs that are near at one configuration ``(1, nq)``, up to so many metres."""
    desk = _desk(plan)
    near_distances(desk.shapes, desk.written, q, influence, desk.count)
    table, count = desk.table, desk.count.item()
    gradients = table.gradients[:count]
    jacobians = gradients.copy()
    if desk.is_mapped:
        jacobians = product(gradients, plan.tree.velocity_map(q[0]))
    jacobians[:, plan.other_positions] = 0.0
    return NearPairs(table.rows[:count].copy(), table.distances[:count].copy(), jacobians, plan)


def near_rows(plan: CheckerPlan, q: NDArray[np.float64], influence: float) -> NearRows:
    """Return the rows of a plan's pairs within a distance at each of q ``(n, nq)``.

    ``influence`` is in metres.
    """
    desk = _desk(plan)
    table, tree = desk.table, plan.tree
    counts, done = np.empty(len(q), np.int64), 0
    parts: list[tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]] = []
    while done < len(q):
        taken = near_distances(desk.shapes, desk.written, q[done:], influence, counts[done:])
        count = int(counts[done] if taken == 1 else counts[done : done + taken].sum())
        gradients = table.gradients[:count]
        if desk.is_mapped:
            ends = np.cumsum(counts[done : done + taken])[:-1]
            shares = zip(np.split(gradients, ends), q[done : done + taken], strict=True)
            mapped = [product(part, tree.velocity_map(at)) for part, at in shares]
            gradients = np.concatenate(mapped)
        else:
            gradients = gradients.copy()
        gradients[:, plan.other_positions] = 0.0
        parts.append((table.rows[:count].copy(), table.distances[:count].copy(), gradients))
        done += taken
    if len(parts) == 1:
        return NearRows(counts, *parts[0])
    if not parts:
        return NearRows(counts, np.empty(0, np.int64), np.empty(0), np.empty((0, q.shape[1])))
    rows, distances, jacobians = (np.concatenate(part) for part in zip(*parts, strict=True))
    return NearRows(counts, rows, distances, jacobians)


def near_pairs(plan: CheckerPlan, q: NDArray[np.float64], influence: float) -> list[NearPairs]:
    """Return the same as ``near_rows``, for each configuration by itself."""
    near = near_rows(plan, q, influence)
    ends = np.cumsum(near.counts).tolist()
    return [
        NearPairs(
            near.rows[first:last], near.distances[first:last], near.jacobians[first:last], plan
        )
        for first, last in zip([0, *ends], ends, strict=False)
    ]


def _placed_covers(bodies: BodyTable, places: Places) -> NDArray[np.float64]:
    """Write the poses of bodies that do not move; return the state of all for now."""
    X, still = bodies.X_WG, slice(len(bodies.joints), None)
    places.X_WG[still] = X.reshape(-1, 12, 1)
    centers = np.einsum("nij,nj->ni", X[:, :, :3], bodies.centers[still]) + X[:, :, 3]
    places.centers[still] = centers[:, :, np.newaxis]
    covers = new_covers(bodies.lower, bodies.upper, bodies.radii)
    rows = covers.reshape(-1, COVER)[still]
    rows[:, :9] = X[:, :, :3].transpose(0, 2, 1).reshape(-1, 9)
    rows[:, 12:15], rows[:, 16:19] = centers, X[:, :, 3]
    return covers
