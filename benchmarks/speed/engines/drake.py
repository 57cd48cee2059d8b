"""Drake's SceneGraph by way of pydrake, with one context."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from benchmarks.peer_shapes import drake_shape, hull_triangles
from benchmarks.speed.scenes import Scene, WORLD
from scene_graph_ros.geometry import Mesh

__all__ = ["Drake"]

MAX_SIZE = 5000
"""Bodies. Larger scenes take minutes to set up."""


class Drake:
    """``pydrake.geometry.QueryObject``; poses go in as one FramePoseVector."""

    name = "Drake"

    def __init__(self, scene: Scene) -> None:
        if scene.size > MAX_SIZE:
            raise NotImplementedError(
                f"registering {scene.size} bodies takes minutes: the time per body grows with"
                " their number"
            )
        self._drake: Any = importlib.import_module("pydrake.geometry")
        self._math: Any = importlib.import_module("pydrake.math")
        drake = self._drake
        self._graph = drake.SceneGraph()
        source = self._graph.RegisterSource("benchmark")
        self._frames = [
            self._graph.RegisterFrame(source, drake.GeometryFrame(f"frame_{k}"))
            for k in range(scene.frames)
        ]
        for k, body in enumerate(scene.bodies):
            X_FG = self._math.RigidTransform(body.X_FG)
            shape = self._shape(body.shape)
            instance = drake.GeometryInstance(X_FG, shape, f"geometry_{k}")
            properties = drake.ProximityProperties()
            if scene.compliance is not None:
                drake.AddCompliantHydroelasticProperties(*scene.compliance, properties)
            instance.set_proximity_properties(properties)
            if body.frame == WORLD:
                self._graph.RegisterAnchoredGeometry(source, instance)
            else:
                self._graph.RegisterGeometry(source, self._frames[body.frame], instance)
        declaration = drake.CollisionFilterDeclaration()
        for f, g in sorted(scene.excluded):
            pair = (drake.GeometrySet(self._frames[f]), drake.GeometrySet(self._frames[g]))
            declaration.ExcludeBetween(*pair)
        self._graph.collision_filter_manager().Apply(declaration)
        self._context = self._graph.CreateDefaultContext()
        self._port = self._graph.get_source_pose_port(source)
        self.choose(scene.X_WF, 0.0)
        self.move(0)
        # The query object stays bound to the context and sees its later poses.
        self._query = self._graph.get_query_output_port().Eval(self._context)

    def _shape(self, shape: Any) -> Any:
        """Return Drake's shape; between bodies a mesh stands for its hull, as it does here."""
        if isinstance(shape, Mesh):
            return self._drake.Convex(points=hull_triangles(shape)[0].T, label="mesh")
        return drake_shape(shape)

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine."""
        del max_distance
        self._sets = [self._pose_vector(X_WF) for X_WF in X_WFs]

    def _pose_vector(self, X_WF: np.ndarray) -> Any:
        result = self._drake.FramePoseVector()
        for frame, X in zip(self._frames, X_WF, strict=True):
            result.set_value(frame, self._math.RigidTransform(X))
        return result

    def move(self, k: int) -> None:
        """See Engine."""
        self._port.FixValue(self._context, self._sets[k % len(self._sets)])

    def candidates(self) -> Any:
        """Return the pairs whose boxes meet."""
        return self._query.FindCollisionCandidates()

    def penetrations(self) -> Any:
        """Return all penetrating pairs."""
        return self._query.ComputePointPairPenetration()

    def distances(self, max_distance: float) -> Any:
        """Return the pairs nearer than ``max_distance`` (m)."""
        return self._query.ComputeSignedDistancePairwiseClosestPoints(max_distance)

    def collides(self) -> Any:
        """Tell whether anything collides."""
        return self._query.HasCollisions()

    def points(self, p_WQs: np.ndarray) -> Any:
        """Ask for the distances of points (m, 3) to all bodies, one by one; count the answers."""
        ask = self._query.ComputeSignedDistanceToPoint
        return sum(len(ask(p_WQ, np.inf)) for p_WQ in p_WQs)

    def surfaces(self, representation: str) -> Any:
        """Return all contact surfaces as triangles or polygons."""
        kinds = self._drake.HydroelasticContactRepresentation
        kind = kinds.kTriangle if representation == "triangle" else kinds.kPolygon
        return self._query.ComputeContactSurfaces(kind)

    def faces(self, result: Any) -> int:
        """See Engine."""
        return sum(surface.num_faces() for surface in result)

    def count(self, row: str, result: Any) -> int:
        """See Engine."""
        return int(result) if row in ("collides", "point", "points") else len(result)
