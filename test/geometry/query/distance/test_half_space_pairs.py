"""Every shape against a half space: its deepest point decides, and flat contact has a middle."""

from measuring import measure_both_ways, pose
import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Sphere,
)

CORNERS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
WEDGE = Convex(vertices=np.array([(0, 0, -0.3), (0.2, 0, 0.1), (-0.1, 0.2, 0.1), (-0.1, -0.2, 0)]))
BOX = trimesh.creation.box((0.2, 0.4, 0.6))
TILT = (0.0, np.arctan2(3.0, 4.0), 0.0)  # turns x to (0.8, 0, -0.6), and z to (0.6, 0, 0.8)

CASES = [
    (Sphere(0.25), (0.3, 0.1, -0.7), 0.25),
    (Capsule(0.1, 0.6), (0, 0, 0), 0.1 + 0.3),
    (Capsule(0.1, 0.6), (0, np.pi / 2, 0), 0.1),
    (Capsule(0.1, 0.6), TILT, 0.1 + 0.8 * 0.3),
    (Box(0.2, 0.4, 0.6), (0, 0, 0.7), 0.3),
    (Box(0.2, 0.4, 0.6), TILT, 0.6 * 0.1 + 0.8 * 0.3),
    (Cylinder(0.2, 0.6), (0, 0, 0), 0.3),
    (Cylinder(0.2, 0.6), (np.pi / 2, 0, 0), 0.2),
    (Cylinder(0.2, 0.6), TILT, 0.6 * 0.2 + 0.8 * 0.3),
    (Ellipsoid(0.2, 0.4, 0.6), (0, 0, 0), 0.6),
    (Ellipsoid(0.2, 0.4, 0.6), TILT, np.hypot(0.6 * 0.2, 0.8 * 0.6)),
    (WEDGE, (0, 0, 0), 0.3),
    (Convex(vertices=CORNERS * (0.1, 0.2, 0.3)), (0, 0, 0.7), 0.3),
    (
        Mesh(vertices=np.array(BOX.vertices), faces=np.array(BOX.faces)),
        TILT,
        0.6 * 0.1 + 0.8 * 0.3,
    ),
]


@pytest.mark.parametrize("height", [-0.2, -1e-9, 0.0, 0.002, 5.0])
@pytest.mark.parametrize(("shape", "turn", "reach"), CASES)
def test_reach_below_the_centre(shape, turn, reach, height):
    """A shape is above the plane by its centre's height minus its reach downwards."""
    X_WH = pose((0.2, 1 / 3, -0.6), (0.5, -0.2, 0.9))
    X_WS = X_WH @ pose((0.3, -0.4, reach + height), turn)
    pair = measure_both_ways(shape, HalfSpace(), X_WS, X_WH)
    assert pair.distance == pytest.approx(height, abs=2e-15 * (1 + abs(height)))
    np.testing.assert_allclose(pair.nhat_BA_W, X_WH[:3, 2], atol=1e-15)
    assert pair.unique
    on_plane = X_WH[:3, 2] @ (pair.p_WCb - X_WH[:3, 3])
    assert on_plane == pytest.approx(0.0, abs=4e-15 * (1 + abs(height)))


@pytest.mark.parametrize(
    "shape", [case[0] for case in CASES if case[1] in ((0, 0, 0), (0, 0, 0.7))]
)
def test_flat_contact_has_a_middle(shape):
    """A shape that stands on the plane touches it below its centre, at any turn about z."""
    X_WH = pose((0.2, 1 / 3, -0.6), (0.5, -0.2, 0.9))
    for angle in (0.0, 0.3, np.pi / 4, 2.0):
        X_WS = X_WH @ pose((0.3, -0.4, 0.7), (0, 0, angle))
        pair = measure_both_ways(shape, HalfSpace(), X_WS, X_WH)
        contact = X_WH[:3, :3].T @ (pair.p_WCb - X_WH[:3, 3])
        np.testing.assert_allclose(contact, (0.3, -0.4, 0.0), atol=1e-14)


def test_lying_capsule_touches_below_its_middle():
    """A capsule and a cylinder that lie on the plane touch it below their middle."""
    for shape in (Capsule(0.1, 0.6), Cylinder(0.1, 0.6)):
        for angle in (0.0, 0.4, 1.3):
            X = pose((0.3, -0.4, 0.05), (0, 0, angle)) @ pose((0, 0, 0), (0, np.pi / 2, 0))
            pair = measure_both_ways(shape, HalfSpace(), X, pose())
            assert pair.distance == pytest.approx(-0.05, abs=1e-15)
            np.testing.assert_allclose(pair.p_WCb, (0.3, -0.4, 0.0), atol=1e-14)


def test_plate_and_needle():
    """Aspects of 1:1e4 keep every digit."""
    for shape in (Box(1.0, 1.0, 1e-4), Cylinder(1.0, 1e-4), Ellipsoid(0.5, 0.5, 0.5e-4)):
        pair = measure_both_ways(shape, HalfSpace(), pose((0, 0, 0.5e-4 + 0.002)), pose())
        assert pair.distance == pytest.approx(0.002, abs=1e-15)
