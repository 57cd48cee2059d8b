"""A TIAGo drives up to a table, as real robots come: in many messages from many senders.

    python examples/mobile_manipulator.py --picture mobile_manipulator.png

Starts the node on a room without a robot, and then plays the robot: its description comes by a
latched topic, its base by odometry, its arm and its hand from two drivers, of which the arm's
stamps are 20 ms late. At the end the hand has to be where all of that puts it, and the picture
shows the room beside the image of the camera on the robot's head.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import sys
import time
from typing import Any

from demo import isolate, processes
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
SCENE = ROOT / "config" / "scenes" / "tiago_room.yaml"
URDF = "package://example-robot-data/robots/tiago_description/robots/tiago.urdf"
ODOMETRY, ODOM = "/mobile_base_controller/odom", "odom"
HAND = "arm_tool_link"
LATE = 20_000_000
"""Nanoseconds by which the arm's stamps lag behind the hand's."""
RATE, SECONDS, WAY = 50.0, 4.0, 1.2
ARM = {
    "torso_lift_joint": (0.0, 0.3),
    "head_1_joint": (0.0, -0.3),
    "head_2_joint": (0.0, -0.5),
    "arm_1_joint": (0.2, 1.5),
    "arm_2_joint": (-1.3, 0.6),
    "arm_3_joint": (-0.2, -0.1),
    "arm_4_joint": (1.9, 1.0),
    "arm_5_joint": (-1.57, -1.57),
    "arm_6_joint": (1.3, 0.5),
    "arm_7_joint": (0.0, 0.0),
}
FINGERS = {"hand_thumb_joint": (0.0, 1.0), "hand_index_joint": (0.0, 1.0)}


def between(ends: dict[str, tuple[float, float]], s: float) -> dict[str, float]:
    """Return positions at s in [0, 1] on the way, from rest to rest."""
    blend = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    return {name: a + blend * (b - a) for name, (a, b) in ends.items()}


def base_at(s: float) -> tuple[float, float]:
    """Return the distance (m) and the angle (rad) that the base has moved by."""
    return WAY * s, 0.3 * math.sin(2.0 * math.pi * s)


class Tiago:
    """Publishes what a TIAGo's drivers do, and asks the node where its hand is."""

    def __init__(self, text: str) -> None:
        from nav_msgs.msg import Odometry
        import rclpy
        from rclpy.qos import DurabilityPolicy, QoSProfile
        from sensor_msgs.msg import Image, JointState
        from std_msgs.msg import String
        from visualization_msgs.msg import MarkerArray

        from scene_graph_msgs.srv import GetPoseInWorld

        rclpy.init()
        self.node = rclpy.create_node("tiago", start_parameter_services=False)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._description = self.node.create_publisher(String, "/robot_description", latched)
        self._description.publish(String(data=text))
        self._joints = self.node.create_publisher(JointState, "/joint_states", 50)
        self._odometry = self.node.create_publisher(Odometry, ODOMETRY, 50)
        self._poses = self.node.create_client(GetPoseInWorld, "/scene_graph/get_pose_in_world")
        self.markers: dict[tuple[str, int], Any] = {}
        self.image: Any = None
        name = "/scene_graph/markers/illustration"
        self.node.create_subscription(MarkerArray, name, self._take_markers, latched)
        topic = "/scene_graph/cameras/head/color/image"
        self.node.create_subscription(Image, topic, lambda m: setattr(self, "image", m), 5)

    def _take_markers(self, message: Any) -> None:
        self.markers.update(((m.ns, m.id), m) for m in message.markers)

    def spin(self, seconds: float) -> None:
        """Take what comes for so long."""
        import rclpy

        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            rclpy.spin_once(self.node, timeout_sec=left)

    def send(self, s: float, now: int) -> None:
        """Publish where all is: each driver with stamps of its own."""
        from nav_msgs.msg import Odometry
        from sensor_msgs.msg import JointState

        from msg_adapters.stamps import stamp_to_msg

        for ends, late in ((FINGERS, 0), (ARM, LATE)):
            positions = between(ends, s)
            message = JointState(name=list(positions), position=list(positions.values()))
            message.header.stamp = stamp_to_msg(now - late)
            self._joints.publish(message)
        x, yaw = base_at(s)
        odometry = Odometry(child_frame_id="base_footprint")
        odometry.header.frame_id, odometry.header.stamp = ODOM, stamp_to_msg(now)
        odometry.pose.pose.position.x = x
        odometry.pose.pose.orientation.z = math.sin(yaw / 2)
        odometry.pose.pose.orientation.w = math.cos(yaw / 2)
        self._odometry.publish(odometry)

    def hand(self, stamp: int = 0) -> Any:
        """Return the node's answer to where the hand is, not older than a stamp (ns)."""
        import rclpy

        from msg_adapters.stamps import stamp_to_msg
        from scene_graph_msgs.msg import QueryOptions
        from scene_graph_msgs.srv import GetPoseInWorld

        frame = f"tiago/{HAND}"
        options = QueryOptions(minimal_stamp=stamp_to_msg(stamp))
        if stamp:
            options.minimal_stamp_sources = [frame]
            options.timeout.sec = 20
        request = GetPoseInWorld.Request(frames=[frame], options=options)
        if not self._poses.wait_for_service(60.0):
            raise SystemExit("The node does not answer")
        future = self._poses.call_async(request)
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=60.0)
        return future.result()


def expected_hand(text: str) -> np.ndarray:
    """Return the hand's position at the end, p_WH, by the description alone."""
    from scene_graph_ros.scene_files import Kinematics, load_urdf

    kinematics = Kinematics(load_urdf(text), links=(HAND,))
    positions = between(ARM, 1.0)
    _, X_BL = kinematics.link_poses(tuple(positions), tuple(positions.values()))
    x, yaw = base_at(1.0)
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ X_BL[0, :3, 3] + [x, 0, 0]


def run(robot: Tiago, text: str) -> int:
    """Wait for the robot in the node, drive, and compare; return the exit code."""
    while (answer := robot.hand()).status.code:
        robot.spin(0.2)
    print("The robot is in the room, as its description says.", flush=True)
    for k in range(int(RATE * SECONDS) + 1):
        now = time.time_ns()
        robot.send(k / (RATE * SECONDS), now)
        robot.spin(1.0 / RATE)
    answer = robot.hand(now - LATE)
    if answer.status.code:
        print(f"No pose of the hand: {answer.status.message}")
        return 1
    p = answer.poses[0].position
    error = float(np.abs(np.array([p.x, p.y, p.z]) - expected_hand(text)).max())
    print(f"The hand is at ({p.x:.3f}, {p.y:.3f}, {p.z:.3f}) m, {error:.1e} m off.")
    return int(error > 1e-9)


def draw(robot: Tiago, path: Path) -> None:
    """Write the room, with the camera's image in a corner of it."""
    from common.camera_images import pixels_of
    from common.picture import Camera, trace
    from PIL import Image

    camera = Camera(eye=(0.2, -3.6, 2.2), target=(1.7, 0.0, 0.7))
    picture = trace(robot.markers.values(), camera).convert("RGB")
    if robot.image is not None:
        seen = Image.fromarray(pixels_of(robot.image)).resize((480, 360))
        picture.paste(seen, (camera.width - 490, camera.height - 370))
    picture.save(path)
    print(f"Picture: {path}")


def main() -> int:
    """Run the example; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="a file for what was to be seen (PNG)")
    arguments = parser.parse_args()
    isolate()
    from scene_graph_ros.scene_files import resolve_resource

    text = resolve_resource(URDF).read_text()
    node = [
        *(sys.executable, "-m", "scene_graph_ros.node", "--ros-args"),
        *("-p", f"scene:={SCENE}", "-p", "shutdown_timeout:=20.0", "--log-level", "warn"),
    ]
    with processes({"scene graph node": node}) as running:
        robot = Tiago(text)
        try:
            code = run(robot, text)
            if arguments.picture is not None:
                robot.spin(2.0)
                draw(robot, arguments.picture)
        finally:
            robot.node.destroy_node()
    return code or int(any(process.returncode for process in running.values()))


if __name__ == "__main__":
    sys.exit(main())
