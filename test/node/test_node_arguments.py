"""The arguments that ROS takes, as the node's process gets them."""

from __future__ import annotations

import subprocess
import sys

from node_harness import environment, RUN_NODE
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import GetParameters, SetParametersAtomically
from spinning import DEADLINE


def test_mistyped_parameters_are_named_and_whole_numbers_taken(client, start_node, tmp_path):
    """At the start and later; a file for a node of another name is none for this one."""
    (tmp_path / "other.yaml").write_text("/cell/scene_graph: {ros__parameters: {scene: x}}")
    more = ["--params-file", str(tmp_path / "other.yaml")]
    node = start_node(
        {"markr_rate": 1.0, "marker_rate": 10},
        program=f"import sys\nsys.argv += {more}\n{RUN_NODE}",
    )
    node.wait_for_output("has no parameters for /scene_graph, but for /cell/scene_graph")
    text = "parameter 'markr_rate' is unknown, and ignored; did you mean 'marker_rate'?"
    assert text in node.output()
    value = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=20)
    message = ParameterMessage(name="marker_rate", value=value)
    request = SetParametersAtomically.Request(parameters=[message])
    name = "/scene_graph/set_parameters_atomically"
    answer = client.call_any(SetParametersAtomically, name, request).result
    assert answer.successful, answer.reason
    got = client.call_any(
        GetParameters, "/scene_graph/get_parameters", GetParameters.Request(names=["marker_rate"])
    ).values[0]
    assert (got.type, got.double_value) == (ParameterType.PARAMETER_DOUBLE, 20.0)
    assert node.stop() == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("--params-file", "/no/p.yaml"),
            "--params-file '/no/p.yaml' can't be read: No such file",
        ),
        (("-p", "scene"), "these arguments can't be used: Couldn't parse parameter override rule"),
    ],
)
def test_arguments_that_ros_refuses_are_told_without_a_traceback(domain, arguments, words):
    """The first of them in one line."""
    done = subprocess.run(
        [sys.executable, "-m", "scene_graph_ros.node", "--ros-args", *arguments],
        env=environment(domain),
        capture_output=True,
        text=True,
        timeout=4 * DEADLINE,
        check=False,
    )
    assert done.returncode == 1
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert arguments[0] == "-p" or len(done.stderr.splitlines()) == 1
