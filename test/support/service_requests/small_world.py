"""A small world that requests are about: an arm, a table, a camera, and a ball on a rail."""

from __future__ import annotations

import atexit
import dataclasses
from functools import cache
from pathlib import Path
import shutil
import tempfile
from typing import Any

from robot_scenes import SLIDE

from scene_graph_msgs.msg import GeometryReference, SourceHandle, WhatIf
import scene_graph_msgs.srv
from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.node.world.edits import EDITS
from scene_graph_ros.node.world.handles import Handle
from scene_graph_ros.node.world.world import World
from scene_graph_ros.scene_files import load_scene_text, Scene

__all__ = ["BALL", "BOX", "OWNER", "SCENE", "WHAT_IF", "new_world", "state"]

ROBOT = """
version: 1
name: r
robots: [{name: slide, urdf: %s, base: {xyz: [0, 0, 2]}}]
"""
SCENE = """
version: 1
name: s
sources: [{name: arm}, {name: table}]
frames:
  - {name: base, source: arm}
  - {name: hand, source: arm, parent: base}
  - {name: cup, source: arm}
geometries:
  - {name: ball, source: arm, frame: base, shape: {type: sphere, radius: 0.4}}
  - {name: box, source: arm, frame: hand, shape: {type: box, size: [0.5, 0.6, 0.7]}}
  - {name: floor, source: table, shape: {type: half_space}}
cameras:
  - {name: eye, source: arm, frame: hand, size: [4, 3], fov_y: 1, images: [depth]}
"""
TOKEN = 7
OWNER = SourceHandle(name="arm", token=TOKEN)
BALL, BOX = GeometryReference(name="ball"), GeometryReference(name="box")
WHAT_IF = WhatIf(frames=["base"], poses=[0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])


@cache
def robot_file() -> Path:
    """Return the URDF of a ball on a rail, which stays until the process ends."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder)
    (folder / "slide.urdf").write_text(SLIDE)
    return folder / "slide.urdf"


@cache
def scenes() -> tuple[Scene, Scene]:
    """Return what the scene and the robot's say; most of a world's time would go into reading."""
    return load_scene_text(SCENE), load_scene_text(ROBOT % robot_file())


def new_world() -> World:
    """Return a world whose source the requests own."""
    graph = SceneGraph()
    scene, with_robot = scenes()
    loaded = scene.apply(graph)
    robot = with_robot.apply(graph).sources["slide"].robot
    world = World(graph)

    def own(edit: Any) -> None:
        records = edit.records
        edit.handles["arm"] = Handle(TOKEN)
        records["slide"] = dataclasses.replace(records["slide"], robot=robot)
        edit.add_cameras(loaded.cameras)

    world.edit(own)
    held = scene_graph_msgs.srv.AttachFrame.Request(source=OWNER, frame="cup", link="ball")
    answer = scene_graph_msgs.srv.AttachFrame.Response()
    world.edit(lambda edit: EDITS["AttachFrame"](held, answer, edit, None))
    return world


def state(world: World) -> tuple[Any, ...]:
    """Return what an edit changes: the scene's version, who owns what, cameras, and the poses."""
    snapshot = world.snapshot
    poses = snapshot.query.snapshot.X_PF.tobytes()
    cameras = tuple(sorted(snapshot.cameras))
    return snapshot.scene_version, tuple(sorted(world.records)), cameras, poses
