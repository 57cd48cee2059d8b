"""The benchmark of robots asks all engines about the same geometries and pairs."""

import re

import numpy as np
from PIL import Image as Picture
import pytest

from benchmarks import robot_speed
from benchmarks.robot_engines.pinocchio_engine import PinocchioEngine
from benchmarks.robot_engines.robot_world import RobotWorld
from scene_graph_ros.planning import load_robot_diagram, SceneGraphCollisionChecker


@pytest.fixture(scope="module")
def checker():
    """A Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))


def test_links_are_where_they_are_for_pinocchio(checker):
    """Joints by name, also the finger that follows the other one."""
    world, tree = RobotWorld.of(checker), checker.model.tree
    q = np.random.default_rng(2).uniform(tree.lower, tree.upper, (5, tree.num_positions))
    engine = PinocchioEngine(world)
    joints = [joint.name for joint in tree.joints]
    frames = [world.things[k].joint - 1 for k in range(len(world.things)) if world.things[k].joint]
    assert set(frames) <= set(range(len(joints))) and len(set(frames)) >= 8
    positions = world.all_positions(q)
    assert positions.shape == (5, 9)
    np.testing.assert_array_equal(positions[:, 7], positions[:, 8])
    for each, row in zip(q, positions, strict=True):
        engine.collides(row)
        checker.update_positions(each)
        placed = checker.model_context().query_object()
        for k, thing in enumerate(world.things):
            geometry = checker.plan.geometry_ids[k]
            X_WG = placed.get_pose_in_world(geometry)
            found = engine.places[k].homogeneous
            np.testing.assert_allclose(found, X_WG, atol=1e-13, err_msg=str(thing))


def test_engines_agree_and_the_table_says_so(capsys, monkeypatch, tmp_path):
    """Ours and pinocchio with Coal, which are always there; a peer that is missing is named."""
    monkeypatch.setattr(robot_speed, "_REPEATS", 1)
    for name in ("DrakeEngine", "MuJoCoEngine"):

        def missing(*arguments, _name=name):
            raise ImportError(f"no {_name}")

        monkeypatch.setattr(robot_speed, name, missing)
    robot_speed.main(["--count", "200", "--picture", str(tmp_path / "bars.png")])
    text = capsys.readouterr().out
    assert "left out: no DrakeEngine" in text and "left out: no MuJoCoEngine" in text
    rows = re.findall(r"^(.+?) +(\d+) +[\d.]+x +(\d+) +[\d.]+x +(\d+) +(\d+)$", text, re.M)
    assert len(rows) == 4
    for (ours, *_, ours_differ, ours_hit), (theirs, *_, differ, hit) in (rows[:2], rows[2:]):
        assert (ours, theirs) == ("scene_graph_ros", "pinocchio, Coal")
        assert int(ours_differ) == int(differ) == 0 and 0 < int(ours_hit) == int(hit)
    scenes = re.findall(r"^(.+): 200 configurations, \d+ edges, (\d+) pairs checked$", text, re.M)
    assert scenes == [("the cell", "412"), ("a box in the hand among 29 boxes", "540")]
    told = re.findall(r"^ *([\d.]+) m, (.+?) +[\d.]+ +([\d.]+) +nanx$", text, re.M)
    each = [(distance, count) for distance, name, count in told if name == "scene_graph_ros"]
    at_once = [(distance, count) for distance, name, count in told if name == "ours at once"]
    assert len(each) == 9 and each == at_once
    assert re.findall(r"^(.+), (\d+) pairs$", text, re.M) == [
        ("the cell", "412"),
        ("the cell as Drake has it (meshes are hulls, no floor)", "396"),
        ("a box in the hand among 29 boxes", "540"),
    ]
    with Picture.open(tmp_path / "bars.png") as picture:
        colours = {colour for _, colour in picture.convert("RGB").getcolors(1 << 20)}
    assert {(44, 160, 44), (153, 153, 153)} <= colours
