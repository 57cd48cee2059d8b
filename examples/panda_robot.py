"""A simulated Panda: publishes its joint positions along a trajectory, as a driver would.

    python examples/panda_robot.py --topic joint_states --rate 100

The trajectory passes its waypoints with zero velocity and smooth acceleration (quintic time
scaling) and repeats.
"""

from __future__ import annotations

import argparse
from bisect import bisect_right
from itertools import accumulate

from common.until_stopped import repeat, stopped_by_signals
from rclpy.node import Node
from sensor_msgs.msg import JointState

ARM = [f"panda_joint{i}" for i in range(1, 8)]
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]

# Joint positions (rad) and opening of each finger (m); seconds to reach them from the one before.
WAYPOINTS = [
    ((0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785), 0.04, 1.0),  # ready
    ((0.0, 0.096, 0.0, -2.16, 0.0, 2.256, 0.785), 0.04, 1.2),  # over the table
    ((0.0, 0.512, 0.0, -2.199, 0.0, 2.711, 0.785), 0.04, 0.8),  # fingers pressed into the table
    ((-0.237, 0.494, -0.283, -2.262, 0.329, 2.719, 0.0), 0.04, 1.0),  # through the brick
    ((0.196, 0.517, 0.362, -1.447, -0.188, 1.93, 1.365), 0.04, 1.3),  # over the bowl
    ((0.25, 0.756, 0.271, -1.584, -0.25, 2.305, 1.404), 0.02, 0.8),  # around the ball in it
    ((0.196, 0.517, 0.362, -1.447, -0.188, 1.93, 1.365), 0.02, 0.6),
    ((1.09, -0.25, 0.25, -2.6, -0.3, 3.6, 0.785), 0.04, 1.4),  # in front of the shelf
    ((1.097, 0.384, 0.279, -2.055, -0.33, 3.705, 0.785), 0.04, 1.0),  # on its middle board
    ((1.09, -0.25, 0.25, -2.6, -0.3, 3.6, 0.785), 0.04, 0.8),
    ((0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785), 0.04, 1.2),
]

STOPS = [[*arm, finger, finger] for arm, finger, _ in WAYPOINTS]
TIMES = list(accumulate((seconds for _, _, seconds in WAYPOINTS[1:]), initial=0.0))


def positions_at(time: float) -> list[float]:
    """Return the positions of the arm's and the fingers' joints at ``time`` (s)."""
    time %= TIMES[-1]
    leg = bisect_right(TIMES, time) - 1
    s = (time - TIMES[leg]) / (TIMES[leg + 1] - TIMES[leg])
    blend = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return [a + blend * (b - a) for a, b in zip(STOPS[leg], STOPS[leg + 1], strict=True)]


class PandaRobot(Node):
    """Publishes ``sensor_msgs/JointState``."""

    def __init__(self, topic: str) -> None:
        super().__init__("panda_robot", start_parameter_services=False)
        self._publisher = self.create_publisher(JointState, topic, 10)
        self._start = self.get_clock().now().nanoseconds
        self._message = JointState(name=ARM + FINGERS)

    def publish(self) -> None:
        """Publish where the joints are now."""
        now, stamp = self.get_clock().now().nanoseconds, self._message.header.stamp
        stamp.sec, stamp.nanosec = divmod(now, 10**9)
        self._message.position = positions_at((now - self._start) * 1e-9)
        self._publisher.publish(self._message)


def main() -> None:
    """Publish until interrupted."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--topic", default="joint_states", help="topic to publish on")
    parser.add_argument("--rate", type=float, default=100.0, help="messages per second")
    parser.add_argument(
        "--phase",
        type=float,
        help="publish so many seconds after multiples of the period, by the system's clock",
    )
    arguments = parser.parse_args()
    with stopped_by_signals() as is_stopped:
        robot = PandaRobot(arguments.topic)
        robot.get_logger().info(f"publishing on {arguments.topic} at {arguments.rate:g} Hz")
        repeat(arguments.rate, robot.publish, is_stopped, arguments.phase)


if __name__ == "__main__":
    main()
