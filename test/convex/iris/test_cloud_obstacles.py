"""Clouds as obstacles of regions: sets that hold every ball, and none that is far from all."""

import numpy as np
import pytest

from scene_graph_ros.convex.iris.cloud_obstacles import MOST_BALLS
from scene_graph_ros.geometry import (
    GeometryInstance,
    PointCloud,
    ProximityProperties,
    QueryObject,
    SceneGraph,
)
from scene_graph_ros.geometry.optimization import (
    find_region_cuts,
    HPolyhedron,
    make_iris_obstacles,
)


def query_of(points, radius, X_WG):
    """Return a query object of one cloud, and the cloud."""
    graph = SceneGraph()
    source = graph.register_source("camera")
    instance = GeometryInstance(X_WG, PointCloud(points, radius), "seen")
    instance.set_proximity_properties(ProximityProperties())
    cloud = graph.register_anchored_geometry(source, instance)
    return QueryObject(graph.create_default_context()), cloud


@pytest.mark.parametrize("radius", [0.02, 0.0])
@pytest.mark.parametrize("count", [5, MOST_BALLS + 3])
def test_every_ball_is_in_a_set(count, radius):
    """Its centre and its border, wherever the cloud is."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.0, 1.0, (count, 3))
    X_WG = np.eye(4)
    X_WG[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    X_WG[:3, 3] = (1.0, 2.0, 3.0)
    query, _ = query_of(points, radius, X_WG)
    sets = make_iris_obstacles(query)
    assert len(sets) <= max(count, 1) if count <= MOST_BALLS else len(sets) == -(-count // 8)
    for p in (points @ X_WG[:3, :3].T + X_WG[:3, 3])[:20]:
        border = p + radius * (1.0 - 1e-12) * np.array([0.6, 0.0, 0.8])
        for each in (p, border):
            assert any(one.point_in_set(each, 1e-12) for one in sets)
    far = np.array([9.0, 9.0, 9.0])
    assert not any(one.point_in_set(far) for one in sets)


def test_regions_are_cut_by_balls():
    """By those that reach into them, of the cloud that they are of."""
    query, cloud = query_of([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]], 0.5, np.eye(4))
    reached = HPolyhedron.make_box([0.4, -1.0, -1.0], [2.0, 1.0, 1.0])
    (cut,) = find_region_cuts(reached, query)
    assert cut.geometry_id == cloud
    assert cut.depth == pytest.approx(0.1, abs=1e-9)
    assert not find_region_cuts(HPolyhedron.make_box([0.6, -1, -1], [4.4, 1, 1]), query)
