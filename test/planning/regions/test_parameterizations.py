"""Regions of points that a function takes to configurations."""

from dataclasses import replace
import pickle

import numpy as np
import pytest
from robot_scenes import ARM, diagram, POSTS

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid, VPolytope
from scene_graph_ros.planning import (
    iris_in_configuration_space,
    iris_zo,
    IrisFromCliqueCoverOptions,
    IrisNpOptions,
    IrisParameterizationFunction,
    IrisZoOptions,
    RationalForwardKinematics,
    region_around,
    RegionError,
    SceneGraphCollisionChecker,
)

DOMAIN = HPolyhedron.make_box([-3.0, -2.8], [3.0, 2.8])
FAST = IrisZoOptions(num_particles=300, epsilon=0.05, mixing_steps=20, max_iterations=2)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """An arm of two joints between a ball and a box."""
    return SceneGraphCollisionChecker(diagram(tmp_path_factory.mktemp("arm"), ARM, POSTS))


def ball(center):
    """Return an ellipsoid to begin with."""
    return Hyperellipsoid.make_hypersphere(0.01, center)


COUPLED = IrisParameterizationFunction(
    lambda s: np.concatenate([s, -2.0 * s], axis=1),
    lambda s: np.tile([[1.0], [-2.0]], (len(s), 1, 1)),
)


def test_a_region_of_parameters_is_free_through_their_function(arm):
    """Both joints as functions of one number, and of numbers squeezed by an arc tangent."""
    coupled = replace(FAST, parameterization=lambda s: np.concatenate([s, -2.0 * s], axis=1))
    line = HPolyhedron.make_box([-1.4], [1.4])
    region = iris_zo(arm, Hyperellipsoid.make_hypersphere(0.01, [0.0]), line, coupled)
    s = np.linspace(-1.4, 1.4, 400)[:, np.newaxis]
    inside = region.point_in_set(s)
    assert inside[200] and 0 < inside.sum() < 400
    assert arm.check_configs_collision_free(coupled.parameterization(s[inside])).mean() >= 0.95
    # In tangents of half angles lines are curves of angles.
    tangents = replace(FAST, parameterization=lambda t: 2.0 * np.arctan(t))
    box = HPolyhedron.make_box([-2.0, -2.0], [2.0, 2.0])
    region = iris_zo(arm, ball([0.0, 0.0]), box, tangents, certificate=True)
    t = np.random.default_rng(0).uniform(-2.0, 2.0, size=(2000, 2))
    chosen = t[region.region.point_in_set(t)]
    assert len(chosen) > 50
    assert arm.check_configs_collision_free(2.0 * np.arctan(chosen)).mean() >= 0.95


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (3, "parameterization must be a function, or None, not 3"),
        (lambda s: s[:, :1], r"parameterization must return finite numbers \(1, 2\) of points"),
        (lambda s: np.full((len(s), 2), np.nan), "parameterization must return finite numbers"),
        (lambda s: "no", "parameterization must return finite numbers"),
    ],
)
def test_parameterizations_that_make_no_sense_are_refused(arm, function, message):
    """By what they return."""
    with pytest.raises(RegionError, match=message):
        iris_zo(arm, ball([0.0, 0.0]), DOMAIN, replace(FAST, parameterization=function))


def test_parameterizations_are_for_one_region_alone(arm):
    """Where seeds are configurations they are refused."""
    options = replace(FAST, parameterization=lambda s: s)
    with pytest.raises(RegionError, match="region_around: options have a parameterization"):
        region_around(arm, [0.0, 0.0], DOMAIN, options)
    with pytest.raises(RegionError, match="IrisFromCliqueCoverOptions: options have"):
        IrisFromCliqueCoverOptions(iris_options=options)
    with pytest.raises(RegionError, match="domain must be an HPolyhedron, not None"):
        iris_zo(arm, ball([0.0, 0.0]), None, options)


def test_gradients_go_through_the_function(arm):
    """One number moves both joints: the region ends where the first of them is not free."""
    line = HPolyhedron.make_box([-1.4], [1.4])
    options = IrisNpOptions(parameterization=COUPLED, configuration_space_margin=1e-3)
    region = iris_in_configuration_space(arm, [0.0], options, domain=line)
    s = np.linspace(-1.4, 1.4, 28_001)[:, np.newaxis]
    free = arm.check_configs_collision_free(np.asarray(COUPLED(s)))
    right = s[14_000:][np.argmin(free[14_000:]), 0]
    left = s[14_000::-1][np.argmin(free[14_000::-1]), 0]
    assert -1.4 < left < 0.0 < right < 1.4
    found = np.sort(region.b / region.A[:, 0])
    np.testing.assert_allclose(found, [left, right], atol=2.5e-3)
    assert left <= found[0] and found[1] <= right


def test_tangents_of_half_angles(arm):
    """By the kinematics that are rational in them; derivatives equal differences."""
    kinematics = RationalForwardKinematics(arm.model.tree, [0.2, -0.1])
    s = np.array([[0.3, -0.8], [0.0, 1.5]])
    slopes, h = kinematics.compute_q_jacobian(s), 1e-6
    for k in range(2):
        ahead, behind = s.copy(), s.copy()
        ahead[:, k] += h
        behind[:, k] -= h
        change = kinematics.compute_q_value(ahead) - kinematics.compute_q_value(behind)
        np.testing.assert_allclose(slopes[:, :, k], change / (2.0 * h), atol=1e-9)
    function = IrisParameterizationFunction(
        kinematics.compute_q_value, kinematics.compute_q_jacobian
    )
    box = HPolyhedron.make_box([-2.0, -2.0], [2.0, 2.0])
    options = IrisNpOptions(parameterization=function, iteration_limit=2)
    region = iris_in_configuration_space(arm, [0.0, 0.0], options, domain=box)
    t = np.random.default_rng(1).uniform(-2.0, 2.0, size=(20_000, 2))
    chosen = t[region.point_in_set(t)]
    assert len(chosen) > 1000
    assert arm.check_configs_collision_free(kinematics.compute_q_value(chosen)).mean() > 0.995


def test_the_identity_changes_nothing(arm):
    """The same region, bit for bit."""
    same = IrisParameterizationFunction(lambda q: q, lambda q: np.tile(np.eye(2), (len(q), 1, 1)))
    plain = IrisNpOptions(iteration_limit=2)
    through = replace(plain, parameterization=same)
    one = iris_in_configuration_space(arm, [0.0, 0.0], plain, domain=DOMAIN)
    other = iris_in_configuration_space(arm, [0.0, 0.0], through, domain=DOMAIN)
    np.testing.assert_array_equal(one.A, other.A)
    np.testing.assert_array_equal(one.b, other.b)


def test_obstacles_are_those_of_configurations(arm):
    """Their nearest points lead to counter-examples: q = 2 s meets the box from 0.2 on."""
    twice = IrisParameterizationFunction(
        lambda s: 2.0 * s, lambda s: np.tile(2.0 * np.eye(2), (len(s), 1, 1)), dimension=2
    )
    wall = VPolytope.make_box([0.2, -3.0], [0.25, 3.0])
    box = HPolyhedron.make_box([-0.2, -0.2], [0.2, 0.2])
    options = IrisNpOptions(
        parameterization=twice, configuration_obstacles=[wall], configuration_space_margin=1e-3
    )
    region = iris_in_configuration_space(arm, [0.0, 0.0], options, domain=box)
    reach = region.support([1.0, 0.0]).value
    assert 0.09 < reach <= 0.1 and region.support([-1.0, 0.0]).value == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: IrisParameterizationFunction(3), "function must be a function, not 3"),
        (lambda: IrisParameterizationFunction(abs, 1.0), "jacobian must be a function, not 1.0"),
        (lambda: IrisParameterizationFunction(abs, dimension=0), "dimension must be a whole"),
        (lambda: IrisParameterizationFunction(abs, dimension=True), "dimension must be a whole"),
        (lambda: IrisNpOptions(parameterization=abs), "parameterization must have derivatives"),
        (lambda: IrisNpOptions(parameterization="no"), "parameterization must be a function"),
    ],
)
def test_what_is_no_parameterization_is_refused(make, message):
    """By name and value."""
    with pytest.raises(RegionError, match=message):
        make()


def test_wrong_derivatives_and_domains_are_refused(arm):
    """Derivatives of another shape, none that are finite, a domain of another dimension."""
    line = HPolyhedron.make_box([-1.4], [1.4])
    for slopes in (lambda s: s, lambda s: np.full((len(s), 2, 1), np.inf), lambda s: None):
        function = IrisParameterizationFunction(COUPLED.function, slopes)
        options = IrisNpOptions(parameterization=function)
        with pytest.raises(RegionError, match="the parameterization's jacobian must return"):
            iris_in_configuration_space(arm, [0.0], options, domain=line)
    options = IrisNpOptions(
        parameterization=IrisParameterizationFunction(
            COUPLED.function, COUPLED.jacobian, dimension=2
        )
    )
    with pytest.raises(RegionError, match="domain must be an HPolyhedron in 2 dimensions"):
        iris_in_configuration_space(arm, [0.0], options, domain=line)
    options = IrisNpOptions(parameterization=COUPLED)
    with pytest.raises(RegionError, match="domain must be an HPolyhedron, not None"):
        iris_in_configuration_space(arm, [0.0], options)


def test_a_parameterization_shows_what_it_has():
    """In one line."""
    shown = repr(IrisParameterizationFunction(abs))
    assert shown == "IrisParameterizationFunction(dimension=None, has_jacobian=False)"
    function = IrisParameterizationFunction(np.abs, np.sign, dimension=1)
    again = pickle.loads(pickle.dumps(function))
    assert again.dimension == 1 and again.has_jacobian


def test_a_function_that_writes_into_its_points_changes_no_others(arm):
    """It has a copy of them: the region is that of the function that does not."""
    regions = [
        iris_zo(arm, ball([0.0, 0.0]), DOMAIN, replace(FAST, parameterization=function))
        for function in (lambda s: 0.5 * s, lambda s: np.multiply(s, 0.5, out=s))
    ]
    np.testing.assert_array_equal(regions[0].A, regions[1].A)
    np.testing.assert_array_equal(regions[0].b, regions[1].b)
