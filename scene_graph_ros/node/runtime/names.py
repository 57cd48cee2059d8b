"""Names of the node's topics and services: relative, so that namespaces and remapping work."""

from __future__ import annotations

__all__ = [
    "BASE_TYPES",
    "CAMERAS",
    "CONTACTS",
    "CONTACT_MARKERS",
    "CONTACT_SURFACE_MARKERS",
    "CONTACT_SURFACE_POINTS",
    "DEFAULT_POSE_TYPE",
    "DIAGNOSTICS",
    "JOG_JOINTS",
    "JOG_STATUS",
    "JOG_TWIST",
    "JOG_VELOCITIES",
    "MARKERS_ILLUSTRATION",
    "MARKERS_PERCEPTION",
    "MARKERS_PLAN",
    "MARKERS_PROXIMITY",
    "MARKERS_REGIONS",
    "NODE_NAME",
    "PLAN_HOLDS",
    "PLAN_PATH",
    "POSE_TOPICS",
    "REGIONS",
    "SENSED",
    "TRAJECTORY",
    "TRANSFORMS",
    "default_configuration_topic",
    "default_heights_topic",
    "default_points_topic",
    "default_pose_topic",
    "default_voxels_topic",
    "service_name",
]

NODE_NAME = "scene_graph"

MARKERS_ILLUSTRATION = "~/markers/illustration"
MARKERS_PROXIMITY = "~/markers/proximity"
MARKERS_PERCEPTION = "~/markers/perception"
MARKERS_PLAN = "~/markers/plan"
MARKERS_REGIONS = "~/markers/regions"
CONTACTS = "~/contacts"
CONTACT_MARKERS = "~/contact_markers"
CONTACT_SURFACE_MARKERS = "~/contact_surface_markers"
CONTACT_SURFACE_POINTS = "~/contact_surface_points"
CAMERAS = "~/cameras"
SENSED = "~/sensed"
"""Of points of images of depth, without the robot's: each source's below its name."""
PLAN_HOLDS = "~/plan_holds"
PLAN_PATH = "~/plan_path"
REGIONS = "~/regions"
JOG_JOINTS = "~/delta_joint_cmds"
JOG_TWIST = "~/delta_twist_cmds"
"""Commands that jog a robot, by the names that MoveIt Servo has for them."""
JOG_VELOCITIES = "~/jog_velocities"
JOG_STATUS = "~/jog_status"
TRAJECTORY = "~/trajectory"
"""Motions that a page had executed."""
DIAGNOSTICS = "/diagnostics"
TRANSFORMS = "/tf"

DEFAULT_POSE_TYPE = "sensor_msgs/msg/MultiDOFJointState"

POSE_TOPICS: dict[str, str] = {
    "sensor_msgs/msg/MultiDOFJointState": "{source}/poses",
    "geometry_msgs/msg/PoseStamped": "{source}/poses",
    "geometry_msgs/msg/TransformStamped": "{source}/poses",
    "sensor_msgs/msg/JointState": "joint_states",
    "tf2_msgs/msg/TFMessage": "/tf",
}
"""Every message type that a source may send its poses as, and the topic where none is named."""

BASE_TYPES = (
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/TransformStamped",
)
"""The message types by which a robot's base may move, beside TF."""


def default_pose_topic(source: str, pose_type: str) -> str:
    """Return the topic on which ``source`` sends messages of ``pose_type`` unless told otherwise.

    Raises ``KeyError`` for a type that is no pose input.
    """
    return POSE_TOPICS[pose_type].format(source=source)


def default_configuration_topic(source: str) -> str:
    """Return the topic on which ``source`` sends configurations of its deformable geometry."""
    return f"{source}/configurations"


def default_heights_topic(source: str) -> str:
    """Return the topic on which ``source`` sends the heights of its height field."""
    return f"{source}/heights"


def default_points_topic(source: str) -> str:
    """Return the topic on which ``source`` sends the points of its cloud."""
    return f"{source}/points"


def default_voxels_topic(source: str) -> str:
    """Return the topic on which ``source`` sends the maps of its voxel grid."""
    return f"{source}/voxels"


def service_name(service_type: str) -> str:
    """Return the relative name of a service: ``HasCollisions`` is ``~/has_collisions``."""
    words = "".join(f"_{c.lower()}" if c.isupper() else c for c in service_type)
    return f"~/{words.lstrip('_')}"
