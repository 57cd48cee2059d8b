"""Run the kernels of the queries on one snapshot and put their arrays into result tables."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.broadphase.aabb import world_boxes
from scene_graph_ros.geometry.broadphase.all_pairs import all_candidate_pairs
from scene_graph_ros.geometry.broadphase.pair_memory import PairMemory
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.proximity import ProximityArrays, shape_table
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.distance.driver import (
    FIRST_PENETRATION,
    NO_FAILURE,
    PENETRATIONS,
    solve_pairs,
    WITHIN,
)
from scene_graph_ros.geometry.query.distance.witness_derivatives import witness_derivatives
from scene_graph_ros.geometry.query.point.all_rows import group_by_kind, KindTable
from scene_graph_ros.geometry.query.point.batch import distance_points, distances_to_all
from scene_graph_ros.geometry.query.point.reuse import AnswerMemory
from scene_graph_ros.geometry.query.results import (
    CandidatePairs,
    Column,
    Penetrations,
    PointDistances,
    SignedDistancePairs,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.held_table import HeldTable, hold

__all__ = [
    "Settings",
    "candidate_rows",
    "collides",
    "describe",
    "distances_of_pairs",
    "pair_distance",
    "pair_distances",
    "pair_memory",
    "pairs_of_candidates",
    "penetrations",
    "penetrations_of",
    "point_distances",
]


class Settings(NamedTuple):
    """How a query about pairs is to be answered, and what its result is to contain."""

    accuracy: Accuracy
    engine: Engine
    derivatives: bool = False
    certificate: bool = False


_NO_FILTERS = np.zeros((0, 0), dtype=np.uint8)


def candidate_rows(snapshot: Snapshot, margin: float) -> NDArray[np.int64]:
    """Return the (k, 2) rows of pairs that may come within ``margin`` >= 0, may be infinite."""
    X_WG = snapshot.X_WG
    if math.isfinite(margin):
        return pair_memory(snapshot).close_pairs(X_WG, margin)
    proximity = snapshot.proximity
    lower, upper = world_boxes(proximity.table, X_WG)
    bits = _NO_FILTERS if proximity.filter_bits is None else proximity.filter_bits
    is_half_space = proximity.table.kind == ShapeKind.HALF_SPACE
    rows: NDArray[np.int64] = all_candidate_pairs(
        lower, upper, is_half_space, X_WG, proximity.frame, bits, margin
    )
    return rows


def pair_memory(snapshot: Snapshot) -> PairMemory:
    """Return what the context of a snapshot remembers, begun anew after a change of its model."""
    return snapshot.memory.of(_begin_pairs, snapshot.proximity)


def _begin_pairs(proximity: ProximityArrays) -> PairMemory:
    bits = _NO_FILTERS if proximity.filter_bits is None else proximity.filter_bits
    return PairMemory(proximity.table, proximity.frame, bits)


@derived(Role.PROXIMITY)
def _held_table(state: GeometryState) -> HeldTable:
    return hold(shape_table(state))


@derived(Role.PROXIMITY)
def _kinds(state: GeometryState) -> KindTable:
    return group_by_kind(shape_table(state))


def _solve(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    keep: int,
    settings: Settings,
    query: str,
) -> tuple[NDArray[Any], ...]:
    """Return the columns of ``solve_pairs``. Raises UnsupportedPairError for two half spaces."""
    if settings.engine is Engine.FCL:
        from scene_graph_ros.geometry.query.fcl_engine import solve_pairs_with_fcl

        *columns, failed = solve_pairs_with_fcl(
            snapshot, pairs, max_distance, keep, lambda row: describe(snapshot, row), query
        )
    else:
        *columns, failed = solve_pairs(
            _held_table(snapshot.state),
            snapshot.X_WG,
            pairs,
            max_distance,
            keep,
            settings.accuracy.bound,
            settings.certificate,
        )
    if failed != NO_FAILURE:
        names = [describe(snapshot, row) for row in pairs[failed]]
        raise UnsupportedPairError(
            f"{query}: {names[0]} against {names[1]} has no answer: two half spaces overlap"
            " without bound unless they are parallel. Filter the pair, or anchor both."
        )
    return tuple(columns)


def describe(snapshot: Snapshot, row: int) -> str:
    """Name a row of the proximity arrays in a message."""
    geometry_id = snapshot.proximity.geometry_ids[row]
    kind = ShapeKind(snapshot.proximity.table.kind[row])
    return f"{kind.name} {snapshot.inspector.get_name(geometry_id)!r} ({geometry_id!r})"


def _extras(
    snapshot: Snapshot, columns: tuple[NDArray[Any], ...], settings: Settings
) -> dict[str, NDArray[np.float64]]:
    """Return the columns that were asked for beside those that every result has."""
    result: dict[str, NDArray[np.float64]] = {}
    if settings.derivatives:
        result |= _derivatives(snapshot, columns[0], columns)
        result |= witness_derivatives(snapshot.proximity.table, snapshot.X_WG, columns)
    if settings.certificate:
        result["gap"] = columns[8]
    return result


def _derivatives(
    snapshot: Snapshot, rows: NDArray[np.int64], columns: tuple[NDArray[Any], ...]
) -> dict[str, NDArray[np.float64]]:
    """Differentiate the distance with respect to both poses.

    The witness points are stationary to first order (envelope theorem), so the distance changes
    at the rate nhat . (v_Ca - v_Cb), the velocities of A's and B's material points there.
    """
    nhat, X_WG = columns[6], snapshot.X_WG
    result = {}
    for side, (name, witness, sign) in enumerate(
        (("ddistance_dX_WA", columns[4], 1.0), ("ddistance_dX_WB", columns[5], -1.0))
    ):
        arm = witness - X_WG[rows[:, side], :3, 3]
        result[name] = sign * np.concatenate([np.cross(arm, nhat), nhat], axis=1)
    return result


def pairs_of_candidates(snapshot: Snapshot) -> CandidatePairs:
    """Return the pairs whose bounding boxes meet."""
    ids = snapshot.proximity.ids[pair_memory(snapshot).candidate_pairs(snapshot.X_WG, 0.0)]
    return CandidatePairs({"id_A": ids[:, 0], "id_B": ids[:, 1]})


def collides(snapshot: Snapshot, settings: Settings) -> bool:
    """Tell whether any pair penetrates; stops at the first."""
    pairs = candidate_rows(snapshot, 0.0)
    if not len(pairs):
        return False
    rows, *_ = _solve(snapshot, pairs, 0.0, FIRST_PENETRATION, settings, "has_collisions")
    return len(rows) > 0


def penetrations(snapshot: Snapshot, settings: Settings) -> Penetrations:
    """Return all penetrating pairs."""
    pairs = candidate_rows(snapshot, 0.0)
    return penetrations_of(snapshot, pairs, settings, "compute_point_pair_penetration")


def penetrations_of(
    snapshot: Snapshot, pairs: NDArray[np.int64], settings: Settings, query: str
) -> Penetrations:
    """Return those of the (m, 2) rows ``pairs`` that penetrate; ``query`` is named in messages."""
    columns = _solve(snapshot, pairs, 0.0, PENETRATIONS, settings, query)
    rows, phi, _, _, p_WCa, p_WCb, nhat_BA_W, _, _ = columns
    ids = snapshot.proximity.ids[rows]
    table = {
        "id_A": ids[:, 0],
        "id_B": ids[:, 1],
        "p_WCa": p_WCa,
        "p_WCb": p_WCb,
        "nhat_BA_W": nhat_BA_W,
        "depth": -phi,
    }
    return Penetrations(table | _extras(snapshot, columns, settings))


def pair_distances(
    snapshot: Snapshot, max_distance: float, settings: Settings
) -> SignedDistancePairs:
    """Return the pairs with a signed distance of at most ``max_distance``."""
    pairs = candidate_rows(snapshot, max(max_distance, 0.0))
    return distances_of_pairs(snapshot, pairs, max_distance, settings)


def distances_of_pairs(
    snapshot: Snapshot, pairs: NDArray[np.int64], max_distance: float, settings: Settings
) -> SignedDistancePairs:
    """Return those of the (m, 2) rows ``pairs`` that are at most ``max_distance`` apart."""
    query = "compute_signed_distance_pairwise_closest_points"
    return _distance_table(snapshot, pairs, max_distance, settings, query)


def pair_distance(
    snapshot: Snapshot, row_A: int, row_B: int, settings: Settings
) -> SignedDistancePairs:
    """Return the one pair, filtered or not."""
    pairs = np.array([[row_A, row_B]], dtype=np.int64)
    query = "compute_signed_distance_pair_closest_points"
    return _distance_table(snapshot, pairs, math.inf, settings, query)


def _distance_table(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    settings: Settings,
    query: str,
) -> SignedDistancePairs:
    columns = _solve(snapshot, pairs, max_distance, WITHIN, settings, query)
    rows, phi, p_ACa, p_BCb, _, _, nhat_BA_W, unique, _ = columns
    ids = snapshot.proximity.ids[rows]
    table = {
        "id_A": ids[:, 0],
        "id_B": ids[:, 1],
        "p_ACa": p_ACa,
        "p_BCb": p_BCb,
        "distance": phi,
        "nhat_BA_W": nhat_BA_W,
        "is_nhat_BA_W_unique": unique,
    }
    return SignedDistancePairs(table | _extras(snapshot, columns, settings))


def point_distances(
    snapshot: Snapshot, p_WQs: NDArray[np.float64], threshold: float, threads: int = 1
) -> PointDistances:
    """Return the signed distances of (m, 3) points to all geometries, up to ``threshold``."""
    arrays, X_WG = snapshot.proximity, snapshot.X_WG
    table, ids = arrays.table, arrays.ids
    point: Column
    id_G: Column
    if threshold == math.inf:
        m, n = len(p_WQs), len(ids)
        kinds = _kinds(snapshot.state)
        answers = snapshot.memory.of(_begin_answers, None).take(m * n)
        columns = distances_to_all(table, kinds, X_WG, p_WQs, threads, answers)
        # Where each answer has its place, these are known without looking.
        point, id_G = lambda: np.repeat(np.arange(m), n), lambda: np.tile(ids, m)
    else:
        point, row, *rest = distance_points(table, X_WG, p_WQs, threshold, threads)
        id_G, columns = ids[row], tuple(rest)
    phi, p_GN, grad_W, unique = columns
    return PointDistances(
        {
            "point": point,
            "id_G": id_G,
            "p_GN": p_GN,
            "distance": phi,
            "grad_W": grad_W,
            "is_grad_W_unique": unique,
        }
    )


def _begin_answers(_: None) -> AnswerMemory:
    return AnswerMemory()
