"""Joints that pages move: told to everybody as messages on the topic of the robot's joints.

So the node itself takes them in as from any other program, and so do others that listen. A robot
whose joints somebody else publishes is left to that. Imported only where the parameter
`browser_control` asks for it.
"""

from __future__ import annotations

from collections.abc import Mapping
import math
import threading
import time
from typing import Any

from sensor_msgs.msg import JointState

from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.runtime.qos import contact_qos
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.views.sliders import Slider

__all__ = ["JointSliders", "sliders_of"]

_JOINT_STATE = "sensor_msgs/msg/JointState"

_WITHOUT_LIMITS = {"rad": math.pi, "m": 1.0}
"""How far a slider goes to both sides for a joint that has no limits."""

_LOOK_PERIOD = 0.5
"""Seconds between two looks at the publishers of joint states."""


def sliders_of(snapshot: WorldSnapshot) -> tuple[Slider, ...]:
    """Return the joints that can be moved: one number each, which no other joint's follows."""
    found = []
    for name, record in sorted(snapshot.records.items()):
        if record.robot is None or record.pose_type != _JOINT_STATE:
            continue
        for joint in record.robot.kinematics.robot.positioned_joints():
            if joint.mimic is None:
                unit = "m" if joint.type.value == "prismatic" else "rad"
                far = _WITHOUT_LIMITS[unit]
                lower = -far if joint.lower is None else joint.lower
                upper = far if joint.upper is None else joint.upper
                found.append(Slider(name, joint.name, lower, upper, unit))
    return tuple(found)


class JointSliders:
    """Publishes where joints are to be, in the thread of updates."""

    def __init__(self, host: Host) -> None:
        self._host, self._node = host, host.node
        self._lock = threading.Lock()
        self._wanted: dict[tuple[str, str], float] = {}
        self._publishers: dict[str, Any] = {}
        self._version = -1
        self._sliders: tuple[Slider, ...] = ()
        self._refused: Mapping[str, str] = {}
        self._looked_at = float("-inf")
        self.moved = 0
        """Positions that were published."""
        self.sequence = 0
        """Another number for each change of what ``refused`` returns."""

    def move(self, robot: str, joint: str, position: float) -> None:
        """Have a joint move, in the next update; from any thread. The newest position counts."""
        with self._lock:
            self._wanted[robot, joint] = position
        self._host.request_update()

    def sliders(self, snapshot: WorldSnapshot) -> tuple[Slider, ...]:
        """Return the joints that can be moved; the same object while the scene is the same."""
        if snapshot.scene_version != self._version:
            self._version, self._sliders = snapshot.scene_version, sliders_of(snapshot)
            self._looked_at = float("-inf")
        return self._sliders

    def refused(self, snapshot: WorldSnapshot) -> Mapping[str, str]:
        """Return why a robot's joints can't be moved, by its name; looked up now and then."""
        sliders, now = self.sliders(snapshot), time.monotonic()
        if now - self._looked_at >= _LOOK_PERIOD:
            self._looked_at = now
            topics = self._host.pose_topics(snapshot)
            reasons = {name: self._reason(topics.get(name, "")) for name, *_ in sliders}
            refused = {name: reason for name, reason in reasons.items() if reason}
            if refused != self._refused:
                self._refused, self.sequence = refused, self.sequence + 1
        return self._refused

    def publish(self, snapshot: WorldSnapshot) -> None:
        """Publish the pages' requests since the last call, within the joints' limits."""
        with self._lock:
            wanted, self._wanted = self._wanted, {}
        if not wanted:
            return
        topics, refused = self._host.pose_topics(snapshot), self.refused(snapshot)
        messages: dict[str, JointState] = {}
        for robot, joint, lower, upper, _ in self.sliders(snapshot):
            # What a page names that is not there any more is nothing.
            position = wanted.get((robot, joint))
            if position is not None and robot not in refused:
                message = messages.setdefault(robot, JointState())
                message.name.append(joint)
                message.position.append(min(max(position, lower), upper))
        stamp = stamp_to_msg(self._node.get_clock().now().nanoseconds)
        for robot, message in messages.items():
            message.header.stamp = stamp
            self._publisher(topics[robot]).publish(message)
            self.moved += len(message.name)

    def close(self) -> None:
        """Publish no more."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)
        self._publishers.clear()

    def _publisher(self, topic: str) -> Any:
        if topic not in self._publishers:
            self._publishers[topic] = self._node.create_publisher(
                JointState, topic, contact_qos(), callback_group=self._host.group
            )
            self._host.publishers_changed()
        return self._publishers[topic]

    def _reason(self, topic: str) -> str:
        """Say why nothing is to be published on a topic, "" where it may be."""
        if not topic:
            return "its topic has no name that ROS allows"
        own = self._node.get_name(), self._node.get_namespace()
        others = {
            f"{each.node_namespace.rstrip('/')}/{each.node_name}"
            for each in self._node.get_publishers_info_by_topic(topic)
            if (each.node_name, each.node_namespace) != own
        }
        return f"{', '.join(sorted(others))} publishes {topic}" if others else ""
