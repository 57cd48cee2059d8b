"""Triangles to draw."""

import numpy as np
import pytest

from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.views.triangles import (
    capsule_triangles,
    hull_triangles,
    surface_triangles,
    Triangles,
)

CUBE = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 2.0) for z in (0.0, 3.0)])


def signed_volume(mesh: Triangles) -> float:
    """Sum the signed tetrahedra to the origin: positive only if the triangles face outwards."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def assert_closed(mesh: Triangles) -> None:
    """Every directed edge comes once, and so does its opposite."""
    edges = [(t[k], t[(k + 1) % 3]) for t in mesh.triangles.tolist() for k in range(3)]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)


def test_a_capsule_is_a_closed_surface_on_the_capsule() -> None:
    """All corners are one radius away from the axis' segment, and the surface faces outwards."""
    capsule = Capsule(0.3, 0.8)
    mesh = capsule_triangles(capsule)
    beyond = np.abs(mesh.vertices[:, 2]) - 0.4
    axial = np.maximum(beyond, 0.0)
    distances = np.hypot(np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]), axial)
    np.testing.assert_allclose(distances, 0.3, rtol=0, atol=1e-15)
    assert_closed(mesh)
    # Inscribed with 16 sides: sin(2 pi / 16) / (2 pi / 16) = 0.974 of the cylinder's section, and
    # somewhat less of the caps.
    assert 0.9 * capsule.volume() < signed_volume(mesh) < capsule.volume()
    assert (mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()) == pytest.approx((-0.7, 0.7))


def test_a_hull_leaves_out_what_is_inside() -> None:
    """Eight corners of a scaled box, an inner point dropped: 12 triangles around 6 m^3 times 8."""
    points = np.vstack([CUBE, (0.5, 1.0, 1.5)])
    mesh = hull_triangles(Convex(vertices=points, scale=2.0))
    assert (len(mesh.vertices), len(mesh.triangles)) == (8, 12)
    assert signed_volume(mesh) == pytest.approx(48.0, rel=1e-14)
    assert_closed(mesh)


def test_a_mirrored_mesh_still_faces_outwards() -> None:
    """A negative scale turns the triangles around with the vertices."""
    cube = hull_triangles(Convex(vertices=CUBE))
    shape = Mesh(vertices=cube.vertices, faces=cube.triangles, scale=(-1.0, 1.0, 0.5))
    mirrored = surface_triangles(shape)
    assert signed_volume(mirrored) == pytest.approx(3.0, rel=1e-14)
    assert mirrored.vertices[:, 0].min() == -1.0


def test_a_point_has_no_triangles_and_a_square_two_sides() -> None:
    """Degenerate hulls are drawn as what they are, without an error."""
    assert len(hull_triangles(Convex(vertices=[(1.0, 2.0, 3.0)])).triangles) == 0
    square = hull_triangles(Convex(vertices=CUBE[CUBE[:, 0] == 0.0]))
    assert len(square.triangles) == 4
    assert signed_volume(square) == pytest.approx(0.0, abs=1e-15)
