"""Scenes of all shapes that the query tests share."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)

_TETRAHEDRON = np.array([[-0.1, -0.1, -0.1], [0.2, 0, -0.1], [0, 0.2, -0.1], [0, 0, 0.2]])
_FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
_SHAPES = [
    Sphere(0.1),
    Capsule(0.07, 0.2),
    Box(0.2, 0.15, 1 / 3),
    Cylinder(0.1, 0.2),
    Ellipsoid(0.1, 0.15, 0.2),
    Convex(vertices=_TETRAHEDRON),
    Mesh(vertices=_TETRAHEDRON, faces=_FACES, scale=(1.0, -1.0, 1.5)),
]


class AllShapes(SimpleNamespace):
    """A scene with seven shapes on frames each, ``copies`` times, and a floor."""

    def scatter(self, seed, *, side=0.6):
        """Give every frame a random pose."""
        n = len(self.frames)
        X = np.tile(np.eye(4), (n, 1, 1))
        rng = np.random.default_rng(seed)
        X[:, :3, :3] = Rotation.random(n, rng=rng).as_matrix()
        X[:, :3, 3] = rng.uniform(-side / 2, side / 2, (n, 3))
        self.context.set_frame_poses(self.source, X)


@pytest.fixture(name="make_scene")
def _make_scene():
    def make(copies=2, *, floor=True):
        graph = SceneGraph()
        source = graph.register_source("test")
        frames, ids = [], []
        for k, shape in enumerate(copies * _SHAPES):
            frame = graph.register_frame(source, GeometryFrame(f"frame_{k}"))
            instance = GeometryInstance(np.eye(4), shape, f"geometry_{k}")
            ids.append(graph.register_geometry(source, frame, instance))
            graph.assign_role(source, ids[-1], ProximityProperties())
            frames.append(frame)
        if floor:
            X_WG = np.eye(4)
            X_WG[2, 3] = -0.2
            instance = GeometryInstance(X_WG, HalfSpace(), "floor")
            ids.append(graph.register_anchored_geometry(source, instance))
            graph.assign_role(source, ids[-1], ProximityProperties())
        context = graph.create_default_context()
        return AllShapes(
            graph=graph,
            source=source,
            frames=frames,
            ids=ids,
            context=context,
            query=graph.query_object(context),
        )

    return make
