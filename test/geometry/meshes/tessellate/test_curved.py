"""Meshes of curved shapes come to the shape as the square of the hint, from inside."""

import math

import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc

from scene_graph_ros.geometry import Capsule, Cylinder, Ellipsoid, Sphere
from scene_graph_ros.geometry.meshes.surface_mesh import SurfaceMesh
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface, tessellate_volume
from scene_graph_ros.geometry.meshes.tessellate.geodesic import (
    geodesic_dome,
    geodesic_sphere,
    LONGEST_DOME_EDGE,
    LONGEST_SPHERE_EDGE,
)

RADIUS, LENGTH = 1.0 / 3.0, 0.7


def _ellipsoid_area(a, b, c):
    """Return the area for a > b > c (Legendre)."""
    phi = math.acos(c / a)
    m = a**2 * (b**2 - c**2) / (b**2 * (a**2 - c**2))
    e, k = ellipeinc(phi, m), ellipkinc(phi, m)
    part = e * math.sin(phi) ** 2 + k * math.cos(phi) ** 2
    return 2.0 * math.pi * (c**2 + a * b / math.sin(phi) * part)


AREAS = [
    (Sphere(RADIUS), 4.0 * math.pi * RADIUS**2),
    (Capsule(RADIUS, LENGTH), 4.0 * math.pi * RADIUS**2 + 2.0 * math.pi * RADIUS * LENGTH),
    (Cylinder(RADIUS, LENGTH), 2.0 * math.pi * RADIUS * (RADIUS + LENGTH)),
    (Cylinder(RADIUS, 0.2), 2.0 * math.pi * RADIUS * (RADIUS + 0.2)),
    (Ellipsoid(0.5, 0.4, 0.3), _ellipsoid_area(0.5, 0.4, 0.3)),
]


def _orders(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


@pytest.mark.parametrize(("shape", "area"), AREAS, ids=[repr(shape) for shape, _ in AREAS])
def test_volume_and_area_converge_with_second_order(shape, area):
    """Halving the hint quarters both errors, and the polyhedron is inside the shape."""
    volume_errors, area_errors = [], []
    for hint in (0.08, 0.04, 0.02, 0.01):
        volume_errors.append(1.0 - tessellate_volume(shape, hint).volume / shape.volume())
        surface = SurfaceMesh(*tessellate_surface(shape, hint))
        area_errors.append(1.0 - surface.total_area / area)
    assert min(volume_errors) > 0.0 and min(area_errors) > 0.0
    # Counts are whole numbers, so single steps vary; three of them together do not.
    assert _orders(volume_errors).mean() == pytest.approx(2.0, abs=0.15)
    assert _orders(area_errors).mean() == pytest.approx(2.0, abs=0.15)
    # The polyhedron's error is about (edge / 2 R)^2 for a radius of curvature R >= 0.18 here.
    assert volume_errors[-1] < (0.01 / 0.18) ** 2 / 2.0


IMPLICIT = [
    (Sphere(RADIUS), lambda p: np.linalg.norm(p, axis=1) - RADIUS),
    (
        Capsule(RADIUS, LENGTH),
        lambda p: np.linalg.norm(
            p - np.clip(p, [0, 0, -LENGTH / 2], [0, 0, LENGTH / 2]), axis=1
        ) - RADIUS,
    ),
    (
        Ellipsoid(0.5, 0.4, 0.3),
        lambda p: np.linalg.norm(p / [0.5, 0.4, 0.3], axis=1) - 1.0,
    ),
]  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "implicit"), IMPLICIT, ids=[repr(shape) for shape, _ in IMPLICIT]
)
def test_vertices_are_on_the_surface(shape, implicit):
    """To rounding, at every resolution."""
    for hint in (1.0, 0.1, 0.03):
        vertices, _ = tessellate_surface(shape, hint)
        assert np.abs(implicit(vertices)).max() <= 1e-15


def test_vertices_of_a_cylinder_are_on_its_rims_and_in_its_caps():
    """All but the two centres of the caps are on a rim."""
    vertices, _ = tessellate_surface(Cylinder(RADIUS, LENGTH), 0.05)
    assert (np.abs(vertices[:, 2]) == LENGTH / 2.0).all()
    radii = np.hypot(vertices[:, 0], vertices[:, 1])
    assert np.abs(radii[:-2] - RADIUS).max() <= 1e-15
    assert (radii[-2:] == 0.0).all()


@pytest.mark.parametrize("shape", [Sphere(RADIUS), Ellipsoid(0.5, 0.4, 0.3)], ids=repr)
@pytest.mark.parametrize("hint", [0.3, 0.1, 0.05, 0.021])
def test_no_edge_is_longer_than_the_hint(shape, hint):
    """And the mesh is not much finer than that needs."""
    vertices, triangles = tessellate_surface(shape, hint)
    edges = np.linalg.norm(vertices[triangles] - vertices[np.roll(triangles, 1, 1)], axis=2)
    assert edges.max() <= hint * (1.0 + 1e-12)
    assert edges.max() >= 0.5 * hint


def test_edges_on_domes_and_rims_are_not_longer_than_the_hint():
    """Of a capsule or cylinder all edges but those along the axis and across the caps."""
    for hint in (0.2, 0.1, 0.033):
        vertices, triangles = tessellate_surface(Capsule(RADIUS, LENGTH), hint)
        on_dome = triangles[(vertices[triangles][:, :, 2] > 0.0).all(axis=1)]
        edges = vertices[on_dome] - vertices[np.roll(on_dome, 1, axis=1)]
        assert np.linalg.norm(edges, axis=2).max() <= hint
        vertices, triangles = tessellate_surface(Cylinder(RADIUS, LENGTH), hint)
        count = (len(vertices) - 2) // 2
        rim = vertices[:count]
        assert np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).max() <= hint


@pytest.mark.parametrize("f", [1, 2, 3, 5, 16, 40])
def test_geodesic_polyhedra(f):
    """Counts, unit length, closedness, longest edges and the regularity of triangles."""
    sphere, faces = geodesic_sphere(f)
    assert (len(sphere), len(faces)) == (10 * f * f + 2, 20 * f * f)
    assert SurfaceMesh(sphere, faces).is_closed
    dome, dome_faces, rim = geodesic_dome(f)
    assert (len(dome), len(dome_faces), len(rim)) == (2 * f * f + 2 * f + 1, 4 * f * f, 4 * f)
    angles = np.arange(4 * f) * (0.5 * math.pi / f)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(4 * f)])
    assert np.abs(dome[rim] - circle).max() <= 1e-15
    for points, triangles, longest, shortest in (
        (sphere, faces, LONGEST_SPHERE_EDGE, 1.05),
        (dome, dome_faces, LONGEST_DOME_EDGE, 1.41),
    ):
        assert np.abs(np.linalg.norm(points, axis=1) - 1.0).max() <= 1e-15
        edges = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, 1)], axis=2)
        assert edges.max() * f <= longest
        assert edges.min() * f >= shortest


def test_worst_quality_of_a_star_falls_as_its_tetrahedra_get_slender():
    """A tetrahedron from the centre of a sphere to a triangle of edge h has quality ~ (h / R)^2.

    For an equilateral base of edge h at distance R: V = sqrt(3)/12 h^2 R and a mean square edge of
    (R^2 + h^2) / 2, nearly; the worst may not be worse than half of that.
    """
    for hint in (0.2, 0.1, 0.05):
        mesh = tessellate_volume(Sphere(1.0), hint)
        edge = 0.8 * hint  # the shortest edges are a fifth shorter than the longest
        ideal = 6.0 * math.sqrt(2.0) * math.sqrt(3.0) / 12.0 * edge**2 / 0.5**1.5
        assert mesh.qualities().min() >= 0.5 * ideal
