"""How forces of contact surfaces change with the pose of a body: formulas and differences."""

import functools
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    add_compliant_hydroelastic_properties,
    add_compliant_hydroelastic_properties_for_half_space,
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    GeometryFrame,
    GeometryInstance,
    HalfSpace,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.hydroelastic.force_derivatives import (
    force_derivatives,
    normal_rates,
)
from scene_graph_ros.geometry.hydroelastic.rims import rim_derivatives

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
        elif isinstance(shape, HalfSpace):
            add_compliant_hydroelastic_properties_for_half_space(
                properties, slab_thickness=0.3, hydroelastic_modulus=1e6, margin=margin
            )
        else:
            add_compliant_hydroelastic_properties(
                properties, hydroelastic_modulus=1e6, resolution_hint=hint, margin=margin
            )
        instance.set_proximity_properties(properties)
        graph.register_geometry(source, frame, instance)
        frames.append(frame)
    context = graph.create_default_context()

    def surface(X_WM, X_WN, word="polygon"):
        context.set_frame_poses(source, dict(zip(frames, (X_WM, X_WN), strict=True)))
        (found,) = graph.query_object(context).compute_contact_surfaces(word)
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
    rates = normal_rates(normal, (grad, None))
    found = force_derivatives([(corners, pressures)], normal, (grad, None), rates, np.zeros(3))
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


def _l_shape(directory):
    """Return a mesh with one edge that is not convex: two bricks side by side, 0.8 m wide."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]) * 0.4 - 0.3
    corners = [(x, y, z) for z in (-0.3, 0.3) for x, y in outline]
    # The outline is a star about its corner 3, and each side is a rectangle.
    below = [(4, 1 + k, 1 + (k + 1) % 6) for k in (4, 5, 0, 1)]
    above = [(10, 7 + (k + 1) % 6, 7 + k) for k in (4, 5, 0, 1)]
    sides = []
    for k in range(6):
        a, b = 1 + k, 1 + (k + 1) % 6
        sides += [(a, b, b + 6), (a, b + 6, a + 6)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"f {a} {b} {c}" for a, b, c in ([(a, c, b) for a, b, c in below + above] + sides)]
    path = directory / "l_shape.obj"
    path.write_text("\n".join(lines))
    return Mesh(path)


# A pressure falls along faces where a body reaches past the middle of another: these are left out.
WITH_RIM = {
    "both compliant": (Ellipsoid(0.5, 0.4, 0.3), Box(0.9, 1.1, 0.7), (False, False), None),
    "both, with a margin": (Ellipsoid(0.5, 0.4, 0.3), Box(0.9, 1.1, 0.7), (False, False), 0.04),
    "M rigid": (Capsule(0.3, 0.5), Ellipsoid(0.5, 0.4, 0.3), (True, False), None),
    "N rigid": (Ellipsoid(0.5, 0.4, 0.3), Cylinder(0.3, 0.6), (False, True), None),
    "N rigid, M with a margin": (
        Ellipsoid(0.5, 0.4, 0.3),
        Box(0.5, 0.4, 0.6),
        (False, True),
        0.04,
    ),
    "M rigid, N a soft ground": (Capsule(0.3, 0.5), HalfSpace(), (True, False), None),
    "M soft, N a soft ground": (Ellipsoid(0.5, 0.4, 0.15), HalfSpace(), (False, False), None),
    "M rigid and not convex": ("L", Ellipsoid(0.5, 0.4, 0.3), (True, False), None),
}


@pytest.mark.parametrize("name", WITH_RIM)
def test_edges_with_pressure_move(name, tmp_path):
    """Deep ones, where faces are left out: differences of the force converge to the formula."""
    first, second, is_rigid, margin = WITH_RIM[name]
    first = _l_shape(tmp_path) if first == "L" else first
    surface = scene(first, second, (0.25, 0.3), is_rigid, margin)
    X_WM = pose([0.02, 0.33, 0.03], (0.5, 0.4, 0.2))
    X_WN = pose([0.02, 0.03, 0.05], (0.1, 0.2, 0.0))
    here = surface(X_WM, X_WN)
    found = here.force_and_moment_derivatives(P)
    size = np.abs(found).max()
    # The part without the rim is wrong by far: there are edges with pressure in each of these.
    polygons = [(here.vertices_W[face], here.pressure[face]) for face in here.faces]
    gradients = here.grad_pressure_M_W, here.grad_pressure_N_W
    rates = normal_rates(here.face_normals_W, gradients)
    inside = force_derivatives(polygons, here.face_normals_W, gradients, rates, P)
    assert np.abs(found - inside).max() > 0.02 * size
    for step in (1e-5, 1e-6):
        wanted = differences(surface, X_WM, X_WN, step)
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-8 * size)
    divided = surface(X_WM, X_WN, "triangle")
    copy = pickle.loads(pickle.dumps(divided))  # of the table, and its first surface
    for other in (divided, copy):
        again = other.force_and_moment_derivatives(P)
        np.testing.assert_allclose(again, found, rtol=0.0, atol=1e-12 * size)


def _rows(planes, offsets, faces):
    return planes[faces], offsets[faces]


def test_an_edge_on_a_slope_is_known_by_hand():
    """A unit square of N's under 2 Pa; a plane of M's, upright or at 45 degrees, ends it."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    normals, rates = np.array([[0.0, 0.0, 1.0]]), np.zeros((1, 3))
    for turn in (0.0, np.pi / 4):
        # The other sides have no pressure, so that only the one at x = 1 counts.
        polygons = [(corners, np.array([0.0, 2.0, 2.0, 0.0]))]
        planes, offsets = np.zeros((1, 2, 4, 3)), np.zeros((1, 2, 4))
        planes[0, 0, 2] = -np.cos(turn), 0.0, np.sin(turn)
        offsets[0, 0, 2] = np.cos(turn)
        # Sides at y = 0 and 1 have pressure at one end: they are N's, which is at rest.
        planes[0, 1, :2], offsets[0, 1, :2] = [[0, 1, 0], [0, -1, 0]], [0, 1]
        found = rim_derivatives(
            polygons, normals, rates, functools.partial(_rows, planes, offsets), 1e-12, np.zeros(3)
        )
        # Along x by 1 m the square grows by 1 m^2 under 2 Pa; its moment is that of (1, 1/2, 0).
        np.testing.assert_allclose(found[:, 3], [1.0, -2.0, 0.0, 0.0, 0.0, 2.0], atol=1e-14)
        # Lifted, the slope m . x = const meets z = 0 at x = 1 - tan.
        np.testing.assert_allclose(found[:, 5], -np.tan(turn) * found[:, 3], atol=1e-14)
        # Turned about z, the point (1, y) moves along x by -y: 2 y and 2 y^2 over the edge.
        np.testing.assert_allclose(found[:, 2], [-2 / 3, 1.0, 0.0, 0.0, 0.0, -1.0], atol=1e-14)
        np.testing.assert_array_equal(found[:, 4], 0.0)


def test_a_rim_is_found_only_where_a_face_is_alone():
    """Two squares side by side have no rim between them, nor where there is no pressure."""
    left = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    right = left + np.array([1.0, 0.0, 1e-13])
    normals, rates = np.array([[0.0, 0.0, 1.0]] * 2), np.array([[0.0, 0.0, 1.0]] * 2)

    def not_asked(faces):
        raise AssertionError(faces)

    sloped = [(left, np.array([0.0, 2.0, 2.0, 0.0])), (right, np.array([2.0, 0.0, 0.0, 2.0]))]
    flat = [(corners, np.where((corners[:, 0] == 1.0), 2.0, -2.0)) for corners in (left, right)]
    with pytest.raises(AssertionError, match=r"\[0 0 1 1\]"):
        rim_derivatives(sloped, normals, rates, not_asked, 1e-12, np.zeros(3))
    with pytest.raises(AssertionError, match=r"\[0 0 0 1 1 1\]"):
        rim_derivatives(flat, normals, rates, not_asked, 1e-15, np.zeros(3))
