"""Contact between two deformable geometries: where their fields are equal."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    Box,
    CollisionFilterDeclaration,
    GeometrySet,
    Mesh,
    ProximityProperties,
    Sphere,
)
from scene_graph_ros.geometry.deformable.field import reference_field
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

SIDE, CELL = 0.2, 0.05
CUBE, SLAB = Box(SIDE, SIDE, SIDE), Box(0.5, 0.5, SIDE)


def stacked(scene, depth, *, slab_first=True):
    """Return a slab with its top at z = 0 and a cube pressed by ``depth`` into it."""
    made = {}
    for name in ("slab", "cube") if slab_first else ("cube", "slab"):
        X = np.eye(4)
        X[2, 3] = -0.5 * SIDE if name == "slab" else 0.5 * SIDE - depth
        made[name] = scene.soft(SLAB if name == "slab" else CUBE, CELL, X, name=name)
    return made["slab"], made["cube"]


def fields_at(scene, surface):
    """Return both fields at the contact points, from each side's weights."""
    result = []
    for geometry_id, indices, weights in (
        (surface.id_A, surface.vertex_indices_A, surface.barycentric_coordinates_A),
        (surface.id_B, surface.vertex_indices_B, surface.barycentric_coordinates_B),
    ):
        field = reference_field(scene.mesh(geometry_id))
        result.append(np.einsum("fk,fk->f", weights, field[indices]))
    return result


@pytest.mark.parametrize("slab_first", [True, False])
def test_cube_on_a_slab(scene, slab_first, check_invariants):
    """Halfway between the two surfaces, at half the depth, with the normal out of B into A."""
    depth = 0.016
    slab, cube = stacked(scene, depth, slab_first=slab_first)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert (surface.id_A, surface.id_B) == tuple(sorted((slab, cube)))
    p_WC = surface.contact_points_W
    inner = (np.abs(p_WC[:, :2]) < 0.5 * SIDE - CELL).all(axis=1)
    assert np.allclose(p_WC[inner, 2], -0.5 * depth, rtol=0, atol=1e-15)
    assert np.allclose(surface.signed_distances[inner], -0.5 * depth, rtol=1e-12, atol=0)
    into_A = -1.0 if slab_first else 1.0
    assert np.allclose(surface.nhats_BA_W[inner], [0.0, 0.0, into_A], rtol=0, atol=1e-12)
    # The faces wholly within the inner square cover it.
    whole = [
        np.abs(surface.polygon(f)[:, :2]).max() <= 0.5 * SIDE - CELL + 1e-12
        for f in range(surface.num_contact_points)
    ]
    assert surface.face_areas[whole].sum() == pytest.approx((SIDE - 2 * CELL) ** 2, rel=1e-11)


def test_fields_are_equal_at_every_contact_point(scene, check_invariants):
    """Of two crumpled bodies the fields agree at each contact point, and are the distance."""
    rng = np.random.default_rng(2)
    slab, cube = stacked(scene, 0.03)
    R = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    for soft in (slab, cube):
        scene.deform(
            soft, lambda q: q @ R.T + rng.normal(scale=0.15 * CELL, size=q.shape) + [5.0, 1.0, 2.0]
        )
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    field_A, field_B = fields_at(scene, surface)
    assert np.allclose(field_A, field_B, rtol=0, atol=1e-13)
    assert np.allclose(surface.signed_distances, field_A, rtol=0, atol=1e-15)
    contact = scene.contact()
    for geometry_id, indices in (
        (surface.id_A, surface.vertex_indices_A),
        (surface.id_B, surface.vertex_indices_B),
    ):
        part = contact.contact_participation(geometry_id)
        assert np.array_equal(part.vertices, np.unique(indices))


def test_names_swapped(make_scene):
    """Registered the other way round, A and B change places and the normals turn."""
    results = []
    for slab_first in (True, False):
        scene = make_scene()
        _, cube = stacked(scene, 0.02, slab_first=slab_first)
        turn = Rotation.from_rotvec([0.05, 0.1, 0.3]).as_matrix()
        scene.deform(cube, lambda q, turn=turn: q @ turn.T + [0.011, 0.007, 0.0])
        (surface,) = scene.contact()
        first, second = surface.tetrahedra_A, surface.tetrahedra_B
        order = np.lexsort((second, first) if slab_first else (first, second))
        results.append((surface, order))
    (a, i), (b, j) = results
    assert np.array_equal(a.tetrahedra_A[i], b.tetrahedra_B[j])
    assert np.array_equal(a.tetrahedra_B[i], b.tetrahedra_A[j])
    assert np.allclose(a.face_areas[i], b.face_areas[j], rtol=0, atol=1e-15)
    assert np.allclose(a.nhats_BA_W[i], -b.nhats_BA_W[j], rtol=0, atol=1e-12)
    assert np.allclose(a.signed_distances[i], b.signed_distances[j], rtol=0, atol=1e-14)


def test_mirrored_bodies_meet_in_the_mirror(scene, check_invariants):
    """Two tetrahedra around an inner vertex each, mirror images in z: they meet at z = 0."""
    corners = np.array([[-1, -1, 0.9], [1, -1, 0.9], [0, 1, 0.9], [0, -0.2, -0.1], [0, -0.3, 0.6]])
    tetrahedra = np.array([[4, 0, 1, 2], [4, 0, 3, 1], [4, 1, 3, 2], [4, 2, 3, 0]])
    upper = VolumeMesh(corners, tetrahedra)
    lower = VolumeMesh(corners * [1, 1, -1], tetrahedra[:, [0, 2, 1, 3]])
    for mesh in (upper, lower):
        shape = Mesh(vertices=mesh.vertices, faces=mesh.boundary_triangles())
        scene.soft(shape, mesh=mesh)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert np.abs(surface.contact_points_W[:, 2]).max() < 1e-15
    assert np.allclose(surface.nhats_BA_W, [0.0, 0.0, 1.0], rtol=0, atol=1e-12)
    # The section of the upper body at z = 0: a tenth of the way up its sides of height 1.
    assert surface.total_area == pytest.approx(0.1**2 * 2.0, rel=1e-12)
    assert np.array_equal(surface.tetrahedra_A, surface.tetrahedra_B)


def test_coincident_bodies_have_no_surface(scene):
    """Two of the same in the same place: their fields are equal everywhere, not on a surface."""
    scene.soft(CUBE, CELL)
    scene.soft(CUBE, CELL)
    assert len(scene.contact()) == 0


@pytest.mark.parametrize("depth", [0.0, -1e-9])
def test_touching_and_apart(scene, depth):
    """A cube that stands on the slab, or above it, does not meet it."""
    stacked(scene, depth)
    assert len(scene.contact()) == 0


def test_a_tiny_overlap(scene, check_invariants):
    """A nanometre deep, the inside of the patch is there, as deep as half of it."""
    stacked(scene, 1e-9)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert surface.signed_distances.min() == pytest.approx(-0.5e-9, rel=1e-6)
    assert surface.total_area == pytest.approx(SIDE**2, rel=0.01)


def test_filters_are_respected(scene):
    """An excluded pair is not looked at; the others are."""
    slab, cube = stacked(scene, 0.01)
    ball = scene.rigid(Sphere(0.05))
    scene.graph.collision_filter_manager(scene.context).apply(
        CollisionFilterDeclaration().exclude_between(GeometrySet(slab), GeometrySet(cube))
    )
    assert [(s.id_A, s.id_B) for s in scene.contact()] == [(slab, ball), (cube, ball)]


def test_a_body_without_the_proximity_role_meets_nothing(scene):
    """Its role taken away, the cube is in no pair, and has no participation."""
    slab, cube = stacked(scene, 0.01)
    role = ProximityProperties.role
    scene.graph.remove_role(scene.source, cube, role, context=scene.context)
    contact = scene.contact()
    assert len(contact) == 0
    assert list(contact.participation) == [slab]
