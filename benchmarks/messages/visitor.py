"""Comes as a participant that listens to contacts, stays a while, goes, and comes again.

    python -m benchmarks.messages.visitor

Prints a line for each visit; ends with standard input.
"""

from __future__ import annotations

import random
import select
import sys
import time

import rclpy
from rclpy.signals import SignalHandlerOptions

from scene_graph_msgs.msg import ContactArray

_STAY = _AWAY = (0.5, 3.0)
"""Seconds between which a visitor stays, and is away."""


def _visit(seconds: float) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("visitor", context=context)
    node.create_subscription(ContactArray, "/scene_graph/contacts", lambda message: None, 1)
    time.sleep(seconds)
    node.destroy_node()
    rclpy.shutdown(context=context)


def main() -> None:
    """Visit until standard input ends."""
    while not select.select([sys.stdin], [], [], random.uniform(*_AWAY))[0]:
        _visit(random.uniform(*_STAY))
        print("visited", flush=True)


if __name__ == "__main__":
    main()
