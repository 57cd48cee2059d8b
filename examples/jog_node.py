"""Jog a Panda's hand through the node: into the table, where it keeps its distance, and up again.

    python examples/jog_node.py

Starts the node on the demo's cell, asks it for 0.2 m/s of the hand by `TwistStamped`, and plays
the robot: joints that follow the node's velocities, and tell where they are.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from demo import isolate, processes
import numpy as np
from plan_around_shelf import SCENE
from plan_in_the_world import make_ready

ARM = [f"panda_joint{i}" for i in range(1, 8)]
JOINTS = [*ARM, "panda_finger_joint1"]
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
PARAMETERS = {
    "scene": SCENE,
    "jog": "panda/arm",
    "jog_link": "panda_hand",
    "jog_acceleration": 5.0,
}
PERIOD, SPEED, SECONDS = 0.01, 0.2, 3.0
"""s, m/s, s: of the node's velocities, of the hand, and for each direction."""


def jog() -> None:
    """Ask for velocities, follow those that come, and print what holds the hand."""
    from geometry_msgs.msg import TwistStamped
    import rclpy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    from scene_graph_msgs.msg import JogStatus

    rclpy.init()
    node = rclpy.create_node("jogger")
    joints = node.create_publisher(JointState, "joint_states", 10)
    twists = node.create_publisher(TwistStamped, "/scene_graph/delta_twist_cmds", 10)
    q, told = np.array(START), JogStatus()

    def follow(message: Any) -> None:
        q[:7] += PERIOD * np.array(message.data)

    def hear(message: Any) -> None:
        nonlocal told
        told = message

    node.create_subscription(Float64MultiArray, "/scene_graph/jog_velocities", follow, 10)
    node.create_subscription(JogStatus, "/scene_graph/jog_status", hear, 10)

    def ask() -> None:
        stamp = node.get_clock().now().to_msg()
        state = JointState(name=JOINTS, position=q.tolist())
        state.header.stamp = stamp
        joints.publish(state)
        twist = TwistStamped()
        twist.header.stamp, twist.header.frame_id, twist.twist.linear.z = stamp, "world", speed
        twists.publish(twist)

    speed = 0.0
    node.create_timer(PERIOD, ask)
    while not told.names:
        rclpy.spin_once(node)
    for speed in (-SPEED, SPEED):
        end = node.get_clock().now().nanoseconds + int(SECONDS * 1e9)
        while node.get_clock().now().nanoseconds < end:
            rclpy.spin_once(node)
        near = "nothing near"
        if told.nearest_a.name:
            pair = f"{told.nearest_a.name} and {told.nearest_b.name}"
            near = f"{1e3 * told.nearest_distance:.1f} mm between {pair}"
        print(f"at {speed:+.1f} m/s: {'held' if told.active_a else 'free'}, {near}")
    node.destroy_node()
    rclpy.shutdown()


def main() -> int:
    """Start the node and jog; return the exit code."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    make_ready("planning")
    isolate()
    values = [part for k, v in PARAMETERS.items() for part in ("-p", f"{k}:={v}")]
    node = [sys.executable, "-m", "scene_graph_ros.node", "--ros-args", *values]
    with processes({"scene graph node": node}):
        jog()
    return 0


if __name__ == "__main__":
    sys.exit(main())
