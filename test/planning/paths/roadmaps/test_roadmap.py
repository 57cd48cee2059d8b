"""Paths through roadmaps that prove what they need, and remember it."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from robot_scenes import BALL, diagram, DRONE, PLATE, ROD, SLIDE

from scene_graph_ros.planning import (
    plan_path,
    PlanFailure,
    PlanningError,
    Roadmap,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.paths.roadmaps import roadmap_search
from scene_graph_ros.planning.paths.search.position_space import PositionSpace

# A ball of 0.1 m on two rails, x and y, before a wall of 0.1 m at x = 1 with a gap at y = 0.4.
CART = """<robot name="cart"><link name="base"/><link name="beam"/><link name="ball">
  <collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="x" type="prismatic"><parent link="base"/><child link="beam"/>
  <axis xyz="1 0 0"/><limit lower="-1" upper="3"/></joint>
  <joint name="y" type="prismatic"><parent link="beam"/><child link="ball"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="1"/></joint></robot>"""

WALL = """
geometries:
  - {{name: left, source: around, pose: {{xyz: [1, {left}, 0]}},
     shape: {{type: box, size: [0.1, 2, 2]}}}}
  - {{name: right, source: around, pose: {{xyz: [1, {right}, 0]}},
     shape: {{type: box, size: [0.1, 2, 2]}}}}
"""

START, GOAL = [0.0, -0.5], [2.0, -0.5]


def cart(folder, half_gap=0.1):
    """Return the checker of a wall whose gap leaves the ball so much room on both sides."""
    away = 0.1 + half_gap + 1.0
    text = WALL.format(left=0.4 + away, right=0.4 - away)
    return SceneGraphCollisionChecker(diagram(folder, CART, text))


def test_a_way_through_a_gap_is_found_and_proven(tmp_path):
    """None of 1000 configurations on each edge collides; the gap is where it goes through."""
    checker = cart(tmp_path)
    plan = plan_path(checker, START, GOAL, planner="prm", timeout=60)
    assert plan.is_success and plan.proven, plan.reason
    path = plan.configurations
    np.testing.assert_array_equal(path[[0, -1]], [START, GOAL])
    t = np.linspace(0.0, 1.0, 1000)[:, np.newaxis, np.newaxis]
    along = ((1.0 - t) * path[:-1] + t * path[1:]).reshape(-1, 2)
    assert checker.check_configs_collision_free(along).all()
    inside = np.abs(along[:, 0] - 1.0) < 0.05
    assert inside.any() and (np.abs(along[inside, 1] - 0.4) <= 0.1).all()
    assert plan.length >= 2.0 * math.hypot(0.95, 0.7)


def test_what_was_proven_is_known_the_next_time(tmp_path):
    """The second search looks at fewer edges; the first seed decides, and the same twice."""
    checker, roadmap = cart(tmp_path), Roadmap()
    first = plan_path(checker, START, GOAL, planner="prm", roadmap=roadmap, timeout=60)
    known = roadmap.num_proven_edges
    again = plan_path(checker, START, GOAL, planner="prm", roadmap=roadmap, timeout=60)
    back = plan_path(checker, GOAL, [0.2, 0.8], planner="prm", roadmap=roadmap, timeout=60)
    assert first.is_success and again.is_success and back.is_success
    assert 0 < known <= roadmap.num_proven_edges
    other = Roadmap()
    same = plan_path(checker, START, GOAL, planner="prm", roadmap=other, timeout=60)
    np.testing.assert_array_equal(same.configurations, first.configurations)
    np.testing.assert_array_equal(
        other.configurations, roadmap.configurations[: other.num_configurations]
    )
    seeds = [plan_path(checker, START, GOAL, planner="prm", seed=k).configurations for k in (1, 2)]
    assert not np.array_equal(*seeds)


def test_a_changed_checker_is_proven_anew(tmp_path):
    """With a padding that closes the gap what was free is not, and without it is again."""
    checker, roadmap = cart(tmp_path), Roadmap()
    assert plan_path(checker, START, GOAL, planner="prm", roadmap=roadmap, timeout=60).is_success
    closed = checker.clone()
    closed.set_padding_all_robot_environment_pairs(0.11)
    plan = plan_path(closed, START, GOAL, planner="prm", roadmap=roadmap, timeout=0.3)
    assert plan.failure is PlanFailure.TIMEOUT
    assert plan_path(checker, START, GOAL, planner="prm", roadmap=roadmap, timeout=60).is_success


def test_what_is_walled_in_says_how_near_it_came(tmp_path, monkeypatch):
    """A ball on a rail can't pass another one: q stays below 0.7, or above 1.3."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    plan_path(checker, [0.0], [0.1], planner="prm")
    begin = time.monotonic()
    late = plan_path(checker, [0.0], [2.0], planner="prm", timeout=0.2)
    assert late.failure is PlanFailure.TIMEOUT and time.monotonic() - begin >= 0.2
    monkeypatch.setattr(roadmap_search, "_MOST_NODES", 256)
    plan = plan_path(checker, [0.0], [2.0], planner="prm")
    assert plan.failure is PlanFailure.EXHAUSTED and not plan.proven
    first, second = plan.tree_sizes
    assert first > 1 and second > 1 and first + second <= 256 and plan.edges > 2
    beginning = "no path was found: the trees from start and goal have"
    assert plan.reason.startswith(f"{beginning} {first} and {second} configurations, ")
    apart = float(plan.reason.split(" configurations, ")[1].split(" ")[0])
    assert 0.6 <= apart < 0.9


def test_turns_are_counted(tmp_path):
    """A plate bars the short way from 0.2 to 0.9; the long one ends a full turn before 0.9."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, ROD, PLATE))
    plan = plan_path(checker, [0.2], [0.9], planner="prm", timeout=60)
    assert plan.is_success, plan.reason
    assert plan.configurations[-1, 0] == pytest.approx(0.9 - 2.0 * math.pi, abs=1e-12)


def test_a_drone_turns_and_flies(tmp_path):
    """Distances between quaternions are angles, whatever their sign."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, DRONE, BALL))
    start, goal = [1.0, 0, 0, 0, -1, 0, 0], [0.0, 0, 0, -1.0, 3.0, 0, 0]
    plan = plan_path(checker, start, goal, planner="prm", timeout=60)
    assert plan.is_success, plan.reason
    assert plan.length > math.hypot(4.0, math.pi)


def test_bad_roadmaps_are_named(tmp_path):
    """One for another planner, and one that was made with positions held elsewhere."""
    checker, roadmap = cart(tmp_path), Roadmap()
    with pytest.raises(PlanningError, match="a roadmap is for the planner 'prm'"):
        plan_path(checker, START, GOAL, roadmap=roadmap)
    tree = checker.plan.tree
    spaces = [
        PositionSpace.of(checker.plan, np.array([q]), np.array([True, False]))
        for q in ([0.0, 0.1], [0.0, 0.2])
    ]
    assert tree.position_names == ("x", "y")
    roadmap.prepare(checker.plan, spaces[0], 0)
    with pytest.raises(PlanningError, match="other positions held, or held elsewhere"):
        roadmap.prepare(checker.plan, spaces[1], 0)
