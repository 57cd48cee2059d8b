"""Pairs with shapes of many elements in them, solved as pairs of the elements that decide them.

Which ball or prism is nearest is found first. Then the pair is asked about as any other, with a
sphere or a convex hull in the shape's place and frame, so that all that is answered of these is
answered of clouds and height fields as well, and as exactly.
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
from scene_graph_ros.geometry.query.elements.chosen_elements import (
    chosen_elements,
    Elements,
    MOST_PRISMS,
)
from scene_graph_ros.geometry.query.elements.nearest import find_nearest
from scene_graph_ros.geometry.query.elements.scene import Clouds, two_fields
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tables.held_table import hold
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["FoundPairs", "columns_of", "find_pairs"]

FloatArray = NDArray[np.float64]


class FoundPairs(NamedTuple):
    """Pairs of a cloud or field with another geometry, and the elements that decide them."""

    clouds: NDArray[np.int64]
    """(m,) which cloud or field."""
    places: NDArray[np.int64]
    """(m,) where its ball is in the tree's order, or which prism it is."""
    others: NDArray[np.int64]
    """(m,) rows of the proximity arrays, or which cloud or field, as ``other_places`` tells."""
    other_places: NDArray[np.int64]
    """(m,) the other's ball or prism; -1 where the other has no elements."""

    def some(self, chosen: Any) -> FoundPairs:
        """Return some of them."""
        return FoundPairs(*(column[chosen] for column in self))


def find_pairs(
    snapshot: Snapshot, clouds: Clouds, max_distance: float, keep: int, settings: Settings
) -> FoundPairs:
    """Return the pairs that may be kept, see ``solve_pairs``: at most ``max_distance`` apart.

    Raises EngineError for the engine that knows no clouds, UnsupportedPairError for two height
    fields.
    """
    if settings.engine is not Engine.NATIVE:
        raise EngineError(
            f"engine {settings.engine.value!r} has no point clouds, height fields and voxel grids:"
            " ask with engine='native'"
        )
    margin = max(max_distance, 0.0)
    found: list[tuple[int, int, int, int]] = []
    pairs, places = clouds.near_pairs(snapshot, margin), clouds.table.own_places()
    for cloud in np.unique(pairs[:, 0]).tolist():
        rows = np.ascontiguousarray(pairs[pairs[:, 0] == cloud, 1])
        nearest = np.empty((len(rows), 2))
        X_WC = np.ascontiguousarray(clouds.X_WC[cloud : cloud + 1])
        if cloud < clouds.num_clouds:
            find_nearest(places, cloud, snapshot.X_WG, X_WC, rows, max_distance, nearest)
        else:
            from scene_graph_ros.geometry.query.elements.field_kernels import find_prisms

            field = cloud - clouds.num_clouds
            find_prisms(places, field, snapshot.X_WG, X_WC, rows, max_distance, nearest)
        is_found = nearest[:, 1] >= 0
        at = nearest[is_found, 1].astype(np.int64).tolist()
        found += [(cloud, p, r, -1) for p, r in zip(at, rows[is_found].tolist(), strict=True)]
        if keep == FIRST_PENETRATION and (nearest[is_found, 0] < 0.0).any():
            break
    for first, second in clouds.near_clouds(snapshot, margin).tolist():
        both = _of_two(snapshot, clouds, places, (first, second), max_distance)
        if both[1] >= 0:
            found.append((first, int(both[1]), second, int(both[2])))
    columns = np.array(found, np.int64).reshape(-1, 4).T
    return FoundPairs(*(np.ascontiguousarray(column) for column in columns))


def _of_two(
    snapshot: Snapshot,
    clouds: Clouds,
    places: Any,
    pair: tuple[int, int],
    max_distance: float,
) -> FloatArray:
    """Return (distance, element, element) of two clouds or fields; -1 if farther."""
    both, (first, second) = np.array([max_distance, 0.0, 0.0]), pair
    if second < clouds.num_clouds:
        find_nearest_balls(places, first, second, clouds.X_WC, both)
        return both
    X_WA, X_WB = (np.ascontiguousarray(clouds.X_WC[k : k + 1]) for k in pair)
    field, heights = second - clouds.num_clouds, clouds.num_heights
    if first < clouds.num_clouds:
        from scene_graph_ros.geometry.query.elements.field_to_cloud import find_ball_at_field

        find_ball_at_field(places, field, first, X_WB, X_WA, max_distance, both)
        return both
    if field < heights:
        raise two_fields(snapshot, clouds.geometry_ids[first], clouds.geometry_ids[second])
    from scene_graph_ros.geometry.query.elements.between_fields import find_voxel_at_field

    other = first - clouds.num_clouds
    find_voxel_at_field(places, other, field, X_WA, X_WB, max_distance, both)
    return both


def columns_of(
    snapshot: Snapshot,
    clouds: Clouds,
    found: FoundPairs,
    max_distance: float,
    keep: int,
    settings: Settings,
) -> dict[str, NDArray[Any]]:
    """Return all columns that records of pairs may have, of those pairs that are kept."""
    most = MOST_PRISMS if clouds.table.fields else max(len(found.clouds), 1)
    parts = []
    for begin in range(0, max(len(found.clouds), 1), most):
        some = found.some(slice(begin, begin + most))
        with (
            chosen_elements(clouds, some.clouds, some.places) as own,
            chosen_elements(clouds, *_elements_of_others(some)) as others,
        ):
            parts.append(
                _columns_of(snapshot, clouds, some, own, others, max_distance, keep, settings)
            )
    if len(parts) == 1:
        return parts[0]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _elements_of_others(found: FoundPairs) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    has_elements = found.other_places >= 0
    return found.others[has_elements], found.other_places[has_elements]


def _columns_of(
    snapshot: Snapshot,
    clouds: Clouds,
    found: FoundPairs,
    own: Elements,
    others: Elements,
    max_distance: float,
    keep: int,
    settings: Settings,
) -> dict[str, NDArray[Any]]:
    m = len(found.clouds)
    is_cloud = found.other_places >= 0
    table, X_CG = _as_elements(snapshot, clouds, found, own, others)
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


def _as_elements(
    snapshot: Snapshot, clouds: Clouds, found: FoundPairs, own: Elements, others: Elements
) -> tuple[ShapeTable, FloatArray]:
    """Return a table of m elements and of each one's partner, and their poses in C."""
    m, is_cloud = len(found.clouds), found.other_places >= 0
    point = clouds.table.point
    rows = np.concatenate([own.rows, found.others])
    rows[m:][is_cloud] = others.rows
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
    """Return elements' positions from their shapes' origins, (2, m, 3), in the first's frame."""
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
    """Return the derivatives for motions of geometries, from those for motions of their elements.

    An element moves at ``v + w x offset`` where its shape's origin moves at v and turns at w.
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
