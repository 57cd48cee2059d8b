"""The inputs of a collision checker's kernels: bodies, pairs and bounds of bodies."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.paths import GeometryPair
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.geometry.tables.held_table import HeldTable
from scene_graph_ros.geometry.tolerances import OSCULATION
from scene_graph_ros.planning.pairs.bodies import (
    BodyTable,
    CheckedTables,
    new_places,
    PairTable,
    Places,
)
from scene_graph_ros.planning.pairs.checked_shapes import checked_shapes, CheckedShapes
from scene_graph_ros.planning.pairs.inner_covers import inner_covers
from scene_graph_ros.planning.pairs.static_tree import no_nodes, static_nodes
from scene_graph_ros.robots.kinematic_tree import KinematicTree

__all__ = ["AllPairs", "CheckerPlan", "carrier", "make_plan", "placed"]

_OUTWARDS = 1.0 + 1e-14
"""Times the radii of balls around hulls: more than rounding takes off them."""


class AllPairs(NamedTuple):
    """All pairs of geometries that could be checked, in the order of the scene's own queries."""

    table: PairTable
    """Without paddings."""
    frames: NDArray[np.int64]
    """``(p, 2)``: the frames of A and B, as rows of the scene's arrays of frames."""
    allowed: NDArray[np.bool_]
    """``(p,)``: whether the scene's filters leave the pair."""


class CheckerPlan(NamedTuple):
    """The arrays of one scene. Body b of the tables is geometry ``geometry_ids[b]``."""

    tree: KinematicTree
    shapes: CheckedShapes
    bodies: BodyTable
    all_pairs: AllPairs
    pairs: PairTable
    """Those that are checked."""
    reaches: NDArray[np.float64]
    """``(r,)``: the largest distance of a robot body's points from its joint's origin, metres."""
    X_LG: NDArray[np.float64]
    """``(r, 4, 4)``: robots' bodies in their links."""
    geometry_ids: tuple[GeometryId, ...]
    geometry_names: tuple[str, ...]
    """``source/frame/geometry``."""
    owners: NDArray[np.int64]
    """``(b,)``: the link (row of the tree), or -1 for what is around the robots."""
    carried: tuple[tuple[Any, ...], ...]
    """``(r,)``: the frames between each robot body's link and the body, from the link on."""
    other_positions: NDArray[np.int64] = np.empty(0, dtype=np.int64)
    """``(k,)``: positions of robots that the checker is not for; derivatives by these are zero."""

    @property
    def held(self) -> HeldTable:
        """The shapes' table, for one thread at a time."""
        return self.shapes.own_held

    @property
    def checked(self) -> CheckedTables:
        """The kernels' inputs."""
        tree, held = self.tree, self.held.places
        return CheckedTables(held, tree.table, self.bodies, self.pairs, self.reaches, tree.X_WB)

    def ids(self, pair: int) -> GeometryPair:
        """Return the geometries of a pair, in the order of the scene's own queries."""
        a, b = self.pairs.bodies[pair]
        if self.pairs.swaps[pair]:
            a, b = b, a
        ids, names = self.geometry_ids, self.geometry_names
        return GeometryPair(ids[a], ids[b], names[a], names[b])

    def pair_of(self, id_A: int, id_B: int) -> int | None:
        """Return the row of the checked pair of two geometries, by their ids' values."""
        known = {int(each): body for body, each in enumerate(self.geometry_ids)}
        both = np.array([known.get(id_A, -1), known.get(id_B, -1)])
        found = np.flatnonzero((np.sort(self.pairs.bodies, axis=1) == np.sort(both)).all(axis=1))
        return int(found[0]) if len(found) else None

    def with_pairs(self, checked: NDArray[np.bool_], paddings: NDArray[np.float64]) -> CheckerPlan:
        """Return the plan with a mask of all pairs, and their paddings, both ``(p,)``."""
        return self._with(self.all_pairs.table, np.flatnonzero(checked), paddings[checked])

    def with_rows(self, rows: NDArray[np.int64]) -> CheckerPlan:
        """Return the plan with some of the pairs that it checks, ``(k,)``."""
        return self._with(self.pairs, rows, self.pairs.paddings[rows])

    def with_paddings(self, paddings: NDArray[np.float64]) -> CheckerPlan:
        """Return the plan with other paddings ``(p,)`` of the pairs that it checks."""
        return self._with(self.pairs, np.arange(len(paddings)), paddings)

    def _with(
        self, pairs: PairTable, rows: NDArray[np.int64], paddings: NDArray[np.float64]
    ) -> CheckerPlan:
        chosen = _pair_table(
            pairs.bodies[rows],
            pairs.swaps[rows],
            paddings,
            pairs.touching[rows],
            pairs.shared[rows],
            self.bodies.radii,
            len(self.carried),
        )
        return self._replace(pairs=chosen)

    def new_places(self) -> Places:
        """Return scratch for one thread."""
        return new_places(
            len(self.tree.table.kinds),
            len(self.carried),
            len(self.bodies.rows),
            len(self.pairs.bodies),
        )

    def least_distances(self, X_WG: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances of the balls of each pair, -inf for half spaces; poses by row."""
        X = X_WG[self.bodies.rows]
        centers = np.einsum("nij,nj->ni", X[:, :3, :3], self.bodies.centers) + X[:, :3, 3]
        a, b = self.pairs.bodies.T
        result: NDArray[np.float64] = np.linalg.norm(centers[a] - centers[b], axis=1)
        return result - self.bodies.radii[a] - self.bodies.radii[b]


def make_plan(snapshot: Snapshot, tree: KinematicTree, links: Mapping[int, int]) -> CheckerPlan:
    """Return the plan of a scene; ``links`` gives the tree's link of frames, by their ids' values.

    Frames below one of these are carried by its link. Pairs are all with a robot in them, without
    padding, until some are chosen.
    """
    shapes, inspector = checked_shapes(snapshot), snapshot.inspector
    carriers = [
        carrier(inspector, inspector.get_frame_id(each), links) for each in shapes.geometry_ids
    ]
    link_of = np.array([link for link, _ in carriers], dtype=np.int64)
    robots, others = np.flatnonzero(link_of >= 0), np.flatnonzero(link_of < 0)
    chosen = np.concatenate([robots, others])
    rows, ids = shapes.rows[chosen], [shapes.geometry_ids[k] for k in chosen.tolist()]
    owners = link_of[chosen]
    places = np.array([tree.joint_of_link[link] for link in owners[: len(robots)]], np.int64)
    centers, radii, lower, upper = _bounds(shapes, rows)
    bodies = BodyTable(
        rows,
        places,
        np.empty((len(robots), 3, 4)),
        np.empty((len(others), 3, 4)),
        centers,
        radii,
        lower,
        upper,
        inner_covers(shapes.table, rows, centers),
        shapes.measure,
        no_nodes(),
    )
    pairs = _all_pairs(snapshot, shapes, rows, tree, places, radii)
    plan = CheckerPlan(
        tree,
        shapes,
        bodies,
        pairs,
        pairs.table,
        np.empty(len(robots)),
        np.empty((len(robots), 4, 4)),
        tuple(ids),
        tuple(inspector.get_path(each) for each in ids),
        owners,
        tuple(carriers[k][1] for k in robots.tolist()),
    )
    return placed(plan, snapshot, shapes)


def placed(
    plan: CheckerPlan, snapshot: Snapshot, shapes: CheckedShapes | None = None
) -> CheckerPlan:
    """Return the plan with all that no joint moves where another moment of its model has it.

    Clouds have the points of that moment; ``shapes`` are those, where they are known.
    """
    if shapes is None:
        shapes = checked_shapes(snapshot)
        if shapes.has_elements:
            plan = _with_shapes(plan, shapes)
    count = len(plan.carried)
    rows, tree, bodies = plan.bodies.rows, plan.tree, plan.bodies
    X_LG = shapes.X_FG[rows[:count]]
    for body, frames in enumerate(plan.carried):
        X_LF = np.eye(4)
        for frame in frames:
            X_LF = product(X_LF, snapshot.pose_in_parent(frame))
        if frames:
            X_LG[body] = product(X_LF, X_LG[body])
    X_JG = product(tree.X_JL[plan.owners[:count]], X_LG)
    out = np.einsum("nij,nj->ni", X_JG[:, :3, :3], bodies.centers[:count]) + X_JG[:, :3, 3]
    X_WG = np.ascontiguousarray(shapes.X_WG[rows[count:]][:, :3]).reshape(-1, 3, 4)
    at = np.einsum("nij,nj->ni", X_WG[:, :, :3], bodies.centers[count:]) + X_WG[:, :, 3]
    small = np.flatnonzero(bodies.radii[count:] < np.inf)
    nodes = static_nodes(count + small, at[small], bodies.radii[count:][small])
    return plan._replace(
        shapes=shapes,
        bodies=bodies._replace(
            X_JG=np.ascontiguousarray(X_JG[:, :3]).reshape(-1, 3, 4), X_WG=X_WG, nodes=nodes
        ),
        reaches=np.linalg.norm(out, axis=1) + bodies.radii[:count],
        X_LG=X_LG,
    )


def _with_shapes(plan: CheckerPlan, shapes: CheckedShapes) -> CheckerPlan:
    """Return the plan with clouds and fields that are others now."""
    bodies, table = plan.bodies, shapes.table
    centers, radii, lower, upper = _bounds(shapes, bodies.rows)
    bodies = bodies._replace(centers=centers, radii=radii, lower=lower, upper=upper)
    scales = OSCULATION * table.scale[bodies.rows]

    def with_touching(pairs: PairTable) -> PairTable:
        return pairs._replace(touching=scales[pairs.bodies].max(axis=1, initial=0.0))

    every = plan.all_pairs._replace(table=with_touching(plan.all_pairs.table))
    pairs = with_touching(plan.pairs)
    return plan._replace(shapes=shapes, bodies=bodies, all_pairs=every, pairs=pairs)


def carrier(inspector: Any, frame: Any, links: Mapping[int, int]) -> tuple[int, tuple[Any, ...]]:
    """Return the link (row of the tree, -1: none) that carries a frame, and the pose in between.

    That is the frames from the link's own, excluded, down to this one.
    """
    between: list[Any] = []
    world = inspector.world_frame_id()
    while frame != world:
        link = links.get(int(frame))
        if link is not None:
            return link, tuple(reversed(between))
        between.append(frame)
        frame = inspector.get_parent_frame(frame)
    return -1, ()


_RADII: dict[ShapeKind, Callable[[NDArray[np.float64]], float] | None] = every_kind(
    "balls around shapes, by half of their boxes",
    {
        ShapeKind.SPHERE: lambda half: half.max(),
        ShapeKind.CAPSULE: lambda half: half.max(),
        ShapeKind.BOX: length,
        ShapeKind.CYLINDER: lambda half: float(np.hypot(half[0], half[2])),
        ShapeKind.ELLIPSOID: lambda half: half.max(),
        ShapeKind.HALF_SPACE: lambda half: np.inf,
        # By their vertices.
        ShapeKind.CONVEX: None,
        ShapeKind.MESH: None,
    },
)


def _bounds(shapes: CheckedShapes, rows: NDArray[np.int64]) -> tuple[NDArray[np.float64], ...]:
    """Return centres and radii of balls, and corners of boxes, around each row's shape in G.

    They contain the shapes, without a tolerance: the largest distance that is computed of a
    hull's vertices is less than the true one by 4 units in the last place at most (Higham,
    *Accuracy and Stability of Numerical Algorithms*, 2002, section 3.1), `_OUTWARDS` adds 45.
    """
    table = shapes.table
    at_rest = np.tile(np.eye(4), (len(table.kind), 1, 1))
    lower, upper = (corner[rows] for corner in world_boxes(table, at_rest))
    are_clouds = rows >= shapes.first_element
    lower[are_clouds], upper[are_clouds] = (
        table.lower[rows[are_clouds]],
        table.upper[rows[are_clouds]],
    )
    centers, radii = np.zeros((len(rows), 3)), np.empty(len(rows))
    for b, row in enumerate(rows):
        kind = ShapeKind(table.kind[row])
        if kind == ShapeKind.HALF_SPACE:
            radii[b], lower[b], upper[b] = np.inf, -np.inf, (np.inf, np.inf, 0.0)
            continue
        centers[b] = 0.5 * (lower[b] + upper[b])
        half = 0.5 * (upper[b] - lower[b])
        of_kind = length if are_clouds[b] else _RADII[kind]
        if of_kind is not None:
            radii[b] = of_kind(half)
            continue
        hull, hulls = table.hull[row], table.hulls
        vertices = hulls.vertices[hulls.vertex_start[hull] : hulls.vertex_start[hull + 1]]
        radii[b] = np.linalg.norm(vertices - centers[b], axis=1).max()
    return centers, radii * _OUTWARDS, lower, upper


def _all_pairs(
    snapshot: Snapshot,
    shapes: CheckedShapes,
    rows: NDArray[np.int64],
    tree: KinematicTree,
    joints: NDArray[np.int64],
    radii: NDArray[np.float64],
) -> AllPairs:
    """Return all pairs of geometries on different frames with a robot in them."""
    robots, count = len(joints), len(rows)
    allowed = np.zeros((count, count), dtype=np.bool_)
    body_of_row = np.zeros(len(shapes.table.kind), np.int64)
    body_of_row[rows] = np.arange(count)
    near = body_of_row[shapes.possible_pairs(snapshot)]
    allowed[near[:, 0], near[:, 1]] = allowed[near[:, 1], near[:, 0]] = True
    a, b = np.nonzero(np.arange(count) > np.arange(robots)[:, np.newaxis])
    is_pair = shapes.frame[rows[a]] != shapes.frame[rows[b]]
    first, second = np.sort(shapes.ranks()[rows][np.stack([a, b])[:, is_pair]], axis=0)
    # In the order in which the scene's own queries look at them, whose first row is the smaller.
    order = np.lexsort((second, first))
    first, second = shapes.rows[first[order]], shapes.rows[second[order]]
    bodies = body_of_row[np.stack([first, second], axis=1)]
    # A is of a robot; of two robots' bodies it is the one whose row comes first.
    swaps = bodies[:, 0] >= robots
    bodies[swaps] = bodies[swaps, ::-1]
    moving = np.concatenate([joints, np.zeros(count - robots, np.int64)])[bodies]
    kinds, which = np.unique(moving, axis=0, return_inverse=True)
    shared = np.array([_last_shared(tree.table.parents, *kind) for kind in kinds], dtype=np.int64)
    scales = shapes.table.scale
    pairs = _pair_table(
        np.ascontiguousarray(bodies, dtype=np.int64),
        np.ascontiguousarray(swaps),
        np.zeros(len(bodies)),
        OSCULATION * np.maximum(scales[first], scales[second]),
        shared[which.reshape(-1)],
        radii,
        robots,
    )
    return AllPairs(
        pairs,
        np.ascontiguousarray(shapes.frame[rows[bodies]]),
        allowed[bodies[:, 0], bodies[:, 1]],
    )


def _pair_table(
    bodies: NDArray[np.int64],
    swaps: NDArray[np.bool_],
    paddings: NDArray[np.float64],
    touching: NDArray[np.float64],
    shared: NDArray[np.int64],
    radii: NDArray[np.float64],
    robots: int,
) -> PairTable:
    """Return the table, with bounds for the tree: ``radii`` are of all bodies."""
    a, b = bodies.T
    is_in_tree = (b >= robots) & (radii[b] < np.inf)
    of_still = np.full((robots, len(radii)), -1)
    most = np.full(robots, -np.inf)
    found = np.flatnonzero(is_in_tree)
    of_still[a[found], b[found]] = found
    np.maximum.at(most, a[found], paddings[found])
    others = np.flatnonzero(~is_in_tree)
    return PairTable(bodies, swaps, paddings, touching, shared, others, of_still, most)


def _last_shared(parents: NDArray[np.int64], a: int, b: int) -> int:
    """Return the last joint on the way from the base to both of two joints."""
    before = set()
    while a > 0:
        before.add(int(a))
        a = parents[a]
    while b > 0 and int(b) not in before:
        b = parents[b]
    return max(int(b), 0)
