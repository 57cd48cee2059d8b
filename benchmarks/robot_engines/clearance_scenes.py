"""Scenes in which clearances are measured: a Panda's cell, the same of what Drake knows, boxes."""

from __future__ import annotations

import numpy as np

from scene_graph_ros.geometry import (
    Box,
    GeometryInstance,
    HalfSpace,
    ProximityProperties,
    Role,
    RoleAssign,
)
from scene_graph_ros.planning import (
    load_robot_diagram,
    RobotDiagram,
    SceneGraphCollisionChecker,
)

__all__ = ["boxes_and_grasp", "cell", "cell_of_hulls"]

_SCENE = "config/scenes/panda_cell.yaml"

_GRASPED = (0.038, 0.038, 0.16)
"""Metres: the edges of the box in the hand."""

_FURNITURE = (
    ((0.57, 0.0, 0.425), (0.74, 1.2, 0.05)),
    ((0.9, 0.56, 0.2), (0.05, 0.05, 0.4)),
    ((0.9, -0.56, 0.2), (0.05, 0.05, 0.4)),
    ((0.24, 0.56, 0.2), (0.05, 0.05, 0.4)),
    ((0.24, -0.56, 0.2), (0.05, 0.05, 0.4)),
    ((-0.05, 0.82, 0.33), (0.66, 0.36, 0.02)),
    ((-0.05, 0.82, 0.63), (0.66, 0.36, 0.02)),
    ((-0.05, 0.82, 0.94), (0.66, 0.36, 0.02)),
    ((-0.05, 0.82, 1.25), (0.66, 0.36, 0.02)),
    ((-0.39, 0.82, 0.63), (0.02, 0.36, 1.26)),
    ((0.29, 0.82, 0.63), (0.02, 0.36, 1.26)),
    ((-0.05, 1.01, 0.63), (0.7, 0.02, 1.26)),
)
"""Centres and edges, metres: a table, its legs, and a shelf of four boards, two sides and back."""

_PLACES = (
    ((0.35, -0.5, 0.45), (0.85, 0.5, 0.45)),
    ((-0.3, 0.7, 0.34), (0.2, 0.9, 0.34)),
    ((-0.3, 0.7, 0.64), (0.2, 0.9, 0.64)),
    ((-0.3, 0.7, 0.95), (0.2, 0.9, 0.95)),
)
"""Corners of where objects stand, metres: the table, and boards of the shelf."""

_OBJECTS = 17


def cell() -> SceneGraphCollisionChecker:
    """Return the Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram(_SCENE))


def cell_of_hulls() -> SceneGraphCollisionChecker:
    """Return the same without what Drake does not measure.

    A mesh is its convex hull, and there is no half space, from which it has no distances of hulls.
    """
    model = load_robot_diagram(_SCENE)
    graph, context = model.scene_graph, model.context
    inspector = context.inspector()
    for geometry in inspector.get_all_geometry_ids(Role.PROXIMITY):
        source = inspector.get_owning_source_id(geometry)
        properties = inspector.get_proximity_properties(geometry)
        if isinstance(inspector.get_shape(geometry), HalfSpace):
            graph.remove_geometry(source, geometry, context=context)
        elif properties is not None and properties.has_property("mesh", "representation"):
            graph.assign_role(
                source, geometry, ProximityProperties(), RoleAssign.REPLACE, context=context
            )
    return SceneGraphCollisionChecker(model)


def boxes_and_grasp(seed: int = 0) -> SceneGraphCollisionChecker:
    """Return the Panda with a box in its hand, among 29 boxes: table, shelf, and what is there."""
    model = load_robot_diagram(_SCENE)
    graph, context, rng = model.scene_graph, model.context, np.random.default_rng(seed)
    inspector = context.inspector()
    links = set(model.frames.values())
    for geometry in inspector.get_all_geometry_ids():
        if inspector.get_frame_id(geometry) not in links:
            source = inspector.get_owning_source_id(geometry)
            graph.remove_geometry(source, geometry, context=context)
    boxes = [(np.array(center), size, 0.0) for center, size in _FURNITURE]
    for k in range(_OBJECTS):
        lower, upper = _PLACES[k % len(_PLACES)]
        size = rng.uniform(0.04, 0.14, 3)
        center = rng.uniform(lower, upper)
        center[2] += 0.5 * size[2]
        boxes.append((center, tuple(size), rng.uniform(0.0, np.pi)))
    source = graph.register_source("boxes", context=context)
    for k, (center, size, yaw) in enumerate(boxes):
        _add_box(model, source, f"box_{k}", center, size, yaw)
    checker = SceneGraphCollisionChecker(model)
    X_HB = np.eye(4)
    X_HB[2, 3] = 0.105
    assert checker.add_collision_shape_to_frame("grasped", "panda_hand", Box(*_GRASPED), X_HB)
    return checker


def _add_box(
    model: RobotDiagram,
    source: object,
    name: str,
    center: np.ndarray,
    size: tuple[float, ...],
    yaw: float,
) -> None:
    X_WB, c, s = np.eye(4), np.cos(yaw), np.sin(yaw)
    X_WB[:2, :2], X_WB[:3, 3] = [[c, -s], [s, c]], center
    box = GeometryInstance(X_WB, Box(*size), name)
    box.set_proximity_properties(ProximityProperties())
    model.scene_graph.register_anchored_geometry(source, box, context=model.context)
