"""Our own queries."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.speed.scenes import Scene, WORLD
from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    CollisionFilterDeclaration,
    GeometryFrame,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
)

__all__ = ["Ours"]


class Ours:
    """The scene in a ``SceneGraph``."""

    name = "scene_graph_ros"

    def __init__(self, scene: Scene) -> None:
        graph = SceneGraph()
        self._source = source = graph.register_source("benchmark")
        frames = [
            graph.register_frame(source, GeometryFrame(f"frame_{k}")) for k in range(scene.frames)
        ]
        ids = []
        self._frame_of: dict[int, int] = {}
        for k, body in enumerate(scene.bodies):
            instance = GeometryInstance(body.X_FG, body.shape, f"geometry_{k}")
            if body.frame == WORLD:
                geometry = graph.register_anchored_geometry(source, instance)
            else:
                geometry = graph.register_geometry(source, frames[body.frame], instance)
            graph.assign_role(source, geometry, _properties(scene))
            ids.append(geometry)
            self._frame_of[int(geometry)] = body.frame
        declaration = CollisionFilterDeclaration()
        for f, g in sorted(scene.excluded):
            declaration.exclude_between(GeometrySet(frames[f]), GeometrySet(frames[g]))
        graph.collision_filter_manager().apply(declaration)
        self.context = graph.create_default_context()
        self.query = graph.query_object(self.context)
        self._X_WFs = scene.X_WF

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """See Engine: the sets are taken as they are."""
        del max_distance
        self._X_WFs = X_WFs

    def move(self, k: int) -> None:
        """See Engine."""
        self.context.set_frame_poses(self._source, self._X_WFs[k % len(self._X_WFs)])

    def candidates(self) -> Any:
        """Return the pairs whose boxes meet."""
        return self.query.find_collision_candidates()

    def penetrations(self) -> Any:
        """Return all penetrating pairs."""
        return self.query.compute_point_pair_penetration()

    def distances(self, max_distance: float) -> Any:
        """Return the pairs nearer than ``max_distance`` (m), exactly."""
        return self.query.compute_signed_distance_pairwise_closest_points(max_distance)

    def collides(self) -> Any:
        """Tell whether anything collides."""
        return self.query.has_collisions()

    def points(self, p_WQs: np.ndarray) -> Any:
        """Return the distances of points (m, 3) to all bodies."""
        if len(p_WQs) == 1:
            return self.query.compute_signed_distance_to_point(p_WQs[0])
        return self.query.compute_signed_distance_to_points(p_WQs)

    def surfaces(self, representation: str) -> Any:
        """Return all contact surfaces as triangles or polygons."""
        return self.query.compute_contact_surfaces(representation)

    def faces(self, result: Any) -> int:
        """See Engine."""
        return int(result.num_faces.sum())

    def count(self, row: str, result: Any) -> int:
        """See Engine."""
        return int(result) if row == "collides" else len(result)

    def colliding_frames(self, X_WF: np.ndarray) -> np.ndarray:
        """Return one frame of each colliding pair at poses (f, 4, 4)."""
        self.context.set_frame_poses(self._source, X_WF)
        return np.unique([self._frame_of[i] for i in self.penetrations().id_A]).astype(int)


def _properties(scene: Scene) -> ProximityProperties:
    properties = ProximityProperties()
    if scene.compliance is not None:
        add_compliant_hydroelastic_properties(properties, *scene.compliance)
    return properties
