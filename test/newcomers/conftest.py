"""A checkout that is set up as `make setup` does, seen from a folder of somebody else's."""

from pathlib import Path
import subprocess
import sys
import sysconfig

import pytest
from small_arm import ARM, CELL

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
    """An arm of two links and its checker, beside a wall."""
    folder = tmp_path_factory.mktemp("robot")
    (folder / "arm.urdf").write_text(ARM)
    (folder / "cell.yaml").write_text(CELL)
    diagram = load_robot_diagram(folder / "cell.yaml")
    return diagram, SceneGraphCollisionChecker(diagram)
