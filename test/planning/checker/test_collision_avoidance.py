"""Displacements out of a collision: which way they lead, their weights, and bad numbers."""

import numpy as np
import pytest
from robot_scenes import BALL, diagram, SLIDE

from scene_graph_ros.planning import (
    CollisionCheckerError,
    compute_collision_avoidance_displacement,
    SceneGraphCollisionChecker,
)


@pytest.fixture(scope="module")
def slide(tmp_path_factory):
    """A ball of 0.1 m on a rail, and one of 0.2 m at x = 1: they touch at 0.7 and 1.3."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("slide"), SLIDE, BALL))


@pytest.mark.parametrize(
    ("x", "expected"),
    [
        # The distance is |x - 1| - 0.3; its slope -1 before the ball and 1 behind it.
        (0.5, 0.0),
        (0.65, -(0.1 - 0.05) / 0.15),
        (0.75, -1.0),
        (0.9, -1.0),
        (1.1, 1.0),
        (1.325, (0.1 - 0.025) / 0.15),
    ],
)
def test_weights_grow_from_clearance_to_penetration(slide, x, expected):
    """From 0 at 0.1 m to 1 at an overlap of 0.05 m."""
    found = compute_collision_avoidance_displacement(slide, [x], -0.05, 0.1)
    assert found == pytest.approx([expected], abs=1e-9)


def test_small_steps_lead_out(slide):
    """Of an overlap of 0.2 m, in both directions."""
    for x, free in ((0.9, 0.7), (1.1, 1.3)):
        q = np.array([x])
        for _ in range(200):
            q = q + 0.01 * compute_collision_avoidance_displacement(slide, q, 0.0, 0.02)
        assert slide.check_config_collision_free(q)
        assert abs(q[0] - free) < 0.05


@pytest.mark.parametrize(
    ("penetration", "clearance", "message"),
    [
        (0.1, 0.2, "max_penetration must be a finite number, at most 0, not 0.1"),
        (float("nan"), 0.2, "max_penetration must be a finite number"),
        (0.0, 0.0, "max_clearance must be a finite number, at least 0 and above"),
        (-0.1, -0.05, "max_clearance must be .* not -0.05"),
        (-0.1, float("inf"), "max_clearance must be .* not inf"),
        (-0.1, "far", "max_clearance must be .* not 'far'"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(slide, penetration, clearance, message):
    """By name and value."""
    with pytest.raises(CollisionCheckerError, match=message):
        compute_collision_avoidance_displacement(slide, [0.5], penetration, clearance)


def test_what_is_no_checker_is_refused():
    """By its value."""
    with pytest.raises(CollisionCheckerError, match="must be a CollisionChecker, not 'arm'"):
        compute_collision_avoidance_displacement("arm", [0.0], -0.05, 0.1)
