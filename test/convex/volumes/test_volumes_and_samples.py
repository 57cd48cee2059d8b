"""Volumes between bounds, and many samples at once, of bodies whose truth is known."""

import math

import numpy as np
import pytest

from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.convex.volumes.effective_sample_size import (
    effective_sample_size,
)
from scene_graph_ros.convex.volumes.volume_interval import (
    _furthest,
    _Points,
    _rounds,
    bernstein_interval,
    clopper_pearson_interval,
)
from scene_graph_ros.geometry.optimization import (
    ConvexSetError,
    HPolyhedron,
    Hyperellipsoid,
    Hyperrectangle,
    Intersection,
    Point,
    VPolytope,
)


def stretched(n, seed):
    """Return a map and a shift that stretch by up to 1000."""
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    return turn * 10.0 ** rng.uniform(-1.5, 1.5, size=n), rng.normal(size=n)


def image(rows, sides, map_, shift):
    """Return the polyhedron of all ``map_ y + shift``."""
    A = rows @ np.linalg.inv(map_)
    return HPolyhedron(A, sides + A @ shift)


def bodies(n):
    """Return a cube, a simplex and a cross-polytope with their volumes."""
    cross = HPolyhedron.make_l1_ball(n)
    return [
        (np.vstack([np.eye(n), -np.eye(n)]), np.ones(2 * n), 2.0**n),
        (np.vstack([-np.eye(n), np.ones(n)]), np.append(np.zeros(n), 1.0), 1 / math.factorial(n)),
        (cross.A, cross.b, 2.0**n / math.factorial(n)),
    ]


@pytest.mark.parametrize("n", [5, 6, 7])
def test_volumes_beyond_four_dimensions(n):
    """Stretched and moved; as narrow as a million rays prove."""
    for k, (rows, sides, volume) in enumerate(bodies(n)):
        map_, shift = stretched(n, 10 * n + k)
        truth = volume * abs(np.linalg.det(map_))
        body = image(rows, sides, map_, shift)
        assert not body.has_exact_volume
        generator = np.random.default_rng(k)
        found = body.calc_volume_interval(generator, 0.02, max_num_samples=64_000)
        assert found.lower <= truth <= found.upper
        assert found.volume == pytest.approx(truth, rel=0.05)
        assert found.confidence == 0.95
        assert found.upper - found.lower < (0.5 if k == 0 else 6.0) * truth


def test_the_interval_holds_as_often_as_it_says():
    """Of forty of a lens of two discs by points of its box, five may miss where two should."""
    lens = Intersection(
        Hyperellipsoid.make_hypersphere(1.0, [0.0, 0.0]),
        Hyperellipsoid.make_hypersphere(1.0, [1.0, 0.0]),
    )
    truth = 2.0 * math.pi / 3.0 - math.sqrt(3.0) / 2.0
    missed, bounds = 0, bounds_of(lens)
    assert lens.calc_volume_interval(np.random.default_rng(1), 0.1).lower < truth
    for seed in range(40):
        source = _Points(lens, bounds)
        found = _rounds(source, np.random.default_rng(seed), 0.1, 0.95, 4000)
        missed += not found.lower <= truth <= found.upper
        assert found.num_samples == 4000
        assert (found.upper - found.lower) / truth < 0.2
    assert missed <= 5


def test_exact_volumes_have_no_chance_in_them():
    """Boxes, hulls, points; nothing has the volume 0."""
    rng = np.random.default_rng(0)
    for each, truth in (
        (Hyperrectangle(np.zeros(6), np.full(6, 2.0)), 64.0),
        (VPolytope.make_unit_box(3), 8.0),
        (Point(np.zeros(7)), 0.0),
        (HPolyhedron.make_box(np.ones(5), np.zeros(5)), 0.0),
    ):
        found = each.calc_volume_interval(rng)
        assert (found.confidence, found.num_samples) == (1.0, 0)
        assert found.lower <= truth <= found.upper
        assert found.upper - found.lower <= 1e-11 * truth


@pytest.mark.parametrize("n", [2, 5, 8])
def test_no_corner_is_further_than_the_bound(n):
    """Of a cube the root of n, of a simplex about its ball of radius 1 n."""
    cube = HPolyhedron.make_unit_box(n)
    assert _furthest(cube) == pytest.approx(math.sqrt(n), rel=1e-6)
    corners = np.vstack([np.eye(n), np.full(n, (1.0 - math.sqrt(n + 1.0)) / n)])
    corners = corners - corners.mean(axis=0)
    corners *= n / np.linalg.norm(corners[0])
    simplex = HPolyhedron(-corners / n, np.ones(n + 1))
    assert _furthest(simplex) == pytest.approx(n, rel=1e-5)
    assert _furthest(simplex) >= n * (1.0 - 1e-12)


def test_intervals_by_their_formulas():
    """Clopper and Pearson by hand where nothing or all hit; Bernstein's terms one by one."""
    low, high = clopper_pearson_interval(0, 10, 0.05)
    assert (low, high) == (0.0, pytest.approx(1.0 - 0.025**0.1))
    low, high = clopper_pearson_interval(10, 10, 0.05)
    assert (low, high) == (pytest.approx(0.025**0.1), 1.0)
    log = math.log(4.0 / 0.01)
    assert bernstein_interval(2.0, 0.0, 100, 0.01) == pytest.approx(math.sqrt(0.04 * log))
    assert bernstein_interval(0.0, 3.0, 101, 0.01) == pytest.approx(0.07 * log)


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_effective_samples_of_known_chains(correlation):
    """Of ``x' = r x + noise`` they are ``(1 - r) / (1 + r)`` of all."""
    rng = np.random.default_rng(7)
    chains = np.empty((16, 2000, 1))
    state = rng.normal(size=(16, 1))
    for k in range(2000):
        state = correlation * state + math.sqrt(1.0 - correlation**2) * rng.normal(size=(16, 1))
        chains[:, k] = state
    truth = 32_000 * (1.0 - correlation) / (1.0 + correlation)
    assert effective_sample_size(chains) == pytest.approx(truth, rel=0.15)
    # Chains that stay apart are worth little more than their number.
    apart = chains + 10.0 * np.arange(16)[:, None, None]
    assert effective_sample_size(apart) < 100
    assert math.isnan(effective_sample_size(chains[:, :3]))


@pytest.mark.parametrize("n", [2, 5])
def test_samples_are_uniform(n):
    """Of a cube and a simplex, thin by 1000, far away: means, variances, no few corners alone."""
    for k, (rows, sides, _) in enumerate(bodies(n)[:2]):
        map_, shift = stretched(n, k)
        body = image(rows, sides, map_, shift)
        found = body.uniform_samples(np.random.default_rng(k), 4000)
        assert found.points.shape == (4000, n)
        # Of 24 seeds the simplex in five dimensions has 1622 to 2095; rounding is like a seed.
        assert found.effective_sample_size > 1000
        assert body.point_in_set(found.points, 1e-12).all()
        local = np.linalg.solve(map_, (found.points - shift).T).T
        # Uniform on a cube, or the Dirichlet distribution of n + 1 ones.
        mean, variance = (0.0, 1.0 / 3.0) if k == 0 else (1 / (n + 1), n / (n + 1) ** 2 / (n + 2))
        error = math.sqrt(variance / found.effective_sample_size)
        assert np.abs(local.mean(axis=0) - mean).max() < 5.0 * error
        np.testing.assert_allclose(local.var(axis=0), variance, rtol=0.2)


def refused():
    """Name what is refused, with its message."""
    box, rng = HPolyhedron.make_unit_box(5), np.random.default_rng(0)
    ray = HPolyhedron([[1.0, 0.0]], [0.0])
    return [
        (lambda: HPolyhedron().calc_volume_interval(rng), "no volume in 0 dimensions"),
        (lambda: box.calc_volume_interval(rng, -1.0), "desired_rel_accuracy must be"),
        (lambda: box.calc_volume_interval(rng, 0.1, 1.0), "confidence must be between 0 and 1"),
        (lambda: box.calc_volume_interval(rng, max_num_samples=0), "at least 1, not 0"),
        (lambda: Intersection([ray]).calc_volume_interval(rng), "is unbounded; intersect"),
        (lambda: ray.uniform_samples(rng, 3), "must be bounded"),
        (lambda: box.uniform_samples(rng, 0), "num_samples must be a whole number, at least 1"),
        (lambda: box.uniform_samples(rng, 2.5), "not 2.5"),
        (lambda: box.uniform_samples(rng, 2, num_chains=0), "num_chains must be"),
        (lambda: box.uniform_samples(rng, 2, mixing_steps=0), "mixing_steps must be"),
    ]


def test_bad_arguments_are_named():
    """With their values."""
    for ask, message in refused():
        with pytest.raises(ConvexSetError, match=message):
            ask()
    assert HPolyhedron().uniform_samples(np.random.default_rng(0), 2).points.shape == (2, 0)
