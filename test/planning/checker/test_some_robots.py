"""Checkers for some of a model's robots: the others move, but are what is around them."""

import pickle

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    GeometryInstance,
    ProximityProperties,
    Sphere,
)
from scene_graph_ros.planning import (
    CollisionCheckerError,
    CollisionCheckerParams,
    RobotCollisionType,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.checker.carried_checker import pack

# Two balls of 0.1 m on one rail along x: 0.3 m apart, the second moves with the first.
SLIDE = """<robot name="slide"><link name="base"/><link name="ball"><collision><geometry>
  <sphere radius="0.1"/></geometry></collision></link><link name="tail"><collision><geometry>
  <sphere radius="0.1"/></geometry></collision></link>
  <joint name="rail" type="prismatic"><parent link="base"/><child link="ball"/>
  <axis xyz="1 0 0"/><limit lower="-5" upper="5" effort="1" velocity="1"/></joint>
  <joint name="stretch" type="prismatic"><parent link="ball"/><child link="tail"/>
  <origin xyz="-0.3 0 0"/><axis xyz="-1 0 0"/>
  <limit lower="0" upper="5" effort="1" velocity="1"/></joint></robot>"""


def at(x):
    """Return a pose on the x axis."""
    X = np.eye(4)
    X[0, 3] = x
    return X


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """Two such robots 1 m apart, and a ball of 0.2 m at x = 3."""
    path = tmp_path_factory.mktemp("two") / "slide.urdf"
    path.write_text(SLIDE)
    builder = RobotDiagramBuilder()
    builder.add_robot("left", path)
    builder.add_robot("right", path, X_WB=at(1.0))
    source = builder.scene_graph.register_source("around")
    instance = GeometryInstance(at(3.0), Sphere(0.2), "ball")
    instance.set_proximity_properties(ProximityProperties())
    builder.scene_graph.register_anchored_geometry(source, instance)
    return builder.build()


@pytest.fixture(scope="module")
def left(model):
    """A checker for the left one."""
    return SceneGraphCollisionChecker(model, robot_model_instances=["left"])


def test_only_some_bodies_are_the_robots(left, model):
    """They come first; rows of matrices between others are never checked."""
    assert left.robot_model_instances == ("left",)
    assert [left.is_part_of_robot(body) for body in left.bodies] == sorted(
        (body.model_instance_name == "left" for body in left.bodies), reverse=True
    )
    whole = left.get_filtered_collision_matrix()
    others = [b.index for b in left.bodies if b.model_instance_name != "left"]
    assert (whole[np.ix_(others, others)] == -1).all()
    every = SceneGraphCollisionChecker(model)
    assert every.robot_model_instances == ("left", "right")
    # Of two balls each: 2 x 2 pairs of both robots, one within each, 4 with the ball around; of
    # the left robot's checker the right one's own pair and its 2 with the ball are missing.
    assert (every.num_pairs, left.num_pairs) == (10, 7)


def test_the_other_robot_is_an_obstacle_that_moves_with_q(left):
    """Balls of 0.1 meet where their centres are 0.2 apart; pairs of the others do not count."""
    assert left.check_config_collision_free([0.0, 0.0, 0.0, 0.5])
    # The right ball at 1 - 0.85.
    assert not left.check_config_collision_free([0.0, 0.0, -0.85, 0.5])
    # The right one in the ball at 3.
    inside = [0.0, 0.0, 2.0, 0.5]
    assert left.check_config_collision_free(inside)
    assert left.check_edge_collision_free([0.0, 0.0, 1.0, 0.5], inside)
    assert not left.check_edge_collision_free([0.0, 0.0, 0.0, 0.5], [2.5, 0.0, 0.0, 0.5])
    types = dict(
        zip(
            (b.name for b in left.bodies),
            left.classify_body_collisions([0.0, 0.0, -0.85, 0.5]),
            strict=True,
        )
    )
    assert types["left/ball"] is RobotCollisionType.ENVIRONMENT_COLLISION
    assert types["right/ball"] is RobotCollisionType.NO_COLLISION


def test_derivatives_by_other_robots_positions_are_zero(left, model):
    """The distance of the balls is 1 + q_right - q_left - 0.2; the left ball is always R."""
    q = np.array([0.1, 0.05, 0.2, 0.3])
    table = left.calc_robot_clearance(q, 10.0)
    every = SceneGraphCollisionChecker(model).calc_robot_clearance(q, 10.0)
    names = [body.name for body in left.bodies]
    rows = {}
    for k in range(table.size):
        pair = names[table.robot_indices[k]], names[table.other_indices[k]]
        assert pair[0].startswith("left/")
        is_own = pair[1].startswith("left/")
        own, around = RobotCollisionType.SELF_COLLISION, RobotCollisionType.ENVIRONMENT_COLLISION
        assert table.collision_types[k] is (own if is_own else around)
        rows[pair] = table.distances[k], table.jacobians[k]
    distance, jacobian = rows["left/ball", "right/ball"]
    assert distance == pytest.approx(0.9, abs=1e-15)
    np.testing.assert_allclose(jacobian, [-1.0, 0.0, 0.0, 0.0], atol=1e-15)
    distance, jacobian = rows["left/tail", "right/tail"]
    # 1 + 0.2 - 0.3 - (0.1 - 0.05) - 0.2.
    assert distance == pytest.approx(0.65, abs=1e-15)
    np.testing.assert_allclose(jacobian, [-1.0, 1.0, 0.0, 0.0], atol=1e-15)
    # All other columns are those of the checker of both.
    whole = {
        tuple(sorted(map(int, p[:2]))): j
        for p, j in zip(every.pairs, every.jacobians, strict=True)
    }
    for pair, jacobian in zip(table.pairs, table.jacobians, strict=True):
        own = whole[tuple(sorted(map(int, pair[:2])))]
        np.testing.assert_array_equal(jacobian, own * [1, 1, 0, 0])
    columns = left.calc_clearance_columns([q, q], 10.0)
    assert (columns.jacobian[:, 2:] == 0.0).all()
    kinds = set(columns.collision_type.tolist())
    assert kinds == {1, 2}
    carried = pickle.loads(pickle.dumps(pack(left))).unpacked()
    near = carried.calc_robot_clearance(q, 10.0)
    np.testing.assert_array_equal(near.jacobians, table.jacobians)


def test_paddings_to_another_robot_are_those_of_the_surroundings(model):
    """0.5 m must stay to all around, the right robot too, and nothing between own bodies."""
    made = SceneGraphCollisionChecker.from_params(
        CollisionCheckerParams(
            model=model,
            robot_model_instances=["left"],
            edge_step_size=0.1,
            env_collision_padding=0.5,
        )
    )
    # From 1 - 0.2 - 0.5 on the balls are too near; the right tail is at 0.2 less than its ball.
    assert made.check_config_collision_free([-0.41, 0.0, 0.0, 0.0])
    assert not made.check_config_collision_free([0.31, 0.0, 0.0, 5.0])
    assert made.maybe_get_uniform_robot_environment_padding() == 0.5
    assert made.get_padding_between("left/ball", "right/ball") == 0.5
    assert made.get_padding_between("left/ball", "left/tail") == 0.0


def test_shapes_and_moments_keep_the_choice(left, model):
    """What is added to the other robot is around it; another moment has the same robots."""
    made = left.clone()
    assert made.add_collision_shape_to_body("load", "right/ball", Sphere(0.3), np.eye(4))
    # The tail of the right one, far behind, counts too: leave it there.
    assert made.check_config_collision_free([0.5, 0.0, 0.45, 5.0])
    assert not made.check_config_collision_free([0.5, 0.0, -0.15, 5.0])
    assert made.at(model.context.snapshot).robot_model_instances == ("left",)
    jacobians = made.calc_robot_clearance([0.0, 0.0, 0.0, 0.0], 9.0).jacobians
    assert (jacobians[:, 2:] == 0.0).all()


@pytest.mark.parametrize(
    ("names", "says"),
    [(["midle"], "there is no robot 'midle'"), ([], "one at least, of 'left', 'right'")],
)
def test_names_of_no_robot_are_refused(model, names, says):
    """And no names at all."""
    with pytest.raises(CollisionCheckerError, match=says):
        SceneGraphCollisionChecker(model, robot_model_instances=names)


def test_a_number_is_no_list_of_robots(model):
    """Names are told apart from what can't be gone through."""
    with pytest.raises(CollisionCheckerError, match="must be names, not 3"):
        SceneGraphCollisionChecker(model, robot_model_instances=3)
