"""The part of a scene that jogging is about: the joints that move, the link, and the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.planning_robots import PlanningRobots
from scene_graph_ros.node.world.world import WorldSnapshot
from scene_graph_ros.planning import SceneGraphCollisionChecker

__all__ = ["JogScene", "jog_scene"]


@dataclass(frozen=True, eq=False)
class JogScene:
    """Robots of one model, as jogging needs them."""

    robots: PlanningRobots
    pairs: NDArray[np.int64]
    """``(p, 2)``: the pairs that are checked."""
    robot: str
    """The name of the robot that is jogged."""
    moving: NDArray[np.intp]
    """``(k,)``: the rows of its positions that may move."""
    names: tuple[str, ...]
    """Of these, in full."""
    joint_names: tuple[str, ...]
    """The same without the robot's name, as its controllers call them."""
    link: str
    """The link that twists are about, in full; "" where there is none."""
    others: tuple[str, ...]
    """Sources around the robot that send poses."""
    moving_frames: tuple[Any, ...]
    """The frames of these that have geometry around the robots."""

    def goes_on(self, before: JogScene) -> bool:
        """Tell whether a filter for a scene is one for this, at another moment."""
        return self.robots.tree.position_names == before.robots.tree.position_names and (
            self is before or np.array_equal(self.pairs, before.pairs)
        )


def jog_scene(
    robots: PlanningRobots,
    checker: SceneGraphCollisionChecker,
    snapshot: WorldSnapshot,
    part: str,
    link: str,
) -> JogScene:
    """Return the scene for a robot, or a group of one, and a link, "" for none.

    Raises UnknownIdError and NameConflictError for names, MessageError for a part without joints.
    """
    tree = robots.tree
    if part in snapshot.robots.robots:
        robot, prefix = part, f"{part}/"
        moving = np.array(
            [k for k, name in enumerate(tree.position_names) if name.startswith(prefix)], np.intp
        )
    else:
        group = robots.groups.names[robots.groups.row(part, "parameter jog")]
        robot, moving = robots.robot_of(group), tree.group_positions(group)
    if not len(moving):
        raise MessageError(f"parameter jog: {quoted(part)} has no joint that could move")
    names = tuple(tree.position_names[row] for row in moving)
    if link:
        link = robots.links.names[robots.links.row(link, "parameter jog_link")]
    others = tuple(
        name for name, each in snapshot.records.items() if each.pose_type and name != robot
    )
    return JogScene(
        robots,
        checker.plan.pairs.bodies,
        robot,
        moving,
        names,
        tuple(name.removeprefix(f"{robot}/") for name in names),
        link,
        others,
        _moving_frames(checker, snapshot, others),
    )


def _moving_frames(
    checker: SceneGraphCollisionChecker, snapshot: WorldSnapshot, sources: tuple[str, ...]
) -> tuple[Any, ...]:
    """Return the frames of sources that carry geometry around the robots."""
    plan, inspector = checker.plan, snapshot.inspector
    ids = {snapshot.records[name].id for name in sources}
    found: dict[int, Any] = {}
    for geometry_id in plan.geometry_ids[len(plan.bodies.joints) :]:
        frame = inspector.get_frame_id(geometry_id)
        if frame != inspector.world_frame_id() and inspector.get_owning_source_id(frame) in ids:
            found[int(frame)] = frame
    return tuple(found.values())
