from constructed_solids import random_solid, with_specks, written
import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.hull import convex_hull


def _rotation(rng):
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.diag(r))


def _grid(size=(1.0, 1.0, 1.0), n=5):
    """Return a block of n^3 points, most of them inside faces and edges."""
    axes = [np.linspace(-1.0, 1.0, n) * half for half in size]
    return np.array(np.meshgrid(*axes)).reshape(3, -1).T


def _climb(hull, direction):
    """Walk from vertex 0 to a neighbour further along ``direction`` until there is none."""
    vertex = 0
    for _ in range(len(hull.vertices)):
        around = hull.neighbors[vertex]
        if not len(around):
            return vertex
        best = around[np.argmax(hull.vertices[around] @ direction)]
        if hull.vertices[best] @ direction <= hull.vertices[vertex] @ direction:
            return vertex
        vertex = best
    raise AssertionError("the walk runs in circles")


def _assert_is_hull(hull, points):
    """Check vertices, planes, orientation, Euler's formula and support by hill climbing."""
    extent = np.ptp(points, axis=0).max() or 1.0
    for vertex in hull.vertices:
        assert (points == vertex).all(axis=1).any()
    assert (points @ hull.normals.T <= hull.offsets + 1e-12 * extent).all()
    assert np.allclose(np.linalg.norm(hull.normals, axis=1), 1.0, atol=1e-15)
    for face, normal, offset in zip(hull.faces, hull.normals, hull.offsets, strict=True):
        corners = hull.vertices[face]
        assert np.abs(corners @ normal - offset).max() <= 1e-12 * extent
        turns = np.cross(np.roll(corners, -1, 0) - corners, np.roll(corners, -2, 0) - corners)
        assert (turns @ normal > 0.0).all(), "corners run counter-clockwise, seen from outside"
    if hull.faces:
        edges = sum(map(len, hull.neighbors)) // 2
        assert len(hull.vertices) - edges + len(hull.faces) == 2
    for direction in np.random.default_rng(0).normal(size=(50, 3)):
        direction /= np.linalg.norm(direction)
        reached = hull.vertices[_climb(hull, direction)] @ direction
        assert reached >= (points @ direction).max() - 1e-12 * extent


def test_block_of_points_has_six_square_faces():
    """Coplanar triangles become one polygon and points inside faces and edges vanish."""
    hull = convex_hull(_grid())
    assert len(hull.vertices) == 8
    assert sorted(len(face) for face in hull.faces) == [4] * 6
    assert sorted(map(len, hull.neighbors)) == [3] * 8
    assert sorted(hull.offsets) == pytest.approx([1.0] * 6)


@pytest.mark.parametrize("seed", range(5))
def test_turned_and_moved_block_keeps_its_six_faces(seed):
    """Rounding of the coordinates does not split faces, also away from the origin."""
    rng = np.random.default_rng(seed)
    points = _grid((1.0, 1 / 3, 0.2)) @ _rotation(rng).T + rng.uniform(-10, 10, 3)
    hull = convex_hull(points)
    assert (len(hull.vertices), len(hull.faces)) == (8, 6)
    _assert_is_hull(hull, points)


@pytest.mark.parametrize("thickness", [1e-3, 1e-6, 1e-9, 1e-11])
def test_thin_plate_is_a_solid_with_the_same_corners(thickness):
    """A plate may be thin by eleven orders of magnitude and still has eight corners."""
    points = _grid((1.0, 1.0, thickness)) @ _rotation(np.random.default_rng(1)).T
    hull = convex_hull(points)
    assert len(hull.vertices) == 8
    _assert_is_hull(hull, points)


def test_coplanar_points_give_a_polygon_with_two_sides():
    """A flat set has two faces of opposite normals, on the same corners."""
    points = _grid((1.0, 1 / 3, 0.0)) @ _rotation(np.random.default_rng(2)).T
    hull = convex_hull(points)
    assert len(hull.vertices) == 4
    assert np.allclose(hull.normals[0], -hull.normals[1])
    assert all(len(around) == 2 for around in hull.neighbors)
    _assert_is_hull(hull, points)


def test_collinear_points_give_a_segment():
    """Points on a line have two ends, that are neighbours, and no face."""
    points = np.outer(np.linspace(-1.0, 2.0, 7), [1.0, 2.0, 1 / 3])
    hull = convex_hull(points)
    assert len(hull.vertices) == 2
    assert [list(around) for around in hull.neighbors] == [[1], [0]]
    assert not hull.faces
    _assert_is_hull(hull, points)


def test_coincident_points_give_a_point():
    """Copies of one point have no neighbours and no face."""
    hull = convex_hull(np.full((5, 3), 1 / 3))
    assert hull.vertices.tolist() == [[1 / 3] * 3]
    assert not hull.faces
    assert len(hull.neighbors[0]) == 0


@pytest.mark.parametrize("width", [1e-6, 1e-10, 1e-13])
def test_needle_supports_to_its_width(width):
    """A needle too thin for a solid hull still has its true ends."""
    points = _grid((1.0, width, width)) @ _rotation(np.random.default_rng(3)).T
    hull = convex_hull(points)
    for direction in np.random.default_rng(4).normal(size=(20, 3)):
        reached = (hull.vertices @ direction).max()
        assert reached >= (points @ direction).max() - 4 * width * np.linalg.norm(direction)


@pytest.mark.parametrize("n", [4, 50, 2000])
def test_points_on_a_ball_are_all_vertices(n):
    """Points on a sphere in general position give 2 n - 4 triangles (Euler)."""
    points = np.random.default_rng(n).normal(size=(n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    hull = convex_hull(points)
    assert (len(hull.vertices), len(hull.faces)) == (n, 2 * n - 4)
    _assert_is_hull(hull, points)


def test_prism_has_two_caps_and_one_face_per_side():
    """The caps of a 64-sided prism are polygons of 64 corners."""
    angle = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(64)])
    points = np.concatenate([ring + np.array([0, 0, z]) for z in (-1.0, 0.0, 1.0)])
    hull = convex_hull(points)
    assert sorted(len(face) for face in hull.faces) == [4] * 64 + [64] * 2
    _assert_is_hull(hull, points)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((3, 2)), [[0.0, 0.0, np.nan]]])
def test_what_is_no_set_of_points_is_refused(points):
    """An empty set, a plane's points and a NaN raise MeshError."""
    with pytest.raises(MeshError, match="convex hull"):
        convex_hull(np.array(points))


@pytest.mark.parametrize("seed", [651, 874, 2090])
def test_points_as_near_as_rounding_leave_a_hull_with_faces(seed):
    """Bodies of 1e-13 of the whole, and corners of needles: qhull gives up, or faces are none."""
    rng = np.random.default_rng(seed)
    solid = random_solid(rng)
    single = rng.random() < 0.3
    given, _ = with_specks(rng, solid)
    points, _ = written(rng, given, single=single)
    hull = convex_hull(points)
    size = np.ptp(points, axis=0).max()
    assert (points @ hull.normals.T - hull.offsets).max() <= 1e-12 * size
    # Each edge is of two faces, which run through it in opposite ways.
    sides = {(a, b) for f in hull.faces for a, b in zip(f, np.roll(f, -1), strict=True)}
    assert sides == {(b, a) for a, b in sides}
    assert len(hull.vertices) - len(sides) // 2 + len(hull.faces) == 2
