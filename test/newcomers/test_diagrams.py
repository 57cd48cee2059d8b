"""Robots in a notebook: a diagram draws itself, and any configuration of its robots."""

import pickle

import numpy as np
import pytest
from small_arm import ARM, CELL

from scene_graph_ros.geometry import GeometryPair
from scene_graph_ros.planning import load_robot_diagram, RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.robots import KinematicTreeError


def test_a_configuration_is_asked_about_and_drawn(small_robot):
    """Links are where kinematics puts them; what is in the way there is named; nothing moves."""
    diagram, checker = small_robot
    before = diagram.context.pose_version
    for q in ([0.0, 0.0], [0.5, -0.3], [3.0, 1.0]):
        query = diagram.query(q)
        X_WL = diagram.tree.link_poses(q, tuple(diagram.frames))
        for X, frame in zip(X_WL, diagram.frames.values(), strict=True):
            assert np.allclose(query.get_pose_in_world(frame), X, atol=1e-14)
        pair = checker.find_colliding_pair(q)
        assert (pair is None) == (not query.has_collisions())
    assert diagram.context.pose_version == before
    assert diagram.query([0.5, -0.3])._repr_html_().startswith("<iframe")
    assert diagram._repr_html_().startswith("<iframe")
    with pytest.raises(KinematicTreeError):
        diagram.query([0.0])


def test_a_link_that_hangs_on_another_is_where_it_is(small_robot):
    """A frame's pose is in its parent, also where that moves with the robot."""
    diagram, _ = small_robot
    scene_graph = diagram.scene_graph.clone()
    upper, lower = (diagram.frames[name] for name in ("upper", "lower"))
    source = scene_graph.model_inspector().get_owning_source_id(lower)
    scene_graph.change_parent(source, lower, upper)
    context = scene_graph.create_default_context()
    moved = RobotDiagram(scene_graph, context, diagram.tree, diagram.frames)
    q = [0.7, -0.4]
    (X_WL,) = diagram.tree.link_poses(q, ("lower",))
    assert np.allclose(moved.query(q).get_pose_in_world(lower), X_WL, atol=1e-14)


def test_a_pair_that_collides_has_names(tmp_path):
    """A wall at 0.5 m is in the upper link: the pair unpacks to ids, and has paths."""
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "cell.yaml").write_text(CELL.replace("[2, 0, 0]", "[0.5, 0, 0]"))
    checker = SceneGraphCollisionChecker(load_robot_diagram(tmp_path / "cell.yaml"))
    pair = checker.find_colliding_pair([0.0, 0.0])
    id_A, id_B = pair
    assert (pair.id_A, pair.id_B) == (id_A, id_B)
    paths = [checker.snapshot.inspector.get_path(each) for each in pair]
    assert [pair.name_A, pair.name_B] == paths
    assert "cell/world/wall" in paths
    assert pickle.loads(pickle.dumps(pair)).name_B == pair.name_B
    assert str(pair) == " and ".join(paths)
    measure = checker.measure_edge([np.pi / 2, 0.0], [0.0, 0.0])
    assert "cell/world/wall" in (measure.pair.name_A, measure.pair.name_B)
    for wrong in ((3, id_B), (id_A, id_B, 5)):
        with pytest.raises(TypeError, match=r"id_A must be|name_A must be"):
            GeometryPair(*wrong)
