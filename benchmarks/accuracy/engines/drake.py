"""Drake's SceneGraph by way of pydrake."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from typing import Any

import numpy as np

from benchmarks.accuracy.constructions import KnownPair, KnownPoint
from benchmarks.accuracy.engines.engine import one_by_one, Refused, Reply, spread, timed
from benchmarks.peer_shapes import drake_shape
from scene_graph_ros.geometry import HalfSpace, Sphere

__all__ = ["Drake"]

_MOST_PAIRS = 8
"""In one scene where half spaces take part: twenty of them end the process."""


class Drake:
    """The queries of ``pydrake.geometry.QueryObject``."""

    name = "Drake"

    def __init__(self) -> None:
        self._drake: Any = importlib.import_module("pydrake.geometry")
        self._math: Any = importlib.import_module("pydrake.math")

    def _scene(self, pairs: Sequence[tuple[Any, np.ndarray, Any, np.ndarray]]) -> Any:
        """Return (query object, ids): A of each pair on a frame at the origin, B anchored.

        All pairs but the given ones are filtered.
        """
        drake = self._drake
        graph = drake.SceneGraph()
        source = graph.RegisterSource("accuracy")
        frame = graph.RegisterFrame(source, drake.GeometryFrame("frame"))
        ids = []
        for k, (A, X_WA, B, X_WB) in enumerate(pairs):
            a = graph.RegisterGeometry(source, frame, self._instance(X_WA, A, f"a{k}"))
            b = graph.RegisterAnchoredGeometry(source, self._instance(X_WB, B, f"b{k}"))
            for geometry in (a, b):
                graph.AssignRole(source, geometry, drake.ProximityProperties())
            ids.append((a, b))
        every = drake.GeometrySet([i for couple in ids for i in couple])
        statement = drake.CollisionFilterDeclaration().ExcludeWithin(every)
        for a, b in ids:
            statement.AllowBetween(drake.GeometrySet(a), drake.GeometrySet(b))
        graph.collision_filter_manager().Apply(statement)
        context = graph.CreateDefaultContext()
        poses = drake.FramePoseVector()
        poses.set_value(frame, self._math.RigidTransform())
        graph.get_source_pose_port(source).FixValue(context, poses)
        self._alive = graph, context  # the query object refers to them
        return graph.get_query_output_port().Eval(context), ids

    def _instance(self, X: np.ndarray, shape: Any, name: str) -> Any:
        return self._drake.GeometryInstance(self._math.RigidTransform(X), drake_shape(shape), name)

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine."""
        arguments, alive = [], []
        for part in _parts(pairs):
            query, ids = self._scene([(p.shape_A, p.X_WA, p.shape_B, p.X_WB) for p in part])
            arguments += [(query, a, b) for a, b in ids]
            alive.append(self._alive)

        def ask(query: Any, a: Any, b: Any) -> float:
            return query.ComputeSignedDistancePairClosestPoints(a, b).distance

        try:
            return one_by_one(ask, arguments)
        except RuntimeError as error:
            raise Refused(str(error)) from error

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """See Engine; one call for a scene of pairs, there is none for a single pair."""
        replies = [self._penetrations(part) for part in _parts(pairs)]
        values = np.concatenate([values for values, _ in replies])
        return Reply(values, sum(seconds for _, seconds in replies) / len(pairs))

    def _penetrations(self, pairs: Sequence[KnownPair]) -> tuple[np.ndarray, float]:
        """Return minus the depths of the pairs of one scene, and the time of its query."""
        places = spread(pairs)
        query, ids = self._scene(
            [(p.shape_A, a, p.shape_B, b) for p, (a, b) in zip(pairs, places, strict=True)]
        )
        try:
            found, seconds = timed(query.ComputePointPairPenetration)
        except RuntimeError as error:
            raise Refused(str(error)) from error
        depths = {frozenset((f.id_A, f.id_B)): f.depth for f in found}
        return np.array([-depths.get(frozenset(couple), 0.0) for couple in ids]), seconds

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """See Engine; a scene of its own for each point."""
        asks, alive = [], []
        far = np.eye(4)
        far[:3, 3] = 100.0
        sphere = self._far_shape()
        for point in points:
            query, _ = self._scene([(point.shape, point.X_WG, sphere, far)])
            alive.append(self._alive)
            asks.append((query, point.p_WQ))
        try:
            return one_by_one(_distance_to_point, asks)
        except RuntimeError as error:
            raise Refused(str(error)) from error

    @staticmethod
    def _far_shape() -> Any:
        return Sphere(0.1)


def _parts(pairs: Sequence[KnownPair]) -> list[Sequence[KnownPair]]:
    """Return the pairs in parts that fit into a scene."""
    is_wide = any(isinstance(p, HalfSpace) for p in (pairs[0].shape_A, pairs[0].shape_B))
    size = _MOST_PAIRS if is_wide else len(pairs)
    return [pairs[k : k + size] for k in range(0, len(pairs), size)]


def _distance_to_point(query: Any, p_WQ: np.ndarray) -> float:
    answers = query.ComputeSignedDistanceToPoint(p_WQ, 10.0)
    if len(answers) != 1:
        raise RuntimeError("the shape is left out of the answer")
    return answers[0].distance
