"""Voxel grids in scene files, as they are read and as they are saved."""

import numpy as np
import pytest

from scene_graph_ros.geometry import GeometryInstance, SceneGraph, VoxelGrid
from scene_graph_ros.scene_files import load_scene, save_scene, SceneFileError
from scene_graph_ros.scene_files.sensor_settings import VoxelSettings

SCENE = """version: 1
sources: [{name: map}]
geometries:
  - name: seen
    source: map
    shape: {type: voxel_grid, voxel: 0.1, counts: [2, 1, 3], runs: [[0, 2], [1, 3], [2, 1]]}
"""
SEEN = VoxelGrid([[[0, 0, 1]], [[1, 1, 2]]], 0.1)


def loaded(path):
    """Return the one shape of a scene file."""
    graph = SceneGraph()
    load_scene(path).apply(graph)
    inspector = graph.model_inspector()
    (geometry_id,) = inspector.get_all_geometry_ids()
    return inspector.get_shape(geometry_id)


def test_a_file_has_runs_of_states(tmp_path):
    """Along z first; a wrong number of voxels is refused."""
    path = tmp_path / "scene.yaml"
    path.write_text(SCENE)
    assert loaded(path) == SEEN
    path.write_text(SCENE.replace("[1, 3]", "[1, 4]"))
    with pytest.raises(SceneFileError, match="runs have 7 voxels, not the 6"):
        loaded(path)


def test_a_saved_scene_has_the_voxels_of_its_context(tmp_path):
    """Those that were set last, and whether unknown is free."""
    graph = SceneGraph()
    source = graph.register_source("map")
    shape = VoxelGrid([[[1]]], 0.25, unknown_is_free=True)
    grid = graph.register_anchored_geometry(source, GeometryInstance(np.eye(4), shape, "seen"))
    context = graph.create_default_context()
    states = np.random.default_rng(0).integers(0, 3, (4, 5, 6))
    context.set_voxels(source, {grid: states})
    path = tmp_path / "saved.yaml"
    save_scene(graph, path, context=context)
    assert loaded(path) == VoxelGrid(states, 0.25, unknown_is_free=True)


TWO = """
version: 1
sources: [{name: map, voxels: VOXELS}]
geometries:
  - {name: one, source: map, shape: {type: voxel_grid, voxel: 0.1, counts: COUNTS, runs: RUNS}}
  - {name: two, source: map, shape: {type: voxel_grid, voxel: 0.1, counts: COUNTS, runs: RUNS}}
"""


def two_grids(voxels="{}", side=2):
    """Return a scene with two grids of so many voxels along each edge."""
    counts, runs = [side] * 3, [[0, side**3]]
    return TWO.replace("VOXELS", voxels).replace("COUNTS", str(counts)).replace("RUNS", str(runs))


def read(tmp_path, text):
    """Return a scene that was read from a file."""
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    return load_scene(path)


def test_the_grids_of_a_file_have_a_limit_together(tmp_path):
    """However few runs say them; it is told before any is made."""
    with pytest.raises(SceneFileError, match="have 33554432 voxels together"):
        read(tmp_path, two_grids(side=256))
    read(tmp_path, two_grids())


@pytest.mark.parametrize(
    ("voxels", "told"),
    [
        ("{geometry: thre}", "source 'map' has no voxel_grid 'thre'"),
        ("{type: sensor_msgs/msg/Image}", "type"),
        ("{free: 65}", "free: 65 must be less than occupied: 65"),
        ("{occupied: 101}", "must be at most 100"),
        ("{topics: a}", "topics"),
    ],
)
def test_settings_of_maps_that_mean_nothing_are_named(tmp_path, voxels, told):
    """With the grid that there is not, or the value."""
    with pytest.raises(SceneFileError, match=told):
        read(tmp_path, two_grids(voxels))


def test_settings_of_maps_are_those_of_their_source(tmp_path):
    """And the defaults where a file says nothing."""
    scene = read(tmp_path, two_grids("{geometry: two, topic: /map, occupied: 50}"))
    assert scene.apply(SceneGraph()).sources["map"].voxels == VoxelSettings(
        geometry="two", topic="/map", occupied=50
    )


SEEING = """
version: 1
sources:
  - {name: eye, depth: {image: depth, into: voxel_grid}}
  - {name: side, depth: {image: side, fills: eye}}
geometries:
  - {name: space, source: eye,
     shape: {type: voxel_grid, voxel: 0.1, counts: [2, 2, 2], runs: [[2, 8]]}}
"""


def test_images_fill_the_grid_of_a_source_that_says_so(tmp_path):
    """Those of another source that names it, too; else images make points of a cloud."""
    sources = read(tmp_path, SEEING).apply(SceneGraph()).sources
    assert sources["eye"].sensor.into_voxels
    assert sources["side"].sensor.fills == "eye"
    cloud = SEEING.replace(", into: voxel_grid", "")
    assert not read(tmp_path, cloud).apply(SceneGraph()).sources["eye"].sensor.into_voxels


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("into: voxel_grid", "into: voxels", "into"),
        ("into: voxel_grid", "into: voxel_grid, geometry: spac", "has no voxel_grid 'spac'"),
        ("image: depth, into: voxel_grid}", "image: depth, into: voxel_grid}, voxels: {}",
         "maps fill its voxel grid, or its sensor does"),
        ("fills: eye", "fills: eye, into: voxel_grid", "into is said by the source that"),
        ("depth: {image: side, fills: eye}", "points: {fills: eye}", "say remember: true"),
        ("image: depth", "image: depth}, points: {remember: true", "give points or depth"),
        ("depth: {image: depth,", "points: {", "needs remember: true"),
        ("source: eye", "source: eye, frame: post", "the voxel_grid 'space' is on frame 'post'"),
    ],
)  # fmt: skip
def test_images_that_can_not_fill_a_grid_are_named(tmp_path, old, new, told):
    """With the settings that contradict each other, or the frame."""
    frames = "frames: [{name: post, source: eye}]\ngeometries:"
    with pytest.raises(SceneFileError, match=told):
        read(tmp_path, SEEING.replace(old, new).replace("geometries:", frames))
