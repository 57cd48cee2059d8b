"""Bytes as they might arrive on a topic: no exception, and only what is good moves something."""

from __future__ import annotations

import random
from types import SimpleNamespace
from typing import Any

from fuzzing import BAD_NUMBERS, BAD_TEXTS, fuzz, Target
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
import numpy as np
import pytest
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState, MultiDOFJointState

from scene_graph_msgs.msg import DeformableConfigurations
from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, SceneGraph, Sphere
from scene_graph_ros.node.world.configurations import ConfigurationChannel
from scene_graph_ros.node.world.inputs import make_channel, POSES
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.robot_motion import RobotMotion
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text

NOW = 1_000_000_000_000
LIMITS = TimeLimits(now=NOW, max_age=5_000_000_000, max_lead=1_000_000_000)
URDF = """<robot name='r'><link name='a'><collision><geometry><sphere radius='1'/></geometry>
</collision></link><link name='b'><collision><geometry><sphere radius='1'/></geometry></collision>
</link><joint name='j' type='revolute'><parent link='a'/><child link='b'/>
<limit lower='-1' upper='1'/></joint></robot>"""
FRAMES = ("left", "right", "cup", "ghost", "", "a" * 300)


def multi_dof(rng: random.Random) -> Any:
    """Return poses of frames, some of them not the source's."""
    msg = MultiDOFJointState()
    msg.header.stamp.sec = NOW // 10**9
    for _ in range(rng.randrange(4)):
        msg.joint_names.append(rng.choice(FRAMES))
        msg.transforms.append(transform(rng))
    return msg


def transform(rng: random.Random) -> Transform:
    """Return a transform whose numbers are right or anything."""
    result = Transform(translation=Vector3(x=rng.uniform(-1.0, 1.0)), rotation=Quaternion(w=1.0))
    if rng.random() < 0.3:
        setattr(result.translation, rng.choice("xyz"), rng.choice(BAD_NUMBERS))
    if rng.random() < 0.3:
        setattr(result.rotation, rng.choice("xyzw"), rng.choice(BAD_NUMBERS))
    return result


def transform_stamped(rng: random.Random) -> Any:
    """Return one pose."""
    msg = TransformStamped(child_frame_id=rng.choice(FRAMES), transform=transform(rng))
    msg.header.stamp.sec = rng.choice([0, NOW // 10**9, -(2**31), 2**31 - 1])
    msg.header.stamp.nanosec = rng.choice([0, 999_999_999, 2**32 - 1])
    return msg


def pose_stamped(rng: random.Random) -> Any:
    """Return the pose of the only frame."""
    msg = PoseStamped()
    msg.header.frame_id = rng.choice(["", "world", *BAD_TEXTS[:10]])
    msg.pose.position.x = rng.choice(BAD_NUMBERS)
    msg.pose.orientation.w = rng.choice([1.0, *BAD_NUMBERS])
    return msg


def joint_state(rng: random.Random) -> Any:
    """Return positions, as many as names or not."""
    msg = JointState(name=[rng.choice(["j", "k", ""]) for _ in range(rng.randrange(3))])
    msg.position = [rng.choice(BAD_NUMBERS) for _ in range(rng.randrange(3))]
    return msg


def configurations(rng: random.Random) -> Any:
    """Return positions of vertices, as many as there are or not."""
    msg = DeformableConfigurations()
    msg.header.stamp.sec = NOW // 10**9
    for field, kind in msg.get_fields_and_field_types().items():
        if kind == "sequence<string>":
            setattr(msg, field, [rng.choice(["blob", "ball", ""]) for _ in range(2)])
        elif kind == "sequence<double>":
            setattr(msg, field, [rng.choice(BAD_NUMBERS) for _ in range(rng.choice([0, 24, 25]))])
    return msg


KINDS = {
    "sensor_msgs/msg/MultiDOFJointState": (MultiDOFJointState, multi_dof),
    "geometry_msgs/msg/TransformStamped": (TransformStamped, transform_stamped),
    "geometry_msgs/msg/PoseStamped": (PoseStamped, pose_stamped),
    "sensor_msgs/msg/JointState": (JointState, joint_state),
    "configurations": (DeformableConfigurations, configurations),
}


def damage(rng: random.Random, data: bytes) -> bytes:
    """Return bytes with some of them changed, cut away or added."""
    changed = bytearray(data)
    for _ in range(rng.choice([0, 0, 1, 2, 10])):
        action, place = rng.randrange(4), rng.randrange(max(len(changed), 1))
        if action == 0:
            changed[place : place + 1] = bytes([rng.randrange(256)])
        elif action == 1:
            value = rng.choice([2**32 - 1, 2**31, 2**16, 0])
            changed[place & ~3 : (place & ~3) + 4] = value.to_bytes(4, "little")
        elif action == 2:
            del changed[place:]
        else:
            changed += rng.randbytes(rng.choice([1, 8, 1000]))
    return bytes(changed)


def make(rng: random.Random) -> list[Any]:
    """Return a kind of topic and messages in a row."""
    kind = rng.choice(list(KINDS))
    messages = [
        damage(rng, serialize_message(KINDS[kind][1](rng))) for _ in range(rng.randrange(1, 6))
    ]
    return [(kind, message) for message in messages]


@pytest.fixture(scope="module")
def world() -> SimpleNamespace:
    """Three sources: one with two frames, one with one, and a robot; and what deforms."""
    graph = SceneGraph()
    frames = "[{name: left, source: two}, {name: right, source: two}, {name: cup, source: one}]"
    text = f"version: 1\nname: s\nsources: [{{name: two}}, {{name: one}}]\nframes: {frames}"
    load_scene_text(text).apply(graph)
    blob = GeometryInstance(np.eye(4), Sphere(0.1), "blob")
    blob.set_proximity_properties(ProximityProperties())
    inspector = graph.model_inspector()
    two = inspector.get_source_id_by_name("two")
    graph.register_deformable_geometry(two, inspector.world_frame_id(), blob, 0.1)
    return SimpleNamespace(world=World(graph), robot=load_robot())


def load_robot() -> Any:
    """Return a robot of one joint, with its own world."""
    from scene_graph_ros.scene_files import load_urdf, register_robot
    from scene_graph_ros.scene_files.loaded_scene import LoadedRobot

    graph = SceneGraph()
    model = load_urdf(URDF)
    source = graph.register_source("robot")
    links = register_robot(model, graph, source)
    return LoadedRobot(model, None, links, np.eye(4), {}, ""), World(graph)


def run(scene: SimpleNamespace, steps: list[Any]) -> None:
    """Store and apply messages, and then a good one."""
    for kind, data in steps:
        if kind == "configurations":
            deform(scene.world, data)
        else:
            move(scene, kind, data)


def deform(world: World, data: bytes) -> None:
    """Take configurations: whatever is in them, positions stay finite."""
    record = world.records["two"]
    channel = ConfigurationChannel(record, Intake("two", lambda text: None), "world")
    channel.store(data, 1)
    deformables = world.deformables["two"]
    channel.apply(channel.take(), deformables, LIMITS)
    for positions in deformables.positions.values():
        assert np.isfinite(positions).all()
    world.commit([], 1, ["two"])


def move(scene: SimpleNamespace, kind: str, data: bytes) -> None:
    """Take poses: whatever is in them, frames stay rigid, and the world takes them."""
    robot, world = None, scene.world
    name = "one" if kind.endswith("PoseStamped") else "two"
    if kind.endswith("JointState") and "Multi" not in kind:
        (robot, world), name = scene.robot, "robot"
    old = world.records[name]
    motion = None if robot is None else RobotMotion(robot)
    record = SourceRecord(old.id, name, kind, robot=robot, motion=motion)
    warnings: list[str] = []
    channel = make_channel(POSES, record, warnings.append, "world")
    frames = world.frames(name)
    frames.stamps[:] = 0
    before = frames.X_PF.copy()
    channel.store(data, 1)
    moved = channel.apply(channel.take(), frames, LIMITS)
    if moved is None:
        np.testing.assert_array_equal(frames.X_PF, before)
        assert warnings or not channel.intake.statistics.faults
    R = frames.X_PF[:, :3, :3]
    assert np.isfinite(frames.X_PF).all()
    assert np.abs(R @ R.transpose(0, 2, 1) - np.eye(3)).max() < 1e-6
    world.commit([name], 1)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_bytes_of_topics(world):
    """Neither damaged messages nor odd values raise, and nothing but good poses is written."""
    fuzz(Target("messages", make, lambda steps: run(world, steps)), 5000)
