"""Small robots in scenes of their own, whose answers are known by construction."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scene_graph_ros.geometry import SceneGraph
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.planning import RobotDiagram
from scene_graph_ros.scene_files import load_scene_text

__all__ = [
    "ARM",
    "BALL",
    "CART",
    "CORNER",
    "DRONE",
    "PLATE",
    "POST",
    "POSTS",
    "ROD",
    "SLIDE",
    "diagram",
    "move",
]

# A rod of 1 m, 1 mm thick, on a hinge at the origin; it turns in the xy-plane.
ROD = """<robot name="rod"><link name="base"/><link name="rod">
  <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.001 0.001"/></geometry></collision>
  </link><joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/>
  <axis xyz="0 0 1"/></joint></robot>"""

# A plate of a tenth of a millimetre that the rod meets at an angle of 0.5.
PLATE = """
geometries:
  - name: plate
    source: around
    pose: {xyz: [0.7020660495, 0.3835404309, 0], rpy: [0, 0, 0.5]}
    shape: {type: box, size: [0.2, 0.0001, 0.2]}
"""

# An arm of two links of 1 m that turns in the xy-plane; they are thin, and end before the joints.
_LINK = """<collision><origin xyz="0.5 0 0"/><geometry><box size="0.8 0.1 0.1"/></geometry>
  </collision>"""
ARM = f"""<robot name="arm"><link name="base"/><link name="upper">{_LINK}</link>
  <link name="lower">{_LINK}</link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/>
  <origin xyz="1 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-2.8" upper="2.8" effort="1" velocity="1"/></joint></robot>"""

# What the stretched arm meets at the angles 0.64 and -2.36.
POSTS = """
geometries:
  - {name: ball, source: around, pose: {xyz: [1.2, 0.9, 0]}, shape: {type: sphere, radius: 0.2}}
  - name: box
    source: around
    pose: {xyz: [-0.9, -0.9, 0]}
    shape: {type: box, size: [0.4, 0.4, 0.4]}
"""

DRONE = """<robot name="drone"><link name="world"/><link name="body">
  <collision><geometry><box size="0.4 0.1 0.05"/></geometry></collision></link>
  <joint name="free" type="floating"><parent link="world"/><child link="body"/></joint></robot>"""

SLIDE = """<robot name="slide"><link name="base"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="ball"/>
  <axis xyz="1 0 0"/><limit lower="-9" upper="9"/></joint></robot>"""

BALL = """
geometries:
  - {name: ball, source: around, pose: {xyz: [1, 0, 0]}, shape: {type: sphere, radius: 0.2}}
"""


# A ball of 0.1 m on two rails, and a post inside the corner of a path.
CART = """<robot name="cart"><link name="base"/><link name="beam"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="base"/><child link="beam"/>
  <axis xyz="1 0 0"/><limit lower="-1" upper="3" velocity="1"/></joint>
  <joint name="y" type="prismatic"><parent link="beam"/><child link="ball"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1" velocity="1"/></joint></robot>"""
POST = """
geometries:
  - {{name: post, source: around, pose: {{xyz: [{x}, {y}, 0]}},
      shape: {{type: sphere, radius: 0.1}}}}
"""
CORNER = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])


def diagram(folder: Path, urdf: str, scene: str = "") -> RobotDiagram:
    """Return a robot, written to a folder, in a scene of its own."""
    (folder / "robot.urdf").write_text(urdf)
    head = "version: 1\nsources: [{name: around}]\nrobots:\n"
    text = f"{head}  - {{name: robot, urdf: {folder}/robot.urdf}}\n{scene}"
    scene_graph = SceneGraph()
    return RobotDiagram.of_scene(scene_graph, load_scene_text(text).apply(scene_graph))


def move(robots: RobotDiagram, q: np.ndarray) -> QueryObject:
    """Put a robot's frames where q puts its links; return the query object."""
    inspector = robots.context.snapshot.inspector
    names = {int(frame): name for name, frame in robots.frames.items()}
    source = inspector.get_owning_source_id(next(iter(robots.frames.values())))
    order = sorted(inspector.frames_for_source(source))
    X_WL = robots.tree.link_poses(q, [names[int(frame)] for frame in order])
    robots.context.set_frame_poses(source, X_WL)
    return robots.scene_graph.query_object(robots.context)
