"""A joint_limits.yaml as MoveIt's: it narrows what the URDF says."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_ros.check import main
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.scene_files import load_scene, SceneFileError
from scene_graph_ros.trajectories.motion_limits import MotionLimits

URDF = """<robot name="a"><link name="base"/><link name="arm"/><link name="hand"/>
<joint name="j" type="revolute"><parent link="base"/><child link="arm"/>
<limit lower="-1" upper="1" velocity="2"/></joint>
<joint name="k" type="continuous"><parent link="arm"/><child link="hand"/></joint></robot>"""
LIMITS = """joint_limits:
  j:
    has_position_limits: true
    min_position: -2.0
    max_position: 0.5
    has_velocity_limits: true
    max_velocity: 3.0
    has_acceleration_limits: true
    max_acceleration: 4.0
    has_deceleration_limits: true
    max_deceleration: 3.5
    has_jerk_limits: false
    max_jerk: 1.0
  k: {has_velocity_limits: true, max_velocity: 1.5, has_jerk_limits: true, max_jerk: 10}
  other: {has_velocity_limits: true, max_velocity: 1.5}
"""


@pytest.fixture
def scene(tmp_path):
    """Return a function that writes a scene with such a file."""

    def write(limits):
        (tmp_path / "a.urdf").write_text(URDF)
        (tmp_path / "limits.yaml").write_text(limits)
        file = tmp_path / "scene.yaml"
        file.write_text(
            "version: 1\nrobots: [{name: a, urdf: a.urdf, joint_limits: limits.yaml}]\n"
        )
        return file

    return write


def load(file):
    """Return the loaded scene."""
    return load_scene(file).apply(SceneGraph())


def test_the_narrower_limit_holds(scene):
    """Of both ends and each rate; what has no ``has_`` word says nothing."""
    loaded = load(scene(LIMITS))
    tree = loaded.sources["a"].robot.model.kinematic_tree()
    assert (tree.lower[0], tree.upper[0]) == (-1.0, 0.5)
    np.testing.assert_array_equal(tree.velocity_limits, [2.0, 1.5])
    np.testing.assert_array_equal(tree.acceleration_limits, [3.5, np.inf])
    np.testing.assert_array_equal(tree.jerk_limits, [np.inf, 10.0])
    assert any("no joint 'other'" in warning for warning in loaded.warnings)


def test_limits_of_motion_are_the_robots_where_these_are_narrower(scene):
    """What is asked for may be less; a joint without a limit has to be given one."""
    tree = load(scene(LIMITS)).sources["a"].robot.model.kinematic_tree()
    limits = MotionLimits.of_tree(
        tree, accelerations={"j": 9.0, "k": 5.0}, jerks={"j": 7.0, "k": 8.0}
    )
    np.testing.assert_array_equal(limits.accelerations, [3.5, 5.0])
    np.testing.assert_array_equal(limits.jerks, [7.0, 8.0])
    alone = MotionLimits.of_tree(tree, positions=[0])
    np.testing.assert_array_equal(alone.accelerations, [3.5])
    assert alone.jerks is None
    with pytest.raises(ValueError, match="'k' has no limit of acceleration"):
        MotionLimits.of_tree(tree)


def test_check_tells_which_limits_the_file_narrows(scene, capsys):
    """With the line, and what was before."""
    assert main([str(scene(LIMITS))]) == 0
    said = capsys.readouterr().out
    assert "limits.yaml:2: joint_limits.j: narrows upper of 'j' to 0.5, from 1" in said
    assert "narrows acceleration of 'j' to 3.5, from none" in said
    assert "velocity of 'j'" not in said


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ("j: {has_position_limits: true, min_position: 1}", "needs min_position and max_pos"),
        ("j: {has_position_limits: true, min_position: 1, max_position: 0}", "is above"),
        ("j: {has_position_limits: true, min_position: 2, max_position: 3}", "nothing in common"),
        ("k: {has_position_limits: true, min_position: 2, max_position: 3}", "continuous"),
        ("j: {has_velocity_limits: true, max_velocity: 0}", "must be positive, got 0"),
        ("j: {has_jerk_limits: true}", "max_jerk must be positive, got nothing"),
        ("j: {max_speed: 1}", "max_speed"),
    ],
)
def test_limits_that_make_no_sense_are_refused_with_their_line(scene, limits, words):
    """In the file of limits, not in the scene."""
    with pytest.raises(SceneFileError, match=words) as error:
        load(scene(f"joint_limits:\n  {limits}\n"))
    assert "limits.yaml:2" in str(error.value)
