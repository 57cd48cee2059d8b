"""Find an object by its colour in a camera's images, and ask the world how far it is.

    python -m scene_graph_ros.node --ros-args -p scene:=config/scenes/panda_cell.yaml &
    python examples/find_by_color.py --camera wrist --rgb 0.35 0.6 0.3 --near panda_hand

Pixels of the colour that are in the light, or in the shade, are looked for; the nearest of them is
projected back by its depth and the camera's numbers, and put into the world by the camera's pose.
"""

from __future__ import annotations

import argparse
import sys
import time
from typing import Any

from common.camera_images import pixels_of
from common.names_of_geometry import paths_of
from geometry_msgs.msg import PoseStamped
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import CameraInfo, Image

from msg_adapters.poses import pose_from_msg
from scene_graph_msgs.srv import ComputeSignedDistanceToPoint

NODE = "/scene_graph"
PATIENCE = 60.0
"""Seconds to wait for images, or an answer."""
DARKEST = 40.0
"""Of 255: what is darker has no colour to speak of."""
SHADE = 0.05
"""Largest difference of two colours that differ in their brightness only, both of length 1."""
REACH = 0.5
"""Metres around the object in which geometries are listed."""


class Finder(Node):
    """Listens to one camera."""

    def __init__(self, camera: str) -> None:
        super().__init__("find_by_color")
        self._messages: dict[str, Any] = {}
        start = f"{NODE}/cameras/{camera}"
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        for topic, kind, qos in (
            ("color/image", Image, QoSProfile(depth=5)),
            ("depth/image", Image, QoSProfile(depth=5)),
            ("depth/camera_info", CameraInfo, QoSProfile(depth=5)),
            ("pose", PoseStamped, latched),
        ):
            self.create_subscription(
                kind, f"{start}/{topic}", lambda m, topic=topic: self._take(topic, m), qos
            )

    def _take(self, topic: str, message: Any) -> None:
        self._messages[topic] = message

    def look(self) -> dict[str, Any]:
        """Return a message of each topic, all of one moment."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            rclpy.spin_once(self, timeout_sec=0.1)
            stamps = {
                (m.header.stamp.sec, m.header.stamp.nanosec) for m in self._messages.values()
            }
            if len(self._messages) == 4 and len(stamps) == 1:
                return self._messages
        sys.exit(f"no images of one moment came within {PATIENCE:g} s")

    def distances(self, p_WQ: np.ndarray) -> Any:
        """Return the table of geometries around a point of the world."""
        client = self.create_client(
            ComputeSignedDistanceToPoint, f"{NODE}/compute_signed_distance_to_point"
        )
        if not client.wait_for_service(PATIENCE):
            sys.exit(f"{client.srv_name}: no such service")
        request = ComputeSignedDistanceToPoint.Request(points=p_WQ.tolist(), threshold=[REACH])
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=PATIENCE)
        reply = future.result()
        if reply is None or reply.status.code:
            why = "no answer" if reply is None else reply.status.message
            sys.exit(f"{client.srv_name}: {why}")
        return reply.table


def is_of_color(color: np.ndarray, rgb: np.ndarray) -> np.ndarray:
    """Return which pixels ``(h, w, 3)`` have a colour, however bright."""
    brightness = np.linalg.norm(color.astype(float), axis=2)
    direction = color / np.maximum(brightness, 1.0)[..., None]
    difference = np.linalg.norm(direction - rgb / np.linalg.norm(rgb), axis=2)
    return (brightness > DARKEST) & (difference < SHADE)


def nearest_point(
    depth: np.ndarray, is_object: np.ndarray, info: CameraInfo, X_WC: np.ndarray
) -> np.ndarray | None:
    """Return p_WQ of the object's pixel with the least depth, None where no pixel has one."""
    z = np.where(is_object & np.isfinite(depth), depth.astype(float), np.inf)
    v, u = np.unravel_index(np.argmin(z), z.shape)
    if not np.isfinite(z[v, u]):
        return None
    K = np.reshape(info.k, (3, 3))
    p_CQ = z[v, u] * np.linalg.solve(K, [u, v, 1.0])
    return X_WC[:3, :3] @ p_CQ + X_WC[:3, 3]


def main() -> int:
    """Find the object; return 1 where it is not to be seen."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--camera", default="wrist", help="name of the camera")
    parser.add_argument("--rgb", type=float, nargs=3, default=(0.35, 0.6, 0.3), metavar="SHARE")
    parser.add_argument("--near", default="panda_hand", help="what names of interest begin with")
    arguments = parser.parse_args()
    rclpy.init()
    finder = Finder(arguments.camera)
    seen = finder.look()
    is_object = is_of_color(pixels_of(seen["color/image"]), np.array(arguments.rgb))
    X_WC = pose_from_msg(seen["pose"].pose, "pose of the camera")
    p_WQ = nearest_point(
        pixels_of(seen["depth/image"]), is_object, seen["depth/camera_info"], X_WC
    )
    if p_WQ is None:
        print(f"nothing of that colour among {is_object.size} pixels")
        return 1
    print(f"{is_object.sum()} pixels; the nearest sees {p_WQ.round(4).tolist()} m in the world")
    table = finder.distances(p_WQ)
    names = paths_of(table.geometries)
    found = sorted(zip(np.abs(table.distance), table.id, strict=True))
    print(f"It is on {names[found[0][1]]}: {1e6 * found[0][0]:.3f} micrometres off its surface")
    for distance, geometry in zip(table.distance, table.id, strict=True):
        if names[geometry].startswith(arguments.near):
            print(f"{1000.0 * distance:.3f} mm from {names[geometry]}")
    finder.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
