"""A body some of whose geometries alone the scene filters: these stay filtered, others do not."""

import numpy as np
import pytest
from robot_scenes import diagram, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    CollisionCheckerParams,
    EdgeStatus,
    HeterogeneousFiltersError,
    load_robot_diagram,
    SceneGraphCollisionChecker,
    UnimplementedCollisionChecker,
)

# The world has two balls of 0.2 m on the rail; that of 0.1 m may go through the second.
TWO_BALLS = """
geometries:
  - {name: ahead, source: around, pose: {xyz: [1, 0, 0]}, shape: {type: sphere, radius: 0.2}}
  - {name: behind, source: around, pose: {xyz: [-1, 0, 0]}, shape: {type: sphere, radius: 0.2}}
collision_filters:
  - {action: exclude, between: [[robot/ball], [around/world/behind]]}
"""


def test_what_the_scene_filters_of_a_body_stays_filtered(tmp_path):
    """The pair of bodies is checked; closed and opened again it is as the scene has it."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, TWO_BALLS))
    assert not checker.is_collision_filtered_between("ball", "world")
    q = np.array([[-1.0], [0.0], [0.65], [0.75], [1.0]])
    as_the_scene = [True, True, True, False, False]
    assert checker.check_configs_collision_free(q).tolist() == as_the_scene
    assert checker.check_edge([-2.0], [0.0])
    checker.set_collision_filtered_between("ball", "world", True)
    assert checker.check_configs_collision_free(q).all()
    checker.set_collision_filtered_between("ball", "world", False)
    assert checker.check_configs_collision_free(q).tolist() == as_the_scene
    checker.set_padding_between("ball", "world", 0.1)
    assert checker.check_configs_collision_free(q).tolist() == [True, True, False, False, False]
    measure = checker.measure_edge([-2.0], [2.0])
    assert measure.status is EdgeStatus.COLLIDES
    assert -2.0 + 4.0 * measure.alpha == pytest.approx(0.6, abs=1e-5)
    inspector = checker.snapshot.inspector
    assert "ahead" in {inspector.get_name(each) for each in measure.pair}
    assert len(checker.calc_robot_clearance([-1.0], 9.0).pairs) == 1


def test_they_are_refused_where_that_is_asked_for(tmp_path):
    """The error names both bodies, a pair of each kind, and what to do; of all checkers."""
    robots = diagram(tmp_path, SLIDE, TWO_BALLS)
    words = (
        r"bodies 'ball' and 'world' are filtered heterogeneously: 'ball_collision_0' and 'behind'"
        r" are filtered, 'ball_collision_0' and 'ahead' are not; filter all of their pairs in the"
        r" scene or none, or leave require_homogeneous_filters off"
    )
    given = {"model": robots, "robot_model_instances": ["robot"], "edge_step_size": 0.1}
    params = CollisionCheckerParams(**given, require_homogeneous_filters=True)
    for make in (
        lambda: SceneGraphCollisionChecker(robots, require_homogeneous_filters=True),
        lambda: SceneGraphCollisionChecker.from_params(params),
        lambda: UnimplementedCollisionChecker.from_params(params, supports_parallel_checking=True),
    ):
        with pytest.raises(HeterogeneousFiltersError, match=words):
            make()
    assert issubclass(HeterogeneousFiltersError, CollisionCheckerError)
    SceneGraphCollisionChecker.from_params(CollisionCheckerParams(**given))
    for value in (1, "no", None):
        with pytest.raises(
            CollisionCheckerError, match="require_homogeneous_filters must be True"
        ):
            CollisionCheckerParams(**given, require_homogeneous_filters=value)
        with pytest.raises(
            CollisionCheckerError, match="require_homogeneous_filters must be True"
        ):
            SceneGraphCollisionChecker(robots, require_homogeneous_filters=value)


def test_what_is_filtered_alike_is_taken(tmp_path):
    """All pairs of two bodies filtered, or none; links that are welded do not matter."""
    both = TWO_BALLS.replace("[around/world/behind]", "[around/world/behind, around/world/ahead]")
    none = TWO_BALLS[: TWO_BALLS.index("collision_filters")]
    for scene, is_filtered in ((both, True), (none, False)):
        robots = diagram(tmp_path, SLIDE, scene)
        checker = SceneGraphCollisionChecker(robots, require_homogeneous_filters=True)
        assert checker.is_collision_filtered_between("ball", "world") == is_filtered
    # The base is welded to the world, with which some of its geometries are filtered.
    welded = """<robot name="slide"><link name="base"><collision><origin xyz="0 0 5"/><geometry>
      <sphere radius="0.1"/></geometry></collision><collision><origin xyz="0 1 5"/><geometry>
      <sphere radius="0.1"/></geometry></collision></link></robot>"""
    scene = TWO_BALLS.replace("[robot/ball]", "[robot/base]")
    robots = diagram(tmp_path, welded, scene)
    SceneGraphCollisionChecker(robots, require_homogeneous_filters=True)
    # So is a Panda's first link, which its scene lets touch the table alone.
    cell = load_robot_diagram("config/scenes/panda_cell.yaml")
    SceneGraphCollisionChecker(cell, require_homogeneous_filters=True)
