"""Seeded scenes for benchmarks: mixed shapes at a given fill, with many sets of poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

__all__ = ["MixedScene", "Ours"]

_CORNERS = 12


@dataclass(frozen=True)
class MixedScene:
    """Shapes and ``(m, n, 4, 4)`` poses in a cube that the shapes fill to a given part."""

    shapes: list[object]
    poses: np.ndarray

    @classmethod
    def make(cls, n: int, fill: float, pose_sets: int, seed: int) -> MixedScene:
        """Draw ``n`` shapes of 10 to 30 cm, evenly from six kinds, and their poses."""
        rng = np.random.default_rng(seed)
        shapes = [_draw_shape(rng, k % 6) for k in range(n)]
        side = (sum(_volume(shape) for shape in shapes) / fill) ** (1.0 / 3.0)
        poses = np.tile(np.eye(4), (pose_sets, n, 1, 1))
        q = rng.normal(size=(pose_sets, n, 4))
        q /= np.linalg.norm(q, axis=-1, keepdims=True)
        poses[..., :3, :3] = _rotations(q)
        poses[..., :3, 3] = rng.uniform(0.0, side, (pose_sets, n, 3))
        return cls(shapes, poses)


def _draw_shape(rng: np.random.Generator, kind: int) -> object:
    a, b, c = rng.uniform(0.1, 0.3, 3)
    if kind == 0:
        return Sphere(a / 2)
    if kind == 1:
        return Box(a, b, c)
    if kind == 2:
        return Capsule(a / 3, b)
    if kind == 3:
        return Cylinder(a / 2, b)
    if kind == 4:
        return Ellipsoid(a / 2, b / 2, c / 2)
    directions = rng.normal(size=(_CORNERS, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Convex(vertices=directions * (a / 2))


def _volume(shape: object) -> float:
    """Return the volume; of a hull, that of the ball through its corners, halved."""
    if isinstance(shape, Convex):
        return 2.0 / 3.0 * np.pi * float(np.linalg.norm(shape.vertices[0])) ** 3
    return shape.volume()


def _rotations(q: np.ndarray) -> np.ndarray:
    """Return (..., 3, 3) rotations of unit quaternions (..., 4) in the order x, y, z, w."""
    v, w = q[..., :3], q[..., 3]
    cross = np.zeros((*q.shape[:-1], 3, 3))
    cross[..., 0, 1], cross[..., 0, 2] = -v[..., 2], v[..., 1]
    cross[..., 1, 0], cross[..., 1, 2] = v[..., 2], -v[..., 0]
    cross[..., 2, 0], cross[..., 2, 1] = -v[..., 1], v[..., 0]
    return np.eye(3) + 2.0 * (w[..., None, None] * cross + cross @ cross)


class Ours:
    """The scene in a ``SceneGraph``, one frame per shape."""

    name = "scene_graph_ros"

    def __init__(self, scene: MixedScene) -> None:
        self._poses = scene.poses
        graph = SceneGraph()
        self._source = graph.register_source("benchmark")
        for k, shape in enumerate(scene.shapes):
            frame = graph.register_frame(self._source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
            geometry = graph.register_geometry(self._source, frame, instance)
            graph.assign_role(self._source, geometry, ProximityProperties())
        self._context = graph.create_default_context()
        self.query = graph.query_object(self._context)

    def move(self, k: int) -> None:
        """Give every frame a new pose."""
        self._context.set_frame_poses(self._source, self._poses[k % len(self._poses)])

    def candidates(self) -> int:
        """Return the number of pairs that the broadphase keeps."""
        return len(self.query.find_collision_candidates())

    def penetrations(self) -> int:
        """Return the number of pairs that overlap."""
        return len(self.query.compute_point_pair_penetration())

    def distances(self, max_distance: float) -> int:
        """Return the number of pairs nearer than ``max_distance`` (metres)."""
        return len(self.query.compute_signed_distance_pairwise_closest_points(max_distance))
