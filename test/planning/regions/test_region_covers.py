"""Covers of what is free by regions: their share, paddings, margins, and work in processes."""

from concurrent.futures import ProcessPoolExecutor
import functools
import itertools
import multiprocessing
import pickle

import numpy as np
import pytest
from robot_scenes import ARM, BALL, diagram, POSTS, SLIDE

from scene_graph_ros.geometry.optimization import HPolyhedron
from scene_graph_ros.planning import (
    iris_in_configuration_space_from_clique_cover,
    IrisFromCliqueCoverOptions,
    IrisNpOptions,
    IrisZoOptions,
    MaxCliqueSolverViaBranchAndBound,
    plan_path,
    plan_through_regions,
    region_around,
    RegionError,
    regions_along,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.checker.carried_checker import pack

LOW, HIGH = np.array([-3.0, -2.8]), np.array([3.0, 2.8])


FAST = IrisZoOptions(num_particles=300, epsilon=0.05, mixing_steps=20, max_iterations=2)


POOL = functools.partial(ProcessPoolExecutor, 2, mp_context=multiprocessing.get_context("fork"))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


@pytest.fixture(scope="module")
def spread():
    """Points of the domain that nothing else uses."""
    return np.random.default_rng(77).uniform(LOW, HIGH, (20_000, 2))


def share_in_collision(checker, region, spread):
    """Return the share of a region that is not free, and how many points say so."""
    inside = spread[region.point_in_set(spread, 0.0)]
    return 1.0 - checker.check_configs_collision_free(inside).mean(), len(inside)


def test_regions_around_seeds_and_along_paths(arm):
    """An edge, three points, and a path whose neighbours meet; a plan goes through them."""
    edge = region_around(arm, [[0.0, 0.0], [-1.5, 0.4]], options=FAST)
    assert edge.region.point_in_set([[0.0, 0.0], [-1.5, 0.4]], 0.0).all()
    with pytest.raises(RegionError, match=r"seed\[0\] and seed\[1\] do not see each other"):
        region_around(arm, [[0.0, 0.0], [1.8, 0.0]], options=FAST)
    plan = plan_path(arm, [0.0, 0.0], [1.8, 0.0], timeout=20.0)
    assert plan.is_success
    regions = regions_along(arm, plan.configurations, options=FAST)
    shared = regions_along(arm, plan.configurations, options=FAST, executor=POOL)
    assert len(shared) == len(regions)
    for one, other in zip(regions, shared, strict=True):
        np.testing.assert_array_equal(one.region.A, other.region.A)
        np.testing.assert_array_equal(one.region.b, other.region.b)
    for q1, q2 in zip(plan.configurations[:-1], plan.configurations[1:], strict=True):
        assert any(r.region.point_in_set([q1, q2], 0.0).all() for r in regions)
    through = plan_through_regions(
        [r.region for r in regions], [0.0, 0.0], [1.8, 0.0], velocities=[1.0, 1.0]
    )
    assert through.is_success


def test_a_cover_has_the_share_that_was_asked_for(arm, spread):
    """Of free points that did not make it; the same in other processes; given ones stay."""
    options = IrisFromCliqueCoverOptions(
        iris_options=FAST,
        coverage_termination_threshold=0.8,
        num_points_per_visibility_round=60,
        num_points_per_coverage_check=1000,
    )
    cover = iris_in_configuration_space_from_clique_cover(
        arm, options, max_clique_solver=MaxCliqueSolverViaBranchAndBound(), certificate=True
    )
    assert cover.reason == "covered" and cover.coverage >= 0.8
    free = spread[arm.check_configs_collision_free(spread)]
    covered = np.any([region.point_in_set(free, 0.0) for region in cover.regions], axis=0)
    assert covered.mean() >= 0.75
    # Of some 800 free points; the true share is known from 20 000 others to 0.003.
    assert cover.coverage - 0.04 < cover.coverage_bound < min(cover.coverage, covered.mean())
    for region in cover.regions:
        assert share_in_collision(arm, region, spread)[0] <= 0.06
    shared = iris_in_configuration_space_from_clique_cover(
        arm,
        options,
        max_clique_solver=MaxCliqueSolverViaBranchAndBound(),
        executor=POOL,
    )
    assert len(shared) == len(cover.regions)
    for one, other in zip(shared, cover.regions, strict=True):
        np.testing.assert_array_equal(one.A, other.A)
    again = iris_in_configuration_space_from_clique_cover(arm, options, sets=cover.regions)
    assert tuple(again) == cover.regions


def test_a_cover_has_no_more_regions_than_it_takes(arm):
    """It ends in the middle of a round; less is covered by the first of the same regions."""
    covers = [
        iris_in_configuration_space_from_clique_cover(
            arm,
            IrisFromCliqueCoverOptions(
                iris_options=FAST,
                coverage_termination_threshold=share,
                num_points_per_visibility_round=100,
                num_points_per_coverage_check=1000,
            ),
        )
        for share in (0.3, 0.5, 0.8)
    ]
    for few, more in itertools.pairwise(covers):
        assert 1 <= len(few) < len(more)
        for one, other in zip(few, more, strict=False):
            np.testing.assert_array_equal(one.A, other.A)


def test_a_cover_keeps_to_paddings_and_obstacles_and_drops_what_fails(arm, spread):
    """All regions keep the padding; a round too few for a clique's region drops it."""
    checker = arm.clone()
    checker.set_padding_all_robot_environment_pairs(0.15)
    obstacle = HPolyhedron.make_box([-1.0, -2.8], [-0.5, 2.8])
    inner = IrisNpOptions(iteration_limit=1, configuration_obstacles=[obstacle])
    options = IrisFromCliqueCoverOptions(
        iris_options=inner,
        coverage_termination_threshold=0.3,
        num_points_per_visibility_round=30,
        num_points_per_coverage_check=500,
    )
    cover = iris_in_configuration_space_from_clique_cover(checker, options, certificate=True)
    assert cover.reason == "covered"
    for region in cover.regions:
        assert share_in_collision(checker, region, spread)[0] <= 0.01
        assert not region.intersects_with(obstacle)
    hopeless = IrisZoOptions(max_iterations_separating_planes=1, epsilon=0.05)
    few = IrisFromCliqueCoverOptions(
        iris_options=hopeless, iteration_limit=1, num_points_per_visibility_round=40
    )
    cover = iris_in_configuration_space_from_clique_cover(arm, few, certificate=True)
    assert cover.reason == "iterations" and cover.dropped
    assert "rounds of faces left" in cover.dropped[0].reason
    assert len(cover.dropped[0].points) >= 3


@pytest.mark.parametrize("kind", [IrisNpOptions, IrisZoOptions])
def test_a_cover_keeps_the_margin(tmp_path, kind):
    """A rail on which 0.7 to 1.3 are not free: a cover ends 0.05 before, on both sides."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    inner = {"configuration_space_margin": 0.05, "mixing_steps": 5}
    if kind is IrisZoOptions:
        inner |= {"num_particles": 100, "bisection_steps": 25, "epsilon": 0.1, "max_iterations": 1}
    options = IrisFromCliqueCoverOptions(
        iris_options=kind(**inner),
        coverage_termination_threshold=0.9,
        num_points_per_visibility_round=20,
        num_points_per_coverage_check=500,
    )
    cover = iris_in_configuration_space_from_clique_cover(
        checker, options, domain=HPolyhedron.make_box([-2.0], [3.0]), certificate=True
    )
    assert cover.reason == "covered"
    ends = [
        (-region.support([-1.0]).value, region.support([1.0]).value) for region in cover.regions
    ]
    left, right = ([each for each in ends if (each[0] < 1.0) is side] for side in (True, False))
    assert left and right
    assert max(last for _, last in left) == pytest.approx(0.65, abs=1e-4)
    assert min(first for first, _ in right) == pytest.approx(1.35, abs=1e-4)


def test_a_carried_checker_tells_the_same_clearances(arm):
    """Distances and derivatives, bit for bit."""
    carried = pickle.loads(pickle.dumps(pack(arm))).unpacked()
    for q in np.random.default_rng(3).uniform(LOW, HIGH, (20, 2)):
        own, other = arm.calc_robot_clearance(q, 0.5), carried.calc_robot_clearance(q, 0.5)
        np.testing.assert_array_equal(own.distances, other.distances)
        np.testing.assert_array_equal(own.jacobians, other.jacobians)
