"""Depths against 50 digits, against point queries, and under motions that change nothing."""

from camera_scenes import (
    CLIPPING,
    depth_camera,
    instance,
    LENS,
    pose,
    random_shapes,
    rays,
    scene_of,
    seen,
    SHAPES,
    WORLD,
)
import mpmath as mp
import numpy as np
import pytest

from benchmarks.cameras.truths import true_depth
from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Sphere,
)
from scene_graph_ros.geometry.perception import CameraIntrinsics, ClippingRange, RenderLabel

PRECISION = 1e-12
PIXELS = 12
"""Of each image are computed in 50 digits."""


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("inside", [False, True])
def test_depths_in_50_digits(name, inside):
    """Every hit's depth is that of the shape's equation, from outside and from within."""
    shape = SHAPES[name]
    rng = np.random.default_rng(5)
    compared = 0
    for seed in range(4):
        X_WG = pose(10 + seed, rng.uniform(-1.0, 1.0, 3))
        X_WC = pose(20 + seed)
        ahead = 0.0 if inside else rng.uniform(0.3, 0.8)
        X_WC[:3, 3] = X_WG[:3, 3] - ahead * X_WC[:3, 2] - 0.01 * X_WG[:3, 2]
        depth, _ = seen(scene_of([instance(shape, X_WG, "body")]), X_WC)
        hits = np.argwhere(np.isfinite(depth))
        assert isinstance(shape, HalfSpace) or len(hits) >= PIXELS
        chosen = rng.permutation(len(hits))[:PIXELS]
        for v, u in hits[chosen].tolist():
            truth = true_depth(shape, X_WG, X_WC, LENS, (u, v), CLIPPING)
            assert truth is not None
            error = abs(float(mp.mpf(depth[v, u]) - truth))
            assert error <= PRECISION * max(0.2, float(truth)), (u, v, seed)
            compared += 1
    assert compared >= 2 * PIXELS


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e4])
def test_a_pixel_projected_back_is_on_the_surface(name, scale):
    """The point query says so of the geometry that the label names, also at the silhouette."""
    shape, rng = _scaled(SHAPES[name], scale), np.random.default_rng(7)
    X_WG, X_WC = pose(3, scale * rng.uniform(-1.0, 1.0, 3)), pose(4)
    X_WC[:3, 3] = X_WG[:3, 3] - 0.5 * scale * X_WC[:3, 2] - 0.01 * scale * X_WG[:3, 2]
    query = scene_of([instance(shape, X_WG, "body")])
    clipping = ClippingRange(CLIPPING.near * scale, 4.0 * scale)
    depth, _ = seen(query, X_WC, clipping=clipping)
    is_hit = np.isfinite(depth)
    assert is_hit.sum() > 50
    p_C = rays()[is_hit] * depth[is_hit, None]
    found = query.compute_signed_distance_to_points(p_C @ X_WC[:3, :3].T + X_WC[:3, 3])
    size = np.maximum(0.2 * scale, np.linalg.norm(p_C, axis=1))
    assert len(found) == is_hit.sum()
    assert (np.abs(found.distance) <= PRECISION * size).all()


def _scaled(shape, scale):
    match shape:
        case Sphere():
            return Sphere(scale * shape.radius)
        case Capsule() | Cylinder():
            return type(shape)(scale * shape.radius, scale * shape.length)
        case Box():
            return Box(*(scale * shape.size))
        case Ellipsoid():
            return Ellipsoid(scale * shape.a, scale * shape.b, scale * shape.c)
        case HalfSpace():
            return shape
    return shape.with_scale(scale)


def _exact_poses(count, seed):
    """Return poses whose positions have few digits, so that they can be moved without rounding."""
    rng = np.random.default_rng(seed)
    grid = np.round(rng.uniform(-0.4, 0.4, (count, 3)) * 2**20) / 2**20
    return [pose(40 + k, p + np.array([0.0, 0.0, 1.0])) for k, p in enumerate(grid)]


def test_far_from_the_origin_nothing_changes():
    """A thousand kilometres away, the same bits: positions are subtracted before all else."""
    shift = 2.0**20 * np.array([1.0, -1.0, 0.5])
    images = []
    for offset in (np.zeros(3), shift):
        bodies = []
        for (name, shape), X_WG in zip(SHAPES.items(), _exact_poses(8, 2), strict=True):
            X = X_WG.copy()
            X[:3, 3] += offset
            bodies.append(instance(shape, X, name))
        images.append(seen(scene_of(bodies), pose(p=offset)))
    np.testing.assert_array_equal(images[0][0], images[1][0])
    np.testing.assert_array_equal(images[0][1], images[1][1])


@pytest.mark.parametrize("power", [-13, 13])
def test_size_does_not_matter(power):
    """A scene 8192 times smaller or larger has the same image, its depths scaled exactly."""
    factor, images = 2.0**power, []
    for scale in (1.0, factor):
        bodies = []
        for (name, shape), X_WG in zip(SHAPES.items(), _exact_poses(8, 2), strict=True):
            X = X_WG.copy()
            X[:3, 3] *= scale
            bodies.append(instance(_scaled(shape, scale), X, name))
        clipping = ClippingRange(CLIPPING.near * scale, CLIPPING.far * scale)
        images.append(seen(scene_of(bodies), clipping=clipping))
    np.testing.assert_array_equal(images[0][1], images[1][1])
    np.testing.assert_array_equal(images[0][0] * factor, images[1][0])


def test_order_of_registration_has_no_effect():
    """The same instances registered in another order: the same bytes, overlaps included."""
    bodies = random_shapes(30, 4, reach=0.15)
    orders = [np.arange(30), np.arange(30)[::-1], np.random.default_rng(1).permutation(30)]
    images = [
        scene_of([bodies[k] for k in order]).render_images(depth_camera(), WORLD, np.eye(4))
        for order in orders
    ]
    assert len(np.unique(images[0].label)) > 5
    for other in images[1:]:
        for one, two in zip(images[0], other, strict=True):
            assert one.tobytes() == two.tobytes()


@pytest.mark.parametrize("seed", range(5))
def test_labels_are_empty_where_depth_is_infinite(seed):
    """There and nowhere else, for a depth range as wide as the clipping."""
    clipping = ClippingRange(0.9, 1.3)
    bodies = [*random_shapes(30, seed), instance(HalfSpace(), pose(seed, (0, 0.2, 1)), "floor")]
    images = scene_of(bodies).render_images(depth_camera(clipping=clipping), WORLD, np.eye(4))
    is_empty = images.label == RenderLabel.EMPTY
    np.testing.assert_array_equal(is_empty, np.isinf(images.depth))
    assert 0 < is_empty.sum() < is_empty.size
    assert (images.depth > 0.0).all()


@pytest.mark.parametrize("name", SHAPES)
def test_every_ray_that_meets_a_shape_sees_it(name):
    """No pixel of a silhouette is lost to bounds: all pixels against the closed form."""
    shape, X_WG, X_WC = SHAPES[name], pose(8, (0.05, -0.04, 0.4)), np.eye(4)
    lens = CameraIntrinsics(24, 18, 21.0, 19.0, 11.2, 8.7)
    depth, _ = seen(scene_of([instance(shape, X_WG, "body")]), X_WC, lens)
    for v in range(0, 18, 2):
        for u in range(24):
            truth = true_depth(shape, X_WG, X_WC, lens, (u, v), CLIPPING)
            is_hit = truth is not None and truth <= CLIPPING.far
            assert np.isfinite(depth[v, u]) == is_hit, (u, v)


def test_float32_is_the_depth_rounded_to_nearest():
    """Images have the nearest of all numbers they could have."""
    query = scene_of(random_shapes(20, 6))
    image = query.render_depth_image(depth_camera(), WORLD, np.eye(4))
    assert image.dtype == np.float32
    np.testing.assert_array_equal(image, seen(query)[0].astype(np.float32))


def test_an_off_centre_ball_tells_half_a_pixel():
    """The ray of pixel (u, v) goes through its centre: half a pixel off, depths are off by far."""
    p_WG, radius = np.array([0.25, -0.2, 1.0]), 0.1
    lens = CameraIntrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
    depth, _ = seen(scene_of([instance(Sphere(radius), pose(p=p_WG), "ball")]), lens=lens)
    errors = {}
    for shift in (0.0, 0.5):
        d = rays(lens) + shift / 60.0 * np.array([1.0, 1.0, 0.0])
        square, along = np.einsum("vui,vui->vu", d, d), d @ p_WG
        room = along**2 - square * (p_WG @ p_WG - radius**2)
        with np.errstate(invalid="ignore"):
            expected = (along - np.sqrt(room)) / square
        both = np.isfinite(depth) & np.isfinite(expected)
        errors[shift] = np.median(np.abs(depth - expected)[both])
    assert errors[0.0] < 1e-14
    assert errors[0.5] > 1e-3
