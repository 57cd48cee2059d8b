"""The benchmark of robots asks all engines about the same geometries and pairs."""

import re

import numpy as np
from PIL import Image as Picture
import pytest

from benchmarks import robot_speed
from benchmarks.robot_engines.pinocchio_engine import PinocchioEngine
from benchmarks.robot_engines.robot_world import RobotWorld
from benchmarks.robot_engines.sphere_covers import covers_of
from scene_graph_ros.geometry import Box, Ellipsoid
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


@pytest.mark.parametrize("count", [1, 20, 200])
def test_spheres_cover_what_they_are_around(count):
    """All points of the surface of each shape are in one of its spheres; more stand out less."""
    shapes = [Box(0.1, 0.3, 0.7), Ellipsoid(0.1, 0.2, 0.5)]
    rng = np.random.default_rng(4)
    ways = rng.normal(size=(4000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    # Where rays from the middle leave a box, and where they leave an ellipsoid.
    points = [
        ways / (np.abs(ways) / np.array([0.05, 0.15, 0.35])).max(axis=1, keepdims=True),
        ways * np.array([0.1, 0.2, 0.5]),
    ]
    for shape, inside in zip(shapes, points, strict=True):
        ((centers, radii),) = covers_of([shape], count)
        assert len(radii) <= count
        away = np.linalg.norm(inside[:, np.newaxis] - centers, axis=2) - radii
        assert away.min(axis=1).max() <= 1e-12
        out = 1.0 if count == 1 else 0.1 if count == 20 else 0.05
        far = centers[:, np.newaxis] + radii[:, np.newaxis, np.newaxis] * ways
        if isinstance(shape, Box):
            assert (np.abs(far) - np.array([0.05, 0.15, 0.35])).max() < out


def test_engines_agree_and_the_table_says_so(capsys, monkeypatch, tmp_path):
    """Ours and pinocchio with Coal, which are always there; a peer that is missing is named."""
    monkeypatch.setattr(robot_speed, "_REPEATS", 1)
    monkeypatch.setattr(robot_speed, "_SPHERES", (60,))
    for name in ("DrakeEngine", "MuJoCoEngine"):

        def missing(*arguments, _name=name):
            raise ImportError(f"no {_name}")

        monkeypatch.setattr(robot_speed, name, missing)
    robot_speed.main(["--count", "200", "--picture", str(tmp_path / "bars.png")])
    text = capsys.readouterr().out
    assert "left out: no DrakeEngine" in text and "left out: no MuJoCoEngine" in text
    number = r"^(.+?) +(\d+) +[\d.]+x +(\d+) +[\d.]+x +(\d+) +([\d.]+)% +(\d+)$"
    rows = re.findall(number, text, re.M)
    assert len(rows) == 6
    # A cover misses nothing, so it differs by alarms alone, and has more edges collide.
    spheres, rows = rows[2::3], [*rows[:2], *rows[3:5]]
    for name, *_, differ, alarms, hit in spheres:
        assert name == "60 spheres"
        assert int(differ) > 0 and 1.0 < float(alarms) < 30.0
        assert int(hit) > int(rows[0][-1])
    for (ours, *_, ours_differ, _, ours_hit), (theirs, *_, differ, _, hit) in (rows[:2], rows[2:]):
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
    assert {(44, 160, 44), (153, 153, 153), (255, 127, 14)} <= colours
