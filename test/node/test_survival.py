"""No message ends the process, or the executor of a program that embeds the node."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_harness import Client, diagnostics_values, wait_until
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from spinning import SpinningThread

from scene_graph_msgs.msg import ContactArray, Status
from scene_graph_ros.node.node import SceneGraphNode

SCENE = """
version: 1
sources:
  - {name: ball}
geometries:
  - {name: ball, source: ball, shape: {type: sphere, radius: 0.1}}
  - {name: floor, source: ball, shape: {type: half_space}}
"""
NO_TYPE = 99


class Embedded:
    """A node in an executor that guards against nothing, and a client of it."""

    def __init__(self, domain, kind, scene):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        values = {"scene": str(scene), "use_sim_time": True, "diagnostics_rate": 20.0}
        self.node = SceneGraphNode(
            context=self.context,
            parameter_overrides=[Parameter(name, value=value) for name, value in values.items()],
        )
        executor = kind(context=self.context)
        executor.add_node(self.node)
        self.spinning = SpinningThread(executor)
        self.client = Client(domain)
        self.contacts = self.client.listen(ContactArray, "contacts")

    def close(self):
        """End both."""
        self.client.close()
        self.spinning.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def ask(self, kind, name, **fields):
        """Call one of the services that rclpy offers for every node."""
        return self.client.call_any(kind, f"/scene_graph/{name}", kind.Request(**fields))

    def check_life(self):
        """Wait for further contacts, and for answers of the executor and of the node itself."""
        count = self.contacts.count
        wait_until(lambda: self.contacts.count > count + 1, "further contacts")
        assert self.client.call("HasCollisions").status.code == Status.OK
        state = self.ask(GetState, "get_state").current_state
        assert state.label == "active"


@pytest.fixture(scope="module", params=[SingleThreadedExecutor, MultiThreadedExecutor])
def embedded(request, domain, tmp_path_factory):
    """A node with a ball in the floor, in each kind of executor."""
    scene = tmp_path_factory.mktemp("scene") / "ball.yaml"
    scene.write_text(SCENE)
    embedded = Embedded(domain, request.param, scene)
    yield embedded
    embedded.close()


@pytest.mark.parametrize(
    "transition",
    [
        Transition(id=Transition.TRANSITION_ACTIVATE),
        Transition(id=Transition.TRANSITION_CREATE),
        Transition(id=99),
        Transition(label="activate"),
        Transition(label="no such label"),
    ],
    ids=lambda t: t.label or str(t.id),
)
def test_a_transition_that_the_state_does_not_allow_is_refused(embedded, transition):
    """The answer is no, and the node is active as before."""
    assert not embedded.ask(ChangeState, "change_state", transition=transition).success
    embedded.check_life()


def test_transitions_that_the_state_allows_are_done(embedded):
    """By number or by label, and back again."""
    inactive = Transition(id=Transition.TRANSITION_DEACTIVATE)
    assert embedded.ask(ChangeState, "change_state", transition=inactive).success
    assert embedded.ask(
        ChangeState, "change_state", transition=Transition(label="activate")
    ).success
    embedded.check_life()


@pytest.mark.parametrize("name", ["marker_rate", "unknown"])
def test_a_parameter_of_no_type_is_refused_with_a_reason(embedded, name):
    """The parameters beside it are set one by one, and not at all where all are meant."""
    odd = ParameterMessage(name=name, value=ParameterValue(type=NO_TYPE))
    good = Parameter("marker_rate", value=7.0).to_parameter_msg()
    refused, done = embedded.ask(SetParameters, "set_parameters", parameters=[odd, good]).results
    assert not refused.successful
    assert name in refused.reason
    assert str(NO_TYPE) in refused.reason
    assert done.successful
    other = Parameter("marker_rate", value=8.0).to_parameter_msg()
    result = embedded.ask(
        SetParametersAtomically, "set_parameters_atomically", parameters=[other, odd]
    ).result
    assert not result.successful
    assert str(NO_TYPE) in result.reason
    (value,) = embedded.ask(GetParameters, "get_parameters", names=["marker_rate"]).values
    assert value.double_value == 7.0
    embedded.check_life()


def test_parameters_that_are_not_declared_are_refused_by_name(embedded):
    """As ordinary nodes do it."""
    parameter = Parameter("colour", value="red").to_parameter_msg()
    (result,) = embedded.ask(SetParameters, "set_parameters", parameters=[parameter]).results
    assert not result.successful
    assert "colour" in result.reason
    embedded.check_life()


def test_a_clock_that_can_not_be_is_refused_and_counted(embedded):
    """Negative seconds, and nanoseconds that a second does not have; later clocks are heard."""
    client = embedded.client
    clock = client.publisher(Clock, "/clock", best_effort=True)

    def is_heard(second):
        clock.publish(Clock(clock=Time(sec=second)))
        return embedded.node.get_clock().now().nanoseconds == second * 10**9

    # What best effort sends is lost until both sides know each other.
    wait_until(lambda: is_heard(11), "the first clock")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    before = embedded.node.clocks_refused
    for wrong in (Time(sec=-1), Time(sec=5, nanosec=10**9)):
        clock.publish(Clock(clock=wrong))
        before += 1
        wait_until(lambda expected=before: embedded.node.clocks_refused == expected, "a refusal")
    diagnostics.wait_for_newest(
        lambda m: diagnostics_values(m, "world")["clock messages refused"] == str(before),
        "the count in the diagnostics",
    )
    embedded.check_life()
    wait_until(lambda: is_heard(12), "the clock")
    client.forget(diagnostics)
    client.destroy(clock)


def test_the_rate_of_diagnostics_changes_at_once(embedded):
    """Not only after the time that the old rate meant, of which ten would be too many to wait."""

    def set_rate(hertz):
        parameter = Parameter("diagnostics_rate", value=hertz).to_parameter_msg()
        (result,) = embedded.ask(SetParameters, "set_parameters", parameters=[parameter]).results
        assert result.successful, result.reason

    set_rate(0.1)
    diagnostics = embedded.client.listen(DiagnosticArray, "/diagnostics")
    set_rate(20.0)
    wait_until(lambda: diagnostics.count > 10, "more than ten messages")
    embedded.client.forget(diagnostics)
