"""Robots in scenes: URDF and SRDF become a source, with their mistakes placed in the scene."""

import numpy as np
import pytest

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.scene_files import load_scene, SceneFileError

ROBOT = """<robot name="arm">
  <link name="base"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <link name="hand"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="hand"/>
    <axis xyz="1 0 0"/></joint></robot>"""
SRDF = """<robot name="arm"><disable_collisions link1="base" link2="hand"/>
  <group_state name="out" group="g"><joint name="slide" value="0.5"/></group_state></robot>"""


def robot_scene(folder, options="", extra=""):
    """Write a robot and a scene with it into a folder; return the scene's file."""
    (folder / "arm.urdf").write_text(ROBOT)
    (folder / "arm.srdf").write_text(SRDF)
    file = folder / "scene.yaml"
    file.write_text(
        "version: 1\n"
        f"robots:\n  - {{name: left, urdf: arm.urdf, srdf: arm.srdf{options}}}\n{extra}"
    )
    return file


def test_robot_in_a_scene(tmp_path):
    """A robot is a source moved by joint states, placed by its base and its posture."""
    options = (
        ", base: {xyz: [0, 0, 1], rpy: [0, 0, 1.5707963267948966]}, group_state: out,"
        " joint_states: left/joint_states, prefix: l_"
    )
    scene_graph = SceneGraph()
    loaded = load_scene(robot_scene(tmp_path, options)).apply(scene_graph)
    source = loaded.sources["left"]
    assert (source.pose_type, source.pose_topic) == (
        "sensor_msgs/msg/JointState",
        "left/joint_states",
    )
    assert set(source.frames) == {"l_base", "l_hand"}
    context = scene_graph.create_default_context()
    loaded.set_initial_poses(context)
    query = scene_graph.query_object(context)
    # Slid out by 0.5 along x, which the base turns to y, 1 m above the floor.
    X_WH = query.get_pose_in_world(source.frames["l_hand"])
    np.testing.assert_allclose(X_WH[:3, 3], [0, 0.5, 1], atol=1e-15)
    poses = source.robot.frame_poses(["slide"], [2.0])
    np.testing.assert_allclose(poses[source.frames["l_hand"]][:3, 3], [0, 2, 1], atol=1e-15)
    assert scene_graph.model_inspector().get_collision_candidates() == []


def test_geometry_on_a_robots_link_and_filters_on_it(tmp_path):
    """A tool can be put on a link of the robot, and its pairs named like any other."""
    extra = (
        "geometries:\n"
        "  - {name: tool, source: left, frame: hand, shape: {type: sphere, radius: 0.1}}\n"
        "collision_filters:\n"
        "  - {between: [[left/hand/tool], [left/base/base_collision_0]]}\n"
    )
    scene_graph = SceneGraph()
    loaded = load_scene(robot_scene(tmp_path, extra=extra)).apply(scene_graph)
    inspector = scene_graph.model_inspector()
    tool = loaded.geometries["left/hand/tool"]
    assert inspector.get_frame_id(tool) == loaded.sources["left"].frames["hand"]
    assert inspector.get_collision_candidates() == []


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ", positions: {slid: 1}",
            "3: robots[0].positions.slid: robot 'arm' has no joint 'slid' with a position;"
            " did you mean 'slide'?",
        ),
        (", group_state: in", "3: robots[0].group_state: "),
        (", base: {quaternion: [0, 0, 0, 3]}", "3: robots[0].base: pose base of robot 'left'"),
    ],
)
def test_robots_are_refused_with_their_place(tmp_path, options, message):
    """What is wrong with a robot is named at its line in the scene."""
    file = robot_scene(tmp_path, options)
    with pytest.raises(SceneFileError) as caught:
        load_scene(file).apply(SceneGraph())
    assert str(caught.value).startswith(f"{file}:{message}")


def test_mistake_in_a_robots_own_file_names_both_places(tmp_path):
    """The message has the scene's line and, behind it, the URDF's."""
    file = robot_scene(tmp_path)
    (tmp_path / "arm.urdf").write_text(ROBOT.replace('radius="0.1"', 'radius="-1"', 1))
    with pytest.raises(SceneFileError) as caught:
        load_scene(file).apply(SceneGraph())
    assert str(caught.value) == (
        f"{file}:3: robots[0].urdf: {tmp_path / 'arm.urdf'}:2: link['base']/collision/geometry/"
        "sphere.radius: must be positive, got -1"
    )
