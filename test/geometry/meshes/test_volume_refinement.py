"""Meshes whose edges are not too long: grids of boxes, and edges cut in halves."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Ellipsoid, Sphere
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.box_grid import grid_box
from scene_graph_ros.geometry.meshes.tessellate import tessellate_volume
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.meshes.volume_refinement import with_short_edges

TETRAHEDRON = VolumeMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])


def longest_edge(mesh):
    """Return the length of the longest edge."""
    corners = mesh.vertices[mesh.tetrahedra]
    return np.linalg.norm(corners[:, :, None] - corners[:, None], axis=-1).max()


@pytest.mark.parametrize("longest", [2.0, 1.4, 0.9, 0.4, 0.2])
def test_a_tetrahedron_cut_up(longest):
    """The pieces conform, fill it, and have short edges; they do not get flatter and flatter."""
    mesh = with_short_edges(TETRAHEDRON, longest)
    VolumeMesh(mesh.vertices, mesh.tetrahedra)  # raises if a volume or a face is wrong
    assert longest_edge(mesh) <= longest
    assert mesh.volume == pytest.approx(1.0 / 6.0, rel=1e-13)
    assert np.array_equal(mesh.vertices[:4], TETRAHEDRON.vertices)
    assert mesh.qualities().min() > 0.3 * TETRAHEDRON.qualities().min()
    assert (longest >= np.sqrt(2.0)) == (mesh.num_tetrahedra == 1)


@pytest.mark.parametrize("longest", [1e120, 1e300, 1.7e308])
def test_edges_may_be_as_long_as_they_like(longest):
    """A length whose cube is beyond all floats asks for nothing."""
    assert with_short_edges(TETRAHEDRON, longest).num_tetrahedra == 1


@pytest.mark.parametrize("longest", [1e-120, 1e-300, 5e-324])
def test_edges_shorter_than_anything_are_refused(longest):
    """A length whose cube is no number above zero asks for more than there may be."""
    with pytest.raises(MeshError, match="tetrahedra"):
        with_short_edges(TETRAHEDRON, longest)


@pytest.mark.parametrize("shape", [Sphere(0.1), Ellipsoid(0.1, 0.07, 0.12)], ids=repr)
def test_round_bodies(shape):
    """Their surface, which is fine already, stays; only the inside is cut."""
    before = tessellate_volume(shape, 0.03)
    mesh = with_short_edges(before, 0.06)
    VolumeMesh(mesh.vertices, mesh.tetrahedra)
    assert longest_edge(mesh) <= 0.06
    assert mesh.volume == pytest.approx(before.volume, rel=1e-12)
    assert len(mesh.boundary_triangles()) == len(before.boundary_triangles())


def test_too_many_are_refused():
    """A hint that asks for billions is refused at once, with the numbers."""
    with pytest.raises(MeshError, match=r"1e-05 m.*2000000"):
        with_short_edges(TETRAHEDRON, 1e-5)
    with pytest.raises(MeshError, match=r"resolution_hint 1e-06 m of Box"):
        grid_box(Box(1.0, 1.0, 1.0), 1e-6)
    with pytest.raises(MeshError, match="tetrahedra"):
        grid_box(Box(1.0, 1.0, 1.0), 1e-300)


@pytest.mark.parametrize(
    ("size", "hint", "cells"),
    [
        ((0.4, 0.3, 0.2), 0.1, (4, 3, 2)),
        ((1.0, 0.1, 0.1), 0.3, (4, 1, 1)),
        ((1, 2, 3), 9, (1,) * 3),
    ],
)
def test_grid_of_a_box(size, hint, cells):
    """Twelve tetrahedra in each cell, each with a corner inside the box."""
    mesh = grid_box(Box(*size), hint)
    VolumeMesh(mesh.vertices, mesh.tetrahedra)
    assert mesh.num_tetrahedra == 12 * np.prod(cells)
    assert mesh.volume == pytest.approx(np.prod(size), rel=1e-12)
    lower, upper = mesh.bounding_box()
    assert np.allclose(upper, 0.5 * np.array(size)) and np.allclose(lower, -upper)
    assert not mesh.is_on_boundary()[mesh.tetrahedra].all(axis=1).any()
    faces = mesh.boundary_triangles()
    n, m, k = cells
    assert len(faces) == 4 * (n * m + m * k + n * k)
