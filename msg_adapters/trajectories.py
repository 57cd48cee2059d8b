"""Trajectories of joints, and how fast joints may move, to messages and back."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Duration
import numpy as np
from numpy.typing import NDArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from msg_adapters.arrays import float64s_to_msg
from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import Meaning, RobotNames
from msg_adapters.stamps import duration_from_msg, duration_to_msg
from scene_graph_msgs.msg import MotionLimits as MotionLimitsMsg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.robots.kinematic_tree import KinematicTree
from scene_graph_ros.trajectories import MotionLimits, TrajectoryPoints

__all__ = [
    "joint_trajectory_from_msg",
    "joint_trajectory_to_msg",
    "motion_limits_from_msg",
    "rise_time_from_msg",
]

_RATES = ("velocities", "accelerations")


def joint_trajectory_to_msg(names: Sequence[str], points: TrajectoryPoints) -> JointTrajectory:
    """Return points of joints by name, to be executed at once: the stamp is zero.

    All numbers are there as they are. Raises OverflowError for times that no message can hold.
    """
    rates = [(name, getattr(points, name)) for name in _RATES]
    given = [(name, values) for name, values in rates if values is not None]
    message = JointTrajectory(joint_names=list(names))
    for row, time in enumerate(points.nanoseconds.tolist()):
        point = JointTrajectoryPoint(
            positions=float64s_to_msg(points.positions[row]),
            time_from_start=duration_to_msg(time),
        )
        for name, values in given:
            setattr(point, name, float64s_to_msg(values[row]))
        message.points.append(point)
    return message


def joint_trajectory_from_msg(
    message: JointTrajectory,
) -> tuple[tuple[str, ...], TrajectoryPoints]:
    """Return the joints' names and the points.

    Raises MessageError for no points, numbers that are not as many as joints, rates that only some
    points have, and efforts, which would be lost; TrajectoryError for times that do not grow and
    numbers that are not finite.
    """
    names, points = tuple(message.joint_names), message.points
    if not points:
        raise MessageError("points is empty")
    rows: dict[str, list[NDArray[np.float64]]] = {name: [] for name in ("positions", *_RATES)}
    for number, point in enumerate(points):
        if len(point.effort):
            raise MessageError(f"points[{number}] has efforts, for which there is no place")
        for name, values in rows.items():
            given = np.array(getattr(point, name), dtype=np.float64)
            has_none = name != "positions" and not len(given)
            if has_none and not values:
                continue
            if len(given) != len(names) or len(values) != number:
                raise MessageError(
                    f"points[{number}].{name} has {len(given)} numbers for {len(names)} joints;"
                    f" {len(values)} of {number} points before have some"
                )
            values.append(given)
    for name, values in rows.items():
        if values and len(values) != len(points):
            raise MessageError(f"only {len(values)} of {len(points)} points have {name}")
    times = np.array([duration_from_msg(p.time_from_start) for p in points], dtype=np.int64)
    velocities, accelerations = (np.array(rows[n]) if rows[n] else None for n in _RATES)
    return names, TrajectoryPoints(times, np.array(rows["positions"]), velocities, accelerations)


def motion_limits_from_msg(
    message: MotionLimitsMsg,
    names: RobotNames,
    tree: KinematicTree,
    positions: NDArray[np.intp],
    field: str,
) -> MotionLimits:
    """Return the limits of some positions ``(k,)`` of a tree, by their ``names``.

    Raises UnknownIdError or NameConflictError for a name, MessageError for lengths that do not
    fit, TrajectoryError for values that are no limits and for positions without one.
    """
    meanings = [names.meaning(name, f"{field}.names") for name in message.names]
    given: dict[str, dict[str, float]] = {}
    for what in (*_RATES, "jerks"):
        values = getattr(message, f"max_{what}")
        if len(values) not in (0, len(meanings)):
            raise MessageError(
                f"{field}.max_{what} has {len(values)} numbers for {len(meanings)} names"
            )
        given[what] = _narrowest(meanings, values, names, f"{field}.max_{what}")
    for what, of_others in (
        ("accelerations", message.max_acceleration),
        ("jerks", message.max_jerk),
    ):
        if of_others != 0.0:
            given[what] = {**dict.fromkeys(names.names, float(of_others)), **given[what]}
    return MotionLimits.of_tree(
        tree,
        accelerations=given["accelerations"],
        velocities=given["velocities"],
        jerks=given["jerks"] or None,
        velocity_scaling=message.velocity_scaling,
        acceleration_scaling=message.acceleration_scaling,
        positions=positions,
    )


def _narrowest(
    meanings: Sequence[Meaning],
    values: Sequence[float],
    names: RobotNames,
    field: str,
) -> dict[str, float]:
    """Return rates by position: of a joint and those that mimic it, the narrowest.

    Raises MessageError where a name comes twice, with two values.
    """
    result: dict[str, float] = {}
    by_name: dict[str, float] = {}
    for meaning, value in zip(meanings, values, strict=False):
        known = by_name.setdefault(meaning.name, float(value))
        if known != value:
            raise MessageError(
                f"{field} has {quoted(meaning.name)} twice, with {known:.10g} and {value:.10g}"
            )
        if meaning.multiplier == 0.0:
            continue  # It stands still, whatever its leader does.
        most, position = float(value) / abs(meaning.multiplier), names.names[meaning.row]
        result[position] = min(result.get(position, most), most)
    return result


def rise_time_from_msg(duration: Duration, field: str) -> float:
    """Return seconds; raises MessageError for less than none."""
    seconds = duration_from_msg(duration) * 1e-9
    if seconds < 0.0:
        raise MessageError(f"{field} is negative: {seconds:g} s")
    return seconds
