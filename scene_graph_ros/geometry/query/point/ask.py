"""Ask how far points are from geometries."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.proximity import shape_table
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.arguments import (
    checked_limit,
    checked_points,
    checked_threads,
)
from scene_graph_ros.geometry.query.memo import Memo
from scene_graph_ros.geometry.query.point.all_rows import group_by_kind, KindTable
from scene_graph_ros.geometry.query.point.batch import distance_points, distances_to_all
from scene_graph_ros.geometry.query.point.reuse import AnswerMemory
from scene_graph_ros.geometry.query.results import Column, PointDistances
from scene_graph_ros.geometry.query.settings import settings_of

__all__ = ["compute_signed_distance_to_point", "compute_signed_distance_to_points"]


def compute_signed_distance_to_point(
    memo: Memo,
    p_WQ: ArrayLike,
    threshold: float,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> PointDistances:
    """Answer `QueryObject.compute_signed_distance_to_point`."""
    _check_settings(memo.snapshot, accuracy, engine)
    point = checked_points("p_WQ", p_WQ, 1)
    limit = checked_limit("threshold", threshold)
    key = ("point", point.tobytes(), limit)
    return memo.get(key, point_distances, point.reshape(1, 3), limit)


def compute_signed_distance_to_points(
    snapshot: Snapshot,
    p_WQs: ArrayLike,
    threshold: float,
    threads: int,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> PointDistances:
    """Answer `QueryObject.compute_signed_distance_to_points`, which is not remembered."""
    _check_settings(snapshot, accuracy, engine)
    points = checked_points("p_WQs", p_WQs, 2)
    limit = checked_limit("threshold", threshold)
    return point_distances(snapshot, points, limit, checked_threads(threads))


def _check_settings(
    snapshot: Snapshot, accuracy: Accuracy | str | None, engine: Engine | str | None
) -> None:
    if accuracy is None and engine is None and snapshot.state.engine is Engine.NATIVE:
        return
    chosen = settings_of(snapshot, accuracy, engine).engine
    if chosen is not Engine.NATIVE:
        raise EngineError(
            f"engine {chosen.value!r} has no distances of points: ask with engine='native'"
        )


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


@derived(Role.PROXIMITY)
def _kinds(state: GeometryState) -> KindTable:
    return group_by_kind(shape_table(state))
