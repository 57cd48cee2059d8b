"""The benchmark of planning reads problems as MoveIt writes them, and times a path for each."""

import io
import tarfile

import numpy as np
from PIL import Image as Picture
import pytest

from benchmarks import plans
from benchmarks.ompl_mujoco import SampledPath
from benchmarks.plans import main, moveit_problems
from scene_graph_ros.geometry import Box, Cylinder

# The quaternion turns by a quarter about x, so that the cylinder lies along y.
SCENE = """
world:
  collision_objects:
    - id: can
      primitives: [{type: cylinder, dimensions: [0.4, 0.1]}]
      primitive_poses:
        - {position: [0, 0, 0.25], orientation: [0.7071067811865476, 0, 0, 0.7071067811865476]}
      pose: {position: [0.5, -0.6, 0], orientation: [0, 0, 0, 1]}
    - id: block
      primitives: [{type: box, dimensions: [0.1, 0.2, 0.3]}]
      primitive_poses: [{position: [-0.6, 0.0, 0.2], orientation: [0, 0, 0, 1]}]
"""

REQUEST = """
start_state:
  joint_state:
    name: [panda_joint1, panda_joint2, panda_joint3, panda_joint4, panda_joint5, panda_joint6,
      panda_joint7, panda_finger_joint1, panda_finger_joint2]
    position: [0, -0.785, 0, -2.356, 0, 1.571, 0.785, 0.065, 0.065]
goal_constraints:
  - joint_constraints: [{joint_name: panda_joint1, position: 0.5}]
"""


@pytest.fixture
def archive(tmp_path):
    """Sources with an archive in them that has one problem."""
    inner = io.BytesIO()
    with tarfile.open(fileobj=inner, mode="w:bz2") as problems:
        for name, text in (("scene0001.yaml", SCENE), ("request0001.yaml", REQUEST)):
            info = tarfile.TarInfo(f"problems/cans_panda/{name}")
            info.size = len(text)
            problems.addfile(info, io.BytesIO(text.encode()))
    path = tmp_path / "sources.tar.gz"
    with tarfile.open(path, "w:gz") as sources:
        info = tarfile.TarInfo("sources/resources/panda/problems.tar.bz2")
        info.size = len(inner.getvalue())
        sources.addfile(info, io.BytesIO(inner.getvalue()))
    return path


def test_problems_are_as_moveit_means_them(archive):
    """Heights before radii, quaternions with w last, poses of parts in those of their objects."""
    (problem,) = moveit_problems(archive, 5)
    assert problem.kind == "cans"
    start, fingers = [0, -0.785, 0, -2.356, 0, 1.571, 0.785], [0.065]
    np.testing.assert_array_equal(problem.start, start + fingers)
    np.testing.assert_array_equal(problem.goal, [0.5, *start[1:], *fingers])
    snapshot = problem.checker.model.context.snapshot
    shapes = {}
    for geometry in snapshot.inspector.get_all_geometry_ids():
        if snapshot.inspector.is_anchored(geometry):
            name = snapshot.inspector.get_name(geometry)
            shapes[name] = snapshot.inspector.get_shape(geometry), snapshot.pose_in_world(geometry)
    can, X_WC = shapes["can_0"]
    assert can == Cylinder(0.1, 0.4)
    np.testing.assert_allclose(X_WC[:3, 3], [0.5, -0.6, 0.25])
    np.testing.assert_allclose(X_WC[:3, 2], [0, -1, 0], atol=1e-12)
    block, X_WB = shapes["block_0"]
    assert block == Box(0.1, 0.2, 0.3)
    np.testing.assert_allclose(X_WB[:3, 3], [-0.6, 0.0, 0.2])


@pytest.mark.parametrize("with_archive", [True, False])
def test_the_command_prints_a_table(archive, capsys, with_archive):
    """A row for each set; every path is found."""
    main(
        [
            "--count",
            "1",
            "--timeout",
            "100",
            *(["--problems", str(archive)] if with_archive else []),
        ]
    )
    head, row, last = capsys.readouterr().out.splitlines()
    assert head.split()[:2] == ["solved", "median"]
    assert row.split()[:2] == ["cans" if with_archive else "shelf", "1/1"]
    assert last.startswith("Measured on ")


def test_ompl_is_beside_ours(archive, capsys, monkeypatch, tmp_path):
    """With our proofs always; with MuJoCo's samples where that is installed, else an error."""

    class Straight:
        """Goes straight, and sees nothing."""

        def __init__(self, checker, group):
            assert group == "arm"

        def plan(self, start, goal, timeout, *, shortened):
            return SampledPath(np.stack([start, goal]), 2)

    monkeypatch.setattr(plans, "SampledPlanner", Straight)
    drawn = tmp_path / "solved.png"
    options = ["--count", "1", "--timeout", "100", "--ompl", "--picture", str(drawn)]
    main(["--problems", str(archive), *options])
    lines = capsys.readouterr().out.splitlines()
    rows = {
        name: lines[lines.index(f"{name}:") + 1].split()
        for name in plans._WITH_OMPL
        if name  # ours has no title
    }
    assert len(rows) == 3 and all(row[:2] == ["cans", "1/1"] for row in rows.values())
    # The way from one to the other is free for the proof, or it collides; whoever found it.
    (problem,) = moveit_problems(archive, 1)
    is_free = problem.checker.check_edge_collision_free(problem.start, problem.goal)
    assert rows["OMPL, MuJoCo's samples"][-1] == str(int(not is_free))
    assert rows["OMPL, our proofs"][-1] == "0"
    with Picture.open(drawn) as picture:
        colours = {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}
    assert (31, 119, 180) in colours  # ours


def test_savings_are_compared(archive, capsys):
    """A row for each, with a path that is no longer than those that need not save as much."""
    main(["--problems", str(archive), "--count", "1", "--timeout", "100", "--savings"])
    lines = capsys.readouterr().out.splitlines()
    rows = [lines[lines.index(f"{name}:") + 1].split() for name in plans._SAVINGS]
    assert len(rows) > 5 and all(row[:2] == ["cans", "1/1"] for row in rows)
    lengths = [float(row[4]) for row in rows]
    assert lengths == sorted(lengths, reverse=True)
