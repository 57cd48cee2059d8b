"""Answers of a snapshot with shapes of many elements: those about all others, and theirs.

Each function is given the answer about the others, and returns that with theirs among it, in the
order of the ids.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.distance.driver import (
    FIRST_PENETRATION,
    PENETRATIONS,
    WITHIN,
)
from scene_graph_ros.geometry.query.elements.scene import Clouds, clouds_of
from scene_graph_ros.geometry.query.elements.solve import columns_of, find_pairs, FoundPairs
from scene_graph_ros.geometry.query.results import (
    CandidatePairs,
    Penetrations,
    ResultTable,
    SignedDistancePair,
    SignedDistancePairs,
)
from scene_graph_ros.geometry.query.settings import Settings
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid

__all__ = [
    "candidates_with_elements",
    "distances_with_elements",
    "elements_collide",
    "pair_distance_of_elements",
    "penetrations_with_elements",
]

Table = TypeVar("Table", bound=ResultTable[Any])


def candidates_with_elements(snapshot: Snapshot, table: CandidatePairs) -> CandidatePairs:
    """Add the pairs of a cloud or field whose bounding boxes meet."""
    clouds = clouds_of(snapshot)
    pairs, both = clouds.near_pairs(snapshot, 0.0), clouds.near_clouds(snapshot, 0.0)
    first = np.concatenate([clouds.ids[pairs[:, 0]], clouds.ids[both[:, 0]]])
    second = np.concatenate([snapshot.proximity.ids[pairs[:, 1]], clouds.ids[both[:, 1]]])
    columns = {"id_A": np.minimum(first, second), "id_B": np.maximum(first, second)}
    return _merged(snapshot, table, columns, ("id_A", "id_B"))


def elements_collide(snapshot: Snapshot, settings: Settings) -> bool:
    """Tell whether any cloud penetrates anything."""
    return len(_solved(snapshot, 0.0, FIRST_PENETRATION, settings)["id_A"]) > 0


def penetrations_with_elements(
    snapshot: Snapshot, table: Penetrations, settings: Settings
) -> Penetrations:
    """Add the penetrations of clouds."""
    return _with_pairs(snapshot, table, _solved(snapshot, 0.0, PENETRATIONS, settings))


def distances_with_elements(
    snapshot: Snapshot, table: SignedDistancePairs, max_distance: float, settings: Settings
) -> SignedDistancePairs:
    """Add the distances of clouds that are at most ``max_distance``."""
    return _with_pairs(snapshot, table, _solved(snapshot, max_distance, WITHIN, settings))


def pair_distance_of_elements(
    snapshot: Snapshot, id_A: GeometryId, id_B: GeometryId, settings: Settings
) -> SignedDistancePair:
    """Return the one pair, filtered or not, of which one at least is a cloud or field.

    Raises UnsupportedPairError for a cloud without points, and for two height fields.
    """
    clouds = clouds_of(snapshot)
    query = "compute_signed_distance_pair_closest_points"
    own = {each: k for k, each in enumerate(clouds.geometry_ids)}
    for each in (id_A, id_B):
        if each in own and clouds.table.counts[own[each]] == 0:
            name = snapshot.inspector.get_path(each)
            is_grid = isinstance(snapshot.inspector.get_shape(each), VoxelGrid)
            elements = "solid voxels" if is_grid else "points"
            raise UnsupportedPairError(f"{query}: {name} has no {elements}, so none is nearest")
    pair = sorted((id_A, id_B), key=lambda each: own.get(each, len(own)))
    rows = {each: row for row, each in enumerate(snapshot.proximity.geometry_ids)}
    is_cloud = pair[1] in own
    other = own[pair[1]] if is_cloud else rows[pair[1]]
    found = find_pairs(
        snapshot, _only(clouds, own[pair[0]], other, is_cloud=is_cloud), np.inf, WITHIN, settings
    )
    columns = columns_of(snapshot, clouds, found, np.inf, WITHIN, settings)
    kept = {name: columns[name] for name in _names(SignedDistancePairs, settings)}
    return SignedDistancePairs(kept, snapshot.state)[0]


class _OnePair(Clouds):
    """Clouds of which one pair is asked about, filtered or not."""

    pair: tuple[int, int]
    is_cloud: bool

    def near_pairs(self, snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
        return np.empty((0, 2), np.int64) if self.is_cloud else np.array([self.pair])

    def near_clouds(self, snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
        return np.array([self.pair]) if self.is_cloud else np.empty((0, 2), np.int64)


def _only(clouds: Clouds, cloud: int, other: int, *, is_cloud: bool) -> Clouds:
    result = _OnePair(*clouds)
    result.pair, result.is_cloud = (cloud, other), is_cloud
    return result


def _solved(
    snapshot: Snapshot, max_distance: float, keep: int, settings: Settings
) -> dict[str, NDArray[Any]]:
    clouds = clouds_of(snapshot)
    found: FoundPairs = find_pairs(snapshot, clouds, max_distance, keep, settings)
    return columns_of(snapshot, clouds, found, max_distance, keep, settings)


_DERIVATIVES = (
    "ddistance_dX_WA",
    "ddistance_dX_WB",
    "dp_WCa_dX_WA",
    "dp_WCa_dX_WB",
    "dp_WCb_dX_WA",
    "dp_WCb_dX_WB",
    "is_witness_differentiable",
)
_OF_TABLE: Mapping[type, tuple[str, ...]] = {
    Penetrations: ("id_A", "id_B", "p_WCa", "p_WCb", "nhat_BA_W", "depth"),
    SignedDistancePairs: (
        "id_A", "id_B", "p_ACa", "p_BCb", "distance", "nhat_BA_W", "is_nhat_BA_W_unique",
    ),
}  # fmt: skip


def _names(table: type, settings: Settings) -> tuple[str, ...]:
    """Return the names of a table's columns by its options."""
    asked = _DERIVATIVES if settings.derivatives else ()
    shown = ("gap", "decided_by") if settings.certificate else ()
    return (*_OF_TABLE[table], "element_A", "element_B", *asked, *shown)


def _with_pairs(snapshot: Snapshot, table: Table, columns: Mapping[str, NDArray[Any]]) -> Table:
    names = [*table.columns, *(n for n in ("element_A", "element_B") if n not in table.columns)]
    return _merged(snapshot, table, {n: columns[n] for n in names}, ("id_A", "id_B"))


def _merged(
    snapshot: Snapshot,
    table: Table,
    columns: Mapping[str, NDArray[Any]],
    order: tuple[str, ...],
) -> Table:
    """Return a table with more rows, sorted; it gets columns for elements where it has none."""
    count = len(table)
    whole = {}
    for name, column in columns.items():
        known = table.columns.get(name)
        if known is None:
            known = np.full(count, -1)
        whole[name] = np.concatenate([known, column])
    rows = np.lexsort([whole[name] for name in reversed(order)])
    return type(table)({name: column[rows] for name, column in whole.items()}, snapshot.state)
