"""The node's parameter ``accuracy``: its tier is set, named in diagnostics and followed."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from node_harness import diagnostics_values
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParametersAtomically

from scene_graph_msgs.msg import ContactArray
from scene_graph_ros.geometry.accuracy import Accuracy

SCENE = """
version: 1
sources:
  - {name: bin}
frames:
  - {name: can, source: bin, pose: {xyz: [0.0, 0.0, 0.1]}}
geometries:
  - {name: can, source: bin, frame: can, shape: {type: cylinder, radius: 0.1, length: 0.3}}
  - {name: egg, source: bin, shape: {type: ellipsoid, semi_axes: [0.1, 0.12, 0.07]}}
"""


@pytest.fixture(scope="module")
def node(start_node, tmp_path_factory):
    """A node with two shapes in contact, started at the tier ``quick``."""
    path = tmp_path_factory.mktemp("accuracy") / "scene.yaml"
    path.write_text(SCENE)
    return start_node({"scene": path, "accuracy": "quick", "diagnostics_rate": 20.0})


@pytest.fixture(scope="module")
def diagnostics(client, node):
    """What the node says about itself, while somebody listens to its contacts."""
    contacts = client.listen(ContactArray, "contacts")
    yield client.listen(DiagnosticArray, "/diagnostics")
    client.forget(contacts)


def set_accuracy(client, value):
    """Set the parameter of the running node and return its answer."""
    text = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=value)
    request = SetParametersAtomically.Request(parameters=[Parameter(name="accuracy", value=text)])
    name = "/scene_graph/set_parameters_atomically"
    return client.call_any(SetParametersAtomically, name, request).result


def is_reported(message, tier):
    """Tell whether the world and the effect are at a tier, and its cost was measured."""
    world = diagnostics_values(message, "world")
    effect = diagnostics_values(message, "effect: point_contact")
    return (
        world["accuracy"] == tier
        and float(world["accuracy: largest error (of the larger shape)"]) == Accuracy(tier).bound
        and effect["accuracy"] == tier
        and float(effect["time at this accuracy, mean (s)"]) > 0.0
    )


def test_diagnostics_name_the_tier_and_its_cost(diagnostics):
    """The tier of the start is in the diagnostics, with its bound and the time of a query."""
    diagnostics.wait_for(lambda message: is_reported(message, "quick"), "the tier quick")


def test_another_tier_is_followed_at_once(client, diagnostics):
    """Setting the parameter of the running node changes the tier of its queries."""
    assert set_accuracy(client, "standard").successful
    diagnostics.wait_for(lambda message: is_reported(message, "standard"), "the tier standard")


def test_unknown_tier_is_refused_and_changes_nothing(client, diagnostics):
    """The refusal names the choices; the node keeps its tier."""
    result = set_accuracy(client, "perfect")
    assert not result.successful
    assert "quick, standard, exact" in result.reason
    message = diagnostics.wait_for_newest(lambda m: True, "diagnostics")
    assert diagnostics_values(message, "world")["accuracy"] == "standard"


def test_parameter_is_described(client, node):
    """Its descriptor tells what the tiers promise, and their names."""
    request = DescribeParameters.Request(names=["accuracy"])
    name = "/scene_graph/describe_parameters"
    (descriptor,) = client.call_any(DescribeParameters, name, request).descriptors
    assert not descriptor.read_only
    assert all(tier.value in descriptor.description for tier in Accuracy)
    assert "1e-12" in descriptor.description
