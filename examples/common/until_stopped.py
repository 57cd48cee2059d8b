"""Works for a node until SIGINT or SIGTERM, and ends between two callbacks.

ROS's own handlers end the context at once, so that a callback which is about to publish fails.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
import contextlib
import math
import signal
import time
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


def repeat(
    rate: float, act: Callable[[], None], is_stopped: Callable[[], bool], phase: float | None
) -> None:
    """Call ``act`` ``rate`` times a second until ``is_stopped``.

    With ``phase`` that is when the system's time is so many seconds past a multiple of the
    period, as clocks of robots that are synchronized make it; without, it begins now. For a node
    that only publishes: an executor would look at all its entities at every turn, which takes
    longer than to publish. A turn that is missed is not made up for.
    """
    period, due = 1.0 / rate, time.monotonic()
    if phase is not None:
        due += (phase - time.time()) % period
    while not is_stopped():
        wait = due - time.monotonic()
        if wait > 0.0:
            # In pieces: a signal does not end a sleep.
            time.sleep(min(wait, REACTION))
            continue
        act()
        due += period * max(1.0, math.ceil((time.monotonic() - due) / period))
