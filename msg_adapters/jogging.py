"""Velocities that are asked for, of joints and of links, and those that are sent to a robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from geometry_msgs.msg import TwistStamped
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Float64MultiArray, MultiArrayDimension
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.arrays import float64s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import RobotNames
from msg_adapters.stamps import duration_to_msg, stamp_to_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = [
    "JointVelocities",
    "joint_velocities_from_msg",
    "twist_from_msg",
    "velocities_to_msg",
    "velocity_point_to_msg",
]


class JointVelocities(NamedTuple):
    """Velocities of some positions, rad/s or m/s, and for how long (s) they are meant."""

    rows: NDArray[np.intp]
    values: NDArray[np.float64]
    duration: float
    """0 where the message leaves it open."""


def joint_velocities_from_msg(
    message: Any, names: RobotNames, moving: NDArray[np.intp]
) -> JointVelocities:
    """Return the velocities of a ``control_msgs/JointJog``, for the ``moving`` positions ``(k,)``.

    Raises UnknownIdError and NameConflictError for a joint's name, MessageError for one that may
    not move or is there twice, displacements, lengths that differ and numbers that are not finite,
    naming the field and the value.
    """
    if len(message.displacements):
        raise MessageError(
            f"displacements has {len(message.displacements)} numbers, and must be empty:"
            " velocities alone are followed"
        )
    count = len(message.joint_names)
    if len(message.velocities) != count:
        raise MessageError(
            f"velocities has {len(message.velocities)} numbers for {count} names in joint_names"
        )
    if not 0.0 <= message.duration <= MAX_COORDINATE:
        raise MessageError(f"duration must be a number from 0 on, not {message.duration}")
    rows: list[int] = []
    for at, name in enumerate(message.joint_names):
        meaning = names.meaning(name, f"joint_names[{at}]")
        if not meaning.is_own or meaning.row not in moving:
            listed = ", ".join(names.short(int(row)) for row in moving)
            raise MessageError(
                f"joint_names[{at}]: {quoted(name)} is none of the joints that are jogged:"
                f" {listed}"
            )
        if meaning.row in rows:
            raise MessageError(f"joint_names[{at}]: {quoted(name)} is there twice")
        rows.append(meaning.row)
        value = message.velocities[at]
        if not abs(value) <= MAX_COORDINATE:
            raise MessageError(
                f"velocities[{at}] of {quoted(name)} must be a finite number, not {value}"
            )
    values = np.array(message.velocities, dtype=np.float64)
    return JointVelocities(np.array(rows, dtype=np.intp), values, float(message.duration))


def twist_from_msg(message: TwistStamped) -> NDArray[np.float64]:
    """Return a twist ``(6,)``: angular velocity, rad/s, then linear velocity, m/s.

    In the frame of the message's header. Raises MessageError naming the number that is not finite.
    """
    result = np.empty(6)
    for part, first in (("angular", 0), ("linear", 3)):
        for k, axis in enumerate("xyz"):
            value = getattr(getattr(message.twist, part), axis)
            if not abs(value) <= MAX_COORDINATE:
                raise MessageError(f"twist.{part}.{axis} must be a finite number, not {value}")
            result[first + k] = value
    return result


def velocities_to_msg(velocities: NDArray[np.float64]) -> Float64MultiArray:
    """Return velocities ``(k,)``, as controllers of groups of joints take them."""
    message = Float64MultiArray(data=float64s_to_msg(velocities))
    count = len(velocities)
    message.layout.dim = [MultiArrayDimension(label="joints", size=count, stride=count)]
    return message


def velocity_point_to_msg(
    names: Sequence[str],
    velocities: NDArray[np.float64],
    positions: NDArray[np.float64],
    stamp: int,
    period: int,
) -> JointTrajectory:
    """Return a trajectory of one point: where joints are, ``period`` (ns) after ``stamp`` (ns).

    ``velocities`` and ``positions`` ``(k,)`` are those at the point.
    """
    point = JointTrajectoryPoint(
        positions=float64s_to_msg(positions),
        velocities=float64s_to_msg(velocities),
        time_from_start=duration_to_msg(period),
    )
    message = JointTrajectory(joint_names=list(names), points=[point])
    message.header.stamp = stamp_to_msg(stamp)
    return message
