"""Calls that compile the kernels of deformable contact."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    Box,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
)
import scene_graph_ros.geometry.deformable.query  # noqa: F401 - declares the kernels

__all__ = ["find_deformable_contact"]


def find_deformable_contact() -> None:
    """Ask for the contact of two deformable boxes, a floor and a box."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("warm_up")
    world = scene_graph.world_frame_id()
    soft = []
    for k in range(2):
        instance = GeometryInstance(np.eye(4), Box(0.2 + 0.1 * k, 0.2, 0.2), f"soft_{k}")
        instance.set_proximity_properties(ProximityProperties())
        soft.append(scene_graph.register_deformable_geometry(source, world, instance, 0.1))
    for name, shape in (("floor", HalfSpace()), ("box", Box(0.1, 0.1, 0.1))):
        rigid = GeometryInstance(np.eye(4), shape, name)
        rigid.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, rigid)
    context = scene_graph.create_default_context()
    query = scene_graph.query_object(context)
    context.set_configurations(source, {soft[0]: 0.9 * query.get_configurations_in_world(soft[0])})
    query.compute_deformable_contact()
