"""Contact of a soft box with rigid geometries: known areas, distances and ties."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import (
    add_rigid_hydroelastic_properties,
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    ProximityProperties,
    RoleAssign,
    Sphere,
)
from scene_graph_ros.geometry.deformable.rigid_surface import rigid_surface

SIDE = 0.2
CELLS = 4
CELL = SIDE / CELLS
CUBE = Box(SIDE, SIDE, SIDE)
TETRAHEDRON = np.array([[-0.05, -0.04, -0.03], [0.06, 0, -0.03], [0, 0.06, -0.03], [0, 0, 0.06]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
ROUND_OR_FLAT = [
    Sphere(0.05),
    Box(0.08, 0.06, 0.07),
    Capsule(0.03, 0.06),
    Cylinder(0.04, 0.05),
    Ellipsoid(0.05, 0.04, 0.03),
    Convex(vertices=TETRAHEDRON),
    Mesh(vertices=TETRAHEDRON, faces=FACES),
]


def pressed(scene, depth, shape, X=None):
    """Return the cube pressed by ``depth`` below z = 0, and its one surface with a shape."""
    soft = scene.soft(CUBE, CELL)
    scene.rigid(shape, X)
    scene.deform(soft, lambda q: q + np.array([0.0, 0.0, 0.5 * SIDE - depth]))
    (surface,) = scene.contact()
    return soft, surface


def away_from_sides(points):
    """Tell which points are further from the cube's sides than a cell: the field is exact."""
    return (np.abs(points[:, :2]) < 0.5 * SIDE - CELL).all(axis=1)


@pytest.mark.parametrize("depth", [0.003, 0.02, 1e-7])
def test_cube_on_a_half_space(scene, depth, check_invariants):
    """The patch is a side of the cube, each point as deep as the cube was pressed."""
    _, surface = pressed(scene, depth, HalfSpace())
    check_invariants(surface, scene.query)
    assert surface.total_area == pytest.approx(SIDE**2, rel=1e-12)
    assert np.allclose(surface.nhats_BA_W, [0.0, 0.0, 1.0], rtol=0, atol=0)
    assert np.abs(surface.contact_points_W[:, 2]).max() < 1e-16
    inner = away_from_sides(surface.contact_points_W)
    assert inner.sum() > 4
    assert np.allclose(surface.signed_distances[inner], -depth, rtol=1e-9, atol=0)
    assert (surface.signed_distances > -depth * (1.0 + 1e-9)).all()


def test_participation_of_a_cube_on_a_half_space(scene):
    """All corners of the lowest layer of cells and their centres take part, and nothing else."""
    soft, surface = pressed(scene, 0.01, HalfSpace())
    part = scene.contact().contact_participation(soft)
    layer = (CELLS + 1) ** 2
    assert part.num_vertices == len(scene.mesh(soft).vertices) == 5 * layer + CELLS**3
    assert part.num_vertices_in_contact == 2 * layer + CELLS**2
    low = scene.mesh(soft).vertices[:, 2] < -0.5 * SIDE + CELL * 1.01
    assert np.array_equal(np.flatnonzero(part.takes_part), np.flatnonzero(low))
    assert set(surface.vertex_indices_A.ravel()) == set(part.vertices)


def test_half_space_and_large_box_agree(make_scene, pose):
    """The top of a large box is a plane, too: the same area, normals and distances."""
    results = []
    for shape, X in ((HalfSpace(), None), (Box(1.0, 1.0, 1.0), pose(z=-0.5))):
        _, surface = pressed(make_scene(), 0.01, shape, X)
        results.append(surface)
    a, b = results
    assert a.total_area == pytest.approx(b.total_area, rel=1e-12)
    assert np.allclose(b.nhats_BA_W, [0.0, 0.0, 1.0], rtol=0, atol=1e-15)
    for moment in (a, b):
        assert moment.face_areas @ moment.signed_distances == pytest.approx(
            a.face_areas @ a.signed_distances, rel=1e-12
        )


def test_small_box_in_a_cube(scene, pose, check_invariants):
    """The part of the box inside the cube: its top, and its four sides to the depth."""
    depth, edge = 0.013, 0.1
    _, surface = pressed(scene, depth, Box(edge, edge, edge), pose(z=-0.5 * edge))
    check_invariants(surface, scene.query)
    up = surface.nhats_BA_W[:, 2] > 0.5
    assert surface.face_areas[up].sum() == pytest.approx(edge**2, rel=1e-12)
    assert surface.face_areas[~up].sum() == pytest.approx(4 * edge * depth, rel=1e-12)
    outwards = surface.contact_points_W[~up, :2] / np.abs(surface.contact_points_W[~up, :2]).max(
        axis=1, keepdims=True
    )
    assert (np.einsum("ij,ij->i", outwards, surface.nhats_BA_W[~up, :2]) > 0.99).all()


@pytest.mark.parametrize("shape", ROUND_OR_FLAT, ids=lambda s: s.type_name)
def test_surface_inside_is_counted_once(scene, shape, check_invariants, pose):
    """Of a body inside the cube every bit of surface is in one tetrahedron: none lost or twice."""
    soft = scene.soft(CUBE, CELL)
    R = Rotation.from_rotvec([0.3, -0.5, 0.2]).as_matrix()
    rigid = scene.rigid(shape, pose(0.011, -0.007, 0.004, R))
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert (surface.id_A, surface.id_B) == (soft, rigid)
    made = rigid_surface(shape, ProximityProperties())
    corners = made.vertices[made.triangles]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    whole = 0.5 * np.linalg.norm(crosses, axis=1).sum()
    assert surface.total_area == pytest.approx(whole, rel=1e-11)
    # The area vectors of a closed surface add up to zero.
    assert np.abs(surface.face_areas @ surface.nhats_BA_W).max() < 1e-12 * whole


def test_faces_on_the_planes_of_the_mesh_are_counted_once(scene):
    """The box's sides lie in sides of cells: each bit belongs to one of the two cells there."""
    scene.soft(CUBE, CELL)
    scene.rigid(Box(2 * CELL, 2 * CELL, 2 * CELL))
    (surface,) = scene.contact()
    assert surface.total_area == pytest.approx(6 * (2 * CELL) ** 2, rel=1e-12)


def test_plane_between_layers_is_counted_once(scene):
    """A half space that ends between two layers of cells cuts the lower one along its top."""
    soft, surface = pressed(scene, CELL, HalfSpace())
    assert surface.total_area == pytest.approx(SIDE**2, rel=1e-12)
    q_WG = scene.query.get_configurations_in_world(soft)
    assert (q_WG[surface.vertex_indices_A][:, :, 2].max(axis=1) < 1e-15).all()


@pytest.mark.parametrize("far", [0.0, 1e3, 1e6])
def test_touching_is_no_contact(scene, far, pose):
    """A cube that stands on a half space and beside a box touches both, and meets neither."""
    soft = scene.soft(CUBE, CELL)
    scene.rigid(HalfSpace())
    scene.rigid(CUBE, pose(far + SIDE, 0.0, 0.5 * SIDE))
    scene.deform(soft, lambda q: q + np.array([far, 0.0, 0.5 * SIDE]))
    contact = scene.contact()
    assert len(contact) == 0
    assert contact.contact_participation(soft).num_vertices_in_contact == 0


def test_submerged_cube_has_no_surface(scene):
    """Deep inside a half space there is no surface of it to meet."""
    soft = scene.soft(CUBE, CELL)
    scene.rigid(HalfSpace())
    scene.deform(soft, lambda q: q - [0.0, 0.0, 0.6 * SIDE])
    assert len(scene.contact()) == 0


def test_coincident_box(scene, check_invariants):
    """A rigid box just where the soft one is: its whole surface, at distance zero."""
    scene.soft(CUBE, CELL)
    scene.rigid(CUBE)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert surface.total_area == pytest.approx(6 * SIDE**2, rel=1e-12)
    assert np.abs(surface.signed_distances).max() < 1e-16


@pytest.mark.parametrize("shape", [*ROUND_OR_FLAT, HalfSpace()], ids=lambda s: s.type_name)
def test_rigid_motion_of_everything_changes_nothing(make_scene, shape, pose):
    """Contact seen from another frame: the same faces, turned and moved."""
    rng = np.random.default_rng(7)
    R, p = Rotation.random(rng=rng).as_matrix(), np.array([3.0, -2.0, 1.0])
    X_WG = pose(0.02, 0.03, -0.08, Rotation.from_rotvec([0.4, 0.1, -0.3]).as_matrix())
    bulge = rng.normal(scale=0.004, size=(5**3 + CELLS**3, 3))
    surfaces = []
    for turn, shift in ((np.eye(3), np.zeros(3)), (R, p)):
        scene = make_scene()
        soft = scene.soft(CUBE, CELL)
        scene.rigid(shape, pose(*shift, turn) @ X_WG)
        scene.deform(soft, lambda q, turn=turn, shift=shift: (q + bulge) @ turn.T + shift)
        surfaces.append(scene.contact()[0])
    a, b = surfaces
    assert np.array_equal(a.tetrahedra_A, b.tetrahedra_A)
    assert np.allclose(a.face_areas, b.face_areas, rtol=0, atol=1e-15)
    assert np.allclose(a.signed_distances, b.signed_distances, rtol=0, atol=1e-13)
    big = a.face_areas > 1e-9
    assert np.allclose((a.contact_points_W @ R.T + p)[big], b.contact_points_W[big], atol=1e-11)
    assert np.allclose(a.nhats_BA_W @ R.T, b.nhats_BA_W, rtol=0, atol=1e-13)


@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_scale(make_scene, scale, pose):
    """A scene of another size has the same faces, in proportion."""
    surfaces = []
    for s in (1.0, scale):
        scene = make_scene()
        scene.soft(Box(s * SIDE, s * SIDE, s * SIDE), s * CELL)
        R = Rotation.from_rotvec([0.4, 0.1, -0.3]).as_matrix()
        scene.rigid(Box(s * 0.3, s * 0.1, s * 0.1), pose(s * 0.07, 0.0, s * 0.01, R))
        surfaces.append(scene.contact()[0])
    a, b = surfaces
    assert np.array_equal(a.tetrahedra_A, b.tetrahedra_A)
    assert np.allclose(a.face_areas * scale**2, b.face_areas, rtol=1e-9, atol=1e-15 * scale**2)
    assert b.total_area == pytest.approx(a.total_area * scale**2, rel=1e-12)


def test_stretched_and_sheared_cube(scene, check_invariants):
    """Horizontal sections keep the map's area factor; the field moves with the material."""
    # Horizontal planes stay horizontal: (x, y) is mapped by M, and z by 1.7 z.
    M, slant, stretch = np.array([[1.3, 0.4], [-0.2, 0.9]]), np.array([0.5, -0.3]), 1.7
    depth = 0.02
    soft = scene.soft(CUBE, CELL)
    scene.rigid(HalfSpace())

    def deform(q):
        height = q[:, 2] + 0.5 * SIDE
        flat = q[:, :2] @ M.T + np.outer(height, slant)
        return np.column_stack([flat, stretch * height - depth])

    scene.deform(soft, deform)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)
    assert surface.total_area == pytest.approx(np.linalg.det(M) * SIDE**2, rel=1e-12)
    height = depth / stretch
    p_GC = (surface.contact_points_W[:, :2] - height * slant) @ np.linalg.inv(M).T
    inner = away_from_sides(p_GC)
    assert inner.sum() > 4
    assert np.allclose(surface.signed_distances[inner], -height, rtol=1e-10, atol=0)


def test_flat_and_inverted_tetrahedra_are_left_out(scene):
    """Turned inside out, tetrahedra have no part; pressed flat, the whole body has none."""
    soft, before = pressed(scene, 0.02, HalfSpace())
    mesh, start = scene.mesh(soft), scene.query.get_configurations_in_world(soft)
    # The centre of the first cell, moved far below, turns the tetrahedra above it inside out.
    centre = (CELLS + 1) ** 3
    moved = start.copy()
    moved[centre, 2] -= 3 * CELL
    scene.context.set_configurations(scene.source, {soft: moved})
    a, b, c, d = (moved[mesh.tetrahedra[:, k]] for k in range(4))
    volumes = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    inverted = np.flatnonzero(volumes < 0.0)
    assert len(inverted) == 2
    (after,) = scene.contact()
    assert set(inverted) & set(before.tetrahedra_A)
    assert not set(inverted) & set(after.tetrahedra_A)
    scene.deform(soft, lambda q: q * [1.0, 1.0, 0.0] - [0.0, 0.0, 0.01])
    assert len(scene.contact()) == 0


def test_nearly_flat_body_keeps_its_weights(scene, check_invariants):
    """Pressed to a ten thousandth of its height and tilted, all invariants still hold."""
    soft = scene.soft(CUBE, CELL)
    scene.rigid(HalfSpace())
    R = Rotation.from_rotvec([0.5, 0.2, 0.0]).as_matrix()
    scene.deform(soft, lambda q: (q * [1.0, 1.0, 1e-4]) @ R.T)
    (surface,) = scene.contact()
    check_invariants(surface, scene.query)


def test_random_configurations(scene, check_invariants):
    """A body of crumpled tetrahedra, some inverted, among all shapes at once."""
    soft = scene.soft(CUBE, CELL)
    for k, shape in enumerate([*ROUND_OR_FLAT, HalfSpace()]):
        X = np.eye(4)
        X[:3, 3] = [0.08 * np.cos(k), 0.08 * np.sin(k), -0.02]
        scene.rigid(shape, X, anchored=k % 2 == 0)
    rng = np.random.default_rng(3)
    scene.deform(soft, lambda q: q + rng.normal(scale=0.3 * CELL, size=q.shape))
    contact = scene.contact()
    assert len(contact) == 8
    assert [s.id_B for s in contact] == sorted(s.id_B for s in contact)
    for surface in contact:
        check_invariants(surface, scene.query)


def test_resolution_of_a_curved_surface(scene):
    """The hydroelastic resolution_hint makes a ball rounder; its area converges from below."""
    scene.soft(CUBE, CELL)
    radius = 0.05
    ball = scene.rigid(Sphere(radius))
    errors, exact = [], 4.0 * np.pi * radius**2
    for hint in (0.02, 0.01, 0.005):
        properties = ProximityProperties()
        add_rigid_hydroelastic_properties(properties, hint)
        scene.graph.assign_role(
            scene.source, ball, properties, RoleAssign.REPLACE, context=scene.context
        )
        errors.append(exact - scene.contact()[0].total_area)
    assert errors[0] > 2.5 * errors[1] > 6.0 * errors[2] > 0.0


def test_moved_rigid_geometry(scene, pose):
    """A rigid geometry on a frame is met where its frame is, also in a what-if snapshot."""
    scene.soft(CUBE, CELL)
    ball = scene.rigid(Sphere(0.03), anchored=False)
    frame = scene.graph.model_inspector().get_frame_id(ball)
    scene.context.set_frame_poses(scene.source, {frame: pose(z=10.0)})
    assert len(scene.contact()) == 0
    what_if = type(scene.query)(scene.query.snapshot.with_frame_poses({frame: pose()}))
    assert len(what_if.compute_deformable_contact()) == 1
    scene.context.set_frame_poses(scene.source, {frame: pose(x=0.02)})
    (surface,) = scene.contact()
    mean = surface.face_areas @ surface.contact_points_W / surface.total_area
    assert np.allclose(mean, [0.02, 0.0, 0.0], rtol=0, atol=1e-6)


def test_flat_and_open_surfaces(scene, check_invariants):
    """A flat hull has two sides, an open mesh the one it shows; points and lines have none."""
    soft = scene.soft(CUBE, CELL)
    sheet = 0.05 * np.array([[1.0, 0, 0], [-0.5, 0.8, 0], [-0.5, -0.8, 0]])
    area = 0.05**2 * 0.5 * 1.5 * 1.6
    flat = scene.rigid(Convex(vertices=sheet))
    shown = scene.rigid(Mesh(vertices=sheet, faces=[[0, 1, 2]]))
    scene.rigid(Convex(vertices=sheet[:2]))
    scene.rigid(Sphere(0.0))
    scene.deform(soft, lambda q: q + np.array([0.0, 0.0, 0.013]))
    both, one = scene.contact()
    assert (both.id_B, one.id_B) == (flat, shown)
    for surface in (both, one):
        check_invariants(surface, scene.query)
    assert both.total_area == pytest.approx(2.0 * area, rel=1e-12)
    assert np.abs(both.face_areas @ both.nhats_BA_W).max() < 1e-15
    assert one.total_area == pytest.approx(area, rel=1e-12)
    assert np.allclose(one.nhats_BA_W, [0.0, 0.0, 1.0], rtol=0, atol=0)
