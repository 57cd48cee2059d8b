"""The node's own process: its arguments, its executor, and its end in order."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import gc
import os
from pathlib import Path
import sys
import threading
import traceback
from typing import Any
import warnings

import rclpy
from rclpy.exceptions import InvalidHandle, ParameterException
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from scene_graph_ros.geometry.compiled.cache import KernelCacheWarning
from scene_graph_ros.geometry.meshes.color_warnings import mesh_color_warnings_told
from scene_graph_ros.node.node import SceneGraphNode
from scene_graph_ros.node.runtime.ending import Ending
from scene_graph_ros.node.runtime.garbage_collection import keep_what_is_there, look_at_all_again
from scene_graph_ros.node.runtime.log_folder import log_problem
from scene_graph_ros.node.runtime.names import NODE_NAME
from scene_graph_ros.node.runtime.parameters import PARAMETERS
from scene_graph_ros.node.runtime.ros_arguments import problem_of, said_by_ros, unreached
from scene_graph_ros.node.runtime.spread_imports import spread_imports

__all__ = ["make_executor", "run"]

_SWITCH_INTERVAL = 1e-4
"""Seconds after which a thread that computes in Python lets another go on: an update waits so long
about twenty times while a change of the scene is made beside it, with the interpreter's own 5 ms
for longer than all the rest takes."""

_PROFILES_FILE = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""The variable that names a file of Fast DDS's profiles; other middleware does not read it."""

_RECORDING_FAILED = 4
"""Exit code where the disk took no more of a recording."""

_PAUSE_AFTER_ERROR = 0.01
"""Seconds, so that a fault which stays does not keep a core busy."""


def make_executor(node: SceneGraphNode) -> Executor:
    """Return the executor that the node's parameters name."""
    if node.server.parameter("executor") == "single_threaded":
        return SingleThreadedExecutor(context=node.context)
    return MultiThreadedExecutor(node.server.parameter("executor_threads"), context=node.context)


def run(args: Sequence[str] | None, ending: Ending) -> int:
    """Run the node until its end is requested; return the exit code of the process."""
    given = list(sys.argv if args is None else args)
    problem = problem_of(given)
    if not problem:
        try:
            _usage().parse_args(remove_ros_args(given)[1:])
        except RuntimeError as error:
            problem = said_by_ros(error)
    sys.setswitchinterval(_SWITCH_INTERVAL)
    spread_imports()
    # The node says it in its log.
    warnings.simplefilter("ignore", KernelCacheWarning)
    os.environ.setdefault(_PROFILES_FILE, str(Path(__file__).with_name("fast_dds.xml")))
    problem = problem or log_problem()
    if problem:
        sys.stderr.write(f"scene_graph: {problem}\n")
        return 1
    ending.note_beginning()
    # ROS's own handlers would end the context while callbacks still publish.
    rclpy.init(args=args, signal_handler_options=SignalHandlerOptions.NO)
    with mesh_color_warnings_told(get_logger(NODE_NAME).warning):
        code = _serve(ending, given)
    rclpy.shutdown()
    # What the middleware shares with other processes goes with the last object that refers to it.
    gc.collect()
    rclpy.get_default_context().destroy()
    return code


def _serve(ending: Ending, args: Sequence[str]) -> int:
    """Make the node and spin it; return the exit code."""
    try:
        node = SceneGraphNode()
    except (ParameterException, ValueError, OSError, LookupError) as error:
        sys.stderr.write(f"scene_graph: {error}\n")
        return 1
    for warning in unreached(args, node.get_fully_qualified_name()):
        node.get_logger().warning(warning)
    ending.timeout = node.server.parameter("shutdown_timeout")
    keep_what_is_there()
    _spin_until(ending.requested, node)
    look_at_all_again()
    node.destroy_node()
    return _RECORDING_FAILED if node.server.recording.has_failed else 0


def _usage() -> argparse.ArgumentParser:
    """Return the parser of the command, which explains it: all its arguments are ROS's."""
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


def _spin_until(stop: threading.Event, node: SceneGraphNode) -> None:
    """Spin in a thread of its own, and wait."""
    executor: Any = make_executor(node)
    executor.add_node(node)
    thread = threading.Thread(target=_spin, args=(executor, node, stop), name="executor")
    thread.start()
    stop.wait()
    # An empty task makes a sleeping executor return.
    executor.create_task(lambda: None)
    thread.join()
    executor.shutdown()


def _spin(executor: Any, node: SceneGraphNode, stop: threading.Event) -> None:
    """Spin until the end is requested: no callback that fails is reason to stop."""
    try:
        while not stop.is_set() and node.context.ok():
            _spin_once(executor, node, stop)
    finally:
        stop.set()


def _spin_once(executor: Any, node: SceneGraphNode, stop: threading.Event) -> None:
    try:
        executor.spin_once()
    except InvalidHandle:
        # rclpy looked at a topic or service that went just now: nothing is lost.
        node.get_logger().debug("an entity went while the executor looked at it")
    except Exception:  # noqa: BLE001 - the node survives whatever it is, and says so
        node.get_logger().error(
            f"a callback failed; the node goes on:\n{traceback.format_exc()}",
            throttle_duration_sec=1.0,
        )
        stop.wait(_PAUSE_AFTER_ERROR)
