"""A ball of radius 0 is a point: pair queries and point queries say the same of it."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    Sphere,
)

BOUND = 1e-13
"""Metres: rounding of two ways to the same distance of shapes of about 0.3 m."""

POINTS = [(0.0, 0.0, 0.0), (0.013, 0.02, -0.01), (0.5, 0.4, 0.3), (0.0, 0.0, 0.1)]


@pytest.mark.parametrize("p_WQ", POINTS)
def test_distance_of_a_ball_without_radius_is_that_of_its_centre(make_scene, p_WQ):
    """Inside, outside and on the surface of every shape, with a unit normal and no collision."""
    scene = make_scene(copies=1)
    frame = scene.graph.register_frame(scene.source, GeometryFrame("point"))
    instance = GeometryInstance(np.eye(4), Sphere(0.0), "point")
    instance.set_proximity_properties(ProximityProperties())
    point = scene.graph.register_geometry(scene.source, frame, instance)
    context = scene.graph.create_default_context()
    X_WQ = np.eye(4)
    X_WQ[:3, 3] = p_WQ
    context.set_frame_pose(scene.source, frame, X_WQ)
    query = scene.graph.query_object(context)

    expected = {r.id_G: r.distance for r in query.compute_signed_distance_to_point(p_WQ)}
    assert expected.pop(point) == 0.0
    penetrating = {r.id_A for r in query.compute_point_pair_penetration() if r.id_B == point}
    for geometry, distance in expected.items():
        pair = query.compute_signed_distance_pair_closest_points(geometry, point)
        assert abs(pair.distance - distance) < BOUND
        assert abs(np.linalg.norm(pair.nhat_BA_W) - 1.0) < BOUND
        assert (geometry in penetrating) == (pair.distance < -BOUND)


def test_two_points_in_one_place_touch(make_scene):
    """Their distance is zero, the normal a choice, and it is no collision."""
    scene = make_scene(copies=0, floor=False)
    balls = []
    for name in ("a", "b"):
        frame = scene.graph.register_frame(scene.source, GeometryFrame(name))
        instance = GeometryInstance(np.eye(4), Sphere(0.0), name)
        instance.set_proximity_properties(ProximityProperties())
        balls.append(scene.graph.register_geometry(scene.source, frame, instance))
    query = scene.graph.query_object(scene.graph.create_default_context())
    pair = query.compute_signed_distance_pair_closest_points(*balls)
    assert pair.distance == 0.0
    assert not pair.is_nhat_BA_W_unique
    assert np.linalg.norm(pair.nhat_BA_W) == pytest.approx(1.0)
    assert not query.has_collisions()
