"""Calls that compile the kernels of clouds: queries, and checks and proofs against them."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    HeightField,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
    VoxelGrid,
)
import scene_graph_ros.geometry.query.elements.ask
import scene_graph_ros.geometry.query.elements.pair_entry
import scene_graph_ros.geometry.query.elements.points
import scene_graph_ros.planning.edges.cloud_proofs
import scene_graph_ros.planning.pairs.measured_pairs  # noqa: F401
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.robots.tree_joint import TreeJoint
from scene_graph_ros.robots.tree_kernels import REVOLUTE

__all__ = ["ask_about_clouds"]


def ask_about_clouds() -> None:
    """Ask how far two clouds, a field, two voxels, a robot and a point are from each other."""
    from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker

    graph = SceneGraph()
    source = graph.register_source("warm_up")
    frames = [graph.register_frame(source, GeometryFrame(name)) for name in ("link", "held")]
    still = SceneGraph.world_frame_id()
    for shape, frame in (
        (Sphere(0.1), frames[0]),
        (PointCloud([[3.0, 0.0, 0.0]], 0.1), still),
        (PointCloud([[0.0, 3.0, 0.0]], [0.1]), frames[1]),
        (VoxelGrid([[[1]]], 0.5), still),
        (VoxelGrid([[[1]]], 0.25), frames[1]),
        (HeightField(np.full((2, 2), -3.0), (9.0, 9.0), -4.0), still),
    ):
        instance = GeometryInstance(np.eye(4), shape, shape.type_name)
        instance.set_proximity_properties(ProximityProperties())
        graph.register_geometry(source, frame, instance)
    context = graph.create_default_context()
    query = graph.query_object(context)
    query.compute_signed_distance_pairwise_closest_points()
    query.compute_signed_distance_to_point((0.0, 0.0, 0.0))
    joint = TreeJoint("joint", REVOLUTE, 0, np.eye(4))
    tree = KinematicTree("warm_up", (joint,), ("link",), (1,), np.eye(4)[np.newaxis])
    checker = SceneGraphCollisionChecker(RobotDiagram(graph, context, tree, {"link": frames[0]}))
    q = np.zeros((2, 1))
    checker.find_collisions(q)
    checker.classify_body_collisions(q[0])
    checker.check_edges_collision_free(q[np.newaxis])
