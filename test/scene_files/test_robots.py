"""Real robots load with their collision geometry, and their SRDF's filters hold."""

import itertools

import numpy as np
import pytest
from robots import find_robot, place_robot, ROBOTS, URDF_ONLY

from scene_graph_ros.geometry import Rgba, Role, SceneGraph
from scene_graph_ros.robots.robot_parts import MeshFile
from scene_graph_ros.scene_files import (
    find_package,
    load_urdf,
    register_robot,
    SceneFileError,
)


def set_posture(placed, context, positions=None):
    """Put the robot into a posture; joints not named stay at zero, the neutral position."""
    positions = positions or {}
    _, X_WL = placed.kinematics.link_poses(tuple(positions), tuple(positions.values()))
    poses = dict(zip(placed.frames.values(), X_WL, strict=True))
    context.set_frame_poses(placed.source, poses)


def link_pairs(placed, pairs):
    """Return the link names of pairs of geometries, each pair in alphabetical order."""
    inspector = placed.scene_graph.model_inspector()
    link = {frame: name for name, frame in placed.frames.items()}
    return {
        tuple(sorted((link[inspector.get_frame_id(id_A)], link[inspector.get_frame_id(id_B)])))
        for id_A, id_B in ((pair.id_A, pair.id_B) for pair in pairs)
    }


@pytest.mark.parametrize("name", [*ROBOTS, *URDF_ONLY])
def test_every_mesh_is_found_and_every_collision_shape_registered(name):
    """A robot's scene has as many proximity geometries as its URDF has collision elements."""
    placed = place_robot(name)
    links = placed.model.links.values()
    shapes = [g.shape for link in links for g in (*link.collisions, *link.visuals)]
    assert [s.resource for s in shapes if isinstance(s, MeshFile) and s.path is None] == []
    expected = sum(len(link.collisions) for link in links)
    inspector = placed.scene_graph.model_inspector()
    assert inspector.num_geometries_with_role(Role.PROXIMITY) == expected > 0
    assert list(placed.frames) == [link.name for link in links if link.collisions]


def test_all_robots_of_the_package_load_but_one_without_links():
    """A reader that refuses a robot which others read is of no use; this one has no link."""
    folder = find_package("example-robot-data")
    files = sorted((folder / "robots").rglob("*.urdf"))
    assert len(files) > 60
    refused = {}
    for file in files:
        try:
            load_urdf(file)
        except SceneFileError as error:
            refused[file.name] = str(error)
    assert [text.rpartition(": ")[2] for text in refused.values()] == ["no <link>"], refused


@pytest.mark.parametrize("name", ROBOTS)
def test_srdf_filters_exactly_its_pairs(name):
    """The pairs that are not candidates are those that the SRDF's text disables."""
    placed = place_robot(name)
    candidates = placed.scene_graph.model_inspector().get_collision_candidates()
    link = {frame: name for name, frame in placed.frames.items()}
    inspector = placed.scene_graph.model_inspector()
    checked = {
        tuple(sorted(link[inspector.get_frame_id(geometry)] for geometry in pair))
        for pair in candidates
    }
    everything = {tuple(sorted(pair)) for pair in itertools.combinations(placed.frames, 2)}
    # Read off the file by hand: no robot here enables pairs or disables links by default.
    disabled = {tuple(sorted((p.link_A, p.link_B))) for p in placed.semantics.disabled_pairs}
    assert checked == everything - disabled


@pytest.mark.parametrize("name", ROBOTS)
def test_no_filtered_pair_is_reported_in_neutral_posture(name):
    """Neither penetration nor collision candidates name a pair that the SRDF disables."""
    placed = place_robot(name)
    context = placed.scene_graph.create_default_context()
    set_posture(placed, context)
    query = placed.scene_graph.query_object(context)
    disabled = placed.semantics.filtered_pairs(placed.model.links)
    assert not link_pairs(placed, query.compute_point_pair_penetration()) & disabled
    assert not link_pairs(placed, query.find_collision_candidates()) & disabled


@pytest.mark.parametrize("name", ["panda", "ur5", "baxter", "talos", "anymal_b"])
def test_filters_are_what_keeps_neighbours_out(name):
    """Without the SRDF the neutral posture has contacts between links that it disables."""
    placed = place_robot(name, with_semantics=False)
    disabled = find_robot(name)[1].filtered_pairs(placed.model.links)
    context = placed.scene_graph.create_default_context()
    set_posture(placed, context)
    contacts = placed.scene_graph.query_object(context).compute_point_pair_penetration()
    assert link_pairs(placed, contacts) & disabled


@pytest.mark.parametrize(
    ("name", "state", "group"),
    [
        ("panda", "default", "arm_and_hand"),
        ("talos", "half_sitting", None),
        ("anymal_b", "standing", None),
    ],
)
def test_srdf_posture_is_free_of_self_contact(name, state, group):
    """The posture that a robot's authors start from has no contact that they don't expect."""
    placed = place_robot(name)
    context = placed.scene_graph.create_default_context()
    positions = placed.semantics.group_state(state, group).positions
    set_posture(placed, context, positions)
    contacts = placed.scene_graph.query_object(context).compute_point_pair_penetration()
    assert link_pairs(placed, contacts) == set()


def test_frames_without_geometry_on_request():
    """The Panda's tool frame has no geometry, and gets a frame only where all links are asked."""
    robot, _ = find_robot("panda")
    scene_graph = SceneGraph()
    some = register_robot(robot, scene_graph, scene_graph.register_source("a"), visual=False)
    all_ = register_robot(
        robot, scene_graph, scene_graph.register_source("b"), visual=False, all_links=True
    )
    assert "panda_hand_tcp" not in some
    assert list(all_) == list(robot.links)


def test_prefix_names_frames_and_geometries():
    """Two robots share a source when their prefixes differ."""
    robot, _ = find_robot("ur5")
    scene_graph = SceneGraph()
    source = scene_graph.register_source("cell")
    for prefix in ("left_", "right_"):
        frames = register_robot(robot, scene_graph, source, prefix=prefix)
        names = {scene_graph.model_inspector().get_name(frame) for frame in frames.values()}
        assert names == {prefix + link for link in frames}


def test_visual_geometry_has_the_files_colours():
    """A visual with a material is shown in the material's colour, and is not for contact."""
    robot, _ = find_robot("anymal_b_kinova")
    scene_graph = SceneGraph()
    frames = register_robot(robot, scene_graph, scene_graph.register_source("anymal"))
    inspector = scene_graph.model_inspector()
    checked = 0
    for name, frame in frames.items():
        shown = inspector.get_geometries(frame, Role.ILLUSTRATION)
        for geometry, visual in zip(shown, robot.links[name].visuals, strict=True):
            if visual.rgba is not None:
                properties = inspector.get_illustration_properties(geometry)
                assert properties.get_property("phong", "diffuse") == Rgba(*visual.rgba)
                assert inspector.get_roles(geometry) == {Role.ILLUSTRATION}
                np.testing.assert_array_equal(inspector.get_pose_in_frame(geometry), visual.X_LG)
                checked += 1
    assert checked > 0
