"""Pairs with clouds in them, solved as pairs of the balls that decide them.

Which ball is nearest is found first. Then the pair is asked about as any other, with a sphere in
the cloud's place and frame, so that all that is answered of spheres is answered of clouds as well,
and as exactly.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import BOUNDS, Engine
from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.distance.driver import FIRST_PENETRATION, solve_pairs
from scene_graph_ros.geometry.query.distance.solved_pairs import BOTH
from scene_graph_ros.geometry.query.distance.witness_derivatives import witness_derivatives
from scene_graph_ros.geometry.query.elements.between_clouds import find_nearest_balls
from scene_graph_ros.geometry.query.elements.nearest import find_nearest
from scene_graph_ros.geometry.query.elements.scene import Clouds
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["FoundPairs", "columns_of", "find_pairs"]

FloatArray = NDArray[np.float64]


class FoundPairs(NamedTuple):
    """Pairs of a cloud with another geometry, and the elements that decide them."""

    clouds: NDArray[np.int64]
    """(m,) which cloud."""
    places: NDArray[np.int64]
    """(m,) where its ball is in the tree's order."""
    others: NDArray[np.int64]
    """(m,) rows of the proximity arrays, or which cloud, as ``other_places`` tells."""
    other_places: NDArray[np.int64]
    """(m,) where the other cloud's ball is; -1 where the other is no cloud."""

    def some(self, chosen: Any) -> FoundPairs:
        """Return some of them."""
        return FoundPairs(*(column[chosen] for column in self))


def find_pairs(
    snapshot: Snapshot, clouds: Clouds, max_distance: float, keep: int, settings: Settings
) -> FoundPairs:
    """Return the pairs that may be kept, see ``solve_pairs``: at most ``max_distance`` apart.

    Raises EngineError for the engine that knows no clouds.
    """
    if settings.engine is not Engine.NATIVE:
        raise EngineError(
            f"engine {settings.engine.value!r} has no point clouds: ask with engine='native'"
        )
    margin = max(max_distance, 0.0)
    found: list[tuple[int, int, int, int]] = []
    pairs, places = clouds.near_pairs(snapshot, margin), clouds.table.held.places
    for cloud in np.unique(pairs[:, 0]).tolist():
        rows = np.ascontiguousarray(pairs[pairs[:, 0] == cloud, 1])
        nearest = np.empty((len(rows), 2))
        X_WC = np.ascontiguousarray(clouds.X_WC[cloud : cloud + 1])
        find_nearest(places, cloud, snapshot.X_WG, X_WC, rows, max_distance, nearest)
        is_found = nearest[:, 1] >= 0
        at = nearest[is_found, 1].astype(np.int64).tolist()
        found += [(cloud, p, r, -1) for p, r in zip(at, rows[is_found].tolist(), strict=True)]
        if keep == FIRST_PENETRATION and (nearest[is_found, 0] < 0.0).any():
            break
    for first, second in clouds.near_clouds(snapshot, margin).tolist():
        both = np.array([max_distance, 0.0, 0.0])
        find_nearest_balls(places, first, second, clouds.X_WC, both)
        if both[1] >= 0:
            found.append((first, int(both[1]), second, int(both[2])))
    columns = np.array(found, np.int64).reshape(-1, 4).T
    return FoundPairs(*(np.ascontiguousarray(column) for column in columns))


class _Balls(NamedTuple):
    """Balls of clouds, one for each of m pairs."""

    p_CP: FloatArray
    """(m, 3) the centres, in their clouds' frames."""
    radii: FloatArray
    indices: NDArray[np.int64]
    """(m,) which point each was as they were given."""


def _balls(clouds: Clouds, which: NDArray[np.int64], places: NDArray[np.int64]) -> _Balls:
    p_CP, radii = np.empty((len(which), 3)), np.empty(len(which))
    indices = np.empty(len(which), np.int64)
    for m, (cloud, place) in enumerate(zip(which.tolist(), places.tolist(), strict=True)):
        tree = clouds.table.clouds[cloud].tree
        leaf, i = divmod(place, tree.points.shape[2])
        p_CP[m], indices[m] = tree.points[leaf, :, i], tree.order[place]
        radii[m] = tree.radii[leaf, i] if len(tree.radii) else tree.radius[1]
    return _Balls(p_CP, radii, indices)


def columns_of(
    snapshot: Snapshot,
    clouds: Clouds,
    found: FoundPairs,
    max_distance: float,
    keep: int,
    settings: Settings,
) -> dict[str, NDArray[Any]]:
    """Return all columns that records of pairs may have, of those pairs that are kept."""
    m = len(found.clouds)
    is_cloud = found.other_places >= 0
    own = _balls(clouds, found.clouds, found.places)
    others = _balls(clouds, found.others[is_cloud], found.other_places[is_cloud])
    table, X_CG = _as_spheres(snapshot, clouds, found, own, others)
    ids = np.empty((2, m), np.int64)
    ids[0], ids[1, is_cloud] = clouds.ids[found.clouds], clouds.ids[found.others[is_cloud]]
    ids[1, ~is_cloud] = snapshot.proximity.ids[found.others[~is_cloud]]
    rows = np.stack([np.arange(m), np.arange(m, 2 * m)], axis=1)
    turned = ids[0] > ids[1]
    rows[turned] = rows[turned, ::-1]
    # Every pair is asked about; the first that penetrates is enough for whoever wants one.
    solved = solve_pairs(
        hold(table), X_CG, rows, max_distance, keep, BOUNDS[settings.accuracy],
        settings.certificate, BOTH,
    )  # fmt: skip
    kept = np.minimum(solved.rows_A, solved.rows_B)
    turned = turned[kept]
    elements = np.full((2, m), -1)
    elements[0], elements[1, is_cloud] = own.indices, others.indices
    offsets = np.zeros((2, m, 3))
    offsets[0], offsets[1, is_cloud] = own.p_CP, others.p_CP
    X_WC = clouds.X_WC[found.clouds[kept]]
    R_WC, p_WC = X_WC[:, :3, :3], X_WC[:, :3, 3]

    def by_side(values: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
        of_kept = values[:, kept]
        where = turned.reshape(-1, *(1,) * (of_kept.ndim - 2))
        return np.where(where, of_kept[1], of_kept[0]), np.where(where, of_kept[0], of_kept[1])

    def to_world(p_C: FloatArray) -> FloatArray:
        return np.einsum("mij,mj->mi", R_WC, p_C) + p_WC

    id_A, id_B = by_side(ids)
    element_A, element_B = by_side(elements)
    offset_A, offset_B = by_side(offsets)
    nhat_BA_W = np.einsum("mij,mj->mi", R_WC, solved.nhat_BA_W)
    columns: dict[str, NDArray[Any]] = {
        "id_A": id_A,
        "id_B": id_B,
        "element_A": element_A,
        "element_B": element_B,
        "p_WCa": to_world(solved.p_WCa),
        "p_WCb": to_world(solved.p_WCb),
        "p_ACa": solved.p_ACa + offset_A,
        "p_BCb": solved.p_BCb + offset_B,
        "nhat_BA_W": nhat_BA_W,
        "distance": solved.distance.copy(),
        "depth": -solved.distance,
        "is_nhat_BA_W_unique": solved.is_unique,
        "gap": solved.gap.copy(),
        "decided_by": solved.decided_by,
    }
    if settings.derivatives:
        offsets_C = by_side(_in_cloud(offsets, X_CG, is_cloud))
        columns |= _derivatives(table, X_CG, solved, R_WC, nhat_BA_W, offsets_C)
    return columns


def _as_spheres(
    snapshot: Snapshot, clouds: Clouds, found: FoundPairs, own: _Balls, others: _Balls
) -> tuple[ShapeTable, FloatArray]:
    """Return a table of m balls and of each one's partner, and their poses in C."""
    m, is_cloud = len(found.clouds), found.other_places >= 0
    point = clouds.table.point
    rows = np.full(2 * m, point)
    rows[m:][~is_cloud] = found.others[~is_cloud]
    whole = clouds.table.held.table
    columns = {
        name: getattr(whole, name)[rows]
        for name in ("kind", "size", "hull", "surface", "exact", "lower", "upper", "scale")
    }
    is_ball = rows == point
    radii = np.zeros(2 * m)
    radii[:m], radii[m:][is_cloud] = own.radii, others.radii
    assert (columns["kind"][is_ball] == ShapeKind.SPHERE).all()
    columns["size"][is_ball, 0] = radii[is_ball]
    columns["lower"][is_ball] = -radii[is_ball, np.newaxis]
    columns["upper"][is_ball] = radii[is_ball, np.newaxis]
    columns["scale"][is_ball] = 2.0 * radii[is_ball]
    X_CG = np.tile(np.eye(4), (2 * m, 1, 1))
    X_CG[:m, :3, 3] = own.p_CP
    X_WB = np.empty((m, 4, 4))
    X_WB[~is_cloud] = snapshot.X_WG[found.others[~is_cloud]]
    X_WB[is_cloud] = clouds.X_WC[found.others[is_cloud]]
    X_WC = clouds.X_WC[found.clouds]
    R_CW = X_WC[:, :3, :3].transpose(0, 2, 1)
    # Differences first: a scene far away is as exact as one at the origin.
    X_CG[m:, :3, 3] = np.einsum("mij,mj->mi", R_CW, X_WB[:, :3, 3] - X_WC[:, :3, 3])
    X_CG[m:, :3, :3] = product(R_CW, X_WB[:, :3, :3])
    X_CG[m:, :3, 3][is_cloud] += np.einsum("mij,mj->mi", X_CG[m:, :3, :3][is_cloud], others.p_CP)
    return whole._replace(**columns), X_CG


def _in_cloud(offsets: FloatArray, X_CG: FloatArray, is_cloud: NDArray[np.bool_]) -> FloatArray:
    """Return balls' positions from their clouds' origins, (2, m, 3), in the first one's frame."""
    result = offsets.copy()
    m = len(is_cloud)
    result[1] = np.einsum("mij,mj->mi", X_CG[m:, :3, :3], offsets[1])
    return result


def _derivatives(
    table: ShapeTable,
    X_CG: FloatArray,
    solved: Any,
    R_WC: FloatArray,
    nhat_BA_W: FloatArray,
    offsets_C: tuple[FloatArray, FloatArray],
) -> dict[str, NDArray[Any]]:
    """Return the derivatives for motions of geometries, from those for motions of their balls.

    A ball's centre moves at ``v + w x offset`` where its cloud's origin moves at v and turns at w.
    """
    columns: dict[str, NDArray[Any]] = {}
    for side, sign in ((0, 1.0), (1, -1.0)):
        witness = solved.p_WCa if side == 0 else solved.p_WCb
        arm_C = witness - X_CG[solved.rows[:, side], :3, 3] + offsets_C[side]
        arm = np.einsum("mij,mj->mi", R_WC, arm_C)
        name = f"ddistance_dX_W{'AB'[side]}"
        columns[name] = sign * np.concatenate([np.cross(arm, nhat_BA_W), nhat_BA_W], axis=1)
    for name, column in witness_derivatives(table, X_CG, solved).items():
        if column.ndim != 3:
            columns[name] = column
            continue
        offset = offsets_C["AB".index(name[-1])]
        moved = column.copy()
        # D_v (w x o) = (w . (o x D_v^T)), row by row.
        moved[:, :, :3] += np.cross(offset[:, np.newaxis], column[:, :, 3:])
        R_CW = R_WC.transpose(0, 2, 1)
        parts = np.split(moved, 2, axis=2)
        turned = [product(product(R_WC, part), R_CW) for part in parts]
        columns[name] = np.concatenate(turned, axis=2)
    return columns
