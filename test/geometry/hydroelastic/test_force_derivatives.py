"""How forces of contact surfaces change with the pose of a body: formulas and differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_rigid_hydroelastic_properties,
    Box,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.hydroelastic.force_derivatives import force_derivatives

P = np.array([0.3, -0.2, 0.5])


def scene(first, second, hints=(0.05, 0.05), is_rigid=(False, False), margin=None):
    """Return the contact surface of two shapes as a function of both poses."""
    graph = SceneGraph()
    source = graph.register_source("s")
    frames = []
    for name, shape, hint, rigid in zip("ab", (first, second), hints, is_rigid, strict=True):
        frame = graph.register_frame(source, GeometryFrame(name))
        instance = GeometryInstance(np.eye(4), shape, name)
        properties = ProximityProperties()
        if rigid:
            add_rigid_hydroelastic_properties(properties, resolution_hint=hint)
        else:
            add_compliant_hydroelastic_properties(
                properties, hydroelastic_modulus=1e6, resolution_hint=hint, margin=margin
            )
        instance.set_proximity_properties(properties)
        graph.register_geometry(source, frame, instance)
        frames.append(frame)
    context = graph.create_default_context()

    def surface(X_WM, X_WN):
        context.set_frame_poses(source, dict(zip(frames, (X_WM, X_WN), strict=True)))
        (found,) = graph.query_object(context).compute_contact_surfaces("polygon")
        return found

    return surface


def pose(p, rpy=(0.0, 0.0, 0.0)):
    """Return a pose."""
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), p
    return X


def moved(X, twist, step):
    """Return a pose after a small motion with a twist [angular; linear] at P."""
    turn = Rotation.from_rotvec(step * twist[:3]).as_matrix()
    result = np.eye(4)
    result[:3, :3] = turn @ X[:3, :3]
    result[:3, 3] = turn @ (X[:3, 3] - P) + P + step * twist[3:]
    return result


def differences(surface, X_WM, X_WN, step=1e-4):
    """Return the same by differences of order four."""
    columns = []
    for twist in np.eye(6):
        total = np.zeros(6)
        for k, weight in ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12)):
            found = surface(moved(X_WM, twist, k * step), X_WN)
            force, moment = found.force_and_moment(P)
            total += weight / step * np.concatenate([moment, force])
        columns.append(total)
    return np.array(columns).T


CASES = {
    "both compliant": (Box(1.0, 1.2, 0.9), Box(2.0, 2.0, 1.0), (False, False), None),
    "M rigid": (Box(1.0, 1.2, 0.9), Box(2.0, 2.0, 1.0), (True, False), None),
    "N rigid": (Box(1.0, 1.2, 0.9), Box(2.0, 2.0, 1.0), (False, True), None),
    "a margin": (Box(1.0, 1.2, 0.9), Box(2.0, 2.0, 1.0), (True, False), 0.05),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_are_those_of_differences(name):
    """A box that stands with a corner in another one, by all six motions."""
    first, second, is_rigid, margin = CASES[name]
    surface = scene(first, second, is_rigid=is_rigid, margin=margin)
    X_WM, X_WN = pose([0.1, 0.05, 0.85], (0.5, 0.4, 0.2)), pose([0.0, 0.0, -0.2])
    found = surface(X_WM, X_WN).force_and_moment_derivatives(P)
    wanted = differences(surface, X_WM, X_WN)
    size = np.abs(wanted).max()
    assert size > 1e4
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-6 * size)


def test_a_ball_on_a_ball_is_pushed_away_from_it():
    """Both compliant and fine: moved nearer, the force grows; turned about itself, nothing."""
    surface = scene(Sphere(0.5), Sphere(0.5), (0.2, 0.2))
    X_WM, X_WN = pose([0.0, 0.0, 0.9]), pose([0.0, 0.0, 0.0])
    found = surface(X_WM, X_WN).force_and_moment_derivatives([0.0, 0.0, 0.9])
    wanted = differences(surface, X_WM, X_WN)
    assert found[5, 5] < 0.0
    at_P = surface(X_WM, X_WN).force_and_moment_derivatives(P)
    np.testing.assert_allclose(at_P, wanted, rtol=0.0, atol=1e-5 * np.abs(wanted).max())


def test_a_face_that_slides_over_a_slope_is_known_by_hand():
    """One rigid triangle in p = -x + 1 above x, moved along x: each point loses 1 Pa/m."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    pressures, normal = 1.0 - corners[:, 0], np.array([[0.0, 0.0, 1.0]])
    grad = np.array([[-1.0, 0.0, 0.0]])
    found = force_derivatives([(corners, pressures)], normal, (grad, None), np.zeros(3))
    # N is rigid: M's pressure moves along x by 1, and grows by 1 everywhere; the area is 1/2.
    np.testing.assert_allclose(found[3:, 3], [0.0, 0.0, 0.5])
    # Its moment: the integral of r x z, with the centroid (1/3, 1/3).
    np.testing.assert_allclose(found[:3, 3], [1 / 6, -1 / 6, 0.0])
    # Turned about z, a point moves by -y along x: the integral of -y is -1/6; that of y^2 is 1/12.
    np.testing.assert_allclose(found[3:, 2], [0.0, 0.0, -1 / 6])
    np.testing.assert_allclose(found[:3, 2], [-1 / 12, 1 / 24, 0.0])


def test_bad_points_are_refused():
    """As of forces."""
    surface = scene(Box(1, 1, 1), Box(1, 1, 1))
    found = surface(pose([0.0, 0.0, 0.8]), pose([0.0, 0.0, 0.0]))
    with pytest.raises(QueryArgumentError, match="p_WP must be three finite numbers"):
        found.force_and_moment_derivatives([0.0, np.nan, 0.0])
    for ask in (found.force_and_moment, found.force_and_moment_derivatives):
        for wrong in (["0", "1", "2"], [0.0, 1j, 0.0]):
            with pytest.raises(QueryArgumentError, match="p_WP must be three numbers"):
                ask(wrong)


@pytest.mark.parametrize("hint", [0.3, 0.1])
@pytest.mark.parametrize("is_rigid", [(False, True), (False, False)])
def test_derivatives_of_curved_bodies_are_those_of_differences(hint, is_rigid):
    """Of their meshes, coarse and finer; all faces are there, so the rim has no pressure."""
    surface = scene(Ellipsoid(0.5, 0.4, 0.3), Cylinder(0.6, 1.0), (hint, hint), is_rigid)
    X_WM, X_WN = pose([0.15, -0.1, 0.7], [0.2, 0.1, 0.3]), pose([0.0, 0.0, 0.0], [0.05, 0.1, 0.2])
    found = surface(X_WM, X_WN).force_and_moment_derivatives(P)
    expected = differences(surface, X_WM, X_WN)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())
