"""Read a robot's ``joint_limits.yaml`` as MoveIt's, which narrows the limits of the URDF."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from scene_graph_ros.geometry.files import MAX_TEXT_BYTES, read_limited
from scene_graph_ros.located import SceneFileError, suggestion
from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import Joint, JointType
from scene_graph_ros.scene_files.schema_errors import located_error
from scene_graph_ros.scene_files.yaml_document import parse_yaml, YamlDocument

__all__ = ["narrowed_by_file"]


class _JointLimits(BaseModel):
    """The limits of one joint in the file, in rad or m, s: none without its ``has_`` word."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    has_position_limits: bool = False
    min_position: float | None = None
    max_position: float | None = None
    has_velocity_limits: bool = False
    max_velocity: float | None = None
    has_acceleration_limits: bool = False
    max_acceleration: float | None = None
    has_deceleration_limits: bool = False
    max_deceleration: float | None = None
    has_jerk_limits: bool = False
    max_jerk: float | None = None
    has_effort_limits: bool = False
    max_effort: float | None = None


class _LimitsFile(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    joint_limits: dict[str, _JointLimits] = {}
    default_velocity_scaling_factor: float | None = None
    default_acceleration_scaling_factor: float | None = None


_RATES = (
    ("velocity", "has_velocity_limits", "max_velocity"),
    ("acceleration", "has_acceleration_limits", "max_acceleration"),
    # Ours are alike both ways, so the smaller of the two holds.
    ("acceleration", "has_deceleration_limits", "max_deceleration"),
    ("jerk", "has_jerk_limits", "max_jerk"),
)


def narrowed_by_file(robot: RobotModel, path: Path, label: str) -> RobotModel:
    """Return a robot whose joints have the narrower of their limits and the file's.

    Its notes name the narrowed limits, its warnings the joints that the robot has not.
    Raises SceneFileError with the line for limits that make no sense.
    """
    try:
        document = parse_yaml(read_limited(path, MAX_TEXT_BYTES), label)
    except OSError as error:
        raise SceneFileError(f"{path}: cannot be read: {error.strerror}") from error
    if not isinstance(document.data, dict):
        raise document.error(f"limits are a mapping, got {type(document.data).__name__}")
    try:
        spec = _LimitsFile.model_validate(document.data)
    except ValidationError as error:
        raise located_error(error, document) from error
    joints, notes, warnings = dict(robot.joints), list(robot.notes), list(robot.warnings)
    for name, limits in spec.joint_limits.items():
        place = document.location("joint_limits", name)
        if name not in joints or not joints[name].type.has_position:
            what = "joint" if name not in joints else "position of joint"
            warnings.append(
                f"{place}: robot {robot.name!r} has no {what} {name!r}{suggestion(name, joints)}"
            )
            continue
        joints[name] = _narrowed(document, joints[name], limits, notes)
    return replace(robot, joints=joints, notes=tuple(notes), warnings=tuple(warnings))


def _narrowed(
    document: YamlDocument, joint: Joint, limits: _JointLimits, notes: list[str]
) -> Joint:
    """Return a joint with the narrower limits, after checking them; say which the file's are."""
    place = ("joint_limits", joint.name)
    changes: dict[str, Any] = {}
    if limits.has_position_limits:
        changes.update(_positions(document, joint, limits))
    for kind, word, key in _RATES:
        if not getattr(limits, word):
            continue
        most = getattr(limits, key)
        if most is None or not most > 0.0:
            value = "nothing" if most is None else f"{most:g}"
            raise document.error(f"{key} must be positive, got {value}", *place)
        known = changes.get(kind, getattr(joint, kind))
        if known is None or most < known:
            changes[kind] = most
    for kind, value in changes.items():
        before = getattr(joint, kind)
        was = "none" if before is None else f"{before:g}"
        where = document.location(*place)
        notes.append(f"{where}: narrows {kind} of {joint.name!r} to {value:g}, from {was}")
    return replace(joint, **changes)


def _positions(document: YamlDocument, joint: Joint, limits: _JointLimits) -> dict[str, float]:
    place = ("joint_limits", joint.name)
    low, high = limits.min_position, limits.max_position
    if low is None or high is None:
        raise document.error("has_position_limits needs min_position and max_position", *place)
    if low > high:
        raise document.error(f"min_position, {low:g}, is above max_position, {high:g}", *place)
    if joint.type is JointType.CONTINUOUS:
        raise document.error(
            f"joint {joint.name!r} is continuous: it has no limits of position", *place
        )
    lower = low if joint.lower is None else max(low, joint.lower)
    upper = high if joint.upper is None else min(high, joint.upper)
    if lower > upper:
        raise document.error(
            f"{low:g} to {high:g} has nothing in common with the URDF's limits of {joint.name!r},"
            f" {joint.lower:g} to {joint.upper:g}",
            *place,
        )
    found = {"lower": lower, "upper": upper}
    return {kind: value for kind, value in found.items() if getattr(joint, kind) != value}
