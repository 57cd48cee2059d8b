"""The ordinary way: messages as objects, one callback after another, in rclpy's executor.

A node with the topics of the scene graph node, written as one writes it with rclpy: a typed
subscription, a loop over transforms, a loop over contacts, a loop over markers. It asks the same
core for the contacts, so what differs is the way of the messages only.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import time
from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
import numpy as np
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import MultiDOFJointState
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from scene_graph_msgs.msg import ContactArray, GeometryName, PointContact
from scene_graph_ros.geometry import Role, SceneGraph
from scene_graph_ros.geometry.spatial.poses import poses_from_quaternions, quaternions_from_poses
from scene_graph_ros.scene_files import load_scene

__all__ = ["OrdinaryNode", "apply_message", "make_markers"]

_MARKER_PERIOD = 1.0 / 30.0
_SIZES: dict[str, Any] = {
    "Sphere": lambda s: (Marker.SPHERE, (2 * s.radius,) * 3),
    "Box": lambda s: (Marker.CUBE, (s.width, s.depth, s.height)),
    "Cylinder": lambda s: (Marker.CYLINDER, (2 * s.radius, 2 * s.radius, s.length)),
    "Ellipsoid": lambda s: (Marker.SPHERE, (2 * s.a, 2 * s.b, 2 * s.c)),
}


def apply_message(
    message: MultiDOFJointState, rows: dict[str, int], X_PF: np.ndarray, source: Any, context: Any
) -> None:
    """Move the frames that a message names; ``rows`` are theirs in ``X_PF`` ``(n, 4, 4)``."""
    numbers = []
    for transform in message.transforms:
        t, q = transform.translation, transform.rotation
        numbers.append((t.x, t.y, t.z, q.x, q.y, q.z, q.w))
    given = np.array(numbers).reshape(-1, 7)
    chosen = [rows[name] for name in message.joint_names]
    X_PF[chosen] = poses_from_quaternions(given[:, :3], given[:, 3:])
    context.set_frame_poses(source, X_PF)


def make_markers(inspector: Any, query: Any, ids: list[Any], header: Header) -> MarkerArray:
    """Return a marker for each geometry, where it is."""
    array = MarkerArray()
    X_WG = query.snapshot.X_WG_of(Role.PROXIMITY)
    positions, quaternions = X_WG[:, :3, 3].tolist(), quaternions_from_poses(X_WG).tolist()
    for geometry_id, p, q in zip(ids, positions, quaternions, strict=True):
        shape = inspector.get_shape(geometry_id)
        kind, size = _SIZES[type(shape).__name__](shape)
        marker = Marker(header=header, ns="proximity", id=int(geometry_id), type=kind)
        marker.pose = Pose(
            position=Point(x=p[0], y=p[1], z=p[2]),
            orientation=Quaternion(x=q[0], y=q[1], z=q[2], w=q[3]),
        )
        marker.scale = Vector3(x=float(size[0]), y=float(size[1]), z=float(size[2]))
        marker.color = ColorRGBA(r=0.7, g=0.7, b=0.7, a=1.0)
        array.markers.append(marker)
    return array


class OrdinaryNode(Node):
    """Contacts and markers of a scene file, the ordinary way."""

    def __init__(self, scene: Path) -> None:
        super().__init__("scene_graph")
        graph = SceneGraph()
        ((_, source),) = load_scene(scene).apply(graph).sources.items()
        self._source = source.source_id
        self._rows = {name: row for row, name in enumerate(source.frames)}
        self._X_PF = np.tile(np.eye(4), (len(source.frames), 1, 1))
        self._model_context = graph.create_default_context()
        self._query = graph.query_object(self._model_context)
        self._inspector = graph.model_inspector()
        self._ids = self._query.snapshot.role_arrays(Role.PROXIMITY).geometry_ids
        self._last_markers = float("-inf")
        self._contacts = self.create_publisher(ContactArray, "~/contacts", 10)
        self._markers = self.create_publisher(MarkerArray, "~/markers/proximity", 1)
        topic = f"{source.name}/poses"
        self.create_subscription(MultiDOFJointState, topic, self._on_poses, 64)
        self.create_timer(0.1, self._publish_idle)
        self._has_poses = False

    def _publish_idle(self) -> None:
        if not self._has_poses:
            self._publish_contacts(Header(frame_id="world"))

    def _on_poses(self, message: MultiDOFJointState) -> None:
        self._has_poses = True
        apply_message(message, self._rows, self._X_PF, self._source, self._model_context)
        header = Header(stamp=message.header.stamp, frame_id="world")
        self._publish_contacts(header)
        if time.monotonic() - self._last_markers >= _MARKER_PERIOD:
            self._last_markers = time.monotonic()
            self._markers.publish(make_markers(self._inspector, self._query, self._ids, header))

    def _name(self, geometry_id: Any) -> GeometryName:
        inspector = self._inspector
        frame = inspector.get_frame_id(geometry_id)
        return GeometryName(
            id=int(geometry_id),
            frame_id=int(frame),
            source=inspector.get_owning_source_name(geometry_id),
            frame=inspector.get_name(frame),
            name=inspector.get_name(geometry_id),
        )

    def _publish_contacts(self, header: Header) -> None:
        message = ContactArray(header=header)
        for pair in self._query.compute_point_pair_penetration():
            a, b, n = (v.tolist() for v in (pair.p_WCa, pair.p_WCb, pair.nhat_BA_W))
            message.points.append(
                PointContact(
                    geometry_a=self._name(pair.id_A),
                    geometry_b=self._name(pair.id_B),
                    point_a=Point(x=a[0], y=a[1], z=a[2]),
                    point_b=Point(x=b[0], y=b[1], z=b[2]),
                    normal=Vector3(x=n[0], y=n[1], z=n[2]),
                    depth=float(pair.depth),
                )
            )
        self._contacts.publish(message)


def main() -> None:
    """Run until interrupted."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.messages.baseline", description=__doc__.splitlines()[0]
    )
    parser.add_argument("scene", type=Path)
    scene = parser.parse_args().scene
    rclpy.init()
    node = OrdinaryNode(scene)
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
