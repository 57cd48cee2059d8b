"""Parts that regions of configurations are made of: faces, walks, bounds of shares, options."""

from types import SimpleNamespace

import numpy as np
import pytest
from robot_scenes import CART, diagram

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid
from scene_graph_ros.planning import (
    iris_in_configuration_space,
    IrisFromCliqueCoverOptions,
    IrisNpOptions,
    IrisZoOptions,
    RegionError,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.planning.regions.faces import Cut, cut_between
from scene_graph_ros.planning.regions.hit_and_run import walked
from scene_graph_ros.planning.regions.outer_loop import Attempt, grow
from scene_graph_ros.planning.regions.region_record import share_bound

LOW, HIGH = np.array([-3.0, -2.8]), np.array([3.0, 2.8])
DOMAIN = HPolyhedron.make_box(LOW, HIGH)
FAST = IrisZoOptions(num_particles=300, epsilon=0.05, mixing_steps=20, max_iterations=2)


def test_a_smaller_region_does_not_take_the_place_of_a_larger_one():
    """Boxes of half widths 1, 2 and 0.5 in turn."""
    widths = iter([1.0, 2.0, 0.5])

    def attempt(B, center):
        box = HPolyhedron.make_box(*(center + np.outer([-1.0, 1.0], [next(widths)] * 2)))
        return Attempt(box, 10, 0, 0.1, 0.9, 1)

    feasibility = SimpleNamespace(free=lambda points: np.ones(len(points), bool))
    options = IrisZoOptions(termination_threshold=-1.0, relative_termination_threshold=-1.0)
    found = grow(feasibility, np.eye(2), np.zeros(2), np.zeros((0, 2)), options, 3, attempt)
    np.testing.assert_allclose(found.volumes, np.pi * np.array([1.0, 4.0, 0.25]), rtol=1e-5)
    assert found.region.point_in_set([1.9, 1.9]) and found.reason == "iterations"
    np.testing.assert_allclose(np.linalg.inv(found.ellipsoid.A), 2.0 * np.eye(2), atol=1e-4)


def test_faces_touch_the_grown_ellipsoid_and_keep_points():
    """A circle at the origin and a point at (2, 0): the face is x <= 2, less the margin."""
    cut = Cut(np.eye(2), np.zeros(2), np.zeros((0, 2)))
    normal, side = cut.face(np.array([2.0, 0.0]), 0.1)
    np.testing.assert_allclose(normal, [1.0, 0.0])
    assert side == pytest.approx(1.9)
    # The point to keep gives less room than the margin, or turns the face.
    normal, side = Cut(np.eye(2), np.zeros(2), np.array([[1.95, 0.0]])).face([2.0, 0.0], 0.1)
    assert side == pytest.approx(1.95) and side >= 1.95
    kept = np.array([[3.0, 1.0], [0.0, 0.0]])
    normal, side = Cut(np.eye(2), np.zeros(2), kept).face(np.array([2.0, 0.0]), 0.1)
    assert (kept @ normal <= side).all() and normal @ [2.0, 0.0] > side
    inside = np.array([[1.5, 0.5]])
    assert cut_between(Cut(np.eye(2), np.zeros(2), kept), inside, 0.1, -1)[2] is not None


def test_a_margin_leaves_the_centre_of_a_thin_ellipsoid_inside():
    """Unless what is not free is itself within the margin of it."""
    thin = Cut(np.diag([0.6, 1e-5]), np.zeros(2), np.zeros((0, 2)))
    q = np.array([0.6, 1e-4])
    (normal,), (side,), inside = cut_between(thin, q[np.newaxis], 0.01, -1)
    assert inside is None
    # (0, 1) nearly: the face is 1e-4 from the centre, and q is beyond it.
    assert 0.0 < side < normal @ q < 1.1e-4
    (normal,), (side,), _ = cut_between(thin, np.array([[0.005, 0.0]]), 0.01, -1)
    assert side == pytest.approx(0.005 - 0.01)


def test_regions_around_a_thin_ellipsoid_are_found(tmp_path):
    """Along a free edge between four boxes, for seeds whose margins cut the centre off before."""
    checker = SceneGraphCollisionChecker(diagram(tmp_path, CART))
    boxes = [([0.1, 0.5], [1, 1]), ([-1, -1], [-0.1, -0.5]), ([0.1, -1], [1, -0.5])]
    obstacles = [HPolyhedron.make_box(*each) for each in [*boxes, ([-1, 0.5], [-0.1, 1])]]
    half, center = np.array([-0.1, 0.6]), np.array([0.05, 0.15])
    along = half / np.linalg.norm(half)
    across = np.array([-along[1], along[0]])
    A = np.vstack([along / np.linalg.norm(half), across / 1e-3])
    for seed in (0, 7, 12, 15):
        options = IrisNpOptions(
            configuration_obstacles=obstacles,
            random_seed=seed,
            starting_ellipse=Hyperellipsoid(A, center),
        )
        region = iris_in_configuration_space(checker, [0.0, 0.0], options)
        assert region.point_in_set(center)
        assert not any(region.intersects_with(each) for each in obstacles)


def test_bounds_of_shares_are_those_of_clopper_and_pearson():
    """Without hits it is 1 - error^(1/n); the tail of the binomial at the bound is the error."""
    assert share_bound(100, 0, 0.05) == pytest.approx(1.0 - 0.05**0.01)
    bound = share_bound(20, 1, 0.05)
    tail = (1.0 - bound) ** 20 + 20 * bound * (1.0 - bound) ** 19
    assert tail == pytest.approx(0.05)
    assert share_bound(5, 5, 0.05) == 1.0


def test_walks_end_evenly_spread_in_a_thin_simplex():
    """Of x, y, z >= 0 with x / 1000 + y + z <= 1 a coordinate is Beta(1, 3): mean 1/4, sd 0.194.

    So the mean of 4001 is known to 0.003; the walks do not fill the lanes. They depend on nothing
    but the generator.
    """
    A = np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1e-3, 1.0, 1.0]])
    b, shape = np.array([0.0, 0.0, 0.0, 1.0]), np.diag([1e3, 1.0, 1.0])
    starts = np.tile([1.0, 1e-3, 1e-3], (4001, 1))
    ends = walked(A, b, starts, 50, shape, np.random.default_rng(3))
    assert ends.shape == (4001, 3) and (b[:, np.newaxis] + 1e-9 >= A @ ends.T).all()
    scaled = ends / [1e3, 1.0, 1.0]
    np.testing.assert_allclose(scaled.mean(axis=0), 0.25, atol=0.012)
    np.testing.assert_allclose(scaled.std(axis=0), np.sqrt(0.0375), atol=0.01)
    again = walked(A, b, starts, 50, shape, np.random.default_rng(3))
    np.testing.assert_array_equal(again, ends)
    with pytest.raises(RegionError, match="the domain is unbounded"):
        walked(A[:3], b[:3], starts, 1, shape, np.random.default_rng(3))


def test_walks_where_rows_are_nearly_nothing_or_there_is_nowhere_to_go():
    """A row of 1e-310 on which a walk begins ends no step; without dimensions all stay."""
    A = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1e-310, 1e-310]])
    b = np.array([1.0, 1.0, 1.0, 1.0, 0.0])
    ends = walked(A, b, np.zeros((100, 2)), 20, np.eye(2), np.random.default_rng(0))
    assert (np.abs(ends) <= 1.0 + 1e-12).all() and (ends.std(axis=0) > 0.3).all()
    none = np.zeros((0, 0))
    stay = walked(none, np.zeros(0), np.zeros((3, 0)), 5, none, np.random.default_rng(0))
    assert stay.shape == (3, 0)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        (IrisZoOptions, {"epsilon": 0.0}),
        (IrisZoOptions, {"delta": 1.0}),
        (IrisZoOptions, {"tau": np.nan}),
        (IrisZoOptions, {"num_particles": 0}),
        (IrisZoOptions, {"mixing_steps": 1.5}),
        (IrisZoOptions, {"max_separating_planes_per_iteration": 0}),
        (IrisZoOptions, {"configuration_space_margin": -1.0}),
        (IrisNpOptions, {"num_collision_infeasible_samples": 0}),
        (IrisFromCliqueCoverOptions, {"coverage_termination_threshold": 1.5}),
        (IrisFromCliqueCoverOptions, {"iris_options": 3}),
    ],
)
def test_options_that_make_no_sense_are_refused(kind, options):
    """By their names."""
    with pytest.raises(RegionError, match=f"{kind.__name__}: {next(iter(options))}"):
        kind(**options)
