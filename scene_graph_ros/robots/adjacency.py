"""Which links of a robot touch by construction."""

from __future__ import annotations

from scene_graph_ros.robots.robot_model import RobotModel
from scene_graph_ros.robots.robot_parts import JointType

__all__ = ["adjacent_pairs"]


def adjacent_pairs(robot: RobotModel) -> set[tuple[str, str]]:
    """Return the pairs of links that touch by construction, each in alphabetical order.

    Links welded together by fixed joints are one body. Pairs within a body, and pairs of links
    joined by one joint, are adjacent; a link without collision geometry passes adjacency on to
    its neighbours, if it can move in the world. One that can't is no part of an arm: a link
    fixed to it, such as a pillar, is checked against the first link that moves.
    """
    body = {robot.root: robot.root}
    neighbours: dict[str, set[str]] = {name: set() for name in robot.links}
    for joint in robot.joints.values():
        welded = joint.type is JointType.FIXED
        body[joint.child] = body[joint.parent] if welded else joint.child
        neighbours[joint.parent].add(joint.child)
        neighbours[joint.child].add(joint.parent)
    for name, link in robot.links.items():
        if not link.collisions:
            around = neighbours.pop(name)
            for neighbour in around:
                if body[name] != robot.root:
                    neighbours[neighbour] |= around - {neighbour}
                neighbours[neighbour].discard(name)
    solid = sorted(neighbours)
    return {
        (link_A, link_B)
        for index, link_A in enumerate(solid)
        for link_B in solid[index + 1 :]
        if body[link_A] == body[link_B] or link_B in neighbours[link_A]
    }
