"""Limits of joints' positions and speeds in a URDF; limits that make no sense are refused."""

from __future__ import annotations

from collections.abc import Mapping
import math

from scene_graph_ros.located import SceneFileError
from scene_graph_ros.robots.robot_parts import Joint, JointType
from scene_graph_ros.scene_files.xml_tree import XmlElement

__all__ = ["check_ranges", "joint_limits", "velocity_limit"]


def joint_limits(
    joint: XmlElement, kind: JointType
) -> tuple[float | None, float | None, list[str]]:
    """Return the lower and upper limit of a joint, rad or m, and notes on narrowed ones.

    ``<safety_controller>`` narrows them. Raises SceneFileError for limits without a position
    between them.
    """
    limit, safety = joint.only_child("limit"), joint.only_child("safety_controller")
    if kind not in (JointType.REVOLUTE, JointType.PRISMATIC):
        return None, None, []
    lower = upper = None
    if limit is not None:
        lower, upper = limit.number("lower", "0"), limit.number("upper", "0")
        if lower > upper:
            raise limit.error(
                f"lower, {lower:g}, is above upper, {upper:g} (Bullet means by that that there"
                " are none: a continuous joint, or wide limits, say so)"
            )
    notes: list[str] = []
    if safety is not None:
        lower, upper, notes = _narrowed(safety, lower, upper)
    return lower, upper, notes


def _narrowed(
    safety: XmlElement, lower: float | None, upper: float | None
) -> tuple[float | None, float | None, list[str]]:
    """Return limits as a safety controller narrows them; a pair of zeros says nothing."""
    names = ("soft_lower_limit", "soft_upper_limit")
    low, high = (safety.number(name, "0") for name in names)
    if low == high == 0.0:
        return lower, upper, []
    if low > high:
        raise safety.error(f"soft_lower_limit, {low:g}, is above soft_upper_limit, {high:g}")
    first = low if lower is None else max(low, lower)
    last = high if upper is None else min(high, upper)
    if first > last:
        raise safety.error(
            f"soft limits {low:g} to {high:g} have nothing in common with the limits"
            f" {lower:g} to {upper:g}"
        )
    if (first, last) == (lower, upper):
        return lower, upper, []
    before = "none" if lower is None else f"{lower:g} to {upper:g}"
    text = f"narrows the limits to {first:g} to {last:g}, from {before}"
    return first, last, [f"{safety.location()}: {text}"]


def velocity_limit(limit: XmlElement | None, kind: JointType) -> float | None:
    """Return the largest speed, None where there is none or its direction has no one number."""
    if limit is None or not kind.has_position or "velocity" not in limit.attributes:
        return None
    velocity = limit.number("velocity")
    if velocity < 0.0:
        raise limit.error(f"must not be negative, got {velocity:g}", "velocity")
    return velocity


def check_ranges(joints: Mapping[str, Joint]) -> None:
    """Raise SceneFileError for joints that mimic another and leave it no position.

    Limits of a follower are limits of its leader: position = multiplier * leader's + offset.
    """
    for joint in joints.values():
        if joint.mimic is None or joint.lower is None or joint.upper is None:
            continue
        leader, factor, offset = joint, 1.0, 0.0
        while leader.mimic is not None:
            offset += factor * leader.mimic.offset
            factor *= leader.mimic.multiplier
            leader = joints[leader.mimic.joint]
        ends = [-math.inf if leader.lower is None else leader.lower]
        ends.append(math.inf if leader.upper is None else leader.upper)
        low, high = sorted((factor * end if factor else 0.0) + offset for end in ends)
        slack = 1e-9 * max(1.0, abs(joint.lower), abs(joint.upper))
        if low > joint.upper + slack or high < joint.lower - slack:
            raise SceneFileError(
                f"{joint.location}/mimic: joint {leader.name!r} leads it to {low:g} to {high:g},"
                f" of which its limits, {joint.lower:g} to {joint.upper:g}, have nothing"
            )
