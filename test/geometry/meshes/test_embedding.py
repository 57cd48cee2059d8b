"""Points in a volume mesh."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box
from scene_graph_ros.geometry.meshes.box_grid import grid_box
from scene_graph_ros.geometry.meshes.embedding import barycentric_coordinates, embed_points
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

MESH = grid_box(Box(0.4, 0.3, 0.2), 0.1)


def depth(mesh, t, x):
    """Return how far a point is inside the nearest face plane of a tetrahedron."""
    corners = mesh.vertices[mesh.tetrahedra[t]]
    heights = []
    for k in range(4):
        a, b, c = np.delete(corners, k, axis=0)
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n) * np.sign(n @ (corners[k] - a))
        heights.append(n @ (x - a))
    return min(heights)


def test_points_inside():
    """The weights are those of the one tetrahedron that holds the point."""
    rng = np.random.default_rng(1)
    expected = rng.integers(0, MESH.num_tetrahedra, 500)
    weights = rng.dirichlet(np.ones(4), 500)
    points = np.einsum("nk,nkj->nj", weights, MESH.vertices[MESH.tetrahedra[expected]])
    found, given = embed_points(MESH.vertices, MESH.tetrahedra, points)
    assert np.array_equal(found, expected)
    assert np.allclose(given, weights, rtol=0, atol=1e-13)


def test_vertices():
    """At a vertex of the mesh, it alone counts."""
    found, weights = embed_points(MESH.vertices, MESH.tetrahedra, MESH.vertices)
    heaviest = MESH.tetrahedra[found, weights.argmax(axis=1)]
    assert np.array_equal(heaviest, np.arange(MESH.num_vertices))
    assert np.allclose(weights.max(axis=1), 1.0, rtol=0, atol=1e-15)


def test_points_outside():
    """They go with the tetrahedron that they are least outside of, and are given back."""
    rng = np.random.default_rng(2)
    points = rng.normal(size=(50, 3))
    found, weights = embed_points(MESH.vertices, MESH.tetrahedra, points)
    corners = MESH.vertices[MESH.tetrahedra[found]]
    assert np.allclose(np.einsum("nk,nkj->nj", weights, corners), points, rtol=0, atol=1e-13)
    assert (weights.min(axis=1) < 0.0).any()
    for x, t in zip(points, found, strict=True):
        best = max(depth(MESH, k, x) for k in range(MESH.num_tetrahedra))
        assert depth(MESH, t, x) >= best - 1e-13


@pytest.mark.parametrize("thickness", [1.0, 1e-3, 1e-6, 1e-8])
def test_weights_give_the_point_back(thickness):
    """However flat the tetrahedron, the weights reproduce the point to rounding."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        a, b, c, d = rng.normal(size=(4, 3)) * [1.0, 1.0, thickness]
        w = rng.dirichlet(np.ones(4))
        x = w @ np.array([a, b, c, d])
        given = np.array(barycentric_coordinates(*(tuple(v.tolist()) for v in (x, a, b, c, d))))
        assert np.abs(given @ np.array([a, b, c, d]) - x).max() < 1e-14
        assert abs(given.sum() - 1.0) < 1e-15


def test_scale_and_place():
    """A mesh far away and of another size has the same tetrahedra for the same points."""
    rng = np.random.default_rng(4)
    points = rng.uniform(-0.5, 0.5, (50, 3)) * [0.4, 0.3, 0.2]
    found, weights = embed_points(MESH.vertices, MESH.tetrahedra, points)
    moved = VolumeMesh(1e3 * MESH.vertices + 1e4, MESH.tetrahedra)
    other, same = embed_points(moved.vertices, moved.tetrahedra, 1e3 * points + 1e4)
    assert np.array_equal(found, other)
    assert np.allclose(weights, same, rtol=0, atol=1e-9)
