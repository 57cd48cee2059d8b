"""Boxes around geometries in the world: closed forms, clouds, and what has none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from soft_bodies import other_configuration, soft_instance, WORLD

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    PointCloud,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import RoleError, UnknownIdError

R = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
RNG = np.random.default_rng(5)
POINTS = RNG.normal(size=(30, 3))


def half_of(shape):
    """Return how far a centred shape reaches along each axis of W, turned by R: closed forms."""
    z = np.abs(R[:, 2])
    if isinstance(shape, Sphere):
        return np.full(3, shape.radius)
    if isinstance(shape, Box):
        return np.abs(R) @ (0.5 * shape.size)
    if isinstance(shape, Capsule):
        return 0.5 * shape.length * z + shape.radius
    if isinstance(shape, Cylinder):
        return 0.5 * shape.length * z + shape.radius * np.sqrt(1.0 - z * z)
    return np.linalg.norm(R * [shape.a, shape.b, shape.c], axis=1)


@pytest.mark.parametrize("far", [0.0, 1e6])
@pytest.mark.parametrize(
    "shape",
    [Sphere(0.3), Box(1, 2, 3), Capsule(0.2, 1), Cylinder(0.3, 2), Ellipsoid(1, 0.5, 2)],
)
def test_boxes_are_those_of_closed_forms(shape, far):
    """In frames that are moved after they were registered."""
    query, (body,) = scene([shape], np.array([0.5, -2.0, far]))
    lower, upper = query.compute_aabb_in_world(body)
    center, half = np.array([0.5, -2.0, far]), half_of(shape)
    slack = 1e-14 * (np.abs(center) + half) * 8.0
    for found, exact, outwards in ((lower, center - half, -1.0), (upper, center + half, 1.0)):
        np.testing.assert_allclose(found, exact, rtol=0.0, atol=slack.max())
        assert (outwards * (found - exact) >= -1e-15 * np.abs(exact)).all()


def scene(shapes, p, *, role=True):
    """Return a query and ids of shapes on a frame at R and p."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frame = graph.register_frame(source, GeometryFrame("f"))
    ids = []
    for k, shape in enumerate(shapes):
        instance = GeometryInstance(np.eye(4), shape, f"g{k}")
        if role:
            instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_geometry(source, frame, instance))
    context = graph.create_default_context()
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    context.set_frame_poses(source, {frame: X})
    return graph.query_object(context), ids


def test_hulls_and_clouds_are_in_the_boxes_of_their_points():
    """With radii; a cloud without points has no box, nor has a half space."""
    p = np.array([1.0, 2.0, 3.0])
    cloud = PointCloud(POINTS, radius=np.linspace(0.0, 0.2, 30))
    query, ids = scene(
        [Convex(vertices=POINTS), cloud, PointCloud(np.zeros((0, 3)), 0.1), HalfSpace()], p
    )
    placed = POINTS @ R.T + p
    lower, upper = query.compute_aabb_in_world(ids[0])
    np.testing.assert_allclose([lower, upper], [placed.min(0), placed.max(0)], atol=1e-12)
    radii = np.linspace(0.0, 0.2, 30)[:, np.newaxis]
    lower, upper = query.compute_aabb_in_world(ids[1])
    expected = [(placed - radii).min(0), (placed + radii).max(0)]
    np.testing.assert_allclose([lower, upper], expected, atol=1e-14)
    assert query.compute_aabb_in_world(ids[2]) is None
    assert query.compute_aabb_in_world(ids[3]) is None
    lower[:] = 0.0
    assert query.compute_aabb_in_world(ids[1])[0].any()


def test_deformable_geometries_have_the_box_of_their_vertices():
    """Where these are now."""
    graph = SceneGraph()
    source = graph.register_source("s")
    pad = graph.register_deformable_geometry(source, WORLD, soft_instance())
    context = graph.create_default_context()
    query = graph.query_object(context)
    lower, upper = query.compute_aabb_in_world(pad)
    np.testing.assert_allclose([lower, upper], [[-0.1] * 3, [0.1] * 3], atol=1e-15)
    q_WG = other_configuration(context, pad)
    context.set_configurations(source, {pad: q_WG})
    found = query.compute_aabb_in_world(pad)
    np.testing.assert_array_equal(found, [q_WG.min(axis=0), q_WG.max(axis=0)])


def test_what_has_no_role_or_is_unknown_is_refused():
    """By its name."""
    query, (body,) = scene([Sphere(1.0)], np.zeros(3), role=False)
    with pytest.raises(RoleError, match=r"geometry 'g0' .* has no proximity role"):
        query.compute_aabb_in_world(body)
    other, (_, second) = scene([Sphere(1.0)] * 2, np.zeros(3))
    with pytest.raises(UnknownIdError):
        query.compute_aabb_in_world(second)
    assert other.compute_aabb_in_world(second) is not None
