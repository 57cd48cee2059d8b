"""Regions of configurations, tested by points that did not make them, and by construction."""

from dataclasses import replace
import pickle

import numpy as np
import pytest
from robot_scenes import ARM, BALL, diagram, DRONE, POSTS, SLIDE

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid, IrisOptions
from scene_graph_ros.planning import (
    iris_in_configuration_space,
    iris_zo,
    IrisNpOptions,
    IrisZoOptions,
    load_robot_diagram,
    NonlinearProgram,
    region_around,
    RegionError,
    RegionNotFoundError,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)

LOW, HIGH = np.array([-3.0, -2.8]), np.array([3.0, 2.8])
DOMAIN = HPolyhedron.make_box(LOW, HIGH)
FAST = IrisZoOptions(num_particles=300, epsilon=0.05, mixing_steps=20, max_iterations=2)


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


def ball(center):
    """Return an ellipsoid to begin with."""
    return Hyperellipsoid.make_hypersphere(0.01, center)


def test_a_region_is_free_as_its_record_says(arm, spread):
    """The share that is not free is below epsilon, by points of a sampler of its own."""
    options = IrisZoOptions(max_iterations=2, epsilon=0.02, num_particles=300, mixing_steps=20)
    for seed in ([0.0, 0.0], [2.0, 0.5]):
        found = iris_zo(arm, ball(seed), DOMAIN, options, certificate=True)
        share, count = share_in_collision(arm, found.region, spread)
        assert count > 100 and share <= 0.02
        assert found.share_bound <= 0.02 and found.confidence == 0.95
        assert found.samples > 1000 and found.hits <= 0.01 * found.samples
        assert found.region.point_in_set(seed, 0.0)
        assert found.region.contained_in(DOMAIN)
        assert found.ellipsoid is not None and len(found.volumes) <= 2
    again = iris_zo(arm, ball(seed), DOMAIN, options)
    np.testing.assert_array_equal(again.A, found.region.A)


def test_constraints_of_a_program_are_those_of_a_function(arm, spread):
    """The same region bit for bit, also by options that were sent or changed; it keeps them."""
    program = NonlinearProgram()
    q = program.new_variables(2, "q")
    program.add_constraint(q[0] * q[0] + q[1] * q[1], ub=1.0, label="disc")
    program.add_constraint(q[1] - q[0], -0.8, 0.9, label="strip")
    program.add_cost(q[0])

    def same(points):
        x, y = points.T
        return np.stack([x * x + y * y - 1.0, y - x - 0.9, -(y - x) - 0.8], axis=1)

    ours = IrisNpOptions(prog_with_additional_constraints=program, iteration_limit=2)
    assert ours.prog_with_additional_constraints is program
    np.testing.assert_allclose(ours.additional_constraints(spread), same(spread), atol=1e-12)
    functions = IrisNpOptions(additional_constraints=same, iteration_limit=2)
    found, expected, sent, again = (
        iris_in_configuration_space(arm, [0.1, 0.1], each, domain=DOMAIN)
        for each in (ours, functions, pickle.loads(pickle.dumps(ours)), replace(ours))
    )
    inside = spread[found.point_in_set(spread, 0.0)]
    assert len(inside) > 100
    assert (same(inside) <= 0.0).mean(axis=0).min() > 0.99
    np.testing.assert_allclose(found.A, expected.A, atol=1e-9)
    for each in (sent, again):
        np.testing.assert_array_equal(each.A, found.A)


def test_programs_that_make_no_sense_are_refused(arm):
    """No program, no constraints, equations, two kinds at once, other variables."""
    name = "prog_with_additional_constraints"
    program = NonlinearProgram()
    q = program.new_variables(3, "q")
    for bad, words in ((3, f"{name} must be a NonlinearProgram, not 3"), (program, "no constr")):
        with pytest.raises(RegionError, match=words):
            IrisNpOptions(prog_with_additional_constraints=bad)
    program.add_constraint(q[0], ub=1.0)
    with pytest.raises(RegionError, match="one of additional_constraints and prog_with"):
        IrisNpOptions(prog_with_additional_constraints=program, additional_constraints=lambda q: q)
    options = IrisNpOptions(prog_with_additional_constraints=program)
    with pytest.raises(RegionError, match="has 3 variables, and configurations have 2 positions"):
        iris_in_configuration_space(arm, [0.1, 0.1], options, domain=DOMAIN)
    program.add_constraint(q[1], 0.5, 0.5, label="level")
    with pytest.raises(RegionError, match="'level' is an equation"):
        IrisNpOptions(prog_with_additional_constraints=program)


@pytest.mark.slow
def test_of_many_regions_at_most_delta_are_worse_than_epsilon(arm):
    """Of 200, around seeds of their own; each is sampled by 4000 points that did not make it."""
    rng = np.random.default_rng(21)
    options = IrisZoOptions(
        max_iterations=1, epsilon=0.02, delta=0.05, num_particles=200, mixing_steps=20
    )
    q = rng.uniform(LOW, HIGH, (500, 2))
    seeds = q[arm.check_configs_collision_free(q)][:200]
    shares, bounds = [], []
    for k, seed in enumerate(seeds):
        own = replace(options, random_seed=1000 + k)
        found = iris_zo(arm, ball(seed), DOMAIN, own, certificate=True)
        low, high = (
            np.array([sign * found.region.support(sign * axis).value for axis in np.eye(2)])
            for sign in (-1.0, 1.0)
        )
        inside = np.zeros((0, 2))
        while len(inside) < 4000:
            more = rng.uniform(low, high, (8000, 2))
            inside = np.concatenate([inside, more[found.region.point_in_set(more, 0.0)]])
        shares.append(1.0 - arm.check_configs_collision_free(inside[:4000]).mean())
        bounds.append(found.share_bound)
    worse = int((np.array(shares) > options.epsilon).sum())
    print(f"{len(shares)} regions, {worse} worse than epsilon, the worst {max(shares):.4f}")
    assert len(shares) == 200
    assert worse <= options.delta * len(shares)
    # They are not free of all collisions: the count would tell.
    assert max(shares) > 0.0
    assert max(bounds) <= options.epsilon


def test_a_region_on_a_rail_ends_before_the_ball(tmp_path):
    """A ball of 0.1 m meets one of 0.2 m at 1 m from 0.7 m on; the margin is 1 cm, or nothing."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, SLIDE, BALL))
    rail = HPolyhedron.make_box([-2.0], [3.0])
    for margin in (0.0, 0.01):
        options = IrisZoOptions(
            configuration_space_margin=margin,
            bisection_steps=25,
            num_particles=100,
            mixing_steps=5,
            epsilon=0.1,
            max_iterations=1,
        )
        region = iris_zo(checker, ball([0.0]), rail, options)
        ends = [region.support(way).value for way in ([-1.0], [1.0])]
        assert ends == pytest.approx([2.0, 0.7 - margin], abs=1e-6)
    checker.set_padding_all_robot_environment_pairs(0.05)
    region = iris_zo(checker, ball([0.0]), rail, options)
    assert region.support([1.0]).value == pytest.approx(0.64, abs=1e-6)
    found = iris_in_configuration_space(checker, [0.0], domain=rail)
    assert found.support([1.0]).value == pytest.approx(0.64, abs=1e-5)


def test_points_to_keep_stay_inside(arm, spread):
    """The corners of a thin triangle; where they are near to something the margin gives way."""
    kept = np.array([[0.0, 0.0], [-1.5, 0.3], [-1.5, 0.6]])
    assert arm.check_edges_collision_free([[kept[0], kept[1]], [kept[0], kept[2]]]).all()
    options = replace(FAST, containment_points=kept, configuration_space_margin=0.05)
    found = iris_zo(arm, ball(kept.mean(axis=0)), DOMAIN, options, certificate=True)
    assert found.region.point_in_set(kept, 0.0).all()
    assert share_in_collision(arm, found.region, spread)[0] <= 0.05


def test_obstacles_and_constraints_of_configurations_are_kept(arm, spread):
    """A box, and a half plane, as exactly as the margin."""
    obstacle = HPolyhedron.make_box([0.5, -3.0], [0.8, 3.0])

    def above(q):
        return -0.4 - q[:, 1]

    both = {"configuration_obstacles": [obstacle], "additional_constraints": above}
    for region in (
        iris_zo(arm, ball([0.0, 0.0]), DOMAIN, replace(FAST, **both)),
        iris_in_configuration_space(
            arm, [0.0, 0.0], IrisNpOptions(iteration_limit=1, **both), domain=DOMAIN
        ),
    ):
        inside = spread[region.point_in_set(spread, 0.0)]
        assert len(inside) > 100
        assert obstacle.point_in_set(inside, 0.0).mean() <= 0.05
        assert (above(inside) > 0.0).mean() <= 0.05
        assert inside[:, 0].max() > 0.3 and inside[:, 1].min() < -0.3
    with pytest.raises(RegionError, match=r"not free: it is in configuration_obstacles\[0\]"):
        iris_zo(arm, ball([0.6, 0.0]), DOMAIN, IrisZoOptions(**both))


def test_counter_examples_leave_nothing_to_find(arm, spread):
    """The region is about as large as by checks alone, and next to no point collides."""
    options = IrisNpOptions(iteration_limit=2, require_sample_point_is_contained=True)
    for seed in ([2.0, 0.5],):
        found = iris_in_configuration_space(arm, seed, options, domain=DOMAIN, certificate=True)
        share, count = share_in_collision(arm, found.region, spread)
        assert count > 100 and share <= 0.002
        assert found.region.point_in_set(seed, 0.0)
        assert found.hits == 0 and found.share_bound < 0.01 and found.samples == 1000
        other = iris_zo(arm, ball(seed), DOMAIN, FAST, certificate=True)
        assert max(found.volumes) > 0.5 * max(other.volumes)


BLOCK = """<robot name="r"><link name="ground"><collision><origin xyz="0 0 -1"/>
<geometry><box size="10 10 2"/></geometry></collision></link>
<link name="lift"/><joint name="up" type="prismatic"><parent link="ground"/><child link="lift"/>
<axis xyz="0 0 1"/><limit lower="0" upper="3" effort="1" velocity="1"/></joint>
<link name="block"><collision><geometry><box size="2 1 1"/></geometry></collision></link>
<joint name="turn" type="revolute"><parent link="lift"/><child link="block"/><axis xyz="0 1 0"/>
<limit lower="-3.14159" upper="3.14159" effort="1" velocity="1"/></joint></robot>"""


def test_the_largest_region_that_passed_is_returned(tmp_path):
    """A block that turns above the ground: the second region is the largest, the third is not.

    Inscribed ellipsoids of the default iterations have volumes of 4.4, 9.3 and below; another
    implementation of the same algorithm ends with 9.5 (Drake, IrisZo).
    """
    (tmp_path / "block.urdf").write_text(BLOCK)
    builder = RobotDiagramBuilder()
    builder.add_robot("r", tmp_path / "block.urdf")
    checker = SceneGraphCollisionChecker(builder.build())
    tree = checker.plan.tree
    domain = HPolyhedron.make_box(tree.lower, tree.upper)
    found = iris_zo(checker, ball([1.0, 0.0]), domain, certificate=True)
    volume = np.pi * np.sqrt(1.0 / np.linalg.det(found.ellipsoid.A.T @ found.ellipsoid.A))
    assert volume == pytest.approx(max(found.volumes), rel=1e-9)
    assert volume == pytest.approx(
        found.region.maximum_volume_inscribed_ellipsoid().calc_volume(), rel=1e-4
    )
    assert volume > 9.0


def test_options_of_iris_are_taken(arm):
    """Bounds and what ends growing; the limits of the joints are the domain."""
    bounds = HPolyhedron.make_box([-0.2, -0.2], [0.2, 0.2])
    options = IrisOptions(bounding_region=bounds, iteration_limit=1)
    found = iris_in_configuration_space(arm, [0.0, 0.0], options, certificate=True)
    assert found.region.contained_in(bounds) and found.reason == "iterations"
    options = IrisNpOptions(bounding_region=bounds, termination_func=lambda region: True)
    with pytest.raises(RegionNotFoundError, match="termination_func is true of the first region"):
        iris_in_configuration_space(arm, [0.0, 0.0], options, certificate=True)
    asked = []
    options = IrisNpOptions(
        bounding_region=bounds,
        termination_func=lambda region: asked.append(region) or len(asked) == 2,
        termination_threshold=-1.0,
        relative_termination_threshold=-1.0,
    )
    found = iris_in_configuration_space(arm, [0.0, 0.0], options, certificate=True)
    assert found.reason == "termination_func" and len(found.volumes) == 1
    assert len(asked) == 2 and found.region is asked[0]


def test_collisions_of_a_test_are_removed(arm):
    """As long as there are some and rounds are left; a region with few of them passes without."""
    rough = replace(FAST, epsilon=0.3, delta=0.3, max_iterations=1)
    plain = iris_zo(arm, ball([0.0, 0.0]), DOMAIN, rough, certificate=True)
    clean = iris_zo(
        arm,
        ball([0.0, 0.0]),
        DOMAIN,
        replace(rough, remove_all_collisions_possible=True),
        certificate=True,
    )
    assert plain.hits > clean.hits == 0
    with pytest.raises(RegionError, match="remove_all_collisions_possible must be True or False"):
        replace(rough, remove_all_collisions_possible=1)


@pytest.mark.parametrize(
    ("center", "domain", "options", "message"),
    [
        ([0.64, 0.0], DOMAIN, {}, r"is not free: .* overlap by"),
        ([9.0, 0.0], DOMAIN, {}, "outside the domain by 6"),
        ([0.0, 0.0], HPolyhedron([[1.0, 0.0]], [1.0]), {}, "unbounded"),
        ([0.0, 0.0], HPolyhedron.make_box([1.0, 1.0], [0.0, 0.0]), {}, "empty"),
        ([0.0, 0.0], HPolyhedron.make_box([-1.0], [1.0]), {}, "2 dimensions"),
        ([0.0], DOMAIN, {}, "starting_ellipsoid must be in 2"),
        ([0.0, 0.0], DOMAIN, {"containment_points": [[-0.5, 0.1]]}, "in their hull"),
        ([0.0, 0.0], DOMAIN, {"containment_points": [[np.nan, 0.5]]}, "containment_points"),
        ([0.0, 0.0], DOMAIN, {"configuration_obstacles": [3]}, r"configuration_obstacles\[0\]"),
        ([0.0, 0.0], DOMAIN, {"additional_constraints": lambda q: "no"}, "additional_con|numbers"),
    ],
)
def test_bad_input_is_refused(arm, center, domain, options, message):
    """Naming the argument and what is wrong with it."""
    with pytest.raises((RegionError, ValueError), match=message):
        iris_zo(arm, ball(center), domain, IrisZoOptions(**options))


def test_what_floats_and_hulls_that_collide_are_refused(tmp_path, arm):
    """Quaternions are no convex space; a hull over the ball has no region."""
    drone = SceneGraphCollisionChecker(diagram(tmp_path, DRONE))
    with pytest.raises(RegionError, match="joint 'free' floats"):
        region_around(drone, drone.get_zero_configuration())
    kept = [[0.0, 0.0], [1.8, 0.0]]
    options = IrisZoOptions(containment_points=kept)
    with pytest.raises(RegionNotFoundError, match=r"in the hull of|too thin|rounds of faces"):
        iris_zo(arm, ball([0.0, 0.0]), DOMAIN, options)


def test_a_panda_has_a_region_in_its_cell():
    """Hundreds of faces in eight dimensions; hardly any of another sampler's points collides."""
    checker = SceneGraphCollisionChecker(load_robot_diagram("config/scenes/panda_cell.yaml"))
    seed = np.array([0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02])
    options = IrisNpOptions(iteration_limit=1)
    found = iris_in_configuration_space(checker, seed, options, certificate=True)
    assert found.region.point_in_set(seed, 0.0) and found.share_bound < 0.02
    generator, q, points = np.random.default_rng(99), seed, []
    for _ in range(1000):
        q = found.region.uniform_sample(generator, q, 10)
        points.append(q)
    assert np.ptp(points, axis=0).min() > 0.03
    assert checker.check_configs_collision_free(points).mean() > 0.98
