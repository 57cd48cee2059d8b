"""What is wrong with the arguments that ROS takes, and which files of parameters reach a node."""

from __future__ import annotations

import pytest
from rclpy.exceptions import ParameterException

from scene_graph_ros.node.runtime.parameter_sections import reaches, sections_of
from scene_graph_ros.node.runtime.ros_arguments import problem_of, said_by_ros, unreached

ROS = ("node", "--ros-args")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("--params-file", "/no/p.yaml"),
            "--params-file '/no/p.yaml' can't be read: No such file",
        ),
        (("--params-file", "/tmp"), "--params-file '/tmp' can't be read: is a folder"),
        (
            ("--log-level", "loud"),
            "--log-level must be one of debug, info, warn, error, fatal, not",
        ),
        (("--log-level", "rcl:=warm"), "not 'warm'; did you mean 'warn'?"),
        (("--log-level", "WARN"), ""),
        (("--log-level", "scene_graph:=debug"), ""),
        (("-p", "scene:=x", "--", "--params-file", "/no"), ""),
    ],
)
def test_a_file_or_a_level_that_there_is_not_is_told(arguments, words):
    """With what was given."""
    said = problem_of((*ROS, *arguments))
    assert words in said
    assert bool(said) == bool(words)


def test_what_ros_says_has_no_places_in_its_sources():
    """Of the rest nothing is lost."""
    error = ParameterException(
        "failed to initialize rcl: Couldn't parse '-p a'. E., at /x.c:1", []
    )
    assert said_by_ros(error).startswith(
        "these arguments can't be used: Couldn't parse '-p a'. E."
    )


@pytest.mark.parametrize(
    ("text", "node", "is_reached"),
    [
        ("scene_graph: {ros__parameters: {}}", "/scene_graph", True),
        ("scene_graph: {ros__parameters: {}}", "/cell/scene_graph", False),
        ("/cell/scene_graph: {ros__parameters: {}}", "/cell/scene_graph", True),
        ("cell: {scene_graph: {ros__parameters: {}}}", "/cell/scene_graph", True),
        ("/**: {ros__parameters: {}}", "/a/b/c", True),
        ("/**/scene_graph: {ros__parameters: {}}", "/scene_graph", True),
        ("/**/scene_graph: {ros__parameters: {}}", "/a/b/scene_graph", True),
        ("/*/scene_graph: {ros__parameters: {}}", "/a/scene_graph", True),
        ("/*/scene_graph: {ros__parameters: {}}", "/a/b/scene_graph", False),
        ("/cell/*: {ros__parameters: {}}", "/cell/scene_graph", True),
        ("scene_grap.: {ros__parameters: {}}", "/scene_graph", False),
    ],
)
def test_which_sections_reach_a_node(tmp_path, text, node, is_reached):
    """As rcl matches names; else the node says that it has its defaults."""
    import yaml

    paths = [path for path, _ in sections_of(yaml.safe_load(text))]
    assert [reaches(path, node) for path in paths] == [is_reached]
    (tmp_path / "p.yaml").write_text(text)
    told = list(unreached((*ROS, "--params-file", str(tmp_path / "p.yaml")), node))
    assert len(told) == (not is_reached)
    assert is_reached or f"has no parameters for {node}, but for /" in told[0]
