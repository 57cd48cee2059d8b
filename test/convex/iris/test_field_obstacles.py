"""Height fields as obstacles of regions: all of a field is in its sets."""

import numpy as np
import pytest

from scene_graph_ros.convex.iris.field_obstacles import count_sets
from scene_graph_ros.convex.iris.scene_obstacles import scene_obstacles
from scene_graph_ros.geometry import (
    GeometryInstance,
    HeightField,
    ProximityProperties,
    SceneGraph,
)


@pytest.mark.parametrize(("rows", "sets"), [(5, 48), (30, 20)])
def test_what_is_in_a_field_is_in_a_set(rows, sets):
    """Its prisms, or boxes around blocks of them where these are many."""
    rng = np.random.default_rng(1)
    field = HeightField(np.zeros((rows, 7 if rows == 5 else 36)), (2.0, 1.0), -0.5)
    heights = rng.uniform(0.0, 0.5, field.heights.shape)
    graph = SceneGraph()
    source = graph.register_source("map")
    X_WG = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    instance = GeometryInstance(X_WG, field, "ground")
    instance.set_proximity_properties(ProximityProperties())
    ground = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    context.set_heights(source, {ground: heights})
    query = graph.query_object(context)
    obstacles = [each.convex_set for each in scene_obstacles(query)]
    assert len(obstacles) == count_sets(field) == sets
    points = rng.uniform([-1.1, -0.6, -0.6], [1.1, 0.6, 0.6], (60, 3)) @ X_WG[:3, :3].T
    points += X_WG[:3, 3]
    distances = query.compute_signed_distance_to_points(points).distance
    for point, distance in zip(points, distances, strict=True):
        is_in = any(each.point_in_set(point, 1e-9) for each in obstacles)
        if distance < -1e-9:
            assert is_in
        elif rows == 5 and distance > 1e-6:
            assert not is_in
    assert 0 < (distances < 0.0).sum() < 60
