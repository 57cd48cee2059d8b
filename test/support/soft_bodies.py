"""Deformable geometries for tests of the model."""

import numpy as np

from scene_graph_ros.geometry import Box, GeometryInstance, ProximityProperties, SceneGraph

WORLD = SceneGraph.world_frame_id()
TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
QUARTER = np.array([[0.0, -1, 0, 3], [1, 0, 0, 4], [0, 0, 1, 5], [0, 0, 0, 1]])


def soft_instance(name="pad", shape=None, X=None, roles=(ProximityProperties,)):
    """Return an instance with some roles."""
    result = GeometryInstance(
        np.eye(4) if X is None else X, Box(0.2, 0.2, 0.2) if shape is None else shape, name
    )
    for properties in roles:
        result.set_properties(properties())
    return result


def other_configuration(context, pad):
    """Return positions that differ from the present ones in every number."""
    return 2.0 * context.configuration(pad) + np.arange(context.configuration(pad).size).reshape(
        -1, 3
    )
