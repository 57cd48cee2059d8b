"""The process: it starts and stops cleanly, with both executors, embedded, and by lifecycle."""

from __future__ import annotations

import signal
import subprocess
import sys

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Quaternion, Transform, Vector3
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from node_harness import (
    Client,
    DEADLINE,
    diagnostics_values,
    environment,
    NodeProcess,
    ROOT,
    RUN_NODE,
    wait_until,
)
from pictured_files import write_obj
import pytest
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParametersAtomically
import rclpy
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import MultiDOFJointState
from spinning import SpinningThread
from transports import BY_HAND, PROFILES

from scene_graph_msgs.msg import ContactArray, Status
import scene_graph_msgs.srv as srv

SCENE = """
version: 1
sources:
  - {name: ball}
frames:
  - {name: ball, source: ball, pose: {xyz: [0.0, 0.0, 0.05]}}
geometries:
  - {name: ball, source: ball, frame: ball, shape: {type: sphere, radius: 0.1}}
  - {name: floor, source: ball, shape: {type: half_space}}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A ball that is 5 cm deep in the floor."""
    path = tmp_path_factory.mktemp("scene") / "ball.yaml"
    path.write_text(SCENE)
    return path


def pose(z, stamp):
    """Return a message that puts the ball at a height."""
    transform = Transform(translation=Vector3(z=z), rotation=Quaternion(w=1.0))
    message = MultiDOFJointState(joint_names=["ball"], transforms=[transform])
    message.header.stamp = stamp
    return message


@pytest.mark.parametrize("executor", ["single_threaded", "multi_threaded"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_works_with_both_executors_and_stops_cleanly(
    client, start_node, scene, executor, number
):
    """Poses go in, contacts come out and services answer; a signal ends it with code 0."""
    node = start_node({"scene": scene, "executor": executor})
    contacts = client.listen(ContactArray, "contacts")
    contacts.wait_for(lambda m: len(m.points) == 1, "the contact")
    publisher = client.publisher(MultiDOFJointState, "/ball/poses")
    publisher.publish(pose(1.0, client.now()))
    contacts.wait_for_newest(lambda m: len(m.points) == 0, "the end of the contact")
    assert client.call("HasCollisions").status.code == Status.OK
    assert node.stop(number) == 0
    assert "Traceback" not in node.output()
    client.forget(contacts)
    client.destroy(publisher)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"scene": "/nowhere/at_all.yaml"}, "/nowhere/at_all.yaml"),
        ({"max_update_rate": -1.0}, "max_update_rate"),
        ({"executor": "magic"}, "magic"),
        ({"min_update_rate": 100.0, "max_update_rate": 50.0}, "min_update_rate"),
    ],
)
def test_a_wrong_start_is_refused_with_a_reason(domain, parameters, message):
    """A scene that is not there and values out of range end the process with code 1."""
    node = NodeProcess(domain, parameters)
    assert node.process.wait(timeout=DEADLINE) == 1
    assert message in node.output()
    assert "Traceback" not in node.output()


@pytest.mark.parametrize(
    ("variables", "message"),
    [
        ({"HOME": "", "ROS_LOG_DIR": None, "ROS_HOME": None}, "HOME is empty: name a folder"),
        ({"ROS_LOG_DIR": "/proc/nothing"}, "'/proc/nothing' for the log can't be made"),
        ({"PYTHONWARNINGS": "error"}, "a warning was made an error by PYTHONWARNINGS"),
    ],
    ids=["no home", "no log", "warnings"],
)
def test_an_environment_without_what_it_takes_is_refused_in_a_sentence(domain, variables, message):
    """With the remedy; nobody has to read where in the program that was."""
    node = NodeProcess(domain, extra_environment=variables, fresh=True)
    assert node.process.wait(timeout=DEADLINE) == 1
    lines = node.output().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("scene_graph: ")
    assert message in lines[0]


def test_what_a_mesh_is_shown_without_is_in_the_log(start_node, tmp_path):
    """A picture that its file names is missing: a warning of the node's own, once."""
    write_obj(tmp_path, [(None, "lost.png")])
    shape = f"shape: {{type: mesh, file: {tmp_path}/squares.obj}}, roles: {{perception: {{}}}}"
    (tmp_path / "cup.yaml").write_text(
        SCENE.split("frames:", maxsplit=1)[0]
        + f"geometries:\n  - {{name: cup, source: ball, {shape}}}\n"
    )
    process = start_node({"scene": tmp_path / "cup.yaml"})
    process.wait_for_output("squares.obj' names 'lost.png', shown without: ")
    lines = [line for line in process.output().splitlines() if "lost.png" in line]
    assert len(lines) == 1
    assert lines[0].startswith("[WARN]")
    assert lines[0].endswith("lost.png' does not exist")
    assert process.stop() == 0


def test_names_can_be_remapped_and_put_into_a_namespace(client, start_node, scene):
    """All names are relative: topics and services move with the node's namespace and name."""
    node = start_node({"scene": scene}, remaps=["__ns:=/cell", "__node:=world"], fresh=True)
    wait_until(lambda: "/cell/world/contacts" in client.topics(), "the topic in the namespace")
    kind = srv.DescribeScene
    answer = client.call_any(kind, "/cell/world/describe_scene", kind.Request())
    assert answer.sources[0].pose_topic == "/cell/ball/poses"
    assert node.stop() == 0


def test_lifecycle_is_offered_and_not_forced(client, start_node, domain, scene):
    """Without autostart nothing happens until a manager asks; every state can be left again."""
    wait_until(lambda: "/scene_graph/contacts" not in client.topics(), "the former node to go")
    node = NodeProcess(domain, {"scene": scene, "autostart": False})

    def change(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        return client.call_any(ChangeState, "/scene_graph/change_state", request).success

    def state():
        answer = client.call_any(GetState, "/scene_graph/get_state", GetState.Request())
        return answer.current_state.label

    assert state() == "unconfigured"
    assert "/scene_graph/contacts" not in client.topics()
    assert change(Transition.TRANSITION_CONFIGURE)
    assert list(client.call("HasCollisions").has_collisions) == [1]
    # Services answer before poses are taken in: a source can already ask where to send them.
    (source,) = client.call("DescribeScene").sources
    assert source.pose_topic == "/ball/poses"
    assert "/scene_graph/contacts" not in client.topics()
    assert change(Transition.TRANSITION_ACTIVATE)
    contacts = client.listen(ContactArray, "contacts")
    contacts.wait_for(lambda m: len(m.points) == 1, "the contact")
    assert change(Transition.TRANSITION_DEACTIVATE)
    wait_until(lambda: "/scene_graph/contacts" not in client.topics(), "the end of the topic")
    assert client.call("HasCollisions").status.code == Status.OK
    assert change(Transition.TRANSITION_ACTIVATE)
    wait_until(lambda: "/scene_graph/contacts" in client.topics(), "the topic again")
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
    assert state() == "unconfigured"
    assert node.stop() == 0
    assert "Traceback" not in node.output()
    client.forget(contacts)


def test_parameters_are_described_and_set_wholly_or_not_at_all(client, start_node):
    """A set in which one value is wrong, or two don't go together, changes none of them."""
    node = start_node()
    described = client.call_any(
        DescribeParameters,
        "/scene_graph/describe_parameters",
        DescribeParameters.Request(names=["marker_rate", "executor"]),
    )
    rate, executor = described.descriptors
    assert rate.description
    assert rate.floating_point_range[0].to_value == 1000.0
    assert executor.read_only

    def set_all(**values):
        parameters = [
            ParameterMessage(
                name=name,
                value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value),
            )
            for name, value in values.items()
        ]
        request = SetParametersAtomically.Request(parameters=parameters)
        name = "/scene_graph/set_parameters_atomically"
        return client.call_any(SetParametersAtomically, name, request).result

    refused = set_all(marker_rate=5.0, min_update_rate=90.0, max_update_rate=80.0)
    assert not refused.successful
    assert "min_update_rate" in refused.reason
    assert not set_all(marker_rate=-5.0).successful
    assert set_all(min_update_rate=90.0, max_update_rate=95.0).successful
    # Had the refused set changed anything, this would not fit now.
    assert not set_all(max_update_rate=80.0).successful
    assert node.stop() == 0


def test_simulated_time_may_jump_back(client, start_node, scene):
    """After a jump back, poses with earlier stamps are taken again, and the jump is counted."""
    clock = client.node.create_publisher(Clock, "/clock", 10)
    node = start_node({"scene": scene, "use_sim_time": True, "diagnostics_rate": 20.0})
    wait_until(clock.get_subscription_count, "the node to listen to the clock")
    publisher = client.publisher(MultiDOFJointState, "/ball/poses")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def at(seconds, z):
        """Send the clock and a pose until the pose is there."""
        clock.publish(Clock(clock=Time(sec=seconds)))
        publisher.publish(pose(z, Time(sec=seconds)))
        answer = client.call("GetPoseInWorld", frames=["ball"])
        return answer.poses[0].position.z == z and answer.stamp.sec == seconds

    wait_until(lambda: at(1000, 1.0), "a pose at 1000 s")
    wait_until(lambda: at(10, 2.0), "a pose after the jump back to 10 s")
    message = diagnostics.wait_for(
        lambda m: int(diagnostics_values(m, "world")["clock jumps"]) >= 1, "a clock jump"
    )
    assert diagnostics_values(message, "world")["internal errors"] == "0"
    # Time stands still now; the node does not.
    contacts = client.listen(ContactArray, "contacts")
    wait_until(lambda: contacts.count >= 3, "contacts while time stands still")
    assert node.stop() == 0
    client.forget(contacts)
    client.forget(diagnostics)


def test_poses_before_simulated_time_begins_do_not_freeze_their_source(client, start_node, scene):
    """What the system's clock stamped is forgotten at the first tick, which counts as a jump."""
    node = start_node({"scene": scene, "use_sim_time": True, "diagnostics_rate": 20.0})
    clock = client.publisher(Clock, "/clock", best_effort=True)
    publisher = client.publisher(MultiDOFJointState, "/ball/poses")
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")

    def height():
        answer = client.call("GetPoseInWorld", frames=["ball"])
        assert answer.status.code == Status.OK, answer.status
        return answer.poses[0].position.z

    publisher.publish(pose(9.0, Time(sec=2**31 - 1, nanosec=2**32 - 1)))
    wait_until(lambda: publisher.publish(pose(1.0, client.now())) or height() == 1.0, "a pose")

    def at_ten_seconds():
        clock.publish(Clock(clock=Time(sec=10)))
        publisher.publish(pose(2.0, Time(sec=10)))
        return height() == 2.0

    wait_until(at_ten_seconds, "a pose in simulated time")
    message = diagnostics.wait_for(
        lambda m: int(diagnostics_values(m, "world")["clock jumps"]) >= 1, "a clock jump"
    )
    assert int(diagnostics_values(message, "source ball")["malformed"]) == 1
    assert node.stop() == 0
    client.forget(diagnostics)
    client.destroy(publisher)
    client.destroy(clock)


def test_an_activation_that_fails_leaves_the_node_as_it_was(domain, monkeypatch):
    """Nothing publishes or takes poses in, and the next one succeeds."""
    from scene_graph_ros.node.effects.manager import Effects
    from scene_graph_ros.node.node import SceneGraphNode

    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    parameters = [Parameter("autostart", value=False)]
    node = SceneGraphNode("unlucky", context=context, parameter_overrides=parameters)
    try:
        assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
        with monkeypatch.context() as broken:
            broken.setattr(Effects, "reports", lambda effects: 1 / 0)
            assert node.trigger_activate() == TransitionCallbackReturn.FAILURE
        assert not node.server.is_running()
        names = {name for name, _ in node.get_publisher_names_and_types_by_node("unlucky", "/")}
        assert "/unlucky/contacts" not in names
        assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
        assert node.server.is_running()
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, MultiThreadedExecutor])
def test_the_node_can_be_embedded(domain, kind):
    """The class takes a context, overrides and a model, and works in an executor of one's own."""
    import numpy as np

    from scene_graph_ros.geometry import (
        GeometryInstance,
        HalfSpace,
        ProximityProperties,
        SceneGraph,
        Sphere,
    )
    from scene_graph_ros.node.node import SceneGraphNode

    scene_graph = SceneGraph()
    source = scene_graph.register_source("own")
    for name, shape in (("ball", Sphere(0.1)), ("floor", HalfSpace())):
        instance = GeometryInstance(np.eye(4), shape, name)
        instance.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, instance)
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    node = SceneGraphNode(
        "embedded",
        context=context,
        scene_graph=scene_graph,
        parameter_overrides=[Parameter("world_frame", value="earth")],
    )
    executor = kind(context=context)
    executor.add_node(node)
    spinning = SpinningThread(executor)
    client = Client(domain, "/embedded")
    try:
        described = client.call("DescribeScene")
        assert [s.name for s in described.sources] == ["own"]
        contacts = client.listen(ContactArray, "contacts")
        message = contacts.wait_for_newest(lambda m: True, "contacts")
        assert message.header.frame_id == "earth"
    finally:
        client.close()
        spinning.close()
        node.destroy_node()
        rclpy.shutdown(context=context)


def test_an_effect_is_not_imported_before_it_is_asked_for(domain):
    """A fresh node without geometry has loaded neither marker nor contact modules, nor trimesh."""
    program = (
        "import sys, rclpy\n"
        "from scene_graph_ros.node.node import SceneGraphNode\n"
        "rclpy.init()\n"
        "node = SceneGraphNode()\n"
        "unwanted = [m for m in ('trimesh', 'pinocchio', 'tf2_msgs', 'pydantic',\n"
        "    'scene_graph_ros.node.effects.markers',\n"
        "    'scene_graph_ros.node.effects.point_contact') if m in sys.modules]\n"
        "node.destroy_node()\n"
        "rclpy.shutdown()\n"
        "sys.exit(', '.join(unwanted) or None)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=4 * DEADLINE,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def run_node(domain, *arguments):
    """Run the command with arguments that end it at once."""
    return subprocess.run(
        [sys.executable, "-m", "scene_graph_ros.node", *arguments],
        env=environment(domain),
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=4 * DEADLINE,
        check=False,
    )


TELL_PROFILES = f"""
import os, rclpy
begin = rclpy.init
def init(**options):
    print("profiles:", os.environ[{PROFILES!r}], flush=True)
    begin(**options)
rclpy.init = init
"""


def test_a_node_brings_its_own_profiles_of_fast_dds(start_node):
    """Where nobody names a file of them; other tests do, so that they would not show it."""
    node = start_node(extra_environment=BY_HAND, program=TELL_PROFILES + RUN_NODE)
    assert f"profiles: {ROOT / 'scene_graph_ros' / 'node' / 'fast_dds.xml'}\n" in node.output()


def test_help_names_the_parameters(domain):
    """Asked for help the command explains itself and ends, also beside ROS's arguments."""
    done = run_node(domain, "--help", "--ros-args", "-p", "scene:=x.yaml")
    assert done.returncode == 0, done.stderr
    for name in ("scene", "max_update_rate", "accuracy"):
        assert f"  {name} " in done.stdout


def test_an_argument_that_means_nothing_is_refused(domain):
    """A typing error does not start a node that ignores it."""
    done = run_node(domain, "--secne", "x.yaml")
    assert done.returncode == 2
    assert "--secne" in done.stderr
