"""What one contact surface tells: faces, pressures, gradients, force and material."""

import math
import pickle

import numpy as np
from pressing_bodies import at, compliant, E, rigid, Scene, two
import pytest

from scene_graph_ros.geometry import (
    add_contact_material,
    Box,
    ContactRepresentation,
    Sphere,
)
from scene_graph_ros.geometry.errors import QueryArgumentError


def test_what_a_surface_tells():
    """All fields of a surface of two compliant spheres have their shapes and agree."""
    query = two(Sphere(0.2), compliant(), Sphere(0.2), compliant(2 * E))
    surfaces = query.compute_contact_surfaces(representation="triangle")
    surface = surfaces[0]
    f, v = surface.num_faces, surface.num_vertices
    assert surface.representation is ContactRepresentation.TRIANGLE
    assert surface.vertices_W.shape == (v, 3)
    assert surface.faces.shape == (f, 3)
    assert surface.faces.min() == 0
    assert surface.faces.max() == v - 1
    assert surface.pressure.shape == (v,)
    for name in ("face_normals_W", "face_centroids_W", "grad_pressure_M_W", "grad_pressure_N_W"):
        assert getattr(surface, name).shape == (f, 3)
    assert surface.face_areas.shape == surface.face_pressures.shape == (f,)
    assert surface.total_area == pytest.approx(surface.face_areas.sum())
    corners = surface.vertices_W[surface.faces]
    assert surface.face_centroids_W == pytest.approx(corners.mean(axis=1), abs=1e-12)
    assert surface.face_pressures == pytest.approx(surface.pressure[surface.faces].mean(axis=1))
    # The gradients give the differences of pressure along the faces, on both sides.
    edges = corners[:, 1] - corners[:, 0]
    pressure = surface.pressure[surface.faces]
    rise = pressure[:, 1] - pressure[:, 0]
    for gradient in (surface.grad_pressure_M_W, surface.grad_pressure_N_W):
        assert np.einsum("ij,ij->i", gradient, edges) == pytest.approx(rise, abs=1e-6)
    # The face is level with the difference of the fields.
    jump = surface.grad_pressure_M_W - surface.grad_pressure_N_W
    jump /= np.linalg.norm(jump, axis=1, keepdims=True)
    assert surface.face_normals_W == pytest.approx(jump, abs=1e-12)
    assert not surface.vertices_W.flags.writeable
    assert "faces" in repr(surface)


def test_polygons_in_rows_and_compressed():
    """Polygons have three to eight corners; both forms name the same vertices."""
    query = two(Sphere(0.2), compliant(), Sphere(0.2), compliant())
    (surface,) = query.compute_contact_surfaces("polygon")
    (triangles,) = query.compute_contact_surfaces("triangle")
    assert len(surface.faces) == surface.num_faces
    start = surface.face_vertex_start
    assert start[0] == 0
    assert start[-1] == surface.num_vertices
    assert all(3 <= len(face) <= 8 for face in surface.faces)
    assert np.array_equal(np.concatenate(surface.faces), np.arange(surface.num_vertices))
    assert [len(face) for face in surface.faces] == np.diff(start).tolist()
    assert surface.total_area == pytest.approx(triangles.total_area, rel=1e-12)
    with pytest.raises(QueryArgumentError, match="polygon"):
        triangles.face_vertex_start  # noqa: B018


def test_rigid_sides_have_no_gradient():
    """The gradient of a rigid side is None, and zero in the table's flat arrays."""
    surfaces = two(Sphere(0.2), compliant(), Box(1, 1, 0.4), rigid()).compute_contact_surfaces()
    surface = surfaces[0]
    assert surface.grad_pressure_N_W is None
    assert surface.grad_pressure_M_W is not None
    assert np.linalg.norm(surface.grad_pressure_M_W, axis=1).min() > 0.0
    assert not surfaces.grad_pressure_N_W.any()
    assert surfaces.is_compliant_M.tolist() == [True]
    assert surfaces.is_compliant_N.tolist() == [False]


def test_force_and_moment_about_any_point():
    """The moment about P is that about the centroid plus the force's arm; both add up faces."""
    surfaces = two(
        Box(0.4, 0.4, 0.4), compliant(), Sphere(0.2), compliant(), z=0.37
    ).compute_contact_surfaces()
    (surface,) = surfaces
    P = np.array([1.0, -2.0, 0.5])
    force, moment = surface.force_and_moment(P)
    # Exact per triangle: the integral of x p is A / 12 (sum x_i p_i + sum x_i sum p_i).
    x, p = surface.vertices_W[surface.faces] - P, surface.pressure[surface.faces]
    n, A = surface.face_normals_W, surface.face_areas
    arms = np.einsum("fij,fi->fj", x, p) + x.sum(axis=1) * p.sum(axis=1)[:, None]
    expected = np.cross(A[:, None] / 12.0 * arms, n).sum(axis=0)
    assert moment == pytest.approx(expected, rel=1e-10, abs=1e-9)
    assert force == pytest.approx((A * p.mean(axis=1)) @ n, rel=1e-12, abs=1e-9)
    assert surfaces.force_W[0] == pytest.approx(force)
    about_centroid = surface.force_and_moment(surface.centroid_W)[1]
    assert surfaces.moment_W[0] == pytest.approx(about_centroid, abs=1e-12)
    for bad in ([1.0, 2.0], [1.0, 2.0, math.nan], "here"):
        with pytest.raises(QueryArgumentError, match="p_WP"):
            surface.force_and_moment(bad)


def test_columns_and_slices():
    """The table's flat arrays, its records, slices and pickles tell the same."""
    scene = Scene()
    for k in range(4):
        scene.add(Sphere(0.2), compliant(), at(x=0.35 * k))
    for word in ("triangle", "polygon"):
        table = scene.query().compute_contact_surfaces(word)
        assert len(table) == 3
        assert table.id_M.tolist() == sorted(table.id_M.tolist())
        copy = pickle.loads(pickle.dumps(table))
        back = table[::-1]
        for k, surface in enumerate(table):
            for other in (copy[k], back[2 - k], table[k:][0]):
                assert other.id_M == surface.id_M
                for name in ("vertices_W", "pressure", "face_normals_W", "grad_pressure_N_W"):
                    assert np.array_equal(getattr(other, name), getattr(surface, name))
                assert np.array_equal(np.hstack(other.faces), np.hstack(surface.faces))
            faces = slice(table.face_start[k], table.face_start[k + 1])
            assert np.array_equal(table.face_areas[faces], surface.face_areas)
        assert len(table[:0]) == 0


def test_material_is_carried_through():
    """A surface has the contact material of both sides, and that of none is empty."""
    properties = compliant()
    add_contact_material(properties, dissipation=1.5, static_friction=0.9, dynamic_friction=0.7)
    (surface,) = two(Sphere(0.2), properties, Box(1, 1, 0.4), rigid()).compute_contact_surfaces()
    assert surface.material_M == {
        "hunt_crossley_dissipation": 1.5,
        "static_friction": 0.9,
        "dynamic_friction": 0.7,
    }
    assert surface.material_N == {}
    with pytest.raises(TypeError):
        surface.material_M["static_friction"] = 0.0


def test_equal_boxes_flush_on_each_other_jump_sideways():
    """Beside the middle their fields are equal in a volume; the smallest step aside splits them.

    Boxes of 1 m, 0.1 m deep: at u from a side the pressure is E u / 0.5, up to u = 0.05. Moved
    along x, the surface rises at 45 degrees to one side and falls to the other, which push alike.
    """
    forces = []
    for aside in (0.0, 1e-7, -1e-7):
        scene = Scene()
        scene.add(Box(1.0, 1.0, 1.0), compliant(), at(x=aside, z=0.9))
        scene.add(Box(1.0, 1.0, 1.0), compliant(), at())
        (surface,) = scene.query().compute_contact_surfaces("polygon")
        forces.append(surface.force_and_moment(np.zeros(3))[0])
    u = 0.05  # half of what they overlap: up to here a side is nearer than the top
    # The integral of E u / 0.5 over strips 2 (0.5 - u) long, to u.
    strip = 4.0 * E * (u**2 / 4.0 - u**3 / 3.0)
    normal = 0.81 * E * u / 0.5 + 4.0 * strip
    # Both sides along y fall. So where it rises a triangle stands upright at either corner, of the
    # height 2 (0.05 - u): each is the integral of E u / 0.5 times that.
    sideways = 2.0 * strip + 2.0 * 4.0 * E * u**3 / 6.0
    assert forces[0] == pytest.approx([0.0, 0.0, normal], abs=0.2)
    assert forces[1] == pytest.approx([sideways, 0.0, normal], abs=0.2)
    assert forces[2] == pytest.approx([-sideways, 0.0, normal], abs=0.2)
    assert 0.05 < sideways / normal < 0.06
