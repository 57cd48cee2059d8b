"""Ask how far points are from geometries; the memory of answers is used again, see ``loans``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.errors import EngineError, RoleError
from scene_graph_ros.geometry.loans import RoomLender
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
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
from scene_graph_ros.geometry.query.on_demand import on_demand
from scene_graph_ros.geometry.query.point.answers import Answers, LARGE, new_answers
from scene_graph_ros.geometry.query.point.batch import distance_points, distances_to_all
from scene_graph_ros.geometry.query.point.kind_table import group_by_kind, HeldKinds, hold_kinds
from scene_graph_ros.geometry.query.results import LateColumns, PointDistances
from scene_graph_ros.geometry.query.settings import settings_of

__all__ = [
    "AnswerMemory",
    "compute_signed_distance_geometry_to_point",
    "compute_signed_distance_to_point",
    "compute_signed_distance_to_points",
]

_MOST = 1 << 20
"""Answers, of 57 bytes each. The memory of more is given back to the system."""


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


def compute_signed_distance_geometry_to_point(
    snapshot: Snapshot,
    p_WQ: ArrayLike,
    geometries: GeometrySet,
    accuracy: Accuracy | str | None,
    engine: Engine | str | None,
) -> PointDistances:
    """Answer `QueryObject.compute_signed_distance_geometry_to_point`."""
    _check_settings(snapshot, accuracy, engine)
    point, ids = checked_points("p_WQ", p_WQ, 1), snapshot.proximity.ids
    inspector = snapshot.inspector
    wanted = [int(each) for each in inspector.get_geometry_ids(geometries, Role.PROXIMITY)]
    for each in sorted(geometries.geometry_ids()):
        if int(each) not in ids:
            name = inspector.get_name(each)
            what = "is deformable" if inspector.is_deformable(each) else "has no proximity role"
            raise RoleError(f"geometry {name!r} ({each!r}) {what}")
    found = point_distances(snapshot, point.reshape(1, 3), math.inf)
    chosen = np.isin(found.id_G, wanted)
    return PointDistances(
        {name: getattr(found, name)[chosen] for name in _COLUMNS}, snapshot.state
    )


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
    arrays, X_WG, state = snapshot.proximity, snapshot.X_WG, snapshot.state
    columns: Mapping[str, NDArray[Any]]
    if threshold == math.inf:
        m, n = len(p_WQs), len(arrays.ids)
        answers = snapshot.memory.of(_begin_answers, None).take(m * n)
        found = distances_to_all(arrays.table, _kinds(state), X_WG, p_WQs, threads, answers)
        columns = LateColumns(_COLUMNS, _Answers(arrays.ids, m, *found), m * n)
    else:
        point, row, phi, p_GN, grad_W, unique = distance_points(
            arrays.table, X_WG, p_WQs, threshold, threads
        )
        columns = {
            "point": point,
            "id_G": arrays.ids[row],
            "p_GN": p_GN,
            "distance": phi,
            "grad_W": grad_W,
            "is_grad_W_unique": unique,
        }
    table = PointDistances(columns, state)
    if arrays.has_elements:
        of_elements = on_demand("point_distances_with_elements")
        table = of_elements(snapshot, table, p_WQs, threshold, threads)
    return table


class _Answers(NamedTuple):
    """Answers of m points about n rows, each in its place."""

    ids: NDArray[np.int64]
    """(n,)"""
    m: int
    distance: NDArray[np.float64]
    p_GN: NDArray[np.float64]
    grad_W: NDArray[np.float64]
    is_unique: NDArray[np.bool_]


_COLUMNS: Mapping[str, Callable[[_Answers], NDArray[Any]]] = {
    "point": lambda answers: np.repeat(np.arange(answers.m), len(answers.ids)),
    "id_G": lambda answers: np.tile(answers.ids, answers.m),
    "p_GN": lambda answers: answers.p_GN,
    "distance": lambda answers: answers.distance,
    "grad_W": lambda answers: answers.grad_W,
    "is_grad_W_unique": lambda answers: answers.is_unique,
}


class AnswerMemory:
    """Hands out memory for answers, and remembers those handed out. Any thread may ask."""

    __slots__ = ("_lender",)

    def __init__(self) -> None:
        self._lender = RoomLender(new_answers, LARGE, _MOST)

    def take(self, count: int) -> Answers:
        """Return flat columns for ``count`` answers, of memory that nobody looks at."""
        if count < LARGE:
            return new_answers(count)  # of the heap, which is not cleared each time
        phi, p_GN, grad_W, unique = self._lender.take(count)
        return phi[:count], p_GN[: 3 * count], grad_W[: 3 * count], unique[:count]


def _begin_answers(_: None) -> AnswerMemory:
    return AnswerMemory()


@derived(Role.PROXIMITY)
def _kinds(state: GeometryState) -> HeldKinds:
    return hold_kinds(group_by_kind(shape_table(state)))
