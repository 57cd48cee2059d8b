"""Calls that compile the kernels of cameras."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    Mesh,
    PerceptionProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    DepthRange,
    DepthRenderCamera,
    ExactRenderEngine,
    RenderCameraCore,
)
from scene_graph_ros.geometry.perception.exact.shading import write_pictures
from scene_graph_ros.geometry.perception.exact.view import look
from scene_graph_ros.geometry.perception.image_forms import (
    colors,
    depths,
    millimetres,
    points,
)
from scene_graph_ros.warmup.bodies import FACES, TETRAHEDRON

__all__ = ["render_images"]


def render_images() -> None:
    """Ask for every kind of image of a ball and a mesh, in every form that others read."""
    scene_graph = SceneGraph()
    scene_graph.add_renderer("exact", ExactRenderEngine())
    source = scene_graph.register_source("warm_up")
    for shape in (Sphere(0.1), Mesh(vertices=TETRAHEDRON, faces=FACES)):
        instance = GeometryInstance(np.eye(4), shape, shape.type_name)
        seen = PerceptionProperties()
        if isinstance(shape, Sphere):
            seen.add_property("phong", "diffuse", Rgba(1.0, 1.0, 1.0, 0.5))
        instance.set_perception_properties(seen)
        scene_graph.register_anchored_geometry(source, instance)
    query = scene_graph.query_object(scene_graph.create_default_context())
    lens = CameraIntrinsics.from_fov_y(4, 3, 1.0)
    core = RenderCameraCore("exact", lens, ClippingRange(0.01, 10.0))
    camera = DepthRenderCamera(core, DepthRange(0.01, 10.0))
    color, depth, label = query.render_images(camera, scene_graph.world_frame_id(), np.eye(4))
    assert color is not None
    assert depth is not None
    assert label is not None
    depths(depth)
    millimetres(depth)
    colors(color)
    points(lens, depth, color, label)
    # There is no picture here, whose file it would take Pillow to read.
    view = look(query.snapshot, core, np.eye(4), (1.0, 1.0, 1.0, 1.0))
    write_pictures(view.sensor, view.screen, view.bodies, view.cover, color)
