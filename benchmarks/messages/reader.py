"""Reads markers as bytes and does nothing with them."""

from __future__ import annotations

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile
from visualization_msgs.msg import MarkerArray


def main() -> None:
    """Read until interrupted."""
    rclpy.init()
    node = rclpy.create_node("reader")
    node.create_subscription(
        MarkerArray, "markers", lambda data: None, QoSProfile(depth=1), raw=True
    )
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
