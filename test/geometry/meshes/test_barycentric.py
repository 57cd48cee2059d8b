"""Barycentric weights in triangles and tetrahedra: back to the point, and closed forms."""

import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.surface_mesh import SurfaceMesh
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

RNG = np.random.default_rng(3)


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_weights_lead_back_to_points(size, offset):
    """Of points in a triangle's plane, also beyond its edges, and in a tetrahedron."""
    corners = size * RNG.normal(size=(4, 3)) + offset
    if np.linalg.det(corners[1:] - corners[0]) < 0.0:
        corners = corners[[0, 2, 1, 3]]
    tolerance = 1e-9 if offset * 1e-16 > 1e-12 * size else 1e-13
    weights = RNG.dirichlet(np.ones(3), size=20) * 3.0 - 2.0 / 3.0
    surface = SurfaceMesh(corners[:3], [[0, 1, 2]])
    found = surface.calc_barycentric(weights @ corners[:3], 0)
    np.testing.assert_allclose(found, weights, atol=1e4 * tolerance)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, atol=1e4 * tolerance)
    weights = RNG.dirichlet(np.ones(4), size=20)
    volume = VolumeMesh(corners, [[0, 1, 2, 3]])
    found = volume.calc_barycentric(weights @ corners, 0)
    np.testing.assert_allclose(found, weights, atol=1e4 * tolerance)
    assert volume.calc_barycentric(corners[2], 0) == pytest.approx([0, 0, 1, 0], abs=1e-9)


def test_points_above_a_triangle_have_the_weights_of_their_projection():
    """And a point beyond an edge a weight below 0."""
    surface = SurfaceMesh([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    assert surface.calc_barycentric([0.5, 1.0, 7.0], 0).tolist() == [0.25, 0.25, 0.5]
    assert surface.calc_barycentric([-2.0, 0.0, 0.0], 0).tolist() == [2.0, -1.0, 0.0]
    point = surface.cartesian_from_barycentric(0, [0.25, 0.25, 0.5])
    assert point.tolist() == [0.5, 1.0, 0.0]
    tetrahedron = VolumeMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])
    assert tetrahedron.calc_barycentric([0.25, 0.5, 0.125], 0).tolist() == [
        0.125,
        0.25,
        0.5,
        0.125,
    ]
    assert tetrahedron.calc_barycentric([2.0, 0.0, 0.0], 0).tolist() == [-1.0, 2.0, 0.0, 0.0]


@pytest.mark.parametrize("index", [1, -1, True, 0.0, "0"])
def test_what_is_not_there_is_refused(index):
    """By its number and value; and points that are none, and flat triangles."""
    surface = SurfaceMesh(np.eye(3), [[0, 1, 2]])
    volume = VolumeMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])
    for mesh, name in ((surface, "triangle"), (volume, "tetrahedron")):
        with pytest.raises(MeshError, match=f"calc_barycentric: {name} must be a whole number"):
            mesh.calc_barycentric([0.0, 0.0, 0.0], index)
        for wrong in ([0.0, np.nan, 0.0], [1.0], [[[0.0] * 3]], "abc"):
            with pytest.raises(MeshError, match="points must be finite numbers"):
                mesh.calc_barycentric(wrong, 0)
    flat = SurfaceMesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    with pytest.raises(MeshError, match="triangle 0 has no area"):
        flat.calc_barycentric([0.0, 0.0, 0.0], 0)
