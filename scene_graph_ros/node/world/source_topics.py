"""The topics that sources send on, as asked for: before namespaces and remapping."""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass
from typing import Any, Protocol

from scene_graph_ros.node.runtime.names import (
    default_configuration_topic,
    default_heights_topic,
    default_points_topic,
    default_pose_topic,
    DEFAULT_POSE_TYPE,
    default_voxels_topic,
    TRANSFORMS,
)
from scene_graph_ros.scene_files.sensor_settings import (
    DepthSettings,
    FLAT_MAPS,
    SensorSettings,
    VoxelSettings,
)

__all__ = [
    "CAMERA_INFO",
    "CONFIGURATION_TYPE",
    "DEFAULT_POSE_TYPE",
    "DEPTH_IMAGES",
    "DESCRIPTION_TYPE",
    "HEIGHTS",
    "IMAGE_TYPE",
    "INFO_TYPE",
    "JOINT_STATE",
    "POINTS_TYPE",
    "POSE_STAMPED",
    "TF",
    "TRANSFORM_STAMPED",
    "VOXELS",
    "Sender",
    "SourceTopic",
    "base_topic",
    "configuration_topic",
    "depth_settings",
    "description_topic",
    "filled_source",
    "fills_voxels",
    "heights_topic",
    "joint_pose_topic",
    "points_topic",
    "pose_topic",
    "topics_of",
    "voxel_settings",
    "voxels_topic",
]

CONFIGURATION_TYPE = "scene_graph_msgs/msg/DeformableConfigurations"
DESCRIPTION_TYPE = "std_msgs/msg/String"
POINTS_TYPE = "sensor_msgs/msg/PointCloud2"
IMAGE_TYPE = "sensor_msgs/msg/Image"
INFO_TYPE = "sensor_msgs/msg/CameraInfo"
JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
TRANSFORM_STAMPED = "geometry_msgs/msg/TransformStamped"
TF = "tf2_msgs/msg/TFMessage"

DEPTH_IMAGES = "depth images"
CAMERA_INFO = "camera info"
"""The nouns of a depth camera's two topics."""

HEIGHTS = "heights"
VOXELS = "voxels"


class Sender(Protocol):
    """A source: empty topics are the default ones, no type means no poses."""

    @property
    def name(self) -> str:
        """Name of the source."""

    @property
    def pose_type(self) -> str:
        """Type of its pose messages."""

    @property
    def pose_topic(self) -> str:
        """Topic of its poses as given."""

    @property
    def configuration_topic(self) -> str:
        """Topic of its configurations as given."""

    @property
    def points_topic(self) -> str:
        """Topic of its cloud's points as given."""

    @property
    def sensor(self) -> SensorSettings | None:
        """The settings of its images of depth or clouds, None where no file has some."""

    @property
    def voxels(self) -> VoxelSettings | None:
        """The settings of the maps of its voxel grid, None where no file has some."""

    @property
    def robot(self) -> Any:
        """The robot, None of a source that is none."""

    @property
    def description(self) -> Any:
        """Where the robot's description comes from, None where a file has it."""


@dataclass(frozen=True)
class SourceTopic:
    """A topic that a source sends ``noun`` on, as asked for: before namespaces and remapping."""

    source: str
    noun: str
    topic: str
    type: str
    is_default: bool


def pose_topic(sender: Sender) -> str:
    """Return the topic of a source's poses as asked for."""
    return sender.pose_topic or default_pose_topic(sender.name, sender.pose_type)


def configuration_topic(sender: Sender) -> str:
    """Return the topic of a source's configurations as asked for."""
    return sender.configuration_topic or default_configuration_topic(sender.name)


def points_topic(sender: Sender) -> str:
    """Return the topic of the points of a source's cloud as asked for."""
    return sender.points_topic or default_points_topic(sender.name)


def heights_topic(sender: Sender) -> str:
    """Return the topic of the heights of a source's height field."""
    return default_heights_topic(sender.name)


def voxel_settings(sender: Sender) -> VoxelSettings:
    """Return the settings of the maps of a source's voxel grid."""
    return sender.voxels or FLAT_MAPS


def voxels_topic(sender: Sender) -> str:
    """Return the topic of these maps as asked for."""
    return voxel_settings(sender).topic or default_voxels_topic(sender.name)


def filled_source(sender: Sender) -> str:
    """Return the name of the source whose geometry a source's sensor fills: mostly its own."""
    return (sender.sensor.fills if sender.sensor is not None else "") or sender.name


def fills_voxels(sender: Sender) -> bool:
    """Tell whether a source's sensor fills its voxel grid in place of a cloud."""
    return sender.sensor is not None and sender.sensor.into_voxels


def depth_settings(sender: Sender) -> DepthSettings | None:
    """Return the settings of a source's images of depth, None where it sends none."""
    return sender.sensor if isinstance(sender.sensor, DepthSettings) else None


def base_topic(sender: Sender) -> str:
    """Return the topic on which a robot's base moves as asked for, "" where it stands still."""
    base = None if sender.robot is None else sender.robot.moving_base
    if base is None:
        return ""
    return base.topic or TRANSFORMS


def joint_pose_topic(sender: Sender) -> str:
    """Return the topic of poses of a robot's joints, "" where it has none that are poses."""
    robot = sender.robot
    return robot.joint_poses_topic if robot is not None and robot.has_joint_poses else ""


def description_topic(sender: Sender) -> str:
    """Return the topic of a robot's description, "" where a file has it."""
    return "" if sender.description is None else sender.description.topic


def topics_of(
    senders: Iterable[Sender],
    deforming: Container[str],
    sensing: Container[str] = (),
    with_fields: Container[str] = (),
    with_grids: Container[str] = (),
) -> dict[SourceTopic, None]:
    """Return all topics.

    ``deforming`` are the names of sources with deformable geometry, ``sensing`` of those with
    clouds, ``with_fields`` of those with height fields, ``with_grids`` of those with voxel grids.
    """
    topics: dict[SourceTopic, None] = {}
    for sender in senders:
        name, kind = sender.name, sender.pose_type
        if kind:
            topic, is_default = pose_topic(sender), not sender.pose_topic
            topics[SourceTopic(name, "poses", topic, kind, is_default)] = None
        if name in deforming:
            topic, is_default = configuration_topic(sender), not sender.configuration_topic
            kind = CONFIGURATION_TYPE
            topics[SourceTopic(name, "configurations", topic, kind, is_default)] = None
        fills, depth = filled_source(sender) in sensing, depth_settings(sender)
        if fills and depth is not None:
            images, info = depth.image_topic, depth.info_topic
            topics[SourceTopic(name, DEPTH_IMAGES, images, IMAGE_TYPE, False)] = None
            topics[SourceTopic(name, CAMERA_INFO, info, INFO_TYPE, False)] = None
        elif fills:
            topic, is_default = points_topic(sender), not sender.points_topic
            topics[SourceTopic(name, "points", topic, POINTS_TYPE, is_default)] = None
        if name in with_fields:
            topics[SourceTopic(name, HEIGHTS, heights_topic(sender), IMAGE_TYPE, True)] = None
        if name in with_grids:
            topic, kind = voxels_topic(sender), voxel_settings(sender).type
            is_default = not voxel_settings(sender).topic
            topics[SourceTopic(name, VOXELS, topic, kind, is_default)] = None
        for noun, topic, kind in _of_robot(sender):
            if topic:
                topics[SourceTopic(name, noun, topic, kind, False)] = None
    return topics


def _of_robot(sender: Sender) -> list[tuple[str, str, str]]:
    """Return a robot's topics beside its joint states: noun, topic or "", type."""
    base = base_topic(sender)
    base_type = (sender.robot.moving_base.type or TF) if base else ""
    return [
        ("base poses", base, base_type),
        ("joint poses", joint_pose_topic(sender), DEFAULT_POSE_TYPE),
        ("descriptions", description_topic(sender), DESCRIPTION_TYPE),
    ]
