"""A checkout that is set up as `make setup` does, seen from a folder of somebody else's."""

from pathlib import Path
import subprocess
import sys
import sysconfig

import pytest

from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker
from tools.bootstrap import environment

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def installed(tmp_path_factory) -> Path:
    """The Python of an environment with the project in it, and all wheels of this one."""
    venv = tmp_path_factory.mktemp("installed") / "venv"
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(venv)], check=True)
    environment.link_project(ROOT, venv, with_ros=False)
    wheels = environment.site_packages(venv) / "wheels.pth"
    # After the links, as in one folder; of the folder's own .pth files none counts.
    wheels.write_text(sysconfig.get_path("purelib") + "\n")
    return venv / "bin" / "python"


@pytest.fixture(scope="session")
def small_robot(tmp_path_factory):
    """An arm of two links, one of which turns without limits, and its checker, beside a wall."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "arm.urdf").write_text(ARM)
    (folder / "cell.yaml").write_text(CELL)
    diagram = load_robot_diagram(folder / "cell.yaml")
    return diagram, SceneGraphCollisionChecker(diagram)


LINK = """
  <link name="{name}">
    <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></collision>
    <visual><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.1 0.1"/></geometry></visual>
  </link>"""
ARM = f"""<robot name="arm">
  <link name="base"/>{LINK.format(name="upper")}{LINK.format(name="lower")}
  <joint name="shoulder" type="continuous">
    <parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/><child link="lower"/><origin xyz="0.6 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="2" effort="1" velocity="1"/>
  </joint>
</robot>"""
CELL = """version: 1
sources: [{name: cell}]
robots: [{name: arm, urdf: arm.urdf}]
geometries:
  - {name: wall, source: cell, pose: {xyz: [2, 0, 0]}, shape: {type: box, size: [0.1, 2, 1]}}
"""
