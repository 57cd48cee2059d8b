"""How long the node takes for a tick of jogging, alone and beside contacts at 100 Hz.

``python -m benchmarks.jogging`` starts the node on the demo's cell, publishes joint states and
poses of objects at 100 Hz, asks for velocities of the hand at 100 Hz, and reads the times of the
last thousand ticks in /diagnostics: median, 99 and 99.9 % of processor time, and by the clock.
First the node only jogs, as nobody hears its contacts; then contacts and markers are heard, too;
then a second node has these, so that the jogging one has a process of its own. ``--seconds`` is
how long each goes on.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import subprocess
import sys
import tempfile
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Transform, TwistStamped
import numpy as np
import rclpy
from sensor_msgs.msg import JointState, MultiDOFJointState
from std_msgs.msg import Float64MultiArray
from visualization_msgs.msg import MarkerArray

from benchmarks.machine import machine
from scene_graph_msgs.msg import ContactArray

__all__ = ["main"]

_SCENE = "config/scenes/panda_cell.yaml"
_JOINTS = [*(f"panda_joint{i}" for i in range(1, 8)), "panda_finger_joint1"]
_START = (0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02)
_PERIOD, _TURN = 0.01, 1.5
"""s: between messages, and until the hand is asked for another direction."""
_WAYS = ((0.2, 0.0, 0.0), (0.0, 0.0, -0.2), (-0.2, 0.0, 0.0), (0.0, 0.0, 0.2))
_BALL = (0.62, 0.32, 0.53)
_JOG = ("-p", "jog:=panda/arm", "-p", "jog_link:=panda_hand", "-p", "jog_acceleration:=15.0")


def _start(name: str, *options: str) -> subprocess.Popen[Any]:
    common = ("-p", f"scene:={_SCENE}", "-r", f"__node:={name}", "--log-level", "error")
    command = [sys.executable, "-m", "scene_graph_ros.node", "--ros-args", *common, *options]
    return subprocess.Popen(command)


class _World:
    """Plays the robot, its objects and its operator, and hears what nodes say."""

    def __init__(self, *, hears: str) -> None:
        """Hear contacts and markers of the node called so, "" for none."""
        self.node = node = rclpy.create_node("bench")
        self._joints = node.create_publisher(JointState, "joint_states", 10)
        self._objects = node.create_publisher(MultiDOFJointState, "objects/poses", 10)
        self._twists = node.create_publisher(TwistStamped, "/jogger/delta_twist_cmds", 10)
        self._q = np.array(_START)
        self.contacts, self.newest = 0, dict[str, str]()
        node.create_subscription(Float64MultiArray, "/jogger/jog_velocities", self._follow, 10)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._read, 10)
        if hears:
            node.create_subscription(ContactArray, f"/{hears}/contacts", self._count, 10)
            markers = f"/{hears}/markers/proximity"
            node.create_subscription(MarkerArray, markers, lambda message: None, 10)
        self._begin = time.monotonic()
        node.create_timer(_PERIOD, self._tell)

    def _follow(self, message: Any) -> None:
        self._q[:7] += _PERIOD * np.array(message.data)

    def _count(self, message: Any) -> None:
        self.contacts += 1

    def _read(self, message: Any) -> None:
        for status in message.status:
            if status.name == "jogger: effect: jog":
                self.newest = {value.key: value.value for value in status.values}

    def _tell(self) -> None:
        stamp, at = self.node.get_clock().now().to_msg(), time.monotonic() - self._begin
        joints = JointState(name=_JOINTS, position=self._q.tolist())
        ball = Transform()
        ball.translation.x, ball.translation.y, ball.translation.z = _BALL
        ball.translation.x += 0.05 * float(np.sin(at))
        objects = MultiDOFJointState(joint_names=["ball"], transforms=[ball])
        twist = TwistStamped()
        linear = twist.twist.linear
        linear.x, linear.y, linear.z = _WAYS[int(at / _TURN) % len(_WAYS)]
        for message, publisher in (
            (joints, self._joints),
            (objects, self._objects),
            (twist, self._twists),
        ):
            message.header.stamp, message.header.frame_id = stamp, "world"
            publisher.publish(message)


def _measure(name: str, seconds: float, *, hears: str) -> None:
    nodes = [_start("jogger", *_JOG)]
    if hears not in ("", "jogger"):
        nodes.append(_start(hears))
    world = _World(hears=hears)
    try:
        end = None
        while end is None or time.monotonic() < end:
            rclpy.spin_once(world.node, timeout_sec=0.1)
            if end is None and int(world.newest.get("commands taken", "0")) > 0:
                end, before = time.monotonic() + seconds, world.contacts
        said = world.newest
        whats = ("tick's processor time", "tick")
        times = [1e6 * float(said[f"{what} {w} (s)"]) for what in whats for w in _QUANTILES]
        rate = (world.contacts - before) / seconds
        late = said["ticks that came a period late"]
        print(f"{name:28}{''.join(f'{t:8.0f}' for t in times)}{rate:12.0f}{late:>8}")
    finally:
        world.node.destroy_node()
        for node in nodes:
            node.terminate()
        for node in nodes:
            node.wait()


_QUANTILES = ("median", "99th percentile", "99.9th percentile")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure and print; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=15.0, help="for each of three rows")
    seconds = parser.parse_args(arguments).seconds
    os.environ.setdefault("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        os.environ.setdefault("ROS_LOG_DIR", str(Path(folder)))
        rclpy.init()
        print(
            "us a tick                     processor: median, 99, 99.9 %  clock: the same"
            "   contacts/s  late"
        )
        _measure("jogging alone", seconds, hears="")
        _measure("beside contacts and markers", seconds, hears="jogger")
        _measure("these in another node", seconds, hears="scene_graph")
        rclpy.shutdown()
    print(machine(load), end="")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
