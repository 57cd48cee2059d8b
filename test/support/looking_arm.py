"""A world with an arm and a camera of depth on it, without a node.

The arm turns about z of the world; its camera is at (1, 0, 0) on it and looks along x of the arm.
"""

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import Header

from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.world.depth_channel import DepthChannel, InfoChannel
from scene_graph_ros.node.world.inputs import make_channel, message_type, POSES
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.source_channel import apply_kept
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

__all__ = ["EYE", "MOST", "NOW", "SCENE", "SECOND", "URDF", "Looking", "ahead"]

URDF = """<robot name="arm"><link name="root"/><link name="upper">
<collision><origin xyz="0.5 0 0"/><geometry><box size="0.6 0.1 0.1"/></geometry></collision></link>
<joint name="turn" type="continuous"><parent link="root"/><child link="upper"/><axis xyz="0 0 1"/>
</joint></robot>"""
SCENE = """
version: 1
sources:
  - name: camera
    depth: {image: eye/depth, frame: arm/upper, step: 1, rate: 20, range: [0.1, 5], expires: 3,
            pose: {xyz: [1, 0, 0], quaternion: [-0.5, 0.5, -0.5, 0.5]}, floor: -0.3}
  - {name: load}
robots:
  - {name: arm, urdf: arm.urdf, joint_states: joint_states}
frames:
  - {name: held, source: load, pose: {xyz: [2, 0, 0]}}
geometries:
  - {name: ball, source: load, frame: held, shape: {type: sphere, radius: 0.1}}
  - {name: seen, source: camera, pose: {xyz: [0, 0, 1]}, shape: {type: point_cloud, radius: 0.01}}
"""
NOW = 10**12
SECOND = 10**9
MOST = 50
EYE = {"height": 3, "width": 3, "k": [3.0, 0.0, 1.0, 0.0, 3.0, 1.0, 0.0, 0.0, 1.0]}


class Looking:
    """A world with an arm and its camera, and the channels that move them."""

    def __init__(self, folder, text=SCENE):
        (folder / "arm.urdf").write_text(URDF)
        (folder / "scene.yaml").write_text(text)
        self.world, self.warnings = World(), []
        loader = SceneLoader("", message_type, EFFECT_NAMES)
        self.world.edit(lambda edit: loader.load(edit, str(folder / "scene.yaml")))
        self.now = NOW
        record = self.world.records["camera"]
        self.intake = Intake("camera", self.warnings.append)
        self.images = DepthChannel(record, self.intake, MOST)
        self.info = InfoChannel(record, Intake("camera", self.warnings.append))
        arm = self.world.records["arm"]
        self.joints = make_channel(POSES, arm, self.warnings.append, "world")
        self.send_info()

    def send_info(self, **fields):
        """Have a lens arrive."""
        self.info.store(serialize_message(CameraInfo(**{**EYE, **fields})), 1)

    def turn(self, angle, stamp, *, updates=True):
        """Have the arm's joint state arrive, and the update that takes it."""
        message = JointState(name=["turn"], position=[angle])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        self.joints.store(serialize_message(message), 1)
        if updates:
            self.update()

    def send(self, stamp=NOW, depth=2.0, **fields):
        """Have an image of one depth arrive; tell whether an update made points of it."""
        rows = np.full((3, 3), depth, "<f4") if np.ndim(depth) == 0 else np.asarray(depth, "<f4")
        message = Image(header=Header(), height=3, width=3, encoding="32FC1", step=12)
        message.data = rows.tobytes()
        for name, value in fields.items():
            setattr(message, name, value)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
        self.images.store(serialize_message(message), 1)
        return self.update()

    def update(self):
        """Apply messages that wait, in the node's order; tell whether points changed."""
        limits = TimeLimits(now=self.now, max_age=5 * SECOND, max_lead=SECOND)
        world, got = self.world, {}
        with world.lock:
            self.joints.noted = world.note_poses
            for name, channel in (("arm", self.joints), ("info", self.info), ("", self.images)):
                record = world.records.get(channel.record.name)
                world.note_poses()
                is_arm = name == "arm"
                target = world.frames if is_arm else world.clouds.get
                got[name] = apply_kept(
                    channel, record, lambda t=target, r=record: t(r.name), limits
                )
            moved = {"arm"} if got["arm"] is not None else set()
            clouds = world.clouds.get("camera")
            expires = clouds is not None and clouds.expire(limits.now)
            sees = got[""] is not None or expires
            if moved or sees:
                world.commit(moved, 1, (), {"camera"} if sees else ())
        return sees

    def middle(self):
        """Return the point that the middle pixel of the newest image saw: the fifth."""
        return self.world.snapshot.images["camera"].p_WPs[4]

    def points(self):
        """Return the points in the world."""
        snapshot = self.world.snapshot.query.snapshot
        geometry = self.world.snapshot.names.geometry_id("seen")
        return snapshot.point_set(geometry).points + np.array([0.0, 0.0, 1.0])

    def faults(self):
        """Return the faults of images so far."""
        return dict(self.intake.statistics.faults)


def ahead(angle, depth=2.0):
    """Return the point that the middle pixel sees."""
    return (1.0 + depth) * np.array([np.cos(angle), np.sin(angle), 0.0])
