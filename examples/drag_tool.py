"""Drag a Panda's hand in a browser; the motion there is planned, played, and executed.

    python examples/drag_tool.py

Starts the node on the demo's cell, with a page that may move the robot, and plays the robot:
joints that follow the trajectories that the node publishes, and tell where they are. Open the
file that the log names after "browser view at" in a browser, choose panda_hand at "drag", and
pull at its handles. Ctrl+C ends it.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

from demo import isolate, processes
import numpy as np
from plan_around_shelf import SCENE
from plan_in_the_world import make_ready

JOINTS = [*(f"panda_joint{i}" for i in range(1, 8)), "panda_finger_joint1"]
START = [0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02]
PARAMETERS = {
    "scene": SCENE,
    "browser": "true",
    "browser_token": "new",
    "browser_control": "true",
    "browser_execute": "true",
}
PERIOD = 0.01
"""s, from one joint state to the next."""


class PlayedRobot:
    """A robot that executes trajectories as `joint_trajectory_controller` does."""

    def __init__(self, node: Any) -> None:
        from sensor_msgs.msg import JointState
        from trajectory_msgs.msg import JointTrajectory

        self._node, self._kind = node, JointState
        self.q = np.array(START)
        self._motion: Any = None
        self._joints = node.create_publisher(JointState, "joint_states", 10)
        node.create_subscription(JointTrajectory, "/scene_graph/trajectory", self._follow, 10)
        node.create_timer(PERIOD, self._tell)

    def _follow(self, message: Any) -> None:
        from msg_adapters.stamps import stamp_from_msg
        from msg_adapters.trajectories import joint_trajectory_from_msg

        names, points = joint_trajectory_from_msg(message)
        rows = [JOINTS.index(name) for name in names]
        self._motion = rows, points.trajectory(), stamp_from_msg(message.header.stamp)
        print(f"a trajectory of {points.duration:.2f} s, {len(points.nanoseconds)} points")

    def _tell(self) -> None:
        now = self._node.get_clock().now()
        if self._motion is not None:
            rows, curve, begin = self._motion
            time = (now.nanoseconds - begin) * 1e-9
            self.q[rows] = curve.value(min(max(time, curve.start_time), curve.end_time))
        state = self._kind(name=JOINTS, position=self.q.tolist())
        state.header.stamp = now.to_msg()
        self._joints.publish(state)


def play(seconds: float) -> None:
    """Play the robot for a while, 0 for ever."""
    from common.until_stopped import stopped_by_signals
    import rclpy

    with stopped_by_signals() as is_stopped:
        node = rclpy.create_node("robot")
        robot = PlayedRobot(node)
        while not is_stopped() and not node.count_publishers("/scene_graph/trajectory"):
            rclpy.spin_once(node)
        end = node.get_clock().now().nanoseconds + int(seconds * 1e9)
        while not is_stopped() and (not seconds or node.get_clock().now().nanoseconds < end):
            rclpy.spin_once(node)
        print(f"the robot is at {', '.join(f'{value:.2f}' for value in robot.q)}")
        node.destroy_node()


def main() -> int:
    """Start the node and play the robot; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=0.0, help="how long; 0: until Ctrl+C")
    parser.add_argument("--port", type=int, default=8780, help="of the page; 0: a free one")
    arguments = parser.parse_args()
    make_ready("planning")
    isolate()
    parameters = {**PARAMETERS, "browser_port": arguments.port}
    values = [part for k, v in parameters.items() for part in ("-p", f"{k}:={v}")]
    node = [sys.executable, "-m", "scene_graph_ros.node", "--ros-args", *values]
    with processes({"scene graph node": node}):
        play(arguments.seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
