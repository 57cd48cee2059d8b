"""Whether somebody has said where the joints are that a plan is about, and how long ago."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math
from typing import Any

from msg_adapters.errors import MessageError, StaleError
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.robot_motion import BASE
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["require_reported"]

_MOST_NAMED = 5
_WORLD = 0
"""The row of the base in the tree."""


def require_reported(
    request: Any,
    robots: PlanningRobots,
    snapshot: WorldSnapshot,
    limit: Callable[[str], Any],
    now: int,
) -> None:
    """Raise StaleError where a goal would begin where nobody has said that the robot is.

    That is so of joints that its group moves or stands on, and of a base that messages move, which
    were never reported, or earlier than the goal's max_state_age before ``now`` (ns). Positions of
    the goal's start need no report. Raises MessageError for an age that means nothing.
    """
    age = float(request.max_state_age)
    if not age >= 0.0:
        raise MessageError(f"max_state_age must be a number from 0 on, not {age}")
    age = age or float(limit("max_pose_age")) or math.inf
    if limit("plan_from_unreported"):
        return
    given = {
        robots.positions.names[robots.positions.row(n, "start.names")] for n in request.start.names
    }
    never, old = [], []
    for robot, name, path in _needed(request.group, robots, given):
        # Of the snapshot: what is heard meanwhile is not where the plan begins.
        stamp = snapshot.stamps[robot].joint_stamps.get(name)
        if stamp == UNSTAMPED:
            never.append(path)
        elif stamp is not None and (now - stamp) * 1e-9 > age:
            old.append(f"{path} {(now - stamp) * 1e-9:.1f} s ago")
    if never or old:
        reports = [f"nobody has reported {_some(never)}"] if never else []
        reports += (
            [f"the last report of {_some(old)}, and max_state_age is {age:g} s"] if old else []
        )
        raise StaleError(
            f"no plan from a state that is not known: {'; '.join(reports)}. Publish joint states,"
            " give these positions in start, or set the node's parameter plan_from_unreported"
        )


def _needed(group: str, robots: PlanningRobots, given: set[str]) -> Iterator[tuple[str, str, str]]:
    """Yield robot, joint (BASE for its base) and path of each that has to be reported."""
    tree, needed = robots.tree, dict[str, None]()
    members = None
    if group:
        members = set(tree.groups[robots.groups.names[robots.groups.row(group, "group")]])
    for joint in tree.joints:
        if members is not None and joint.name not in members:
            continue
        needed[joint.mimics or joint.name] = None
        above = joint.parent
        while above != _WORLD:
            needed[tree.joints[above - 1].mimics or tree.joints[above - 1].name] = None
            above = tree.joints[above - 1].parent
    positions = {path: robots.positions_of(path) for path in needed}
    owners = {path: robots.robot_of(path) for path in needed}
    for path in needed:
        if not given.issuperset(positions[path]):
            yield owners[path], path.removeprefix(f"{owners[path]}/"), path
    for robot in dict.fromkeys(owners.values()):
        yield robot, BASE, f"{robot}'s base"


def _some(names: list[str]) -> str:
    more = len(names) - _MOST_NAMED
    return ", ".join(names[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
