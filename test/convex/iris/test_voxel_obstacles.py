"""Voxel grids as obstacles of regions: all that is solid is in their sets."""

import numpy as np
import pytest

from scene_graph_ros.convex.iris.scene_obstacles import scene_obstacles
from scene_graph_ros.convex.iris.voxel_obstacles import count_voxel_sets, MOST_RUNS
from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph, VoxelGrid


@pytest.mark.parametrize(("counts", "part"), [((6, 5, 7), 0.2), ((20, 20, 20), 0.4)])
def test_what_is_solid_is_in_a_set(counts, part):
    """Runs along z, and nothing else; or boxes around blocks where there are many."""
    rng = np.random.default_rng(1)
    states = (rng.random(counts) < part).astype(int)
    graph = SceneGraph()
    source = graph.register_source("map")
    X_WG = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
    instance = GeometryInstance(X_WG, VoxelGrid([[[0]]], 0.1), "map")
    instance.set_proximity_properties(ProximityProperties())
    geometry = graph.register_anchored_geometry(source, instance)
    context = graph.create_default_context()
    context.set_voxels(source, {geometry: states})
    query = graph.query_object(context)
    sets = [each.convex_set for each in scene_obstacles(query)]
    assert len(sets) == count_voxel_sets(context.snapshot.voxel_set(geometry))
    is_exact = len(sets) != 27
    assert len(sets) <= MOST_RUNS
    p_G = rng.uniform(-0.05, np.array(counts) * 0.1 + 0.05, (40, 3))
    p_W = p_G @ X_WG[:3, :3].T + X_WG[:3, 3]
    distances = query.compute_signed_distance_to_points(p_W).distance
    for point, distance in zip(p_W, distances, strict=True):
        is_in = any(each.point_in_set(point, 1e-9) for each in sets)
        if distance < -1e-9:
            assert is_in
        elif is_exact and distance > 1e-6:
            assert not is_in
    assert 0 < (distances < 0.0).sum() < 40
