"""Robots and scenes put together by hand, against what scene files make of the same."""

import math

import numpy as np
import pytest
from robot_scenes import BALL, SLIDE

from scene_graph_ros.geometry import GeometryInstance, ProximityProperties, Sphere
from scene_graph_ros.geometry.errors import NameConflictError
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.planning import (
    DiagramBuiltError,
    load_robot_diagram,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.robots import JointStateError, KinematicTreeError

CELL = "config/scenes/panda_cell.yaml"


def at(x, y=0.0):
    """Return a pose at (x, y, 0)."""
    X = np.eye(4)
    X[:2, 3] = x, y
    return X


@pytest.fixture(name="urdf")
def slide_urdf(tmp_path):
    """A ball of 0.1 m on a rail along x."""
    path = tmp_path / "slide.urdf"
    path.write_text(SLIDE)
    return path


def test_a_scene_file_is_what_it_is_without_a_builder():
    """The same answers for 100 configurations of a Panda in its cell."""
    builder = RobotDiagramBuilder()
    builder.add_scene(CELL)
    built, loaded = builder.build(), load_robot_diagram(CELL)
    assert built.tree.position_names == loaded.tree.position_names
    rng = np.random.default_rng(6)
    q = rng.uniform(built.tree.lower, built.tree.upper, (100, built.tree.num_positions))
    ours, theirs = (SceneGraphCollisionChecker(each) for each in (built, loaded))
    assert ours.num_pairs == theirs.num_pairs
    free = ours.check_configs_collision_free(q)
    assert free.tolist() == theirs.check_configs_collision_free(q).tolist()
    assert 0 < free.sum() < 100


def test_a_robot_and_what_is_around_it_by_hand(urdf):
    """A ball whose base is at y = 0.5, and another at 1 m on its rail: 0.7 m to go."""
    builder = RobotDiagramBuilder()
    robot = builder.add_robot("slide", urdf, X_WB=at(0.0, 0.5), positions={"rail": 0.25})
    source = builder.scene_graph.register_source("around")
    instance = GeometryInstance(at(1.0, 0.5), Sphere(0.2), "ball")
    instance.set_proximity_properties(ProximityProperties())
    builder.scene_graph.register_anchored_geometry(source, instance)
    assert not builder.is_diagram_built()
    robots = builder.build()
    assert builder.is_diagram_built()
    assert robots.tree.position_names == ("rail",)
    frame = robot.link_frames["ball"]
    X_WF = robots.scene_graph.query_object(robots.context).get_pose_in_world(frame)
    assert X_WF[:3, 3].tolist() == [0.25, 0.5, 0.0]
    checker = SceneGraphCollisionChecker(robots)
    assert checker.measure_edge([0.0], [1.0]).alpha == pytest.approx(0.7, abs=2e-6)


def test_several_robots_and_a_scene_have_names_of_their_own(urdf, tmp_path):
    """A robot of a file and one by hand on the same rail: centres must keep 0.2."""
    (tmp_path / "one.yaml").write_text(
        "version: 1\nsources: [{name: around}]\nrobots:\n  - {name: left, urdf: slide.urdf}\n"
        + BALL.replace("[1, 0, 0]", "[9, 9, 9]")
    )
    builder = RobotDiagramBuilder()
    builder.add_scene(tmp_path / "one.yaml")
    builder.add_robot("right", urdf, X_WB=at(1.0))
    robots = builder.build()
    assert robots.tree.position_names == ("left/rail", "right/rail")
    checker = SceneGraphCollisionChecker(robots)
    assert checker.robot_model_instances == ("left", "right")
    assert checker.measure_edge([0.0, 0.0], [1.0, 0.0]).alpha == pytest.approx(0.8, abs=2e-6)


def test_once_built_nothing_more_is_added(urdf):
    """Each method says so by its name."""
    builder = RobotDiagramBuilder()
    with pytest.raises(KinematicTreeError, match="no robot to plan for"):
        builder.build()
    builder.add_robot("slide", urdf)
    builder.build()
    for what, ask in {
        "scene_graph": lambda: builder.scene_graph,
        "add_scene": lambda: builder.add_scene(CELL),
        "add_robot": lambda: builder.add_robot("other", urdf),
        "build": builder.build,
    }.items():
        with pytest.raises(DiagramBuiltError, match=f"^{what}: the diagram is built"):
            ask()
    assert builder.is_diagram_built()


def test_what_cannot_be_added_leaves_nothing(urdf):
    """Its name is free again, and the rest is built."""
    builder = RobotDiagramBuilder()
    builder.add_robot("slide", urdf)
    with pytest.raises(NameConflictError, match="slide"):
        builder.add_robot("slide", urdf)
    with pytest.raises(KinematicTreeError, match=r"'second' has no joint 'rial'.*'rail'"):
        builder.add_robot("second", urdf, positions={"rial": 0.1})
    with pytest.raises(JointStateError, match="rail"):
        builder.add_robot("second", urdf, positions={"rail": math.nan})
    with pytest.raises(SceneFileError, match=r"missing\.urdf"):
        builder.add_robot("second", urdf.with_name("missing.urdf"))
    builder.add_robot("second", urdf, X_WB=at(0.0, 3.0))
    assert builder.build().tree.position_names == ("slide/rail", "second/rail")
