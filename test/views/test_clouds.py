"""What pages and viewers are told of clouds, and when."""

import numpy as np

from scene_graph_ros.geometry import (
    GeometryInstance,
    IllustrationProperties,
    PointCloud,
    Role,
    SceneGraph,
)
from scene_graph_ros.views.clouds import (
    balls_in_world,
    cloud_items,
    MOST_DRAWN,
    octahedra_in_world,
    placed_version,
)

X_WG = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])


def scene_of(shape):
    """Return source, cloud and context."""
    graph = SceneGraph()
    source = graph.register_source("camera")
    instance = GeometryInstance(X_WG, shape, "seen")
    instance.set_illustration_properties(IllustrationProperties())
    return (
        source,
        graph.register_anchored_geometry(source, instance),
        graph.create_default_context(),
    )


def test_balls_are_where_the_cloud_has_them():
    """In W, in the order in which they were set."""
    source, cloud, context = scene_of(PointCloud([], 0.25))
    points = np.array([[1.0, 0, 0], [0, 2.0, 0]])
    assert balls_in_world(context.snapshot, cloud)[0].shape == (0, 3)
    context.set_points(source, {cloud: points})
    (centers,) = balls_in_world(context.snapshot, cloud)
    assert centers.tolist() == [[1, 3, 3], [-1, 2, 3]]


def test_pages_draw_octahedra_in_the_balls():
    """The corners of each are on the ball; what is not needed has no size."""
    source, cloud, context = scene_of(PointCloud([[0, 0, 1], [0, 0, 2]], [0.5, 0.25]))
    (item,) = cloud_items(context.inspector(), Role.ILLUSTRATION, [cloud])
    corners = octahedra_in_world(context.snapshot, cloud).reshape(MOST_DRAWN, 6, 3)
    assert item.triangles.max() == 6 * MOST_DRAWN - 1
    for center, radius in (((1, 2, 4), 0.5), ((1, 2, 5), 0.25)):
        away = np.linalg.norm(corners - center, axis=2)
        assert (np.abs(away - radius).max(axis=1) < 1e-12).sum() == 1
    assert (np.ptp(corners[2:], axis=1) == 0.0).all()
    normals = np.cross(*(np.diff(corners[0][item.triangles[:8]], axis=1).transpose(1, 0, 2)[:2]))
    outwards = corners[0][item.triangles[:8]].mean(axis=1) - corners[0].mean(axis=0)
    assert (np.einsum("fi,fi->f", normals, outwards) > 0.0).all()
    context.set_points(source, {cloud: (np.zeros((0, 3)), [])})
    assert (np.ptp(octahedra_in_world(context.snapshot, cloud), axis=0) == 0.0).all()


def test_of_many_balls_some_are_drawn_evenly():
    """Of each place some."""
    rng = np.random.default_rng(1)
    _, cloud, context = scene_of(PointCloud(rng.uniform(-1, 1, (3 * MOST_DRAWN, 3)), 0.01))
    centers = octahedra_in_world(context.snapshot, cloud).reshape(MOST_DRAWN, 6, 3).mean(axis=1)
    octants = (centers > X_WG[:3, 3]) @ [1, 2, 4]
    assert np.bincount(octants, minlength=8).min() > MOST_DRAWN / 16


def test_points_are_told_again_when_they_are_others():
    """Not where another geometry's have changed."""
    source, cloud, context = scene_of(PointCloud([[0, 0, 1]], 0.5))
    before = placed_version(context.snapshot, cloud)
    assert placed_version(context.snapshot, cloud) == before
    context.set_points(source, {cloud: [[0, 0, 1]]})
    assert placed_version(context.snapshot, cloud) != before
