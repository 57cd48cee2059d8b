"""Voxel grids as values: what is taken, what is refused, and equality; runs and surfaces."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
    Voxel,
    VoxelGrid,
)
from scene_graph_ros.geometry.errors import InvalidConfigurationError, InvalidShapeError
from scene_graph_ros.geometry.shapes.voxel_grid import MOST_VOXELS
from scene_graph_ros.geometry.shapes.voxel_runs import from_runs, to_runs
from scene_graph_ros.geometry.shapes.voxel_surface import voxel_triangles

STATES = np.array([[[0, 1], [2, 0]], [[0, 0], [1, 1]], [[2, 2], [2, 0]]])


def test_a_grid_has_a_copy_that_nobody_can_change():
    """Of whole numbers or truth values; equal by all that it is made of."""
    given = STATES.copy()
    grid = VoxelGrid(given, 0.02)
    given[:] = 0
    assert (grid.occupancy == STATES).all()
    assert grid.occupancy.dtype == np.uint8
    with pytest.raises(ValueError, match="read-only"):
        grid.occupancy[0, 0, 0] = 1
    assert grid == VoxelGrid(STATES, 0.02) == pickle.loads(pickle.dumps(grid))
    assert hash(grid) == hash(VoxelGrid(STATES, 0.02))
    others = VoxelGrid(STATES, 0.03), VoxelGrid(STATES, 0.02, unknown_is_free=True), Sphere(1.0)
    assert all(grid != other for other in others)
    assert repr(others[1]) == "VoxelGrid(3x2x2, voxel=0.02, unknown_is_free=True)"
    assert (VoxelGrid(STATES == Voxel.OCCUPIED, 1).occupancy == (STATES == 1)).all()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((STATES[0], 0.1), r"occupancy must be \(nx, ny, nz\), not \(2, 2\)"),
        (([[[0], [1, 2]]], 0.1), "occupancy must be whole numbers"),
        ((0.5 * STATES, 0.1), "occupancy must be whole numbers"),
        ((3 * STATES, 0.1), r"occupancy\[0, 0, 1\] must be 0 \(free\).*not 3"),
        ((-STATES, 0.1), r"occupancy\[0, 0, 1\] must be 0 \(free\).*not -1"),
        ((STATES, 0.0), "voxel must be an edge from 1e-09 m to 1e\\+09 m, not 0.0"),
        ((STATES, float("nan")), "voxel must be an edge"),
        ((STATES, "wide"), "voxel must be an edge from .* not 'wide'"),
        ((STATES, 5e8), "at most 1e\\+09 m long along each axis, not 3 voxels"),
        ((np.broadcast_to(np.uint8(0), (2**10, 2**10, 2**9)), 0.1), f"at most {MOST_VOXELS}"),
    ],
)
def test_what_is_no_grid_is_refused_by_the_name_of_its_part(arguments, told):
    """The value, and which one of many, is told."""
    with pytest.raises(InvalidShapeError, match=told):
        VoxelGrid(*arguments)


def test_unknown_is_free_must_be_a_truth_value():
    """Nothing else is taken for one."""
    with pytest.raises(InvalidShapeError, match="unknown_is_free must be True or False, not 1"):
        VoxelGrid(STATES, 0.1, unknown_is_free=1)


def test_voxels_are_set_whole_or_not_at_all():
    """One grid of two is refused: both keep their voxels, and the errors name what is wrong."""
    graph = SceneGraph()
    source = graph.register_source("map")
    ids = []
    for name, shape in (("one", VoxelGrid(STATES, 1)), ("two", VoxelGrid(STATES, 1))):
        instance = GeometryInstance(np.eye(4), shape, name)
        instance.set_proximity_properties(ProximityProperties())
        ids.append(graph.register_anchored_geometry(source, instance))
    ball = graph.register_anchored_geometry(
        source, GeometryInstance(np.eye(4), Sphere(1.0), "ball")
    )
    context = graph.create_default_context()
    with pytest.raises(InvalidConfigurationError, match=r"'two' of source 'map'.*\[0, 0, 0\]"):
        context.set_voxels(source, {ids[0]: STATES[:1], ids[1]: STATES + 9})
    assert (context.voxels(ids[0]) == STATES).all()
    with pytest.raises(InvalidConfigurationError, match="is a Sphere, whose voxels can't be set"):
        context.set_voxels(source, {ball: STATES})
    with pytest.raises(InvalidConfigurationError, match="is a Sphere, which has no voxels"):
        context.voxels(ball)
    assert graph.model_inspector().get_all_voxel_grid_ids() == ids


def test_runs_are_the_same_voxels_again():
    """Also of none; runs that are no voxels are refused."""
    for states in (STATES, np.zeros((0, 3, 2), int), np.full((4, 1, 1), 2)):
        occupancy = VoxelGrid(states, 1).occupancy
        runs = to_runs(occupancy)
        assert (np.diff(runs[:, 0]) != 0).all()
        assert (from_runs(occupancy.shape, runs) == occupancy).all()
    for counts, runs, told in (
        ((2, 2), [[0, 4]], "three whole numbers"),
        ((2, 2, -1), [[0, 4]], "three whole numbers"),
        ((2, 2, 1e9), [[0, 4]], "three whole numbers whose product"),
        ((2**8, 2**8, 2**8 + 1), [[0, 2**24 + 2**16]], "at most 16777216"),
        ((2, 2, 1), [[0, 3]], "runs have 3 voxels, not the 4 of"),
        ((2, 2, 1), [[0, 3], [3, 1]], r"runs\[1\] must be a state"),
        ((2, 2, 1), [[0, float("nan")]], r"runs\[0\] must be a state"),
    ):
        with pytest.raises(InvalidShapeError, match=told):
            from_runs(counts, runs)
    with pytest.raises(InvalidShapeError, match="16777217 voxels are too many for a file"):
        to_runs(np.zeros((2**24 + 1, 1, 1), np.uint8))


def test_a_surface_is_closed_and_holds_the_volume_of_its_voxels():
    """Each edge is walked both ways alike often; the divergence theorem tells the volume."""
    rng = np.random.default_rng(4)
    solid = rng.random((5, 6, 4)) < 0.3
    corners, triangles = voxel_triangles(solid, 0.5)
    p = corners[triangles]
    volume = np.einsum("ti,ti->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    assert volume == pytest.approx(solid.sum() * 0.5**3, rel=1e-12)
    walks = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    there, back = (np.sort(w @ [10**6, 1]) for w in (walks, walks[:, ::-1]))
    assert (there == back).all()
    assert len(voxel_triangles(solid & False, 0.5)[1]) == 0
