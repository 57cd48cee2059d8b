"""Single jobs of the message path beside the ordinary way, in one process.

What is published has a reader in another process; what is read was sent by another process.
Times are processor times of this process, so that other work on the machine matters little.
"""

from __future__ import annotations

from collections.abc import Callable
import gc
import statistics
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from benchmarks.messages.baseline import apply_message, make_markers
from benchmarks.messages.processes import isolated, Isolation, Sender
from benchmarks.messages.scene import poses, scene_text, SOURCE
from msg_adapters.scene import marker_items
from msg_adapters.wire.markers import MarkerWire
from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.pose_channel import PoseChannel
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

__all__ = ["markers", "received_poses"]

_MATCH_SECONDS = 30.0
_LIMITS = TimeLimits(0, 0, 0)

Row = tuple[str, float, float, str]
"""What was done, processor seconds the ordinary way and ours, and the size of the result."""


class _Domain:
    """A node on an isolated domain."""

    def __init__(self, isolation: Isolation) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=isolation.domain)
        self.node = rclpy.create_node("micro", context=self.context)

    def close(self) -> None:
        """End it."""
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def _median(job: Callable[[], float], repetitions: int) -> float:
    job()
    gc.collect()
    return statistics.median(job() for _ in range(repetitions))


def _model(count: int) -> tuple[SceneGraph, Any, dict[str, Any]]:
    graph = SceneGraph()
    loaded = load_scene_text(scene_text(count)).apply(graph)
    source = loaded.sources[SOURCE]
    return graph, source.source_id, source.frames


def _poses(count: int, step: int) -> np.ndarray:
    rows = poses(count, step)
    return poses_from_quaternions(rows[:, :3], rows[:, 3:])


def markers(count: int, repetitions: int) -> Row:
    """Build and publish all markers, every pose changed before."""
    graph, source, _ = _model(count)
    context = graph.create_default_context()
    query, inspector = graph.query_object(context), graph.model_inspector()
    world = World(graph)
    snapshot = world.snapshot
    ids = snapshot.query.snapshot.role_arrays(Role.PROXIMITY).geometry_ids
    wire = MarkerWire(serialize_message, frame_id="world")
    wire.set_items(marker_items(snapshot.inspector, snapshot.names, Role.PROXIMITY, ids))
    step = 0
    sizes: dict[str, int] = {}
    with isolated() as isolation:
        domain = _Domain(isolation)
        publisher = domain.node.create_publisher(MarkerArray, "markers", QoSProfile(depth=1))
        reader = isolation.start("benchmarks.messages.reader")
        begin = time.monotonic()
        while not publisher.get_subscription_count():
            if reader.poll() is not None or time.monotonic() - begin > _MATCH_SECONDS:
                raise RuntimeError("the reader of markers did not come up")
            time.sleep(0.01)

        def ordinary() -> float:
            nonlocal step
            step += 1
            context.set_frame_poses(source, _poses(count, step))
            start = time.process_time()
            message = make_markers(inspector, query, list(ids), Header(frame_id="world"))
            publisher.publish(message)
            sizes["ordinary"] = len(message.markers)
            return time.process_time() - start

        def ours() -> float:
            nonlocal step
            step += 1
            context.set_frame_poses(source, _poses(count, step))
            start = time.process_time()
            X_WG = query.snapshot.X_WG_of(Role.PROXIMITY)
            data, sizes["ours"] = wire.message(X_WG, step, is_whole=False)
            publisher.publish(data)
            return time.process_time() - start

        result = _median(ordinary, max(3, repetitions // 10)), _median(ours, repetitions)
        domain.close()
    size = f"{sizes['ordinary']} and {sizes['ours']} markers"
    return (f"{count} markers built and published", *result, size)


def received_poses(count: int, repetitions: int) -> Row:
    """Receive poses that another process sent, and move the frames by them."""
    graph, source, frames = _model(count)
    context = graph.create_default_context()
    rows = {name: row for row, name in enumerate(frames)}
    X_PF = np.tile(np.eye(4), (count, 1, 1))
    world = World(graph)
    channel = PoseChannel(world.records[SOURCE], Intake(SOURCE, print), MultiDOFJointState)
    moved = {"ordinary": 0, "ours": 0}
    with isolated() as isolation:
        domain = _Domain(isolation)
        subscription = domain.node.create_subscription(
            MultiDOFJointState, f"{SOURCE}/poses", lambda message: None, 10
        )
        sender = Sender(isolation, count)
        sender.begin(20.0, 1e6)

        def take(is_raw: bool) -> tuple[Any, float]:
            _wait(domain, subscription)
            start = time.process_time()
            handle = subscription.handle
            return handle.take_message(subscription.msg_type, is_raw)[0], start

        def ordinary() -> float:
            message, start = take(False)
            apply_message(message, rows, X_PF, source, context)
            moved["ordinary"] = len(message.joint_names)
            return time.process_time() - start

        def ours() -> float:
            data, start = take(True)
            with world.lock:
                channel.store(data, time.monotonic_ns())
                before = channel.intake.statistics.applied_poses
                channel.apply(channel.take(), world.frames(SOURCE), _LIMITS)
                world.commit({SOURCE}, None)
            moved["ours"] = channel.intake.statistics.applied_poses - before
            return time.process_time() - start

        for _ in range(5):
            ours()
        result = _median(ordinary, max(3, repetitions // 10)), _median(ours, repetitions)
        domain.close()
    size = f"{moved['ordinary']} and {moved['ours']} poses"
    return (f"{count} poses received and applied", *result, size)


def _wait(domain: _Domain, subscription: Any) -> None:
    with domain.context.handle, subscription.handle:
        while True:
            wait_set = rclpy_implementation.WaitSet(1, 0, 0, 0, 0, 0, domain.context.handle)
            wait_set.clear_entities()
            wait_set.add_subscription(subscription.handle)
            wait_set.wait(int(_MATCH_SECONDS * 1e9))
            if wait_set.get_ready_entities("subscription"):
                return
            raise RuntimeError("no poses came")
