"""Calls that compile the kernels of sensors: points, the self filter, clearing."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception.camera import CameraIntrinsics
from scene_graph_ros.sensing import CloudView, DepthRules, DepthView, SeenPoints, SelfFilter

__all__ = ["look_at_an_image"]


def look_at_an_image() -> None:
    """Look twice at a wall, of which a ball hides a part; likewise at a cloud."""
    graph = SceneGraph()
    source = graph.register_source("warm_up")
    X_WG = np.eye(4)
    X_WG[2, 3] = 0.5
    ball = GeometryInstance(X_WG, Sphere(0.1), "ball")
    ball.set_proximity_properties(ProximityProperties())
    geometry = graph.register_anchored_geometry(source, ball)
    own = SelfFilter(graph.model_inspector(), [geometry])
    own.place({SceneGraph.world_frame_id(): np.eye(4)})
    lens = CameraIntrinsics(8, 8, 8.0, 8.0, 3.5, 3.5)
    depth = np.full((8, 8), 1.0, np.float32)
    depth[3:5, 3:5] = 0.4
    view = DepthView.of(depth, lens, np.eye(4), DepthRules(step=1), own)
    seen = SeenPoints.none().after(view, view.points(), 1, 100)[0]
    seen = seen.after(view, view.points(), 2, 100)[0]
    p_CPs = view.p_CPs.reshape(-1, 3)
    for size in ((1, len(p_CPs)), view.mask.shape):
        cloud = CloudView.of(p_CPs, np.eye(4), DepthRules(), own, size=size)
        seen.after(cloud, cloud.points(), 3, 100)
