"""The node's own process: ``python -m scene_graph_ros.node`` and ``ros2 run``."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import signal
import sys
import threading
from types import FrameType
from typing import Any

import rclpy
from rclpy.exceptions import InvalidHandle, ParameterException
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from scene_graph_ros.node.node import SceneGraphNode
from scene_graph_ros.node.parameters import PARAMETERS

__all__ = ["main", "make_executor"]

_SWITCH_INTERVAL = 5e-4
"""Seconds after which a thread that computes in Python lets another go on: the interpreter's own
5 ms would be the longest part of an answer's time."""


def make_executor(node: SceneGraphNode) -> Executor:
    """Return the executor that the node's parameters name."""
    if node.server.parameter("executor") == "single_threaded":
        return SingleThreadedExecutor(context=node.context)
    return MultiThreadedExecutor(node.server.parameter("executor_threads"), context=node.context)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM; return the exit code of the process."""
    _usage().parse_args(remove_ros_args(sys.argv if args is None else args)[1:])
    stop = threading.Event()
    _stop_on_signals(stop)
    sys.setswitchinterval(_SWITCH_INTERVAL)
    # ROS's own handlers would end the context while callbacks still publish.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = SceneGraphNode()
    except (ParameterException, ValueError, OSError, LookupError) as error:
        sys.stderr.write(f"scene_graph: {error}\n")
        rclpy.shutdown()
        return 1
    failures = _spin_until(stop, node)
    node.destroy_node()
    rclpy.shutdown()
    if failures:
        raise failures[0]
    return 0


def _usage() -> argparse.ArgumentParser:
    """Return what explains the command: all its arguments are ROS's."""
    lines = [
        f"  {p.name:32} {p.description} Default: {p.default!r}{', read-only' * p.read_only}."
        for p in PARAMETERS
    ]
    return argparse.ArgumentParser(
        prog="scene_graph_node",
        usage="%(prog)s [-h] [--ros-args -p scene:=FILE -p PARAMETER:=VALUE -r FROM:=TO ...]",
        description="The scene graph node: poses in, contacts and markers out, queries answered.",
        epilog="\n".join(["parameters:", *lines]),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def _stop_on_signals(stop: threading.Event) -> None:
    def handle(number: int, frame: FrameType | None) -> None:
        stop.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, handle)


def _spin_until(stop: threading.Event, node: SceneGraphNode) -> list[BaseException]:
    """Spin in a thread of its own: the main thread sleeps, where signals reach it at once."""
    failures: list[BaseException] = []
    executor: Any = make_executor(node)
    executor.add_node(node)

    def spin() -> None:
        try:
            while not stop.is_set():
                try:
                    executor.spin_once()
                except InvalidHandle:
                    # rclpy looked at a topic or service that went just now: nothing is lost.
                    node.get_logger().debug("an entity went while the executor looked at it")
        except BaseException as error:  # noqa: BLE001 - raised again by the main thread
            failures.append(error)
            stop.set()

    thread = threading.Thread(target=spin, name="executor")
    thread.start()
    stop.wait()
    # An empty task makes a sleeping executor return.
    executor.create_task(lambda: None)
    thread.join()
    executor.shutdown()
    return failures
