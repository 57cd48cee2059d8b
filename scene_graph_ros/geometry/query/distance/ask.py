"""Ask how far apart pairs are, and where they are nearest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.errors import RoleError, UnsupportedPairError
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.records import refuse_deformable
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.query.arguments import checked_limit
from scene_graph_ros.geometry.query.candidates.rows import candidate_rows
from scene_graph_ros.geometry.query.distance.driver import WITHIN
from scene_graph_ros.geometry.query.distance.solve import ID_COLUMNS, pair_columns, Recipes, solve
from scene_graph_ros.geometry.query.distance.solved_pairs import LOCAL
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.results import SignedDistancePair, SignedDistancePairs
from scene_graph_ros.geometry.query.settings import Settings, settings_of

__all__ = [
    "compute_signed_distance_pair_closest_points",
    "compute_signed_distance_pairwise_closest_points",
    "distances_of_pairs",
]


def compute_signed_distance_pairwise_closest_points(
    memo: Memo,
    max_distance: float,
    derivatives: bool,
    certificate: bool,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> SignedDistancePairs:
    """Answer `QueryObject.compute_signed_distance_pairwise_closest_points`."""
    limit = checked_limit("max_distance", max_distance)
    settings = settings_of(memo.snapshot, accuracy, engine, derivatives, certificate)
    return memo.get(("distances", limit, settings), pair_distances, limit, settings)


def compute_signed_distance_pair_closest_points(
    memo: Memo,
    id_A: GeometryId,
    id_B: GeometryId,
    derivatives: bool,
    certificate: bool,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> SignedDistancePair:
    """Answer `QueryObject.compute_signed_distance_pair_closest_points`."""
    row_A, row_B = sorted(_proximity_row(memo.snapshot, id_) for id_ in (id_A, id_B))
    if id_A == id_B:
        raise UnsupportedPairError(
            f"compute_signed_distance_pair_closest_points: {id_A!r} against itself"
        )
    settings = settings_of(memo.snapshot, accuracy, engine, derivatives, certificate)
    if _OF_ELEMENTS in (row_A, row_B):
        of_elements = on_demand("pair_distance_of_elements")
        ids = tuple(sorted((id_A, id_B)))
        return memo.get(("distance", ids, settings), of_elements, *ids, settings)
    key = ("distance", row_A, row_B, settings)
    return memo.get(key, pair_distance, row_A, row_B, settings)


_OF_ELEMENTS = -1
"""Instead of a row: a shape of many elements has none."""


def _proximity_row(snapshot: Snapshot, geometry_id: GeometryId) -> int:
    record = snapshot.state.geometry(geometry_id)
    refuse_deformable(record, "its contact is a matter of compute_deformable_contact")
    name = record.name
    ids = snapshot.proximity.ids
    row = int(np.searchsorted(ids, int(geometry_id)))
    if row == len(ids) or ids[row] != int(geometry_id):
        if geometry_id in snapshot.state.element_ids(Role.PROXIMITY):
            return _OF_ELEMENTS
        raise RoleError(f"geometry {name!r} ({geometry_id!r}) has no proximity role")
    return row


def pair_distances(
    snapshot: Snapshot, max_distance: float, settings: Settings
) -> SignedDistancePairs:
    """Return the pairs with a signed distance of at most ``max_distance``."""
    pairs = candidate_rows(snapshot, max(max_distance, 0.0))
    table = distances_of_pairs(snapshot, pairs, max_distance, settings)
    if snapshot.proximity.has_elements:
        table = on_demand("distances_with_elements")(snapshot, table, max_distance, settings)
    return table


def distances_of_pairs(
    snapshot: Snapshot, pairs: NDArray[np.int64], max_distance: float, settings: Settings
) -> SignedDistancePairs:
    """Return those of the (m, 2) rows ``pairs`` that are at most ``max_distance`` apart."""
    query = "compute_signed_distance_pairwise_closest_points"
    return _distance_table(snapshot, pairs, max_distance, settings, query)


def pair_distance(
    snapshot: Snapshot, row_A: int, row_B: int, settings: Settings
) -> SignedDistancePair:
    """Return the one pair, filtered or not."""
    pairs = np.array([[row_A, row_B]], dtype=np.int64)
    query = "compute_signed_distance_pair_closest_points"
    return _distance_table(snapshot, pairs, math.inf, settings, query)[0]


def _distance_table(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    settings: Settings,
    query: str,
) -> SignedDistancePairs:
    solved = solve(snapshot, pairs, max_distance, WITHIN, settings, query, LOCAL)
    return SignedDistancePairs(pair_columns(_COLUMNS, snapshot, solved, settings), snapshot.state)


_COLUMNS: Recipes = {
    **ID_COLUMNS,
    "p_ACa": lambda answers: answers[1].p_ACa,
    "p_BCb": lambda answers: answers[1].p_BCb,
    "distance": lambda answers: answers[1].distance,
    "nhat_BA_W": lambda answers: answers[1].nhat_BA_W,
    "is_nhat_BA_W_unique": lambda answers: answers[1].is_unique,
}
