"""Check that the links and joints of a URDF form one tree, and put parents before children."""

from __future__ import annotations

from collections.abc import Mapping
import dataclasses

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import Location, SceneFileError, suggestion
from scene_graph_ros.robots.robot_parts import Joint, Link
from scene_graph_ros.scene_files.dialects import link_dialect
from scene_graph_ros.scene_files.xml_tree import XmlElement

__all__ = ["arrange_joints", "check_mimics", "free_of_the_missing"]


def arrange_joints(
    root: XmlElement, links: Mapping[str, Link], joints: Mapping[str, Joint]
) -> tuple[str, dict[str, Joint]]:
    """Return the root link's name and the joints, each after the joint that moves its parent.

    Raises SceneFileError for unknown links, two joints with one child, several roots or a loop.
    """
    by_child: dict[str, Joint] = {}
    for joint in joints.values():
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name not in links:
                raise SceneFileError(
                    f"{joint.location}/{role}: no link {quoted(name)}"
                    f"{link_dialect(name) or suggestion(name, links)}"
                )
        if joint.child in by_child:
            other = by_child[joint.child]
            raise SceneFileError(
                f"{joint.location}/child: link {joint.child!r} is already moved by joint"
                f" {other.name!r} in line {other.location.line}"
            )
        by_child[joint.child] = joint
    roots = [name for name in links if name not in by_child]
    if len(roots) != 1:
        what = ", ".join(repr(name) for name in roots) or "none: the joints form a loop"
        place = Location(root.file, root.line)
        raise SceneFileError(f"{place}: expected one root link, got {what}")
    return roots[0], _ordered(roots[0], joints)


def _ordered(base: str, joints: Mapping[str, Joint]) -> dict[str, Joint]:
    by_parent: dict[str, list[Joint]] = {}
    for joint in joints.values():
        by_parent.setdefault(joint.parent, []).append(joint)
    result: dict[str, Joint] = {}
    pending = [base]
    while pending:
        below = by_parent.get(pending.pop(), [])
        result.update((joint.name, joint) for joint in below)
        pending.extend(joint.child for joint in reversed(below))
    for joint in joints.values():
        if joint.name not in result:
            raise SceneFileError(f"{joint.location}: is part of a loop of joints")
    return result


def free_of_the_missing(joints: Mapping[str, Joint]) -> tuple[dict[str, Joint], list[str]]:
    """Return the joints, those that mimic a missing joint without mimicry, and warnings of them.

    Robots are cut down to some of their joints, and keep the word of one that is gone.
    """
    result, warnings = dict(joints), []
    for joint in joints.values():
        if joint.mimic is not None and joint.mimic.joint not in joints:
            result[joint.name] = dataclasses.replace(joint, mimic=None)
            warnings.append(
                f"{joint.location}/mimic: ignored, as there is no joint"
                f" {quoted(joint.mimic.joint)}{suggestion(joint.mimic.joint, joints)}"
            )
    return result, warnings


def check_mimics(joints: Mapping[str, Joint]) -> None:
    """Raise SceneFileError if a mimicked joint is immobile, or mimics in a circle."""
    settled: set[str] = set()
    for joint in joints.values():
        followed = {joint.name: None}
        current = joint
        while current.mimic is not None and current.name not in settled:
            name = current.mimic.joint
            if name in followed:
                circle = " -> ".join([*list(followed)[:10], name])
                raise SceneFileError(f"{joint.location}/mimic: joints mimic each other: {circle}")
            followed[name] = None
            current = joints[name]
            if not current.type.has_position:
                raise SceneFileError(
                    f"{joint.location}/mimic: joint {name!r} is {current.type.value} and has no"
                    " position to mimic"
                )
        settled.update(followed)
