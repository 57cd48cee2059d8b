"""Everything at once: poses, queries, changes of the scene and lifecycle transitions."""

from __future__ import annotations

import random
import threading
import time

from diagnostic_msgs.msg import DiagnosticArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from node_harness import Client, diagnostics_from_now, diagnostics_values, wait_until
import pytest
from rclpy.qos import QoSProfile
from scene_requests import reference, register_balls, sphere, transform, what_if
from sensor_msgs.msg import MultiDOFJointState
from visualization_msgs.msg import MarkerArray

from scene_graph_msgs.msg import ContactArray, Status

SECONDS = 4.0
"""How long it goes on: some hundred requests and five interruptions."""


def send_poses(client, publisher, stop):
    """Move both balls at 250 Hz."""
    rng = random.Random(3)
    while not stop.is_set():
        message = MultiDOFJointState(
            joint_names=["a", "b"], transforms=[transform(rng.random()), transform(0.5)]
        )
        message.header.stamp = client.now()
        publisher.publish(message)
        time.sleep(0.004)


def ask(other, codes, stop):
    """Ask three queries at a time and note the status of each answer."""
    while not stop.is_set():
        options = what_if("b", *[(0.05 * i, 0, 0) for i in range(20)])
        futures = [
            other.start("ComputePointPairPenetration", options=options),
            other.start("ComputeSignedDistancePairwise"),
            other.start("DescribeScene", with_shapes=True),
        ]
        for future in futures:
            wait_until(future.done, "an answer")
            codes.append(future.result().status.code)


def change(client, source, codes, stop):
    """Add and remove geometry and note the status of each answer."""
    while not stop.is_set():
        names = [f"extra_{i}" for i in range(5)]
        answers = [
            client.call(
                "RegisterGeometry",
                source=source,
                frame="a",
                geometries=[sphere(name) for name in names],
            ),
            client.call(
                "RemoveGeometry",
                source=source,
                geometries=[reference(name) for name in names],
            ),
        ]
        codes.extend(answer.status.code for answer in answers)


@pytest.mark.parametrize("executor", ["multi_threaded", "single_threaded"])
def test_everything_at_once_is_answered_and_leaves_no_fault(start_node, domain, client, executor):
    """Under all this every request is OK, no update fails, and the process ends with code 0."""
    node = start_node({"executor": executor, "diagnostics_rate": 10.0})
    other = Client(domain)
    source = register_balls(client)
    listeners = [
        client.listen(ContactArray, "contacts"),
        client.listen(MarkerArray, "markers/proximity", QoSProfile(depth=100)),
        client.listen(DiagnosticArray, "/diagnostics"),
    ]
    publisher = client.publisher(MultiDOFJointState, "/balls/poses")
    stop = threading.Event()
    codes: list[int] = []
    threads = [
        threading.Thread(target=send_poses, args=(client, publisher, stop)),
        threading.Thread(target=ask, args=(other, codes, stop)),
        threading.Thread(target=change, args=(client, source, codes, stop)),
    ]
    for thread in threads:
        thread.start()
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        time.sleep(0.7)
        for transition in (Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVATE):
            request = ChangeState.Request(transition=Transition(id=transition))
            assert other.call_any(ChangeState, "/scene_graph/change_state", request).success
    wait_until(lambda: len(codes) > 10, "more than ten answers")
    stop.set()
    for thread in threads:
        thread.join()
    assert set(codes) == {Status.OK}
    message = diagnostics_from_now(other, listeners[2])
    assert diagnostics_values(message, "world")["internal errors"] == "0"
    wait_until(lambda: listeners[0].count, "contacts")
    other.close()
    for listener in listeners:
        client.forget(listener)
    assert node.stop() == 0
    output = node.output()
    assert "Traceback" not in output, output[max(output.find("Traceback") - 300, 0) :][:4000]
