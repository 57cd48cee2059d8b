"""Shapes on links that have no geometry of their own: a tool's flange, say."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, GeometryInstance, ProximityProperties, Sphere
from scene_graph_ros.planning import (
    CollisionCheckerError,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)

# It turns about z; the flange is 1 m out, and has no geometry, as the base has none.
TURN = """<robot name="turn"><link name="base"/><link name="beam">
  <collision><origin xyz="0.3 0 0"/><geometry><box size="0.4 0.05 0.05"/></geometry></collision>
  </link><link name="flange"/>
  <joint name="hinge" type="revolute"><parent link="base"/><child link="beam"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="1"/></joint>
  <joint name="end" type="fixed"><parent link="beam"/><child link="flange"/>
  <origin xyz="1 0 0"/></joint></robot>"""
RADIUS, POST = 0.1, 0.05
ANGLE = 1.0
"""rad: where the post is, 1 m out."""


def checker_of(folder, *, all_links):
    """Return the checker of the robot and a post that the beam does not reach."""
    urdf = folder / "turn.urdf"
    urdf.write_text(TURN)
    builder = RobotDiagramBuilder()
    builder.add_robot("turn", urdf, all_links=all_links)
    source = builder.scene_graph.register_source("around")
    X_WP = np.eye(4)
    X_WP[:2, 3] = np.cos(ANGLE), np.sin(ANGLE)
    post = GeometryInstance(X_WP, Sphere(POST), "post")
    post.set_proximity_properties(ProximityProperties())
    builder.scene_graph.register_anchored_geometry(source, post)
    return SceneGraphCollisionChecker(builder.build())


def test_a_ball_on_a_flange_is_checked_and_proven(tmp_path):
    """It meets the post where the chord 2 sin(angle / 2) is both radii."""
    checker = checker_of(tmp_path, all_links=True)
    q = np.linspace(-2.9, 2.9, 59)[:, np.newaxis]
    assert checker.check_configs_collision_free(q).all()
    assert checker.is_part_of_robot("flange")
    assert checker.add_collision_shape_to_body("tool", "flange", Sphere(RADIUS), np.eye(4))
    chords = 2.0 * np.abs(np.sin(0.5 * (q[:, 0] - ANGLE)))
    np.testing.assert_array_equal(checker.check_configs_collision_free(q), chords > RADIUS + POST)
    clearance = checker.calc_robot_clearance([0.3], 5.0)
    gap = 2.0 * np.sin(0.35) - RADIUS - POST
    assert clearance.distances.min() == pytest.approx(gap, abs=1e-12)
    assert clearance.jacobians[clearance.distances.argmin()] == pytest.approx(
        [-np.cos(0.35)], abs=1e-12
    )
    measure = checker.measure_edge([0.0], [2.0])
    first = ANGLE - 2.0 * np.arcsin(0.5 * (RADIUS + POST))
    assert measure.alpha == pytest.approx(first / 2.0, abs=1e-5)
    assert measure.alpha <= first / 2.0
    checker.set_padding_between("flange", "world", 0.02)
    padded = checker.calc_robot_clearance([0.3], 5.0)
    assert padded.distances.min() == pytest.approx(gap - 0.02, abs=1e-12)
    checker.remove_all_added_collision_shapes()
    assert checker.check_configs_collision_free(q).all()


def test_a_link_without_a_frame_is_named_with_what_helps(tmp_path):
    """Its robot was loaded without such links; nothing has changed."""
    checker = checker_of(tmp_path, all_links=False)
    with pytest.raises(
        CollisionCheckerError, match=r"link 'flange' has no geometry, so no frame.*all_links"
    ):
        checker.add_collision_shape_to_body("tool", "flange", Box(0.1, 0.1, 0.1), np.eye(4))
    assert checker.get_all_added_collision_shapes() == {}
