"""The approximate signed distance field of a reference mesh."""

import numpy as np
import pytest

from scene_graph_ros.geometry import Box, Sphere
from scene_graph_ros.geometry.deformable.field import reference_field
from scene_graph_ros.geometry.meshes.box_grid import grid_box
from scene_graph_ros.geometry.meshes.tessellate import tessellate_volume
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.meshes.volume_refinement import with_short_edges


def test_box():
    """At every vertex, minus the distance to the nearest of the six sides."""
    mesh = grid_box(Box(0.4, 0.3, 0.2), 0.06)
    half = np.array([0.2, 0.15, 0.1])
    expected = -(half - np.abs(mesh.vertices)).min(axis=1)
    assert np.allclose(reference_field(mesh), expected, rtol=0, atol=1e-16)
    assert reference_field(mesh).min() < -0.09


def test_ball():
    """Minus the distance from a polyhedron that lies between two spheres."""
    radius, hint = 0.1, 0.02
    mesh = with_short_edges(tessellate_volume(Sphere(radius), hint), 0.04)
    depth = radius - np.linalg.norm(mesh.vertices, axis=1)
    sagitta = hint**2 / (2.0 * radius)
    field = reference_field(mesh)
    assert (-field <= depth + 1e-15).all()
    assert (-field >= depth - sagitta).all()


def test_only_boundary_vertices():
    """A single tetrahedron has no vertex inside, and the field 0."""
    mesh = VolumeMesh(np.vstack([np.zeros(3), np.eye(3)]), [[0, 1, 2, 3]])
    assert np.array_equal(reference_field(mesh), np.zeros(4))


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_scale(scale):
    """The field is a length."""
    a = reference_field(grid_box(Box(0.4, 0.3, 0.2), 0.06))
    b = reference_field(grid_box(Box(0.4 * scale, 0.3 * scale, 0.2 * scale), 0.06 * scale))
    assert np.allclose(b, scale * a, rtol=1e-12, atol=0)
