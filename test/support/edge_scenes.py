"""Robots in scenes that are hard for proofs of edges: thin things, many joints, large robots."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path

import numpy as np
from robot_scenes import diagram

from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker

__all__ = ["EDGE_SCENES"]

_ROBOTS = "package://example-robot-data/robots"

# A rod of 1 m and 1 mm, on a hinge that turns without an end, on a rail.
_ROD = """<robot name="rod"><link name="base"/><link name="cart"/><link name="rod">
  <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.001 0.001"/></geometry></collision>
  </link><joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
  <axis xyz="1 0 0"/><limit lower="-0.6" upper="0.6"/></joint>
  <joint name="hinge" type="continuous"><parent link="cart"/><child link="rod"/>
  <axis xyz="0 0 1"/></joint></robot>"""


def _geometry(name: str, xyz: np.ndarray, rpy: np.ndarray, shape: str) -> str:
    """Return a line of a scene file."""
    place, turn = (", ".join(f"{each:.6f}" for each in row) for row in (xyz, rpy))
    pose = f"{{xyz: [{place}], rpy: [{turn}]}}"
    return f"  - {{name: {name}, source: around, pose: {pose}, shape: {shape}}}\n"


def _rod(folder: Path) -> SceneGraphCollisionChecker:
    """A rod among posts, each a millimetre thick."""
    rng, text = np.random.default_rng(1), "geometries:\n"
    for k in range(8):
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 1.4)
        place = np.array([far * math.cos(angle), far * math.sin(angle), 0.0])
        shape = "{type: cylinder, radius: 0.0005, length: 0.2}"
        text += _geometry(f"post_{k}", place, np.zeros(3), shape)
    return SceneGraphCollisionChecker(diagram(folder, _ROD, text))


def _blades(folder: Path) -> SceneGraphCollisionChecker:
    """An arm of three blades of 0.1 mm that turn in space, among plates and rods as thin."""
    links, joints, parent = "", "", "base"
    for k, axis in enumerate(("0 0 1", "0 1 0", "1 0 0")):
        links += f"""<link name="blade_{k}"><collision><origin xyz="0.2 0 0"/>
          <geometry><box size="0.3 0.0001 0.1"/></geometry></collision></link>"""
        xyz = "0 0 0" if k == 0 else "0.4 0 0"
        joints += f"""<joint name="turn_{k}" type="continuous"><parent link="{parent}"/>
          <child link="blade_{k}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>"""
        parent = f"blade_{k}"
    urdf = f'<robot name="blades"><link name="base"/>{links}{joints}</robot>'
    rng, text = np.random.default_rng(2), "geometries:\n"
    shapes = (
        "{type: box, size: [0.2, 0.2, 0.0001]}",
        "{type: cylinder, radius: 0.0001, length: 0.5}",
        "{type: box, size: [0.3, 0.02, 0.0001]}",
    )
    for k in range(9):
        way = rng.standard_normal(3)
        place = rng.uniform(0.3, 1.1) * way / np.linalg.norm(way)
        turn = rng.uniform(-math.pi, math.pi, 3)
        text += _geometry(f"thin_{k}", place, turn, shapes[k % 3])
    return SceneGraphCollisionChecker(diagram(folder, urdf, text))


def _chain(folder: Path) -> SceneGraphCollisionChecker:
    """Sixty links of 5 cm that bend by up to 0.12 rad, up and aside by turns, among rods."""
    links, joints, parent = "", "", "base"
    for k in range(60):
        links += f"""<link name="link_{k}"><collision><origin xyz="0.025 0 0"/>
          <geometry><box size="0.04 0.01 0.002"/></geometry></collision></link>"""
        xyz, axis = ("0 0 0" if k == 0 else "0.05 0 0"), ("0 0 1" if k % 2 else "0 1 0")
        joints += f"""<joint name="bend_{k}" type="revolute"><parent link="{parent}"/>
          <child link="link_{k}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/>
          <limit lower="-0.12" upper="0.12" effort="1" velocity="1"/></joint>"""
        parent = f"link_{k}"
    urdf = f'<robot name="chain"><link name="base"/>{links}{joints}</robot>'
    rng, text = np.random.default_rng(3), "geometries:\n"
    for k in range(12):
        place = np.array([rng.uniform(0.8, 3.0), *rng.uniform(-0.6, 0.6, 2)])
        shape = "{type: cylinder, radius: 0.001, length: 1}"
        text += _geometry(f"rod_{k}", place, rng.uniform(-math.pi, math.pi, 3), shape)
    return SceneGraphCollisionChecker(diagram(folder, urdf, text))


def _panda(folder: Path) -> SceneGraphCollisionChecker:
    """A Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def _baxter(folder: Path) -> SceneGraphCollisionChecker:
    """A Baxter, two arms of seven joints each, before a table with a pole of 2 mm."""
    (folder / "scene.yaml").write_text(f"""
version: 1
sources: [{{name: around}}]
robots:
  - name: baxter
    urdf: {_ROBOTS}/baxter_description/urdf/baxter.urdf
    srdf: {_ROBOTS}/baxter_description/srdf/baxter_manipulation.srdf
geometries:
  - {{name: table, source: around, pose: {{xyz: [0.9, 0, -0.2]}},
     shape: {{type: box, size: [0.8, 1.6, 0.02]}}}}
  - {{name: pole, source: around, pose: {{xyz: [0.7, 0.2, 0.3]}},
     shape: {{type: cylinder, radius: 0.001, length: 1}}}}
""")
    return SceneGraphCollisionChecker(load_robot_diagram(str(folder / "scene.yaml")))


def _talos(folder: Path) -> SceneGraphCollisionChecker:
    """A Talos that hangs by its base: two arms, two legs and hands, between poles of 2 mm."""
    (folder / "scene.yaml").write_text(f"""
version: 1
sources: [{{name: around}}]
robots:
  - name: talos
    urdf: {_ROBOTS}/talos_data/robots/talos_full_v2.urdf
    srdf: {_ROBOTS}/talos_data/srdf/talos.srdf
geometries:
  - {{name: floor, source: around, pose: {{xyz: [0, 0, -1.2]}}, shape: {{type: half_space}}}}
  - {{name: pole, source: around, pose: {{xyz: [0.6, 0.3, 0.3]}},
     shape: {{type: cylinder, radius: 0.001, length: 1}}}}
  - {{name: rail, source: around, pose: {{xyz: [0.5, 0, -0.6], rpy: [1.5707963, 0, 0]}},
     shape: {{type: cylinder, radius: 0.001, length: 2}}}}
""")
    return SceneGraphCollisionChecker(load_robot_diagram(str(folder / "scene.yaml")))


EDGE_SCENES: dict[str, Callable[[Path], SceneGraphCollisionChecker]] = {
    "rod": _rod,
    "blades": _blades,
    "chain": _chain,
    "panda": _panda,
    "baxter": _baxter,
    "talos": _talos,
}
