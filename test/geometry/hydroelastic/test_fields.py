"""Pressure fields: values at known points, exactness, gradients, margins."""

import math

import numpy as np
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    Mesh,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.hydroelastic.elements import linear_fields
from scene_graph_ros.geometry.hydroelastic.fields import compliant_solid, solid_of_volume_mesh
from scene_graph_ros.geometry.meshes import tetrahedralize
from scene_graph_ros.geometry.meshes.sources import surface_of
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface, tessellate_volume
from scene_graph_ros.geometry.meshes.volume_io import save_volume_mesh
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

MODULUS = 1e7


def _fields(solid):
    vertices, tetrahedra = np.array(solid.vertices), np.array(solid.tetrahedra)
    return linear_fields(vertices, tetrahedra, MODULUS * solid.extent)


def _at(solid, points):
    """Return the extent at points inside, by the tetrahedron that has them; NaN outside."""
    gradient, constant = _fields(solid)
    result = np.full(len(points), math.nan)
    corners = solid.vertices[solid.tetrahedra]
    matrices = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    for k, point in enumerate(points):
        weights = np.linalg.solve(matrices, (point - corners[:, 0])[:, :, None])[:, :, 0]
        inside = np.minimum(weights.min(axis=1), 1.0 - weights.sum(axis=1))
        if inside.max() >= -1e-9:
            t = int(inside.argmax())
            result[k] = (gradient[t] @ point + constant[t]) / MODULUS
    return result


def _random_inside(shape, count=300):
    """Return points in a box a little larger than that around the shape."""
    vertices, _ = tessellate_surface(shape, 0.05)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    grown = 0.02 * (upper - lower)
    return np.random.default_rng(0).uniform(lower - grown, upper + grown, (count, 3))


@pytest.mark.parametrize(
    "sizes",
    [(0.1, 0.2, 0.3), (0.3, 0.2, 0.1), (0.2, 0.2, 0.2), (0.1, 0.3, 0.1), (0.3, 0.1, 0.3),
     (1.0, 1e-3, 1.0), (1e-3, 1.0, 1e-3)],
)  # fmt: skip
def test_field_of_a_box_is_the_distance_exactly(sizes):
    """Distance to the nearest face over the largest distance there is, everywhere inside."""
    half = 0.5 * np.array(sizes)
    points = np.random.default_rng(0).uniform(-half, half, (300, 3))
    exact = (half - np.abs(points)).min(axis=1) / half.min()
    solid = compliant_solid(Box(*sizes), None, 0.0)
    assert np.abs(_at(solid, points) - exact).max() <= 1e-12


def test_gradient_of_a_box_is_along_a_face_normal():
    """In each tetrahedron the pressure rises straight from one face, by E over the depth."""
    gradient, _ = _fields(compliant_solid(Box(0.1, 0.2, 0.3), None, 0.0))
    slopes = np.sort(np.abs(gradient), axis=1) / (MODULUS / 0.05)
    assert np.abs(slopes - [0.0, 0.0, 1.0]).max() <= 1e-13


def _cylinder_extent(p, radius, half):
    depth = np.minimum(radius - np.hypot(p[:, 0], p[:, 1]), half - np.abs(p[:, 2]))
    return depth / min(radius, half)


def _capsule_extent(p, radius, half):
    nearest = np.clip(p, [0, 0, -half], [0, 0, half])
    return 1.0 - np.linalg.norm(p - nearest, axis=1) / radius


ROUND = [
    (Sphere(0.2), lambda p: 1.0 - np.linalg.norm(p, axis=1) / 0.2),
    (Ellipsoid(0.2, 0.3, 0.1), lambda p: 1.0 - np.linalg.norm(p / [0.2, 0.3, 0.1], axis=1)),
    (Capsule(0.1, 0.3), lambda p: _capsule_extent(p, 0.1, 0.15)),
    (Cylinder(0.1, 0.3), lambda p: _cylinder_extent(p, 0.1, 0.15)),
    (Cylinder(0.2, 0.1), lambda p: _cylinder_extent(p, 0.2, 0.05)),
    (Cylinder(0.1, 0.2), lambda p: _cylinder_extent(p, 0.1, 0.1)),
]


@pytest.mark.parametrize(("shape", "exact"), ROUND, ids=[repr(shape) for shape, _ in ROUND])
def test_field_of_round_shapes_converges_with_second_order(shape, exact):
    """The largest error over many points falls fourfold when the hint is halved."""
    points = _random_inside(shape)
    errors = []
    for hint in (0.08, 0.04, 0.02):
        values = _at(compliant_solid(shape, hint, 0.0), points)
        inside = ~np.isnan(values)
        assert inside.mean() > 0.3
        errors.append(np.abs(values - exact(points))[inside].max())
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(2.0, abs=0.35)


@pytest.mark.parametrize(
    ("shape", "point"),
    [
        (Sphere(0.2), [0.0, 0.0, 0.0]),
        (Ellipsoid(0.2, 0.3, 0.1), [0.0, 0.0, 0.0]),
        (Capsule(0.1, 0.3), [0.0, 0.0, 0.15]),
        (Capsule(0.1, 0.3), [0.0, 0.0, -0.1]),
        (Cylinder(0.1, 0.3), [0.0, 0.0, 0.05]),
        (Cylinder(0.2, 0.1), [0.0, 0.149, 0.0]),
        (Convex(vertices=[[0, 0, 0], [2, 0, 0], [0, 2, 0], [2, 2, 0], [0, 0, 1], [2, 0, 1],
                          [0, 2, 1], [2, 2, 1]]), [1.0, 1.0, 0.5]),
    ],
    ids=repr,
)  # fmt: skip
def test_extent_is_one_at_the_deepest_place(shape, point):
    """Centre, segment, disk or centre of the largest ball."""
    solid = compliant_solid(shape, 0.02, 0.0)
    assert _at(solid, np.array([point], dtype=float))[0] == pytest.approx(1.0, abs=2e-3)


def test_gradient_of_a_thin_tetrahedron_keeps_its_digits():
    """Two corners on the surface and two, 1e-9 apart, at the deepest: the slope is exact."""
    tiny = 1e-9
    points = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, tiny, 0.5], [0.0, -tiny, 0.5]])
    for order in ([0, 1, 2, 3], [2, 0, 3, 1], [3, 2, 1, 0]):
        pressure = np.array([0.0, 0.0, 1.0, 1.0])[order]
        gradient, constant = linear_fields(points[order], np.array([[0, 1, 2, 3]]), pressure)
        assert gradient[0] == pytest.approx([0.0, 0.0, 2.0], abs=1e-15)
        assert constant[0] == 0.0


WITH_MARGIN = [
    Sphere(0.2),
    Box(0.1, 0.2, 0.3),
    Capsule(0.1, 0.3),
    Cylinder(0.1, 0.3),
    Cylinder(0.2, 0.1),
    Ellipsoid(0.2, 0.3, 0.1),
    Convex(vertices=0.1 * np.random.default_rng(1).normal(size=(20, 3))),
]


@pytest.mark.parametrize("shape", WITH_MARGIN, ids=repr)
def test_margin_leaves_the_field_inside_as_it_was(shape):
    """Inside the body the pressure is that without a margin; around it, it is negative."""
    points = _random_inside(shape)
    plain = _at(compliant_solid(shape, 0.05, 0.0), points)
    grown_solid = compliant_solid(shape, 0.05, 0.005)
    grown = _at(grown_solid, points)
    inside = ~np.isnan(plain)
    assert np.abs(grown[inside] - plain[inside]).max() <= 1e-9
    outside = ~inside & ~np.isnan(grown)
    assert outside.any()
    assert (grown[outside] <= 1e-9).all()


@pytest.mark.parametrize("shape", WITH_MARGIN, ids=repr)
def test_margin_moves_every_face_out_by_it(shape):
    """Points at 0.9 margins above each triangle's middle are in the layer, at 1.5 outside."""
    margin = 0.005
    vertices, triangles = tessellate_surface(shape, 0.05)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    middle = (a + b + c) / 3.0
    solid = compliant_solid(shape, 0.05, margin)
    above = _at(solid, (middle + 0.9 * margin * normals)[::3])
    assert (above < 0.0).all()  # and not NaN
    if not isinstance(shape, (Convex, Ellipsoid)):
        assert np.isnan(_at(solid, (middle + 1.5 * margin * normals)[::3])).all()


L_OUTLINE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]
"""The square 2 x 2 less a unit square, not convex."""
L_TRIANGLES = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]]
U_OUTLINE = [[0, 0], [3, 0], [3, 2], [2, 2], [2, 1], [1, 1], [1, 2], [0, 2]]
"""A slot of width 1 between walls of width 1."""
U_TRIANGLES = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]]


def _prism(outline, triangles):
    """Return the vertices and outward triangles of a prism of height 1."""
    n = len(outline)
    vertices = [np.column_stack([outline, np.full(n, z)]) for z in (0.0, 1.0)]
    faces = [[a, c, b] for a, b, c in triangles]
    faces += [[a + n, b + n, c + n] for a, b, c in triangles]
    for k in range(n):
        after = (k + 1) % n
        faces += [[k, after, after + n], [k, after + n, k + n]]
    return np.concatenate(vertices), np.array(faces)


def _prism_volume(outline, triangles):
    """Return the prism as tetrahedra, all with all their vertices on the surface."""
    vertices, _ = _prism(outline, triangles)
    n = len(outline)
    tetrahedra = []
    for triangle in triangles:
        a, b, c = sorted(triangle)
        tetrahedra += [[a, b, c, c + n], [a, b, c + n, b + n], [a, b + n, c + n, a + n]]
    corners = vertices[np.array(tetrahedra)]
    negative = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    turned = [
        [b, a, c, d] if turn else [a, b, c, d]
        for (a, b, c, d), turn in zip(tetrahedra, negative, strict=True)
    ]
    return VolumeMesh(vertices, turned)


def test_tetrahedra_on_the_surface_alone_are_cut():
    """Each becomes four; the extent inside is the distance to the surface over the largest."""
    mesh = _prism_volume(L_OUTLINE, L_TRIANGLES)
    solid = solid_of_volume_mesh(mesh, 0.0, "an L")
    VolumeMesh(solid.vertices, solid.tetrahedra)
    assert len(solid.tetrahedra) == 4 * mesh.num_tetrahedra
    assert (solid.extent[solid.tetrahedra] > 0.0).any(axis=1).all()
    x, y, z = solid.vertices[solid.surface_count :].T
    # The L is the union of [0, 2] x [0, 1] and [0, 1] x [0, 2], so inside it the distance to its
    # outline is that to the sides, or to the inner corner (1, 1).
    corner = np.hypot(np.minimum(x - 1.0, 0.0), np.minimum(y - 1.0, 0.0))
    inner = np.where(x > 1.0, 1.0 - y, np.where(y > 1.0, 1.0 - x, corner))
    depth = np.min([x, y, 2.0 - x, 2.0 - y, z, 1.0 - z, inner], axis=0)
    assert solid.extent[solid.surface_count :] == pytest.approx(depth / depth.max(), rel=1e-12)
    assert (solid.extent[: solid.surface_count] == 0.0).all()


def test_mesh_of_a_file_has_the_distance_as_its_field(tmp_path):
    """The box's own tetrahedra from a file give the same field as the box."""
    path = tmp_path / "box.vtk"
    save_volume_mesh(path, tessellate_volume(Box(0.1, 0.2, 0.3)))
    solid = compliant_solid(Mesh(path), None, 0.0)
    points = np.random.default_rng(0).uniform([-0.05, -0.1, -0.15], [0.05, 0.1, 0.15], (50, 3))
    expected = _at(compliant_solid(Box(0.1, 0.2, 0.3), None, 0.0), points)
    assert np.abs(_at(solid, points) - expected).max() <= 1e-12


def test_margin_of_a_mesh_that_is_not_convex():
    """The layer surrounds the body; one wider than half the slot folds over and is refused."""
    slotted = _prism_volume(U_OUTLINE, U_TRIANGLES)
    solid = solid_of_volume_mesh(slotted, 0.01, "a U")
    mesh = VolumeMesh(solid.vertices, solid.tetrahedra)
    lower, upper = mesh.bounding_box()
    assert lower == pytest.approx([-0.01, -0.01, -0.01], rel=2e-3)
    assert upper == pytest.approx([3.01, 2.01, 1.01], rel=1e-5)
    # The outline of the layer: 3.02 x 2.02 less a slot of 0.98 x 1, times a height of 1.02.
    assert mesh.volume == pytest.approx((3.02 * 2.02 - 0.98 * 1.0) * 1.02, rel=1e-4)
    solid_of_volume_mesh(slotted, 0.49, "a U")
    with pytest.raises(MeshError, match=r"margin 0\.51 m of a U is too large"):
        solid_of_volume_mesh(slotted, 0.51, "a U")


def test_mesh_that_is_not_convex_is_filled_by_the_library():
    """The result is a volume mesh of the L, all of it; a second request gives the same."""
    pytest.importorskip("pytetwild")
    vertices, faces = _prism(L_OUTLINE, L_TRIANGLES)
    shape = Mesh(vertices=vertices, faces=faces)
    solid = compliant_solid(shape, 1.0, 0.0)
    mesh = VolumeMesh(solid.vertices, solid.tetrahedra)
    assert mesh.volume == pytest.approx(3.0, rel=5e-3)  # its surface may move by 3e-3 m
    assert tessellate_volume(shape, 1.0) is tessellate_volume(shape, 1.0)
    assert solid.extent.max() == 1.0
    assert (solid.extent[solid.tetrahedra] > 0.0).any(axis=1).all()


def test_the_library_fills_a_mesh_once_for_all_processes(monkeypatch):
    """Its result differs from run to run; others, who remember nothing, have the same one."""
    pytest.importorskip("pytetwild")
    vertices, faces = _prism(L_OUTLINE, L_TRIANGLES)
    surface = surface_of(Mesh(vertices=vertices, faces=faces))
    first = tetrahedralize.tetrahedralize(surface, 1.0, "an L")
    assert (first.volumes() > 0.0).all()

    def run_again(*_):
        raise AssertionError("the library was run again")

    monkeypatch.setattr(tetrahedralize, "_run", run_again)
    again = tetrahedralize.tetrahedralize(surface, 1.0, "an L")
    assert again.vertices.tobytes() == first.vertices.tobytes()
    assert again.tetrahedra.tobytes() == first.tetrahedra.tobytes()
    with pytest.raises(AssertionError, match="run again"):
        tetrahedralize.tetrahedralize(surface, 0.9, "an L")


def test_library_that_takes_too_long_is_stopped(monkeypatch):
    """The error names the mesh and says what to do instead."""
    pytest.importorskip("pytetwild")
    monkeypatch.setattr(tetrahedralize, "PATIENCE", 1e-3)
    vertices, faces = _prism(L_OUTLINE, L_TRIANGLES)
    # Of another size than the meshes above, which are kept.
    with pytest.raises(MeshError, match=r"in 0\.001 s: give it as a \.vtk"):
        tessellate_volume(Mesh(vertices=1.25 * np.asarray(vertices), faces=faces), 1.0)
