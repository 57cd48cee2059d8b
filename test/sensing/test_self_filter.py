"""Cells around bodies decide as the distance of each point does."""

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.spatial.poses import pose_from_xyz_rpy
from scene_graph_ros.sensing import SelfFilter
from scene_graph_ros.sensing.near_cells import NEAR, UNSURE

TETRAHEDRON = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def bodies(scale, at):
    """Return a filter of bodies on two frames, one a mesh of triangles, in place, and centres."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    frames = [graph.register_frame(source, GeometryFrame(name)) for name in ("arm", "hand")]
    faces = ProximityProperties()
    add_rigid_hydroelastic_properties(faces, resolution_hint=1.0)
    mesh = Mesh(vertices=0.3 * scale * CORNERS, faces=TETRAHEDRON)
    shapes = [
        (frames[0], Capsule(0.06 * scale, 0.4 * scale), ProximityProperties()),
        (frames[0], Box(0.2 * scale, 0.1 * scale, 0.3 * scale), ProximityProperties()),
        (frames[1], Sphere(0.1 * scale), ProximityProperties()),
        (frames[1], Ellipsoid(0.3 * scale, 0.02 * scale, 0.1 * scale), ProximityProperties()),
        (frames[1], mesh, ProximityProperties()),
        (frames[1], mesh, faces),
    ]
    ids, rng = [], np.random.default_rng(1)
    for k, (frame, shape, properties) in enumerate(shapes):
        X_FG = pose_from_xyz_rpy(0.2 * scale * rng.normal(size=3), rng.normal(size=3))
        instance = GeometryInstance(X_FG, shape, f"body_{k}")
        instance.set_proximity_properties(properties)
        ids.append(graph.register_geometry(source, frame, instance))
    own = SelfFilter(graph.model_inspector(), ids)
    X_WF = {frame: pose_from_xyz_rpy(at, rng.normal(size=3)) for frame in frames}
    own.place(X_WF)
    return own


@pytest.mark.parametrize("padding", [0.0, 0.002, 0.03, 0.5])
@pytest.mark.parametrize(
    ("scale", "at"), [(1.0, (0.3, -1.0, 2.0)), (1e-3, (0, 0, 0)), (1e3, (9e4, 0, 0))]
)
def test_points_are_near_where_their_distance_says_so(padding, scale, at):
    """Also on surfaces, at the padding itself and far away; again, when cells are known."""
    own, padding = bodies(scale, at), padding * scale
    rng = np.random.default_rng(3)
    points = np.array(at) + 0.4 * scale * rng.normal(size=(4000, 3))
    # From each point to where its distance is the padding, a hair more, or less.
    found = own._graph.query_object(own._context).compute_signed_distance_to_points(points)
    first = np.unique(found.point, return_index=True)[1]
    hair = scale * rng.choice([0.0, 1e-6, -1e-6], len(first))[:, np.newaxis]
    on = points[found.point[first]]
    on = on + found.grad_W[first] * (padding - found.distance[first, np.newaxis] + hair)
    points = np.concatenate([points, on])
    expected = own.has(points, padding)
    assert 0.05 < expected.mean() < 0.99
    for _ in range(2):
        np.testing.assert_array_equal(own.near(points, padding), expected)
    np.testing.assert_array_equal(own.near(points, 2 * padding), own.has(points, 2 * padding))


def test_most_points_of_a_surface_need_no_distance():
    """All those of a ball's surface are in cells that are near, so that nothing is left unsure."""
    graph = SceneGraph()
    source = graph.register_source("robot")
    instance = GeometryInstance(pose_from_xyz_rpy([1, 2, 3]), Sphere(0.1), "ball")
    instance.set_proximity_properties(ProximityProperties())
    own = SelfFilter(graph.model_inspector(), [graph.register_anchored_geometry(source, instance)])
    own.place({SceneGraph.world_frame_id(): np.eye(4)})
    rays = np.random.default_rng(0).normal(size=(5000, 3))
    rays /= np.linalg.norm(rays, axis=1)[:, np.newaxis]
    assert own.near([1, 2, 3] + 0.1 * rays, 0.02).all()
    states = own._cells_for(0.02).states
    assert (states == NEAR).any()
    assert not (states == UNSURE).any()
    assert not own.near([1, 2, 3] + 0.1201 * rays, 0.02).any()


def test_a_filter_of_nothing_has_no_points():
    """Neither has one that is asked about no points."""
    none = SelfFilter(SceneGraph().model_inspector(), [])
    none.place({})
    assert not none.near(np.zeros((3, 3)), 0.1).any()
    assert bodies(1.0, (0, 0, 0)).near(np.empty((0, 3)), 0.1).shape == (0,)
