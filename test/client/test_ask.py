"""The command that asks a node, for who has no `ros2` command."""

import subprocess
import sys

import pytest

from scene_graph_ros.ask import main

NODE = ("--node", "geometry", "--namespace", "/lab", "--timeout", "60")


@pytest.fixture
def ask(cell, capsys):
    """Run the command in this process; return what it says, and its status."""

    def run(*arguments):
        status = main([*NODE, *arguments])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


def test_help_says_what_can_be_asked(tmp_path):
    """All questions are listed; without one it is a wrong call. No node is needed."""
    command = [sys.executable, "-m", "scene_graph_ros.ask"]
    done = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True)
    for word in ("topics", "services", "echo", "contacts", "distance", "plan", "param", "picture"):
        assert f"    {word}" in done.stdout
    assert subprocess.run(command, capture_output=True, check=False).returncode == 2


def test_it_imports_no_kernels():
    """It answers at once: neither the core nor numba is imported."""
    code = (
        "import sys, scene_graph_ros.ask, scene_graph_ros.client.parameters;"
        "print([n for n in sys.modules if n in ('numba', 'scene_graph_ros.geometry')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_graph_is_listed(ask):
    """Nodes, topics with types, services with types."""
    assert "/lab/geometry\n" in ask("nodes")[1]
    assert "/lab/geometry/contacts  scene_graph_msgs/msg/ContactArray" in ask("topics")[1]
    assert "/lab/geometry/attach_frame  scene_graph_msgs/srv/AttachFrame" in ask("services")[1]


def test_messages_are_printed(ask):
    """By the topic's name below the node's, also where it is latched."""
    status, said, _ = ask("echo", "contacts")
    assert status == 0
    assert said.startswith("header:\n  stamp:\n    sec: ")
    assert said.endswith("---\n")
    assert "name: 'lab/geometry: " in ask("echo", "/diagnostics")[1]


def test_questions_are_answered(ask):
    """The wall is 1.95 m - 0.1 m in y and 3 - 0.5 in z from the ball: by Pythagoras."""
    status, said, _ = ask("distance", "ball", "wall")
    expected = 1e3 * ((1.95**2 + 2.5**2) ** 0.5 - 0.1)
    assert status == 0
    assert float(said.split()[-2]) == pytest.approx(expected, rel=1e-5)
    assert ask("contacts")[1] == "nothing touches\n"
    assert "cell/world/wall  at 0 2 0 m" in ask("scene")[1]
    assert [float(v) for v in ask("pose", "wall")[1].splitlines()[1].split()] == [0, 1, 0, 2]
    status, said, error = ask("distance", "bal", "wall")
    assert (status, said) == (1, "")
    assert error.startswith("error: compute_signed_distance_pair: UNKNOWN_NAME")


def test_a_plan_is_printed(ask, world):
    """A path, joint by joint; a goal without a number is a wrong one."""
    world.move_joints({"shoulder": 0.0, "elbow": 0.0})
    status, said, _ = ask("plan", "shoulder=0.5", "elbow=0.25")
    assert status == 0
    assert said.splitlines()[-1] == "arm/shoulder=0.5000  arm/elbow=0.2500"
    assert ask("plan", "shoulder")[2] == "error: a goal is JOINT=POSITION, not 'shoulder'\n"
    world.move_joints({"shoulder": 0.0, "elbow": 0.0})  # what was said long ago is no start
    status, said, problem = ask("plan", "shoulder=3", "elbow=9")
    assert status == 1, problem
    assert said.startswith("no path: ")


def test_parameters_are_read_and_set(ask):
    """One, all; a whole number where the parameter is a double; a wrong one is refused."""
    assert ask("param", "marker_rate", "11")[1] == "marker_rate: 11.0\n"
    assert "marker_rate: 11.0\n" in ask("param")[1]
    status, _, error = ask("param", "marker_rate", "-1")
    assert status == 1
    assert error.startswith("error: marker_rate: ")
    assert "has no parameter 'markr_rate', but " in ask("param", "markr_rate")[2]


def test_a_picture_is_a_file(ask, tmp_path):
    """What a camera sees is written where one says."""
    file = tmp_path / "seen.png"
    assert ask("picture", "above", "-o", str(file))[:2] == (0, f"wrote {file}\n")
    assert file.read_bytes().startswith(b"\x89PNG")
