"""Normals of meshes measured by their triangles where something touches them off their hulls."""

from measuring import measure, pose
import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Convex, Mesh

X_WM = pose((0.2, -1 / 3, 0.4), (0.3, 0.7, -0.2))
SHAPES = ("mesh", "convex")


def _prism(outline, cap, half):
    """Return the closed mesh between y = -half and half over an outline in x and z."""
    outline, count = np.asarray(outline, float), len(outline)
    front = np.c_[outline[:, 0], np.full(count, -half), outline[:, 1]]
    back = front + np.array([0.0, 2.0 * half, 0.0])
    faces = [*cap, *[(c + count, b + count, a + count) for a, b, c in cap]]
    sides = [(k, (k + 1) % count) for k in range(count)]
    faces += [t for a, b in sides for t in ((b, a, a + count), (b, a + count, b + count))]
    return Mesh(vertices=np.r_[front, back], faces=np.array(faces))


def _channel():
    """Return a channel along y whose floor has a ridge, up to (0, y, 1), between its walls."""
    outline = [
        (-2, 0),
        (2, 0),
        (2, 2),
        (1, 2),
        (1, 0.25),
        (0, 1),
        (-1, 0.25),
        (-1, 2),
        (-2, 2),
    ]
    cap = [(0, 1, 4), (0, 4, 6), (6, 4, 5), (0, 6, 7), (0, 7, 8), (1, 2, 3), (1, 3, 4)]
    return _prism(outline, cap, 2.0)


def _wedge(kind, size):
    """Return a wedge on its sharp edge, which runs along y through its origin."""
    mesh = _prism(size * np.array([(0, 0), (0.3, 1), (-0.3, 1)]), [(0, 1, 2)], 0.5 * size)
    return mesh if kind == "mesh" else Convex(vertices=mesh.vertices)


def _spike(kind, size):
    """Return a tetrahedron that stands on a corner, at its origin."""
    points = size * np.array([(0, 0, 0), (0.2, 0, 1), (-0.1, 0.2, 1), (-0.1, -0.2, 1)])
    if kind == "convex":
        return Convex(vertices=points)
    return Mesh(vertices=points, faces=np.array([(0, 2, 1), (0, 3, 2), (0, 1, 3), (1, 2, 3)]))


def _on_the_ridge(shape, kind, gap, roll, x=0.0):
    X_MS = pose((x, 0.1, 1.0 + gap), (0.0, 0.0, roll))
    return measure(_channel(), shape, X_WM, X_WM @ X_MS, triangles=(True, kind == "mesh"))


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("gap", [1e-3, 1e-8, 1e-12, 0.0])
@pytest.mark.parametrize(("size", "roll"), [(0.5, 0.7), (0.5, 1.2), (0.5, np.pi / 2), (1e-6, 0.7)])
def test_edges_that_cross_over_a_ridge(kind, size, roll, gap):
    """Apart and touching, the normal of crossing edges is at a right angle to both."""
    pair = _on_the_ridge(_wedge(kind, size), kind, gap, roll)
    assert pair.distance == pytest.approx(gap, abs=4e-15)
    # The direction of a tiny wedge's edge is known to the rounding of places around it.
    np.testing.assert_allclose(pair.nhat_BA_W, -X_WM[:3, 2], atol=1e-14 if size > 1e-3 else 3e-9)
    rest = pair.p_WCa - pair.p_WCb - pair.distance * pair.nhat_BA_W
    assert np.abs(rest).max() <= 1e-15
    if gap == 0.0:
        assert pair.unique


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("gap", [1e-8, 1e-12, 0.0])
@pytest.mark.parametrize("size", [0.5, 1e-6])
def test_corner_on_a_ridge(kind, size, gap):
    """The normal of a corner on an edge is one that separates; touching, others are as good."""
    pair = _on_the_ridge(_spike(kind, size), kind, gap, 0.4)
    assert pair.distance == pytest.approx(gap, abs=4e-15)
    n_M = -X_WM[:3, :3].T @ pair.nhat_BA_W
    slope = np.array([0.6, 0.0, 0.8])  # outward normal of a side of the ridge
    assert abs(n_M[1]) <= 1e-12
    assert n_M[2] >= slope[2] - 1e-12  # between those of both sides
    n_S = pose((0, 0, 0), (0.0, 0.0, 0.4))[:3, :3].T @ n_M
    assert min(np.asarray(_spike("convex", 1.0).vertices) @ n_S) >= -1e-12
    if gap == 0.0:
        assert not pair.unique


@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("beside", [1e-13, 1e-12, 1e-11, 1e-9])
@pytest.mark.parametrize("height", [1e-6, 1e-4, 1e-2])
def test_corner_over_a_face_next_to_its_edge(kind, beside, height):
    """However near the edge, the normal over a face is the face's: to rounding, not its root."""
    normal, down = np.array([0.6, 0.0, 0.8]), np.array([0.8, 0.0, -0.6])
    p = np.array([0.0, 0.1, 1.0]) + beside * down + height * normal
    spike = _spike(kind, 0.3)
    X_MS = pose(p, (0.0, 0.0, 0.3))
    pair = measure(_channel(), spike, X_WM, X_WM @ X_MS, triangles=(True, kind == "mesh"))
    assert pair.distance == pytest.approx(height, abs=4e-15)
    np.testing.assert_allclose(pair.nhat_BA_W, -X_WM[:3, :3] @ normal, atol=3e-14)


@pytest.mark.parametrize("kind", SHAPES)
def test_touching_both_walls_of_a_groove(kind):
    """Where no direction separates from all that is touched, one of the touched faces has it."""
    box = Box(2.0, 0.5, 0.5)  # as wide as the channel
    shape = box
    if kind == "mesh":
        points = np.array(
            [(x, y, z) for x in (-1, 1) for y in (-0.25, 0.25) for z in (-0.25, 0.25)]
        )
        faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)]
        faces += [(2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]
        shape = Mesh(vertices=points, faces=np.array(faces))
    pair = measure(_channel(), shape, pose(), pose((0, 0, 1.6)), triangles=(True, kind == "mesh"))
    assert abs(pair.distance) <= 1e-14
    np.testing.assert_allclose(np.abs(pair.nhat_BA_W), (1, 0, 0), atol=1e-14)
