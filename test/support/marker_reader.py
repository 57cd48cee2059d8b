"""A viewer of markers in a process of its own: ``marker_reader.py TOPIC [SHOWN]``.

Prints what it shows after each message: ``{"id": y, ...}``, a line each. ``SHOWN``, such a line,
is what it shows from the beginning.
"""

from __future__ import annotations

import json
import sys

import rclpy
from rclpy.qos import QoSProfile
from visualization_msgs.msg import Marker, MarkerArray


def main() -> None:
    """Show markers until killed."""
    rclpy.init()
    node = rclpy.create_node("marker_reader")
    shown: dict[int, float] = {}
    if len(sys.argv) > 2:
        shown.update((int(key), y) for key, y in json.loads(sys.argv[2]).items())

    def take(message: MarkerArray) -> None:
        for marker in message.markers:
            if marker.action == Marker.DELETEALL:
                shown.clear()
            elif marker.action == Marker.DELETE:
                shown.pop(marker.id, None)
            else:
                shown[marker.id] = marker.pose.position.y
        sys.stdout.write(json.dumps(shown) + "\n")
        sys.stdout.flush()

    # As a viewer subscribes: it keeps a few messages, and asks for nothing from the past.
    node.create_subscription(MarkerArray, sys.argv[1], take, QoSProfile(depth=5))
    rclpy.spin(node)


if __name__ == "__main__":
    main()
