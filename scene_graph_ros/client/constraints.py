"""Constraints on links as messages, without importing those of `scene_graph_ros.planning`."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Vector3
import numpy as np

from scene_graph_msgs.msg import LinkConstraint
from scene_graph_ros.client.poses import pose_msg

__all__ = ["constraint_msg"]


def constraint_msg(constraint: Any) -> LinkConstraint:
    """Return an angle between vectors, an orientation or a position as a message.

    A message is returned as it is. Raises ValueError for anything else.
    """
    if isinstance(constraint, LinkConstraint):
        return constraint
    make = _MAKERS.get(type(constraint).__name__)
    if make is None:
        raise ValueError(
            f"constraints must be {', '.join(_MAKERS)} or LinkConstraint messages, not"
            f" {type(constraint).__name__}"
        )
    frame = constraint.frame or ""
    return LinkConstraint(link=constraint.link, frame=frame, **make(constraint))


def _angle(of: Any) -> dict[str, Any]:
    return {
        "type": LinkConstraint.ANGLE_BETWEEN_VECTORS,
        "vector_in_frame": _vector(of.a_A),
        "vector_in_link": _vector(of.b_L),
        "angle_lower": float(of.angle_lower),
        "angle_upper": float(of.angle_upper),
    }


def _orientation(of: Any) -> dict[str, Any]:
    turns = {"orientation": of.R_AT, "tool": of.R_LT}
    X = np.eye(4)
    fields: dict[str, Any] = {}
    for name, R in turns.items():
        X[:3, :3] = R
        fields[name] = pose_msg(X).orientation
    return {"type": LinkConstraint.ORIENTATION, "theta_bound": float(of.theta_bound), **fields}


def _position(of: Any) -> dict[str, Any]:
    x, y, z = map(float, of.p_LQ)
    return {
        "type": LinkConstraint.POSITION,
        "point": Point(x=x, y=y, z=z),
        "box": pose_msg(of.X_AF),
        "lower": _vector(of.p_FQ_lower),
        "upper": _vector(of.p_FQ_upper),
    }


_MAKERS = {
    "AngleBetweenVectorsConstraint": _angle,
    "OrientationConstraint": _orientation,
    "PositionConstraint": _position,
}


def _vector(v: Any) -> Vector3:
    x, y, z = map(float, v)
    return Vector3(x=x, y=y, z=z)
