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

from geometry_msgs.msg import Pose, Quaternion, Transform, Vector3
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState
from until_stopped import spin_until, stopped_by_signals

from scene_graph_msgs.srv import DescribeScene

RADIUS = 0.04
"""Metres, of the circles."""
PERIOD = 4.0
"""Seconds per circle."""


def turned(q: Quaternion, angle: float) -> Quaternion:
    """Return ``q`` turned by ``angle`` (rad) about the object's own z axis."""
    s, c = math.sin(angle / 2), math.cos(angle / 2)
    return Quaternion(
        x=q.x * c + q.y * s, y=q.y * c - q.x * s, z=q.z * c + q.w * s, w=q.w * c - q.z * s
    )


def pose_at(start: Pose, time: float, phase: float) -> Transform:
    """Return where an object that started at ``start`` is after ``time`` (s)."""
    angle = 2.0 * math.pi * time / PERIOD + phase
    p, up = start.position, 0.5 * RADIUS * math.sin(2.0 * angle)
    return Transform(
        translation=Vector3(
            x=p.x + RADIUS * math.cos(angle), y=p.y + RADIUS * math.sin(angle), z=p.z + up
        ),
        rotation=turned(start.orientation, 0.5 * angle),
    )


class MovingObjects(Node):
    """Publishes ``sensor_msgs/MultiDOFJointState`` for all frames of one source."""

    def __init__(self, scene: Any, source: str, rate: float) -> None:
        super().__init__("moving_objects")
        topic = next(entry.pose_topic for entry in scene.sources if entry.name == source)
        self._starts = {frame.name: frame.pose for frame in scene.frames}
        self._publisher = self.create_publisher(MultiDOFJointState, topic, 10)
        self._start = self.get_clock().now()
        self.get_logger().info(f"{len(self._starts)} objects on {topic} at {rate:g} Hz")
        self.create_timer(1.0 / rate, self._publish)

    def _publish(self) -> None:
        now = self.get_clock().now()
        time = (now - self._start).nanoseconds * 1e-9
        message = MultiDOFJointState(joint_names=list(self._starts))
        message.header.stamp = now.to_msg()
        message.header.frame_id = "world"
        message.transforms = [
            pose_at(start, time, phase=float(i)) for i, start in enumerate(self._starts.values())
        ]
        self._publisher.publish(message)


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
    arguments = parser.parse_args()
    with stopped_by_signals() as is_stopped:
        scene = describe(arguments.source, arguments.scene_graph, is_stopped)
        if scene is not None:
            spin_until(MovingObjects(scene, arguments.source, arguments.rate), is_stopped)


if __name__ == "__main__":
    main()
