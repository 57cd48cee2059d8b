"""Free objects on the move: asks the node which frames a source has and publishes their poses.

    python examples/moving_objects.py --source objects --rate 100

Each object circles about the place where the scene put it, slowly spinning, so that it comes in
and out of contact with what is near. A real tracker of objects would publish the same message.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import math
from typing import Any

from common.until_stopped import repeat, spin_until, stopped_by_signals
from geometry_msgs.msg import Pose, Transform
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState

from scene_graph_msgs.srv import DescribeScene

RADIUS = 0.04
"""Metres, of the circles."""
PERIOD = 4.0
"""Seconds per circle."""


def move(X: Transform, start: Pose, time: float, phase: float) -> None:
    """Put into ``X`` where an object that started at ``start`` is after ``time`` (s)."""
    angle = 2.0 * math.pi * time / PERIOD + phase
    p, p0 = X.translation, start.position
    p.x = p0.x + RADIUS * math.cos(angle)
    p.y = p0.y + RADIUS * math.sin(angle)
    p.z = p0.z + 0.5 * RADIUS * math.sin(2.0 * angle)
    # It turns half as fast about its own z axis.
    s, c = math.sin(angle / 4.0), math.cos(angle / 4.0)
    q, q0 = X.rotation, start.orientation
    q.x, q.y = q0.x * c + q0.y * s, q0.y * c - q0.x * s
    q.z, q.w = q0.z * c + q0.w * s, q0.w * c - q0.z * s


class MovingObjects(Node):
    """Publishes ``sensor_msgs/MultiDOFJointState`` for all frames of one source."""

    def __init__(self, scene: Any, source: str) -> None:
        super().__init__("moving_objects", start_parameter_services=False)
        topic = next(entry.pose_topic for entry in scene.sources if entry.name == source)
        self._starts = [frame.pose for frame in scene.frames]
        self._message = MultiDOFJointState(
            joint_names=[frame.name for frame in scene.frames],
            transforms=[Transform() for _ in scene.frames],
        )
        self._message.header.frame_id = "world"
        self._publisher = self.create_publisher(MultiDOFJointState, topic, 10)
        self._start = self.get_clock().now().nanoseconds
        self.get_logger().info(f"{len(scene.frames)} objects on {topic}")

    def publish(self) -> None:
        """Publish where the objects are now."""
        now, stamp = self.get_clock().now().nanoseconds, self._message.header.stamp
        stamp.sec, stamp.nanosec = divmod(now, 10**9)
        time = (now - self._start) * 1e-9
        for i, (X, start) in enumerate(zip(self._message.transforms, self._starts, strict=True)):
            move(X, start, time, phase=float(i))
        self._publisher.publish(self._message)


def describe(source: str, scene_graph: str, is_stopped: Callable[[], bool]) -> Any:
    """Return the node's answer about a source, or None where a signal came before."""
    node = Node("moving_objects_setup")
    client = node.create_client(DescribeScene, f"{scene_graph}/describe_scene")
    while not client.wait_for_service(timeout_sec=1.0):
        if is_stopped():
            return None
        node.get_logger().info(f"waiting for {client.srv_name}")
    future = client.call_async(DescribeScene.Request(source=source))
    spin_until(node, lambda: future.done() or is_stopped())
    if not future.done():
        return None
    scene = future.result()
    if scene.status.code:
        raise SystemExit(f"{client.srv_name}: {scene.status.message}")
    node.destroy_node()
    return scene


def main() -> None:
    """Publish until interrupted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--source", default="objects", help="source whose frames to move")
    parser.add_argument("--scene-graph", default="/scene_graph", help="name of the node to ask")
    parser.add_argument("--rate", type=float, default=100.0, help="messages per second")
    parser.add_argument(
        "--phase",
        type=float,
        help="publish so many seconds after multiples of the period, by the system's clock",
    )
    arguments = parser.parse_args()
    with stopped_by_signals() as is_stopped:
        scene = describe(arguments.source, arguments.scene_graph, is_stopped)
        if scene is not None:
            objects = MovingObjects(scene, arguments.source)
            repeat(arguments.rate, objects.publish, is_stopped, arguments.phase)


if __name__ == "__main__":
    main()
