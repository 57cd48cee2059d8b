"""This package at each tier: one call for each pair, or one for a scene of many pairs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Refused, Reply, spread, timed
from scene_graph_ros.geometry import (
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.errors import EngineError, UnsupportedPairError

__all__ = ["Ours", "OursBatched", "OursWithFcl", "Scene", "copied"]


class Scene:
    """Shapes on frames of their own, at poses (n, 4, 4)."""

    query: Any
    """Its queries, once it is open."""

    def __init__(
        self,
        graph: SceneGraph,
        shapes: Sequence[Any],
        poses: Sequence[np.ndarray],
        meshes: str = "convex_hull",
    ) -> None:
        """Register the shapes; ``meshes`` says what meshes stand for, as their property does."""
        properties = ProximityProperties()
        properties.add_property("mesh", "representation", meshes)
        self.graph = graph
        self._source = self.graph.register_source("accuracy")
        self._poses = np.array(poses)
        self.frames, self.ids = [], []
        for k, shape in enumerate(shapes):
            frame = self.graph.register_frame(self._source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
            geometry = self.graph.register_geometry(self._source, frame, instance)
            self.graph.assign_role(self._source, geometry, properties)
            self.frames.append(frame)
            self.ids.append(geometry)

    @classmethod
    def of_pairs(
        cls, graph: SceneGraph, pairs: Sequence[KnownPair], meshes: str = "convex_hull"
    ) -> Scene:
        """Return a scene of pairs, each at a place of its own; all other pairs are filtered."""
        shapes = [shape for pair in pairs for shape in (pair.shape_A, pair.shape_B)]
        scene = cls(graph, shapes, [X for couple in spread(pairs) for X in couple], meshes)
        scene.keep_only([(2 * k, 2 * k + 1) for k in range(len(pairs))])
        scene.open()
        return scene

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

    def by_pair(self, table: Any, values: np.ndarray, missing: float = np.nan) -> np.ndarray:
        """Return a column (k,) of a result in the pairs' order."""
        places = {
            (int(i), int(j)): k
            for k, (i, j) in enumerate(zip(table.id_A, table.id_B, strict=True))
        }
        ids = [int(i) for i in self.ids]
        couples = zip(ids[::2], ids[1::2], strict=True)
        rows = [places.get((min(c), max(c)), len(values)) for c in couples]
        return np.append(values, missing)[rows]


_COPIES = 8
"""Of every pair in a scene of many, so that what a call costs once is shared by many pairs."""


_ENOUGH = 1e-3
"""Metres that a distance may be too large without being left out: more than any tier's error."""


def _shapes(pairs: Sequence[KnownPair]) -> list[Any]:
    return [shape for pair in pairs for shape in (pair.shape_A, pair.shape_B)]


def copied(pairs: Sequence[KnownPair]) -> list[KnownPair]:
    """Return the pairs several times; but once if a half space would be near all the others."""
    is_wide = any(isinstance(shape, HalfSpace) for shape in _shapes(pairs[:1]))
    return [*pairs] * (1 if is_wide else _COPIES)


class Ours:
    """A call of ``compute_signed_distance_pair_closest_points`` for each pair."""

    def __init__(self, accuracy: Accuracy) -> None:
        self.name = f"{accuracy.value}, one by one"
        self._settings: dict[str, Any] = {"accuracy": accuracy}

    def _scene(self, shapes: Sequence[Any], poses: Sequence[np.ndarray]) -> Scene:
        return Scene(SceneGraph(**self._settings), shapes, poses)

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        scene = self._scene(_shapes(pairs), [X for pair in pairs for X in (pair.X_WA, pair.X_WB)])
        scene.open()
        ask = scene.query.compute_signed_distance_pair_closest_points
        couples = list(zip(scene.ids[::2], scene.ids[1::2], strict=True))
        values, seconds = timed(lambda: [ask(a, b).distance for a, b in couples], scene.place)
        return Reply(np.array(values), seconds / len(pairs))

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; one call for the whole scene, there is none for a single pair."""
        pairs = copied(pairs)
        scene = Scene.of_pairs(SceneGraph(**self._settings), pairs)
        ask = scene.query.compute_point_pair_penetration
        table, seconds = timed(ask, scene.place)
        return Reply(scene.by_pair(table, -table.depth, missing=0.0), seconds / len(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine; a scene of its own for each point."""
        asks = []
        for point in points:
            scene = self._scene([point.shape], [point.X_WG])
            scene.open()
            asks.append((scene.query.compute_signed_distance_to_point, point.p_WQ))
        return one_by_one(lambda ask, p_WQ: ask(p_WQ).distance[0], asks)


class OursBatched(Ours):
    """One call of ``compute_signed_distance_pairwise_closest_points`` for a scene of pairs."""

    def __init__(self, accuracy: Accuracy) -> None:
        super().__init__(accuracy)
        self.name = accuracy.value

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        pairs = copied(pairs)
        scene = Scene.of_pairs(SceneGraph(**self._settings), pairs)
        ask = scene.query.compute_signed_distance_pairwise_closest_points
        limit = _ENOUGH + max(pair.distance for pair in pairs)
        table, seconds = timed(lambda: ask(limit), scene.place)
        return Reply(scene.by_pair(table, table.distance), seconds / len(pairs))

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine; 64 times the same point at once."""
        values, total = [], 0.0
        for point in points:
            scene = self._scene([point.shape], [point.X_WG])
            scene.open()
            ask = scene.query.compute_signed_distance_to_points
            many = np.tile(point.p_WQ, (64, 1))
            table, seconds = timed(lambda ask=ask, many=many: ask(many))
            values.append(table.distance[0])
            total += seconds / len(many)
        return Reply(np.array(values), total / len(points))


class OursWithFcl(OursBatched):
    """The same with ``engine="fcl"``."""

    def __init__(self) -> None:
        super().__init__(Accuracy.EXACT)
        self.name = 'engine="fcl"'
        self._settings = {"engine": Engine.FCL}

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        try:
            return super().distances(pairs)
        except UnsupportedPairError as error:
            raise Refused(str(error)) from error

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine."""
        try:
            return super().points(points)
        except EngineError as error:
            raise Refused(str(error)) from error
