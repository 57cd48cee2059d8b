"""Answers a service at once, knowing nothing: what middleware, Python and machine take anyway."""

from __future__ import annotations

import sys

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.signals import SignalHandlerOptions

from scene_graph_msgs.srv import HasCollisions

__all__ = ["EMPTY", "NAME"]

EMPTY = "an empty service"
"""What tables call it."""

NAME = "/empty_service/has_collisions"


def main() -> None:
    """Answer until the process is ended."""
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("empty_service")
    service = node.create_service(HasCollisions, NAME, lambda request, response: response)
    handle = service.handle
    wait_set = rclpy_implementation.WaitSet(0, 0, 0, 0, 1, 0, node.context.handle)
    while True:
        wait_set.clear_entities()
        wait_set.add_service(handle)
        wait_set.wait(-1)
        _, header = handle.service_take_request(HasCollisions.Request)
        if header is not None:
            service.send_response(HasCollisions.Response(), header)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
