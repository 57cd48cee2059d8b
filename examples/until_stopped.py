"""Runs a node until SIGINT or SIGTERM, and ends it between two callbacks.

ROS's own handlers end the context at once, so that a callback which is about to publish fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import signal
from types import FrameType

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

REACTION = 0.1
"""Seconds after which a signal is noticed at the latest."""


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[Callable[[], bool]]:
    """Begin and end ROS; yield what tells whether a signal to stop has come."""
    is_stopped = False

    def stop(number: int, frame: FrameType | None) -> None:
        nonlocal is_stopped
        is_stopped = True

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield lambda: is_stopped
    finally:
        rclpy.shutdown()


def spin_until(node: Node, is_stopped: Callable[[], bool]) -> None:
    """Handle callbacks of ``node`` until ``is_stopped``."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    while not is_stopped():
        executor.spin_once(timeout_sec=REACTION)
    executor.shutdown()
