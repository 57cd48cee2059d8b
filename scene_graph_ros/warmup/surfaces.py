"""Calls that compile the kernels of contact surfaces."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    Convex,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
import scene_graph_ros.geometry.hydroelastic.query  # noqa: F401 - declares the kernels
from scene_graph_ros.warmup.bodies import TETRAHEDRON

__all__ = ["find_surfaces"]


def find_surfaces() -> None:
    """Ask for contact surfaces as triangles and as polygons."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    soft, hard = ProximityProperties(), ProximityProperties()
    add_compliant_hydroelastic_properties(soft, 0.1, 1e6)
    add_rigid_hydroelastic_properties(hard, 0.1)
    bodies = [
        (Box(0.1, 0.2, 0.3), soft),
        (Convex(vertices=TETRAHEDRON), soft),
        (Sphere(0.1), hard),
    ]
    for k, (shape, properties) in enumerate(bodies):
        frame = scene_graph.register_frame(source, GeometryFrame(f"frame_{k}"))
        instance = GeometryInstance(np.eye(4), shape, f"body_{k}")
        instance.set_proximity_properties(properties)
        scene_graph.register_geometry(source, frame, instance)
    query = scene_graph.query_object(scene_graph.create_default_context())
    surfaces = query.compute_contact_surfaces()
    surfaces.grad_pressure_M_W  # noqa: B018
    query.compute_contact_surfaces("polygon")
