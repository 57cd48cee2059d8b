"""Launch file, parameter file and RViz configuration agree with the node's own tables."""

from __future__ import annotations

import ast
import importlib.util
import os
from pathlib import Path
import subprocess
import sys
import types
from xml.etree import ElementTree

import pytest
import yaml

from scene_graph_ros.node.runtime import names
from scene_graph_ros.node.runtime.parameter_checks import validate
from scene_graph_ros.node.runtime.parameters import defaults, PARAMETERS

ROOT = Path(__file__).parents[2]
LAUNCH = ROOT / "launch" / "scene_graph.launch.py"


class Recorded:
    """Stands for any class of launch: keeps its arguments."""

    def __init__(self, *args, **kwargs):
        self.args, self.kwargs = args, kwargs


@pytest.fixture
def description(monkeypatch):
    """What the launch file describes, with stand-ins for the packages of launch."""
    classes = {
        "launch": ("LaunchDescription",),
        "launch.actions": ("DeclareLaunchArgument",),
        "launch.conditions": ("IfCondition",),
        "launch.substitutions": (
            "EnvironmentVariable",
            "LaunchConfiguration",
            "PathJoinSubstitution",
            "PythonExpression",
        ),
        "launch_ros": (),
        "launch_ros.actions": ("Node",),
        "launch_ros.parameter_descriptions": ("ParameterValue",),
        "launch_ros.substitutions": ("FindPackageShare",),
    }
    for module, members in classes.items():
        stand_in = types.ModuleType(module)
        for member in members:
            setattr(stand_in, member, type(member, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, module, stand_in)
    spec = importlib.util.spec_from_file_location("scene_graph_launch", LAUNCH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.generate_launch_description().args[0]


def test_each_launch_argument_is_declared_and_used(description):
    """No argument is used undeclared, none is declared for nothing."""
    declared = {item.args[0] for item in description if type(item).__name__.startswith("Declare")}
    tree = ast.parse(LAUNCH.read_text())
    used = {
        node.args[0].value
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "LaunchConfiguration"
    }
    assert declared == used


def test_the_launch_file_sets_parameters_that_exist(description):
    """What is set beside the file are parameters of the node, or ROS's own use_sim_time."""
    nodes = [item for item in description if type(item).__name__ == "Node"]
    ours = next(n for n in nodes if n.kwargs["package"] == "scene_graph_ros")
    _, given = ours.kwargs["parameters"]
    assert set(given) <= {*defaults(), "use_sim_time"}
    assert "scene" in given


def test_the_launch_file_starts_what_is_installed(description):
    """The executable is the console script that set-up installs."""
    nodes = [item for item in description if type(item).__name__ == "Node"]
    ours = next(n for n in nodes if n.kwargs["package"] == "scene_graph_ros")
    assert f'"{ours.kwargs["executable"]} = scene_graph_ros.node.main:main"' in (
        (ROOT / "setup.py").read_text()
    )


def test_the_launch_file_chooses_udp_unless_the_environment_chooses(description):
    """Shared memory of Fast DDS holds messages up now and then."""
    (default,) = (
        item.kwargs["default_value"]
        for item in description
        if type(item).__name__.startswith("Declare") and item.args == ("transports",)
    )
    assert default.args == ("FASTDDS_BUILTIN_TRANSPORTS",)
    assert default.kwargs == {"default_value": "UDPv4"}
    ours = next(
        item
        for item in description
        if getattr(item, "kwargs", {}).get("package") == "scene_graph_ros"
    )
    (variable,) = ours.kwargs["additional_env"]
    assert variable == "FASTDDS_BUILTIN_TRANSPORTS"


def test_both_files_of_profiles_say_the_same_of_responses():
    """Tests talk by UDP: what holds with the one holds with what the node takes by default."""

    def services(path):
        (writer,) = (e for e in ElementTree.parse(path).iter() if e.tag.endswith("data_writer"))
        assert writer.attrib["profile_name"] == "service"
        return [(e.tag, (e.text or "").strip()) for e in writer.iter()]

    by_default = ROOT / "scene_graph_ros" / "node" / "fast_dds.xml"
    assert services(by_default) == services(ROOT / "config" / "udp_on_this_machine.xml")


def test_files_that_the_launch_file_names_exist(description):
    """Defaults inside the package's share folder are files of this project."""
    for item in description:
        if type(item).__name__ != "DeclareLaunchArgument":
            continue
        default = item.kwargs["default_value"]
        assert item.kwargs["description"]
        if type(default).__name__ == "PathJoinSubstitution":
            _, *parts = default.args[0]
            assert ROOT.joinpath(*parts).is_file()


def test_the_parameter_file_holds_every_default():
    """The file lists all parameters with their defaults and nothing else."""
    content = yaml.safe_load((ROOT / "config" / "scene_graph.yaml").read_text())
    assert content == {"/**": {"ros__parameters": defaults()}}
    assert validate(defaults()) == []


def test_rviz_shows_the_topics_of_the_node():
    """Every marker topic of the node is a display of the RViz configuration."""
    content = yaml.safe_load((ROOT / "config" / "scene_graph.rviz").read_text())
    displays = content["Visualization Manager"]["Displays"]
    topics = {display["Topic"]["Value"] for display in displays if "Topic" in display}
    ours = (
        names.MARKERS_PLAN,
        names.MARKERS_REGIONS,
        "~/cameras/wrist/color/image",
        names.MARKERS_ILLUSTRATION,
        names.MARKERS_PROXIMITY,
        names.MARKERS_PERCEPTION,
        names.CONTACT_MARKERS,
        names.CONTACT_SURFACE_MARKERS,
        names.CONTACT_SURFACE_POINTS,
    )
    assert topics == {topic.replace("~", f"/{names.NODE_NAME}") for topic in ours}


@pytest.mark.parametrize(
    ("namespace", "whole"),
    [("", "/looker"), ("cell", "/cell/looker"), ("/a/cell/", "/a/cell/looker")],
)
def test_the_launch_file_has_rviz_show_the_node_that_it_starts(description, namespace, whole):
    """Each topic of the configuration, whatever the node's name and namespace are."""
    rviz = next(i for i in description if getattr(i, "kwargs", {}).get("package") == "rviz2")
    content = yaml.safe_load((ROOT / "config" / "scene_graph.rviz").read_text())
    displays = content["Visualization Manager"]["Displays"]
    shown = {display["Topic"]["Value"] for display in displays if "Topic" in display}
    assert shown == {configured for configured, _ in rviz.kwargs["remappings"]}
    given = {"namespace": namespace, "name": "looker"}
    for configured, expression in rviz.kwargs["remappings"]:
        (parts,) = expression.args
        text = "".join(part if isinstance(part, str) else given[part.args[0]] for part in parts)
        # As PythonExpression does with what its parts say.
        assert eval(text) == configured.replace("/scene_graph", whole)


def test_every_parameter_is_described():
    """Each parameter has a sentence, numbers have a range, and names are unique."""
    assert len({p.name for p in PARAMETERS}) == len(PARAMETERS)
    for parameter in PARAMETERS:
        assert parameter.description.endswith(".")
        if type(parameter.default) in (int, float):
            assert parameter.minimum is not None
            assert parameter.minimum <= parameter.default <= parameter.maximum


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"marker_rate": "30"}, "marker_rate must be a number, not '30'"),
        ({"marker_rate": 0}, "at least"),
        ({"marker_rate": 10**400}, "at most 1000"),
        ({"marker_rate": True}, "marker_rate must be a number, not True"),
        ({"marker_rate": float("nan")}, "finite"),
        ({"marker_rate": 0.0}, "at least"),
        ({"executor_threads": 65}, "at most 64"),
        ({"executor_threads": True}, "an integer"),
        ({"executor": "magic"}, "multi_threaded, single_threaded"),
        ({"colour": "red"}, "unknown parameter colour"),
        (
            {"min_update_rate": 1000.0, "max_update_rate": 999.0},
            "must not be greater than max_update_rate",
        ),
        ({"browser_host": "0.0.0.0"}, "'0.0.0.0' is reached from other machines"),
        ({"browser_port": 65536}, "at most 65535"),
    ],
)
def test_wrong_values_are_named(values, problem):
    """Each problem names the parameter and what it may be."""
    (found,) = validate(values)
    assert problem in found


def test_a_browser_elsewhere_takes_a_token():
    """With one any address will do, without one those that only this machine reaches."""
    assert validate({"browser_host": "0.0.0.0", "browser_token": "secret"}) == []
    for host in ("::1", "localhost", "127.0.0.2"):
        assert validate({"browser_host": host}) == []


def test_parameters_can_be_read_without_ros():
    """The table of parameters and the names of effects import no rclpy."""
    program = (
        "import sys\n"
        "import scene_graph_ros.node.runtime.parameter_checks\n"
        "import scene_graph_ros.node.runtime.names\n"
        "import scene_graph_ros.node.effects.declarations\n"
        "assert 'rclpy' not in sys.modules\n"
    )
    subprocess.run(
        [sys.executable, "-c", program],
        check=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_whole_numbers_do_where_numbers_are_asked_for():
    """As people write them."""
    assert validate({"marker_rate": 30, "min_update_rate": 1}) == []
