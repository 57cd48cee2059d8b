"""A body some of whose geometries alone the scene filters: these stay filtered, others do not."""

import numpy as np
import pytest
from robot_scenes import diagram, SLIDE

from scene_graph_ros.planning import EdgeStatus, SceneGraphCollisionChecker

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
