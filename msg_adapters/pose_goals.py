"""Where tools of robots are to be, from messages."""

from __future__ import annotations

import math

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg
from msg_adapters.robot_configurations import RobotNames
from scene_graph_msgs.msg import PoseGoal
from scene_graph_ros.planning.ik.pose_target import PoseTarget

__all__ = ["pose_target_from_msg"]

_TOLERANCE = 1e-9
"""m and rad, where a message says none."""


def pose_target_from_msg(msg: PoseGoal, links: RobotNames, field: str) -> PoseTarget:
    """Return a target, whose link has the name that the tree of all robots has for it.

    Raises UnknownIdError or NameConflictError for the link, InvalidPoseError for a pose and
    MessageError for a tolerance, naming ``field`` and the value.
    """
    tolerances = {}
    for name in ("position_tolerance", "rotation_tolerance"):
        value = getattr(msg, name)
        if not 0.0 <= value < math.inf:
            raise MessageError(f"{field}.{name} must be a number from 0 on, not {value}")
        tolerances[name] = value if value > 0.0 else _TOLERANCE
    return PoseTarget(
        links.names[links.row(msg.link, f"{field}.link")],
        X_WT=pose_from_msg(msg.pose, f"{field}.pose"),
        X_LT=pose_from_msg(msg.tool, f"{field}.tool"),
        **tolerances,
    )
