"""Topics of sources are subscribed to each for itself: one that can't be costs no other."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from node_harness import Client
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import MultiDOFJointState
from spinning import SpinningThread

from scene_graph_msgs.msg import Status
from scene_graph_ros.geometry import GeometryFrame, GeometryInstance, SceneGraph, Sphere
from scene_graph_ros.node.node import SceneGraphNode


@pytest.fixture
def client(domain):
    """A client of a node whose model, made by a program, has a source that makes no topic."""
    graph = SceneGraph()
    for name in ("two words", "good"):
        source = graph.register_source(name)
        frame = graph.register_frame(source, GeometryFrame(f"frame of {name}"))
        graph.register_geometry(source, frame, GeometryInstance(np.eye(4), Sphere(0.1), "ball"))
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=domain)
    fast = [Parameter("diagnostics_rate", value=20.0)]
    node = SceneGraphNode("embedded", context=context, scene_graph=graph, parameter_overrides=fast)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    spinning = SpinningThread(executor)
    client = Client(domain, "/embedded")
    yield client
    client.close()
    spinning.close()
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_a_topic_that_fails_costs_no_other(capfd, client):
    """It is told once and shown in the diagnostics; sources before and after it are heard."""
    later = client.call("RegisterSource", name="later")
    assert (later.status.code, later.pose_topic) == (Status.OK, "/later/poses")
    described = client.call("DescribeScene")
    assert {s.name: s.pose_topic for s in described.sources} == {
        "two words": "",
        "good": "/good/poses",
        "later": "/later/poses",
    }
    for topic in ("/good/poses", "/later/poses"):
        client.destroy(client.publisher(MultiDOFJointState, topic))
    diagnostics = client.listen(DiagnosticArray, "/diagnostics")
    message = diagnostics.wait_for(lambda m: len(m.status) > 3, "diagnostics of the sources")
    levels = {status.name: status for status in message.status}
    bad = levels["embedded: source two words"]
    assert bad.level == DiagnosticStatus.ERROR
    assert bad.message.startswith("no poses can be received: InvalidTopicNameException")
    assert levels["embedded: source good"].level == DiagnosticStatus.OK
    client.forget(diagnostics)
    assert client.call("RemoveSource", source=later.source).status.code == Status.OK
    logged = "".join(capfd.readouterr())
    assert logged.count("source 'two words': no poses can be received") == 1
    assert "Traceback" not in logged
