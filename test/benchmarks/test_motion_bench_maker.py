"""Paths and motions for problems that others made: ten of each set of MotionBenchMaker's."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.motions import ARM_LIMITS, least_time
from benchmarks.plans import moveit_problems
from scene_graph_ros.planning import plan_path, plan_trajectory
from scene_graph_ros.planning.trajectories import find_excess

ARCHIVE = Path(__file__).with_name("motion_bench_maker_panda.tar.bz2")

SETS = (
    "bookshelf_small",
    "bookshelf_tall",
    "bookshelf_thin",
    "box",
    "cage",
    "table_pick",
    "table_under_pick",
)


SLOWEST = dict.fromkeys(SETS, 1.05) | {"cage": 1.15, "table_under_pick": 1.2}
"""Of the least time without anything in the way: what the median of a set takes at most."""


@pytest.mark.parametrize("name", SETS)
def test_motions_of_a_set_are_fast_within_limits_and_free(name):
    """All are found; none of 100 configurations along each collides; five sets are within 5 %."""
    shares = []
    for problem in moveit_problems(ARCHIVE, sets=(name,)):
        motion = plan_trajectory(
            problem.checker, problem.start, problem.goal, ARM_LIMITS, group="arm", timeout=60
        )
        assert motion.is_success, motion.reason
        ends = motion.points.positions[[0, -1]]
        np.testing.assert_array_equal(ends, [problem.start, problem.goal])
        tree = problem.checker.plan.tree
        rows = np.array([tree.position_index(joint) for joint in ARM_LIMITS.names])
        assert find_excess(motion.points.of(rows).trajectory(), ARM_LIMITS) is None
        along = motion.trajectory.value(np.linspace(0.0, motion.duration, 100))
        assert ((along >= tree.lower - 1e-9) & (along <= tree.upper + 1e-9)).all()
        assert problem.checker.check_configs_collision_free(along).all()
        shares.append(motion.duration / least_time(problem))
    assert min(shares) >= 1.0 - 1e-9
    assert np.median(shares) <= SLOWEST[name]


@pytest.mark.parametrize("name", SETS)
def test_all_problems_of_a_set_are_solved_and_proven(name):
    """From the start to the goal; none of 100 configurations along each edge collides."""
    problems = list(moveit_problems(ARCHIVE, sets=(name,)))
    assert len(problems) == 10
    t = np.linspace(0.0, 1.0, 100)[:, np.newaxis, np.newaxis]
    for problem in problems:
        plan = plan_path(problem.checker, problem.start, problem.goal, group="arm", timeout=60)
        assert plan.is_success and plan.proven, plan.reason
        path, tree = plan.configurations, problem.checker.plan.tree
        np.testing.assert_array_equal(path[[0, -1]], [problem.start, problem.goal])
        assert ((path >= tree.lower) & (path <= tree.upper)).all()
        along = ((1.0 - t) * path[:-1] + t * path[1:]).reshape(-1, path.shape[1])
        assert problem.checker.check_configs_collision_free(along).all()
        nearest = min(
            problem.checker.calc_robot_clearance(q, 0.2).distances.min(initial=0.2)
            for q in along[::50]
        )
        assert 0.0 < plan.least_clearance <= nearest
