"""Conditions on links of robots, from messages."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from geometry_msgs.msg import Pose
import numpy as np

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg
from msg_adapters.robot_configurations import RobotNames
from scene_graph_msgs.msg import LinkConstraint
from scene_graph_ros.planning.constraints.link_constraints import (
    AngleBetweenVectorsConstraint,
    OrientationConstraint,
    PositionConstraint,
)
from scene_graph_ros.planning.constraints.link_constraints import (
    LinkConstraint as Constraint,
)
from scene_graph_ros.planning.errors import PlanningError

__all__ = ["link_constraint_from_msg"]

_FIELDS = {
    "a_A": "vector_in_frame",
    "b_L": "vector_in_link",
    "p_LQ": "point",
    "X_AF": "box",
    "p_FQ_lower": "lower",
    "p_FQ_upper": "upper",
}
"""Fields of messages for the names of arguments, in errors about these."""


def link_constraint_from_msg(msg: LinkConstraint, links: RobotNames, field: str) -> Constraint:
    """Return a constraint, whose links have the names that the tree of all robots has for them.

    Raises UnknownIdError or NameConflictError for a link, InvalidPoseError for a pose or a
    quaternion, and MessageError for all else, naming ``field`` and the value.
    """
    link = links.names[links.row(msg.link, f"{field}.link")]
    frame = links.names[links.row(msg.frame, f"{field}.frame")] if msg.frame else None
    with _located(field):
        if msg.type == LinkConstraint.ANGLE_BETWEEN_VECTORS:
            return AngleBetweenVectorsConstraint(
                link,
                _numbers(msg.vector_in_frame),
                _numbers(msg.vector_in_link),
                msg.angle_upper,
                msg.angle_lower,
                frame,
            )
        if msg.type == LinkConstraint.ORIENTATION:
            R_AT, R_LT = (
                pose_from_msg(Pose(orientation=getattr(msg, name)), f"{field}.{name}")[:3, :3]
                for name in ("orientation", "tool")
            )
            return OrientationConstraint(link, R_AT, msg.theta_bound, R_LT, frame)
        if msg.type == LinkConstraint.POSITION:
            return PositionConstraint(
                link,
                _numbers(msg.lower),
                _numbers(msg.upper),
                _numbers(msg.point),
                pose_from_msg(msg.box, f"{field}.box"),
                frame,
            )
    known = ("ANGLE_BETWEEN_VECTORS", "ORIENTATION", "POSITION")
    listed = ", ".join(f"{getattr(LinkConstraint, name)} ({name})" for name in known)
    raise MessageError(f"{field}.type must be one of {listed}, not {msg.type}")


def _numbers(msg: Any) -> np.ndarray:
    return np.array([msg.x, msg.y, msg.z])


@contextmanager
def _located(field: str) -> Iterator[None]:
    """Have errors about arguments name the fields that these come from."""
    try:
        yield
    except PlanningError as error:
        words = str(error)
        for name, own in _FIELDS.items():
            words = words.replace(name, f"{field}.{own}")
        raise MessageError(words if field in words else f"{field}: {words}") from error
