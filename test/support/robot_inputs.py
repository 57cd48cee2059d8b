"""A robot in a world, and channels that move it, without a node."""

from __future__ import annotations

import math

from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world.inputs import make_channel, message_type, POSES
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

__all__ = ["FREE", "LIMITS", "MS", "NOW", "ODOMETRY", "TWO", "Robot", "odometry"]

NOW = 1_000_000_000_000
MS = 1_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
LIMIT = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
TWO = f"""<robot name="two">
  <link name="base">{BALL}</link>
  <link name="arm">{BALL}</link><link name="hand">{BALL}</link><link name="grip">{BALL}</link>
  <link name="other">{BALL}</link>
  <joint name="arm_j" type="revolute"><parent link="base"/><child link="arm"/>
    <axis xyz="0 0 1"/>{LIMIT}</joint>
  <joint name="hand_j" type="fixed"><origin xyz="1 0 0"/><parent link="arm"/><child link="hand"/>
  </joint>
  <joint name="grip_j" type="prismatic"><parent link="hand"/><child link="grip"/>
    <axis xyz="0 0 1"/>{LIMIT}</joint>
  <joint name="other_j" type="prismatic"><parent link="hand"/><child link="other"/>
    <axis xyz="0 0 1"/><mimic joint="grip_j" multiplier="-1"/>{LIMIT}</joint>
</robot>"""
FREE = f"""<robot name="free">
  <link name="base">{BALL}</link><link name="cart">{BALL}</link><link name="drone">{BALL}</link>
  <joint name="cart_j" type="planar"><parent link="base"/><child link="cart"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="drone_j" type="floating"><origin xyz="0 0 2"/><parent link="base"/>
    <child link="drone"/></joint>
</robot>"""


class Robot:
    """A robot in a world, and the channels that move it."""

    def __init__(self, folder, urdf, *, keys="", srdf=""):
        (folder / "robot.urdf").write_text(urdf)
        text = "version: 1\nrobots:\n  - name: r\n    urdf: robot.urdf\n"
        if srdf:
            (folder / "robot.srdf").write_text(srdf)
            text += "    srdf: robot.srdf\n"
        scene = folder / "scene.yaml"
        scene.write_text(text + keys)
        self.world = World()
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        self.world.edit(lambda edit: loader.load(edit, str(scene)))
        self.warnings = []
        self.channels = {}

    @property
    def record(self):
        return self.world.records["r"]

    def channel(self, noun):
        if noun not in self.channels:
            self.channels[noun] = make_channel(noun, self.record, self.warnings.append, "world")
        return self.channels[noun]

    def send(self, noun, message, *, is_static=False):
        """Let a message arrive and the world be updated; tell whether something moved."""
        channel = self.channel(noun)
        channel.store(serialize_message(message), 1, is_static=is_static)
        with self.world.lock:
            moved = apply_kept(channel, self.record, lambda: self.world.frames("r"), LIMITS)
            if moved is not None:
                self.world.commit(["r"], None)
        return moved is not None

    def joints(self, stamp, *, is_static=False, **positions):
        message = JointState(name=list(positions), position=list(positions.values()))
        message.header.stamp = stamp_to_msg(stamp)
        return self.send(POSES, message, is_static=is_static)

    def faults(self, noun=POSES):
        return dict(self.channel(noun).intake.statistics.faults)

    def where(self, link):
        snapshot = self.world.snapshot
        return snapshot.query.get_pose_in_world(snapshot.names.frame_id(f"r/{link}"))

    @property
    def positions(self):
        return self.record.robot.kinematics.positions


ODOMETRY = "    base: {topic: /odom, type: nav_msgs/msg/Odometry}\n"


def odometry(stamp, x, *, yaw=0.0, parent="odom", child="base"):
    """Return where a base is."""
    message = Odometry(child_frame_id=child)
    message.header.frame_id = parent
    message.header.stamp = stamp_to_msg(stamp)
    message.pose.pose.position.x = x
    turned = Quaternion(z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    message.pose.pose.orientation = turned
    return message
