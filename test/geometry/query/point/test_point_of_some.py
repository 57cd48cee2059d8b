"""Distances of a point to some geometries: the rows of the whole answer that are theirs."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    GeometryFrame,
    GeometryId,
    GeometryInstance,
    GeometrySet,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError, RoleError, UnknownIdError


@pytest.fixture(name="world")
def _world():
    """Balls of 0.5 m at x = 0, 2 and 4, the last two on one frame, and a box without a role."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frames = [graph.register_frame(source, GeometryFrame(name)) for name in "ab"]
    balls = []
    for frame, x in ((frames[0], 0.0), (frames[1], 2.0), (frames[1], 4.0)):
        X = np.eye(4)
        X[0, 3] = x
        instance = GeometryInstance(X, Sphere(0.5), f"ball{x:g}")
        instance.set_proximity_properties(ProximityProperties())
        balls.append(graph.register_geometry(source, frame, instance))
    box = graph.register_geometry(
        source, frames[0], GeometryInstance(np.eye(4), Box(1, 1, 1), "box")
    )
    return graph.query_object(graph.create_default_context()), frames, balls, box


def test_only_the_sets_geometries_have_rows(world):
    """By their own ids, and by their frames; a point at x = 7 is 6.5, 4.5 and 2.5 from them."""
    query, frames, balls, _ = world
    q = [7.0, 0.0, 0.0]
    for chosen, wanted in (
        (GeometrySet(balls[1]), {1: 4.5}),
        (GeometrySet(frames[1]), {1: 4.5, 2: 2.5}),
        (GeometrySet(frames[0], balls[2]), {0: 6.5, 2: 2.5}),
        (GeometrySet(), {}),
    ):
        found = query.compute_signed_distance_geometry_to_point(q, chosen)
        assert {each.id_G: each.distance for each in found} == {
            balls[k]: value for k, value in wanted.items()
        }
        whole = {each.id_G: each for each in query.compute_signed_distance_to_point(q)}
        for each in found:
            np.testing.assert_array_equal(each.p_GN, whole[each.id_G].p_GN)
            np.testing.assert_array_equal(each.grad_W, whole[each.id_G].grad_W)


def test_geometries_that_have_no_distance_are_named(world):
    """Those without the role, ids of nothing, and points that are none."""
    query, _, balls, box = world
    ask = query.compute_signed_distance_geometry_to_point
    with pytest.raises(RoleError, match=r"geometry 'box' .* has no proximity role"):
        ask([0.0, 0.0, 0.0], GeometrySet(box))
    with pytest.raises(UnknownIdError):
        ask([0.0, 0.0, 0.0], GeometrySet(GeometryId.get_new_id()))
    with pytest.raises(QueryArgumentError, match="p_WQ"):
        ask([0.0, 0.0], GeometrySet(balls))
    with pytest.raises(TypeError):
        ask([0.0, 0.0, 0.0], [balls[0]])
