"""A user's module about a cell: the core alone."""

from collections.abc import Sequence

import numpy as np

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    QueryObject,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.scene_files import load_scene


def build() -> tuple[SceneGraph, GeometryId]:
    """Make a ball above a floor."""
    scene_graph = SceneGraph()
    source = scene_graph.register_source("robot")
    link = scene_graph.register_frame(source, GeometryFrame("link"))
    ball = GeometryInstance(np.eye(4), Sphere(0.1), "ball")
    ball_id = scene_graph.register_geometry(source, link, ball)
    scene_graph.assign_role(source, ball_id, ProximityProperties())
    floor = GeometryInstance(np.eye(4), HalfSpace(), "floor")
    scene_graph.register_anchored_geometry(source, floor)
    return scene_graph, ball_id


def deepest(query: QueryObject) -> tuple[float, list[str]]:
    """Return the largest depth, and what touches."""
    table = query.compute_point_pair_penetration()
    names = [table.name_of(pair.id_A.get_value()) for pair in table]
    return float(table.depth.max(initial=0.0)), names


def free(query: QueryObject, poses: Sequence[np.ndarray]) -> list[bool]:
    """Tell of many poses of the first frame whether nothing touches."""
    frame = query.inspector().get_all_frame_ids()[1]
    touching: list[bool] = query.ask_what_if(
        [{frame: X_WF} for X_WF in poses], QueryObject.has_collisions
    )
    return [not each for each in touching]


def count(path: str) -> int:
    """Count the geometries of a scene file."""
    scene_graph = SceneGraph()
    loaded = load_scene(path).apply(scene_graph)
    return len(loaded.geometries)
