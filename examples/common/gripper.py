"""A simulated gripper that closes until it feels a force, by what the node says of contacts."""

from __future__ import annotations

from collections.abc import Callable
import math
import time
from typing import Any

from geometry_msgs.msg import Quaternion, Transform, Vector3
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import MultiDOFJointState
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import ContactArray
from scene_graph_msgs.srv import ComputeContactSurfaces, ComputePointPairPenetration

NODE = "/scene_graph"
LATCHED = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
FINGER_HEIGHT = 0.093
"""Metres, of the fingers' origins over the table."""
OPEN, CLOSED = 0.04, 0.03
"""Metres between the middle and each finger."""
SPEED = 0.01
"""Metres per second: the fastest that a finger moves."""
GAIN = 1e-3
"""Metres per second for each newton that is missing."""
TOLERANCE, SETTLED = 0.01, 0.3
"""The force counts as reached when it is off by less than a hundredth for this long (s)."""
PATIENCE = 30.0
"""Seconds to wait for a message, an answer or a force."""


def norm(v: Any) -> float:
    """Return the length of a message's vector."""
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)


class Gripper(Node):
    """Publishes the fingers' poses, listens to contacts and markers."""

    def __init__(self, rate: float) -> None:
        rclpy.init()
        super().__init__("gripper")
        self.opening = OPEN
        self.contacts: ContactArray | None = None
        self.latencies: list[float] = []
        self._period = 1.0 / rate
        self._target = 0.0
        self._markers: dict[tuple[str, int], Marker] = {}
        self._publisher = self.create_publisher(MultiDOFJointState, "/gripper/poses", 10)
        self.create_subscription(ContactArray, f"{NODE}/contacts", self._on_contacts, 10)
        for topic in ("markers/illustration", "contact_surface_markers"):
            self.create_subscription(MarkerArray, f"{NODE}/{topic}", self._on_markers, LATCHED)
        self.create_timer(self._period, self._step)

    def __enter__(self) -> Gripper:
        return self

    def __exit__(self, *exception: object) -> None:
        self.destroy_node()
        rclpy.try_shutdown()

    @property
    def force(self) -> float:
        """The smaller of the forces on the two pads, newton."""
        surfaces = self.contacts.surfaces if self.contacts else []
        return min((norm(s.wrench.force) for s in surfaces), default=0.0)

    def markers(self) -> list[Marker]:
        """Return what the node shows at present."""
        return list(self._markers.values())

    def _on_contacts(self, message: ContactArray) -> None:
        stamp = message.header.stamp
        if stamp.sec:
            self.latencies.append(time.time() - (stamp.sec + 1e-9 * stamp.nanosec))
        self.contacts = message

    def _on_markers(self, message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.ADD:
                self._markers[marker.ns, marker.id] = marker
            else:
                self._markers.pop((marker.ns, marker.id), None)

    def _step(self) -> None:
        """Close or open by what the force lacks, and say where the fingers are."""
        if self._target > 0.0:
            speed = float(np.clip(GAIN * (self._target - self.force), -SPEED, SPEED))
            self.opening = float(np.clip(self.opening - speed * self._period, CLOSED, OPEN))
        message = MultiDOFJointState(joint_names=["left_finger", "right_finger"])
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = "world"
        # Both fingers hang down; the right one is turned by half a turn.
        for side, rotation in ((-1.0, Quaternion(x=1.0, w=0.0)), (1.0, Quaternion(y=1.0, w=0.0))):
            position = Vector3(x=0.0, y=side * self.opening, z=FINGER_HEIGHT)
            message.transforms.append(Transform(translation=position, rotation=rotation))
        self._publisher.publish(message)

    def wait(self, is_done: Callable[[], bool], what: str, seconds: float = PATIENCE) -> None:
        """Handle messages until ``is_done``; raise TimeoutError after so many seconds."""
        end = time.monotonic() + seconds
        while not is_done():
            if time.monotonic() > end:
                raise TimeoutError(f"{what}: not within {seconds:g} s")
            rclpy.spin_once(self, timeout_sec=0.05)

    def squeeze(self, force: float) -> None:
        """Close, or open, until both pads feel ``force`` (N) and it stays."""
        self._target = force
        since = time.monotonic()

        def is_settled() -> bool:
            nonlocal since
            if abs(self.force - force) > TOLERANCE * force:
                since = time.monotonic()
            return time.monotonic() - since > SETTLED

        self.wait(is_settled, f"a force of {force:g} N")

    def _ask(self, service: type, name: str, request: Any) -> Any:
        client = self.create_client(service, f"{NODE}/{name}")
        self.wait(client.service_is_ready, client.srv_name)
        future = client.call_async(request)
        self.wait(future.done, client.srv_name)
        reply = future.result()
        if reply.status.code:
            raise RuntimeError(f"{client.srv_name}: {reply.status.message}")
        return reply

    def ask_surfaces(self) -> Any:
        """Return the contact surfaces with all their faces, as triangles."""
        request = ComputeContactSurfaces.Request()
        return self._ask(ComputeContactSurfaces, "compute_contact_surfaces", request).table

    def ask_points(self) -> Any:
        """Return the table of what point contact says of the same moment."""
        request = ComputePointPairPenetration.Request()
        name = "compute_point_pair_penetration"
        return self._ask(ComputePointPairPenetration, name, request).table
