"""Points against triangle meshes: closed ones have an inside, open ones have none."""

from hypothesis import given, settings
from hypothesis import strategies as st
from measuring import measure_point, measure_points, nearest_on_triangle, pose
import numpy as np
import pytest
from searching import times
import trimesh

from scene_graph_ros.geometry import Box, Mesh


def mesh_of(surface):
    """Return the Mesh of a trimesh surface."""
    return Mesh(vertices=np.array(surface.vertices), faces=np.array(surface.faces))


def l_shape():
    """Return a closed L: the cube [0, 2]^3 without the part where x > 1 and z > 1."""
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float)
    front = np.c_[outline[:, 0], np.zeros(6), outline[:, 1]]
    vertices = np.r_[front, front + np.array([0.0, 2.0, 0.0])]
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    sides = [(k, (k + 1) % 6) for k in range(6)]
    faces = [*cap, *[(c + 6, b + 6, a + 6) for a, b, c in cap]]
    faces += [t for a, b in sides for t in ((b, a, a + 6), (b, a + 6, b + 6))]
    return vertices, np.array(faces)


def test_box_mesh_is_the_box():
    """A box as triangles gives the box's answers, everywhere but in ties."""
    surface = trimesh.creation.box((1.0, 2 / 3, 4 / 7))
    rng = np.random.default_rng(5)
    points = rng.uniform(-1.0, 1.0, (300, 3))
    X_WG = pose((0.3, 0.2, -0.1), (0.5, 0.1, -0.3))
    triangles = measure_points(mesh_of(surface), points, X_WG)
    box = measure_points(Box(1.0, 2 / 3, 4 / 7), points, X_WG)
    for a, b in zip(triangles, box, strict=True):
        assert a.distance == pytest.approx(b.distance, abs=4e-15)
        np.testing.assert_allclose(a.p_GN, b.p_GN, atol=1e-14)
        np.testing.assert_allclose(a.grad_W, b.grad_W, atol=1e-13)
        assert a.unique and b.unique


@pytest.mark.search
@settings(max_examples=times(15), deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([1e-4, 1.0, 1e4]))
def test_hierarchy_against_all_triangles(seed, scale):
    """The hierarchy finds the nearest of all triangles of a bumpy closed surface."""
    rng = np.random.default_rng(seed)
    surface = trimesh.creation.icosphere(2, radius=1.0)
    vertices = scale * np.array(surface.vertices) * rng.uniform(0.6, 1.0, (162, 1))
    p = scale * rng.normal(size=3)
    answer = measure_point(Mesh(vertices=vertices, faces=np.array(surface.faces)), p)
    expected = min(
        np.linalg.norm(p - nearest_on_triangle(p, *vertices[face])) for face in surface.faces
    )
    assert abs(answer.distance) == pytest.approx(expected, abs=1e-14 * 4 * scale)


def test_icosphere_approaches_the_sphere():
    """A fine icosphere is inside the sphere, by less than its facets' height."""
    surface = trimesh.creation.icosphere(4, radius=1 / 3)
    corners = np.asarray(surface.vertices)[surface.faces]
    height = 1 / 3 - np.abs(np.linalg.norm(corners.mean(axis=1), axis=1)).min()
    rng = np.random.default_rng(2)
    points = rng.uniform(-0.6, 0.6, (200, 3))
    for p, answer in zip(points, measure_points(mesh_of(surface), points), strict=True):
        sphere = np.linalg.norm(p) - 1 / 3
        assert sphere - 1e-15 <= answer.distance <= sphere + height + 1e-15


@pytest.mark.parametrize(
    ("p", "distance", "p_GN", "grad", "unique"),
    [
        ((1.5, 1.0, 0.75), -0.25, (1.5, 1, 1), (0, 0, 1), True),
        ((1.25, 1.0, 1.5), 0.25, (1, 1, 1.5), (1, 0, 0), True),
        ((1.25, 1.0, 1.25), 0.25, None, None, False),
        ((0.7, 1.0, 0.6), -0.5, (1, 1, 1), (0.6, 0, 0.8), True),
        ((0.5, 1.0, 2.25), 0.25, (0.5, 1, 2), (0, 0, 1), True),
        ((2.3, 1.0, 1.4), 0.5, (2, 1, 1), (0.6, 0, 0.8), True),
        ((2.2, -0.3, -0.6), 0.7, (2, 0, 0), (2 / 7, -3 / 7, -6 / 7), True),
    ],
)
def test_l_shape(p, distance, p_GN, grad, unique):
    """Faces, convex and concave edges and corners of an L give the constructed answer."""
    vertices, faces = l_shape()
    answer = measure_point(Mesh(vertices=vertices, faces=faces), np.array(p))
    assert answer.distance == pytest.approx(distance, abs=1e-15)
    assert answer.unique is unique
    if p_GN is not None:
        np.testing.assert_allclose(answer.p_GN, p_GN, atol=1e-15)
        np.testing.assert_allclose(answer.grad_W, grad, atol=1e-14)


def test_on_the_surface_the_gradient_is_the_normal():
    """On a face the gradient is its normal; on an edge a mean of both, and a choice."""
    vertices, faces = l_shape()
    mesh = Mesh(vertices=vertices, faces=faces)
    on_face = measure_point(mesh, np.array([1.5, 0.9, 1.0]))
    assert on_face.distance == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(on_face.grad_W, (0, 0, 1), atol=1e-15)
    assert on_face.unique
    on_edge = measure_point(mesh, np.array([2.0, 0.9, 1.0]))
    assert on_edge.distance == pytest.approx(0.0, abs=1e-15)
    np.testing.assert_allclose(on_edge.grad_W, np.array([1, 0, 1]) / np.sqrt(2), atol=1e-15)
    assert not on_edge.unique


def test_open_mesh_is_unsigned():
    """An open surface has no inside: the distance is positive on both sides."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
    mesh = Mesh(vertices=vertices, faces=np.array([(0, 1, 2), (0, 2, 3)]))
    for z in (0.25, -0.25):
        answer = measure_point(mesh, np.array([0.5, 0.4, z]))
        assert answer.distance == 0.25
        np.testing.assert_array_equal(answer.grad_W, (0, 0, np.sign(z)))
        assert answer.unique
    beside = measure_point(mesh, np.array([1.3, 0.5, 0.4]))
    assert beside.distance == pytest.approx(0.5, abs=1e-15)


def test_inverted_closed_mesh_is_turned():
    """A closed mesh whose triangles all face inwards still has its inside inside."""
    vertices, faces = l_shape()
    answer = measure_point(Mesh(vertices=vertices, faces=faces[:, ::-1]), np.array([0.5, 1, 0.4]))
    assert answer.distance == pytest.approx(-0.4, abs=1e-15)


def test_threshold_keeps_the_inside():
    """A threshold drops what is further outside, and never what is inside."""
    vertices, faces = l_shape()
    mesh = Mesh(vertices=vertices, faces=faces)
    points = np.array([(0.5, 1.0, 0.5), (1.5, 1.0, 1.8), (5.0, 0.0, 0.0)])
    assert [a.distance for a in measure_points(mesh, points, threshold=0.1)] == [-0.5]
    assert [a.distance for a in measure_points(mesh, points, threshold=0.6)] == [-0.5, 0.5]


def _points_next_to_features(vertices, faces, rng, count):
    """Return points above and below faces near their borders, edges near their ends, vertices."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = []
    for k in range(count):
        t = rng.integers(len(faces))
        weights = 10.0 ** rng.uniform(-14.0, 0.0, 3)
        if k % 3:
            weights[rng.integers(3)] = 0.0
        if k % 3 == 2:
            weights = np.eye(3)[rng.integers(3)]
        at = np.any(np.isin(faces, faces[t][weights > 0.0]), axis=1)
        n = normals[t] if k % 3 == 0 else rng.dirichlet(np.full(at.sum(), 0.3)) @ normals[at]
        height = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-11.0, 0.0)
        points.append(weights / weights.sum() @ corners[t] + height * n / np.linalg.norm(n))
    return np.array(points)


@pytest.mark.search
def test_no_triangle_at_the_nearest_point_is_nearer_yet():
    """At a right angle to the gradient, however near, is a plane that no triangle there crosses.

    This is what makes a point the nearest; the gradient of a difference of two near points, or of
    an edge next to a face that is nearer by less than rounding, is off by 1e-9 to 1e-4.
    """
    rng = np.random.default_rng(8)
    surface = trimesh.creation.icosphere(1, radius=1.0)
    faces = np.array(surface.faces)
    vertices = np.array(surface.vertices) * rng.uniform(0.6, 1.0, (len(surface.vertices), 1))
    points = _points_next_to_features(vertices, faces, rng, times(300))
    centres = vertices[faces].mean(axis=1)
    radii = np.linalg.norm(vertices[faces] - centres[:, None], axis=2).max(axis=1)
    for answer in measure_points(Mesh(vertices=vertices, faces=faces), points):
        x, way = answer.p_GN, np.copysign(1.0, answer.distance) * answer.grad_W
        beside = [
            vertices[face] - x
            for face in faces[np.linalg.norm(centres - x, axis=1) <= radii + 1e-9]
            if np.linalg.norm(nearest_on_triangle(x, *vertices[face]) - x) <= 1e-14
        ]
        assert len(beside) > 0
        assert np.max(np.concatenate(beside) @ way) <= 1e-10


@pytest.mark.parametrize("seed", [10, 17, 26, 37])
def test_a_sheet_on_a_face_leaves_the_inside_as_it_is(seed):
    """Of triangles that are equally near, that of the solid tells the side."""
    rng = np.random.default_rng(seed)
    box = trimesh.creation.box((2.0, 2.0, 2.0))
    centres = rng.uniform(0.6, 1.0, (6, 1, 2))
    flat = (centres + rng.uniform(-0.8, 1.5, (6, 3, 2))).reshape(-1, 2)
    sheets = np.c_[flat, np.ones(18)]
    faces = np.r_[box.faces, 8 + np.arange(18).reshape(-1, 3)]
    mesh = Mesh(vertices=np.r_[box.vertices, sheets], faces=faces)
    depths = 10.0 ** rng.uniform(-9.0, -2.0, 500)
    points = np.c_[rng.uniform(-0.98, 0.98, (500, 2)), 1.0 - depths]
    for answer, depth in zip(measure_points(mesh, points), 1.0 - points[:, 2], strict=True):
        assert answer.distance == pytest.approx(-depth, abs=1e-15)
