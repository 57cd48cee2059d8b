"""Points against spheres, capsules, boxes, cylinders and half spaces: answers by construction."""

from measuring import measure_point, measure_points, pose
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Capsule, Cylinder, HalfSpace, Sphere

R = 1 / 3
H = 2 / 7

SCALES = (1e-4, 1.0, 1e4)


def expect(answer, distance, p_GN, grad, *, unique=True, scale=1.0):
    """Check every field of an answer."""
    assert answer.distance == pytest.approx(distance, rel=0, abs=1e-15 * scale)
    np.testing.assert_allclose(answer.p_GN, p_GN, rtol=0, atol=1e-15 * scale)
    np.testing.assert_allclose(answer.grad_W, grad, rtol=0, atol=1e-15)
    assert answer.unique is unique


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("height", [-0.3, -1e-9, 0.0, 1e-9, 0.002, 5.0])
def test_sphere_along_a_ray(scale, height):
    """A point on a ray from the centre has its height above the sphere, inside and outside."""
    direction = np.array([2.0, -3.0, 6.0]) / 7.0
    radius = scale * R
    p = (radius + scale * height) * direction
    expect(
        measure_point(Sphere(radius), p),
        np.linalg.norm(p) - radius,
        radius * direction,
        direction,
        scale=4 * scale,
    )


def test_centre_of_a_sphere():
    """At the centre +x is chosen, and said to be a choice."""
    expect(measure_point(Sphere(R), np.zeros(3)), -R, (R, 0, 0), (1, 0, 0), unique=False)


@pytest.mark.parametrize(
    ("p", "distance", "p_GN", "grad", "unique"),
    [
        ((0.5, 0, H / 2), 0.5 - R, (R, 0, H / 2), (1, 0, 0), True),
        ((0, -0.1, -H / 4), 0.1 - R, (0, -R, -H / 4), (0, -1, 0), True),
        ((0, 0, 0.9), 0.9 - H - R, (0, 0, H + R), (0, 0, 1), True),
        ((0, 0, H + 0.1), 0.1 - R, (0, 0, H + R), (0, 0, 1), True),
        ((0.3, 0, -H - 0.4), 0.5 - R, (0.6 * R, 0, -H - 0.8 * R), (0.6, 0, -0.8), True),
        ((0, 0, H / 3), -R, (R, 0, H / 3), (1, 0, 0), False),
    ],
)
def test_capsule_by_region(p, distance, p_GN, grad, unique):
    """Side, caps and axis of a capsule each give the constructed answer."""
    expect(measure_point(Capsule(R, 2 * H), np.array(p)), distance, p_GN, grad, unique=unique)


@pytest.mark.parametrize(
    ("p", "distance", "p_GN", "grad", "unique"),
    [
        ((0.7, 0.1, 0.2), 0.7 - R, (R, 0.1, 0.2), (1, 0, 0), True),
        ((R + 0.3, -H - 0.4, 0.1), 0.5, (R, -H, 0.1), (0.6, -0.8, 0), True),
        ((R + 0.2, H + 0.3, -0.5 - 0.6), 0.7, (R, H, -0.5), (2 / 7, 3 / 7, -6 / 7), True),
        ((0.1, 0.25, -0.1), 0.25 - H, (0.1, H, -0.1), (0, 1, 0), True),
        ((0.0, 0.0, -0.4), -0.1, (0, 0, -0.5), (0, 0, -1), True),
        ((0.0, 0.0, 0.0), -H, (0, H, 0), (0, 1, 0), False),
        ((R, H, 0.1), 0.0, (R, H, 0.1), (0.5**0.5, 0.5**0.5, 0), False),
        ((-R, 0.1, 0.5), 0.0, (-R, 0.1, 0.5), (-(0.5**0.5), 0, 0.5**0.5), False),
        ((0.1, H, -0.5), 0.0, (0.1, H, -0.5), (0, 0.5**0.5, -(0.5**0.5)), False),
        ((-R, H, -0.5), 0.0, (-R, H, -0.5), (-(3**-0.5), 3**-0.5, -(3**-0.5)), False),
        ((R, 0.05, 0.1), 0.0, (R, 0.05, 0.1), (1, 0, 0), True),
    ],
)
def test_box_by_region(p, distance, p_GN, grad, unique):
    """Faces, edges, corners, the inside and the centre of a box give the constructed answer.

    On an edge or a corner the gradient is the mean direction of the faces' normals.
    """
    answer = measure_point(Box(2 * R, 2 * H, 1.0), np.array(p))
    expect(answer, distance, p_GN, grad, unique=unique)


@pytest.mark.parametrize(
    ("p", "distance", "p_GN", "grad", "unique"),
    [
        ((0.0, -0.7, 0.1), 0.7 - R, (0, -R, 0.1), (0, -1, 0), True),
        ((0.1, 0.05, 0.9), 0.9 - H, (0.1, 0.05, H), (0, 0, 1), True),
        ((R + 0.3, 0, -H - 0.4), 0.5, (R, 0, -H), (0.6, 0, -0.8), True),
        ((0.3, 0, 0.1), 0.3 - R, (R, 0, 0.1), (1, 0, 0), True),
        ((0.1, 0, -0.2), 0.2 - H, (0.1, 0, -H), (0, 0, -1), True),
        ((0, 0, 0), -H, (0, 0, H), (0, 0, 1), False),
        ((R, 0, H), 0.0, (R, 0, H), (0, 0, 1), False),
    ],
)
def test_cylinder_by_region(p, distance, p_GN, grad, unique):
    """Side, ends, rims, the inside and the centre of a cylinder give the constructed answer."""
    answer = measure_point(Cylinder(R, 2 * H), np.array(p))
    expect(answer, distance, p_GN, grad, unique=unique)


def test_long_cylinder_on_its_axis():
    """On the axis, far from the ends, +x is chosen, and said to be a choice."""
    answer = measure_point(Cylinder(0.1, 3.0), np.array([0.0, 0.0, 0.25]))
    expect(answer, -0.1, (0.1, 0, 0.25), (1, 0, 0), unique=False)


@pytest.mark.parametrize("z", [-1e4, -1e-9, 0.0, 2.0])
def test_half_space_is_its_height(z):
    """A half space's signed distance is the height above its plane."""
    expect(measure_point(HalfSpace(), np.array([3, -4, z])), z, (3, -4, 0), (0, 0, 1), scale=1e4)


@pytest.mark.parametrize(
    "shape",
    [Sphere(0.3), Capsule(0.2, 0.5), Box(0.3, 0.7, 0.5), Cylinder(0.2, 0.6), HalfSpace()],
    ids=lambda s: type(s).__name__,
)
def test_gradient_is_the_derivative(shape):
    """The gradient, in W, is the central difference of the distance over a moved point."""
    rng = np.random.default_rng(7)
    X_WG = pose((0.2, -0.4, 1 / 3), (0.4, 0.3, -0.8))
    step = 1e-5
    points = rng.uniform(-0.8, 0.8, (40, 3))
    answers = measure_points(shape, points, X_WG)
    moves = step * np.eye(3) @ X_WG[:3, :3]  # steps along W's axes, seen from G
    for p, answer in zip(points, answers, strict=True):
        around = [a.distance for a in measure_points(shape, np.r_[p + moves, p - moves], X_WG)]
        slope = (np.array(around[:3]) - around[3:]) / (2 * step)
        if abs(np.linalg.norm(slope) - 1.0) < 1e-6:  # no kink within the step
            np.testing.assert_allclose(answer.grad_W, slope, atol=1e-7)
    assert len(answers) == len(points)
