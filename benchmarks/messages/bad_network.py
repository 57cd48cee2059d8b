"""Drivers of a robot on a bad network: messages jittered, reordered, sent twice, and lost.

    python -m benchmarks.messages.bad_network --rounds 500 --rate 50 --seed 0

Publishes a round of all drivers at a rate, and writes ``{"sent": n}`` at its end.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import heapq
import itertools
import json
import math
import random
import sys
import time
from typing import Any, NamedTuple

from geometry_msgs.msg import Quaternion, Transform, Vector3
from nav_msgs.msg import Odometry
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState, MultiDOFJointState

from msg_adapters.stamps import stamp_to_msg

__all__ = ["BASE_TOPIC", "DRIVERS", "Driver", "base_message", "joint_message", "sled_message"]

BASE_TOPIC = "/odom"
_COPIES = (0, 1, 1, 1, 1, 2)
"""Of a message, each as likely: one in six is lost, one comes twice."""
_DELAYS = (0.0, 0.0, 0.0, 2.5, 6.5)
"""Rounds by which a copy comes later."""
_JITTER = 3e-3
"""Seconds by which stamps are off at most."""


class Driver(NamedTuple):
    """Who sends positions of some joints, or poses; by how much its stamps are late."""

    names: tuple[str, ...]
    lateness: float
    make: Callable[[tuple[str, ...], list[float]], Any]


def joint_message(names: tuple[str, ...], values: list[float]) -> JointState:
    """Return positions of joints."""
    return JointState(name=list(names), position=values)


def _turned(angle: float) -> Quaternion:
    return Quaternion(z=math.sin(0.5 * angle), w=math.cos(0.5 * angle))


def base_message(names: tuple[str, ...], values: list[float]) -> Odometry:
    """Return the pose of the base: along x by a value, turned about z by the same in radians."""
    message = Odometry(child_frame_id="base")
    message.header.frame_id = "odom"
    message.pose.pose.position.x = values[0]
    message.pose.pose.orientation = _turned(values[0])
    return message


def sled_message(names: tuple[str, ...], values: list[float]) -> MultiDOFJointState:
    """Return the pose of a planar joint, likewise."""
    at = Transform(translation=Vector3(x=values[0]), rotation=_turned(values[0]))
    return MultiDOFJointState(joint_names=list(names), transforms=[at])


DRIVERS = (
    Driver(("arm_j",), 0.020, joint_message),
    Driver(("grip_j",), 0.0, joint_message),
    Driver(("grip_j", "arm_j"), 0.005, joint_message),
    Driver(("base",), 0.050, base_message),
    Driver(("sled_j",), 0.010, sled_message),
)
"""Two that speak of the same joints, and one each of what else moves."""


def _publisher(node: Node, driver: Driver) -> Any:
    kinds = {
        joint_message: (JointState, "/joint_states"),
        base_message: (Odometry, BASE_TOPIC),
        sled_message: (MultiDOFJointState, "/multi_dof_joint_states"),
    }
    kind, topic = kinds[driver.make]
    return node.create_publisher(kind, topic, QoSProfile(depth=1000))


def _round(rng: random.Random, driver: Driver) -> Any:
    message = driver.make(driver.names, [rng.uniform(-1.0, 1.0) for _ in driver.names])
    seconds = rng.uniform(-_JITTER, _JITTER) - driver.lateness
    message.header.stamp = stamp_to_msg(time.time_ns() + int(1e9 * seconds))
    return message


def main() -> None:
    """Publish as the arguments say."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.messages.bad_network")
    parser.add_argument("--rounds", type=int, required=True)
    parser.add_argument("--rate", type=float, required=True)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("drivers")
    publishers = [_publisher(node, driver) for driver in DRIVERS]
    while not all(publisher.get_subscription_count() for publisher in publishers):
        time.sleep(0.01)
    rng, sent, order = random.Random(arguments.seed), 0, itertools.count()
    waiting: list[tuple[float, int, Any, Any]] = []
    begin = time.monotonic()
    for k in itertools.count():
        if k < arguments.rounds:
            for driver, publisher in zip(DRIVERS, publishers, strict=True):
                message = _round(rng, driver)
                for _ in range(rng.choice(_COPIES)):
                    due = k + rng.choice(_DELAYS)
                    heapq.heappush(waiting, (due, next(order), publisher, message))
        elif not waiting:
            break
        while waiting and waiting[0][0] <= k:
            *_, publisher, message = heapq.heappop(waiting)
            publisher.publish(message)
            sent += 1
        time.sleep(max(0.0, begin + (k + 1) / arguments.rate - time.monotonic()))
    sys.stdout.write(json.dumps({"sent": sent}) + "\n")
    sys.stdout.flush()
    sys.stdin.readline()  # Whoever listens has heard all.
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(0)
