"""This package, one call for each pair, or one call for a scene of many pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Reply, spread, timed
from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
)

__all__ = ["Ours", "OursBatched"]


class _Scene:
    """Shapes on frames of their own, at poses (n, 4, 4)."""

    def __init__(self, shapes: Sequence[Any], poses: Sequence[np.ndarray]) -> None:
        self.graph = SceneGraph()
        self._source = self.graph.register_source("accuracy")
        self._poses = np.array(poses)
        self.frames, self.ids = [], []
        for k, shape in enumerate(shapes):
            frame = self.graph.register_frame(self._source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
            geometry = self.graph.register_geometry(self._source, frame, instance)
            self.graph.assign_role(self._source, geometry, ProximityProperties())
            self.frames.append(frame)
            self.ids.append(geometry)

    def keep_only(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Filter all pairs but these of the shapes' indices."""
        statement = CollisionFilterDeclaration().exclude_within(GeometrySet(self.ids))
        for i, j in pairs:
            statement.allow_between(GeometrySet(self.ids[i]), GeometrySet(self.ids[j]))
        self.graph.collision_filter_manager().apply(statement)

    def open(self) -> None:
        """Make the query object; the model is complete."""
        self._context = self.graph.create_default_context()
        self.place()
        self.query = self.graph.query_object(self._context)

    def place(self) -> None:
        """Give all frames their poses anew, so that no earlier answer is remembered."""
        self._context.set_frame_poses(self._source, self._poses)


def _shapes(pairs: Sequence[KnownPair]) -> list[Any]:
    return [shape for pair in pairs for shape in (pair.shape_A, pair.shape_B)]


class Ours:
    """A call of ``compute_signed_distance_pair_closest_points`` for each pair."""

    name = "scene_graph_ros"

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        scene = _Scene(_shapes(pairs), [X for pair in pairs for X in (pair.X_WA, pair.X_WB)])
        scene.open()
        ask = scene.query.compute_signed_distance_pair_closest_points
        couples = list(zip(scene.ids[::2], scene.ids[1::2], strict=True))
        values, seconds = timed(lambda: [ask(a, b).distance for a, b in couples], scene.place)
        return Reply(np.array(values), seconds / len(pairs))

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; one call for the whole scene, there is none for a single pair."""
        scene = _many_pairs(pairs)
        ask = scene.query.compute_point_pair_penetration
        table, seconds = timed(ask, scene.place)
        return Reply(_by_pair(scene, table.id_A, table.id_B, -table.depth), seconds / len(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine; a scene of its own for each point."""
        asks = []
        for point in points:
            scene = _Scene([point.shape], [point.X_WG])
            scene.open()
            asks.append((scene.query.compute_signed_distance_to_point, point.p_WQ))
        return one_by_one(lambda ask, p_WQ: ask(p_WQ).distance[0], asks)


class OursBatched:
    """One call of ``compute_signed_distance_pairwise_closest_points`` for a scene of pairs."""

    name = "scene_graph_ros, batched"

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        scene = _many_pairs(pairs)
        ask = scene.query.compute_signed_distance_pairwise_closest_points
        limit = 2.0 * max(abs(pair.distance) for pair in pairs)
        table, seconds = timed(lambda: ask(limit), scene.place)
        values = _by_pair(scene, table.id_A, table.id_B, table.distance)
        return Reply(values, seconds / len(pairs))

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        return Ours().penetrations(pairs)

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine; all points against one shape, whose poses are undone."""
        values, total = [], 0.0
        for point in points:
            scene = _Scene([point.shape], [point.X_WG])
            scene.open()
            ask = scene.query.compute_signed_distance_to_points
            many = np.tile(point.p_WQ, (64, 1))
            table, seconds = timed(lambda ask=ask, many=many: ask(many))
            values.append(table.distance[0])
            total += seconds / len(many)
        return Reply(np.array(values), total / len(points))


def _many_pairs(pairs: Sequence[KnownPair]) -> _Scene:
    scene = _Scene(_shapes(pairs), [X for couple in spread(pairs) for X in couple])
    scene.keep_only([(2 * k, 2 * k + 1) for k in range(len(pairs))])
    scene.open()
    return scene


def _by_pair(scene: _Scene, id_A: np.ndarray, id_B: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the values in the pairs' order, 0 for a pair that is missing."""
    found = dict(zip(zip(id_A.tolist(), id_B.tolist(), strict=True), values, strict=True))
    ids = [int(i) for i in scene.ids]
    couples = zip(ids[::2], ids[1::2], strict=True)
    return np.array([found.get((min(c), max(c)), 0.0) for c in couples])
