"""Robots that are balls on rails, in a world like the node's: all answers are known by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robot_scenes import SLIDE

from msg_adapters.queries import options_from_msg
from scene_graph_msgs import srv
from scene_graph_msgs.msg import QueryOptions
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.effects.declarations import EFFECT_NAMES
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.world.inputs import message_type
from scene_graph_ros.node.world.scenes import SceneLoader
from scene_graph_ros.node.world.world import World

__all__ = ["answer", "rail_scene", "rail_world", "slide"]

RAILS = """
version: 1
sources: [{name: around}]
robots:
  - {name: slide, urdf: %s, positions: {rail: -1}, collision: true}
frames: [{name: post, source: around, pose: {xyz: [1, 0, 0]}}]
geometries:
  - {name: post, source: around, frame: post, shape: {type: sphere, radius: 0.2}}
"""
# The robot's ball has a radius of 0.1: it touches the post where the rail is at 0.7.

SECOND = """
  - {name: other, urdf: %s, base: {xyz: [0, 5, 0]}, joint_states: other/joint_states}
"""


def rail_scene(folder: Path, *, two: bool = False, more: str = "") -> Path:
    """Write a scene with a robot, or two, and a post in the way of the first; return the file.

    ``more`` are further geometries.
    """
    urdf = folder / "slide.urdf"
    urdf.write_text(SLIDE)
    text = RAILS % urdf
    if two:
        text = text.replace("frames:", f"{SECOND % urdf}frames:".lstrip("\n"))
    path = folder / "rails.yaml"
    path.write_text(text + more)
    return path


def rail_world(folder: Path, **options: Any) -> World:
    """Return a world with that scene."""
    world = World(SceneGraph())
    loader = SceneLoader("", message_type, EFFECT_NAMES)
    world.edit(lambda edit: loader.load(edit, str(rail_scene(folder, **options))))
    return world


def slide(world: World, robot: str, position: float, joint: str = "rail") -> None:
    """Put a robot's ball somewhere, or move another joint of it, as a message would."""
    with world.lock:
        motion = world.records[robot].motion
        assert motion is not None
        motion.stamped([joint], 1, is_static=False)
        _, X_WL = motion.kinematics.link_poses([joint], [position])
        motion.write(X_WL, [joint], world.frames(robot))
        world.commit({robot}, None)


def answer(world: World, name: str, limits: dict[str, int] | None = None, **fields: Any) -> Any:
    """Return what a query service answers; raises what it would refuse a request for."""
    options = fields.get("options", QueryOptions())
    snapshot = world.snapshot
    scope = QueryScope(
        snapshot,
        options_from_msg(options, snapshot.names),
        lambda parameter: {"query_threads": 1, **(limits or {})}.get(parameter, 10**6),
    )
    response = getattr(srv, name).Response()
    QUERIES[name].handler(getattr(srv, name).Request(**fields), response, scope)
    return response
