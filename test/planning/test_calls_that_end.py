"""Calls that plan, time or prove: each has a time limit, and a function that may end it."""

import inspect

import numpy as np
import pytest
from robot_scenes import CART, diagram, POST

from scene_graph_ros import planning
from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning.trajectories import MotionLimits, PiecewisePolynomial

START, GOAL = np.array([0.0, 0.5]), np.array([2.0, 0.9])
LIMITS = MotionLimits([1.0, 1.0], [2.0, 2.0], ("x", "y"), [20.0, 20.0])
VERBS = ("plan_", "prove_", "thin_", "time_")


@pytest.fixture(scope="module")
def checker(tmp_path_factory):
    """A ball on two rails, with a post far away."""
    robots = diagram(tmp_path_factory.mktemp("cart"), CART, POST.format(x=9.0, y=9.0))
    return planning.SceneGraphCollisionChecker(robots)


def calls(checker):
    """Return a call of each, with a time limit and a function that watches."""
    tree = checker.plan.tree
    link = tree.link_names[-1]
    X_WT = tree.link_poses(GOAL, [link])[0]
    boxes = [HPolyhedron.make_box([-1.0, -1.0], [3.0, 1.0])]
    line = PiecewisePolynomial.first_order_hold([0.0, 1.0], [START, GOAL])
    timed = planning.time_path(checker, [START, GOAL], LIMITS)
    return {
        "plan_path": lambda **how: planning.plan_path(checker, START, GOAL, **how),
        "plan_straight": lambda **how: planning.plan_straight(
            checker, START, X_WT[np.newaxis], link, **how
        ),
        "plan_through_regions": lambda **how: planning.plan_through_regions(
            boxes, START, GOAL, velocities=[1.0, 1.0], checker=checker, **how
        ),
        "plan_trajectory": lambda **how: planning.plan_trajectory(
            checker, START, GOAL, LIMITS, **how
        ),
        "prove_trajectory": lambda **how: planning.prove_trajectory(
            checker, timed.points, LIMITS, **how
        ),
        "thin_trajectory": lambda **how: planning.thin_trajectory(
            checker, timed, LIMITS, 4, deviation=1.0, **how
        ),
        "time_curve": lambda **how: planning.time_curve(checker, line, LIMITS, at=START, **how),
        "time_path": lambda **how: planning.time_path(checker, [START, GOAL], LIMITS, **how),
    }


def test_all_that_plan_have_both(checker):
    """The table has each public function whose name says that it plans, times or proves."""
    names = {name for name in planning.__all__ if name.startswith(VERBS)}
    assert set(calls(checker)) == names
    for name in names:
        parameters = inspect.signature(getattr(planning, name)).parameters
        assert {"timeout", "watch"} <= set(parameters), name


@pytest.mark.parametrize("name", sorted(n for n in planning.__all__ if n.startswith(VERBS)))
def test_a_function_that_watches_may_end_it(checker, name):
    """Its exception comes out; and it may let all go on."""

    class EnoughError(Exception):
        pass

    seen = []

    def enough(*_):
        raise EnoughError

    call = calls(checker)[name]
    with pytest.raises(EnoughError):
        call(timeout=60.0, watch=enough)
    assert call(timeout=60.0, watch=lambda *progress: seen.append(progress)) is not None
    assert seen
