"""What holds for the meshes of all shapes, ordinary ones, slender ones, tiny and huge ones."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
import numpy as np
import pytest
from searching import times

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    Convex,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    Mesh,
    Sphere,
)
from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.meshes.surfaces import is_closed_surface
from scene_graph_ros.geometry.meshes.tessellate import (
    solid_of,
    tessellate_surface,
    tessellate_volume,
)
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

POINTS = np.random.default_rng(1).normal(size=(30, 3))


def _cube_mesh(sizes):
    """Return a closed mesh of a box, twelve triangles."""
    vertices, triangles = tessellate_surface(Box(*sizes))
    return Mesh(vertices=vertices, faces=triangles)


SHAPES = [
    Sphere(1.0 / 3.0),
    Box(0.1, 0.2, 0.3),
    Box(0.3, 0.3, 0.3),
    Box(0.2, 0.3, 0.2),
    Box(0.3, 0.1, 0.3),
    Capsule(0.1, 0.3),
    Cylinder(0.1, 0.3),
    Cylinder(0.3, 0.1),
    Cylinder(0.1, 0.2),
    Ellipsoid(0.1, 0.2, 0.3),
    Convex(vertices=0.1 * POINTS),
    _cube_mesh((0.1, 0.2, 0.3)),
]
SLENDER = [
    Box(1.0, 1e-3, 1e-3),
    Box(1e-3, 1.0, 1.0),
    Box(1.0, 1.0 - 1e-6, 1.0 + 1e-6),
    Capsule(1e-3, 1.0),
    Capsule(1.0, 1e-3),
    Cylinder(1e-3, 1.0),
    Cylinder(1.0, 1e-3),
    Cylinder(0.5, 1.0 - 1e-6),
    Cylinder(0.5, 1.0 + 1e-6),
    Ellipsoid(1e-3, 1e-3, 1.0),
    Ellipsoid(1.0, 1.0, 1e-3),
    Convex(vertices=POINTS * [1.0, 1.0, 1e-3]),
    Convex(vertices=POINTS * [1e-3, 1e-3, 1.0]),
]


def _size(shape):
    vertices = tessellate_surface(shape, 1e6)[0]
    return float(np.abs(vertices).max())


def _enclosed(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def _assert_right(solid):
    """Check all that does not depend on the shape."""
    mesh = VolumeMesh(solid.vertices, solid.tetrahedra)  # positive, conforming, every vertex used
    on_boundary = np.arange(len(solid.vertices)) < solid.surface_count
    assert (mesh.is_on_boundary() == on_boundary).all()
    as_sets = [np.sort(np.sort(t, axis=1), axis=0) for t in
               (mesh.boundary_triangles(), solid.triangles)]  # fmt: skip
    assert (as_sets[0] == as_sets[1]).all()
    assert is_closed_surface(solid.triangles)
    assert _enclosed(solid.vertices, solid.triangles) == pytest.approx(mesh.volume, rel=1e-9)
    assert (solid.extent[on_boundary] <= 0.0).all()
    assert (solid.extent[solid.tetrahedra] != 0.0).any(axis=1).all(), "a field is nowhere flat"
    assert solid.extent.max() == 1.0


@pytest.mark.parametrize("shape", SHAPES + SLENDER, ids=repr)
@pytest.mark.parametrize("fineness", [0.01, 1.0, 5.0, 40.0])
def test_mesh_is_conforming_positive_and_closed(shape, fineness):
    """With hints far larger than the shape, about as large, and small ones."""
    hint = _size(shape) / fineness
    solid = solid_of(shape, hint)
    _assert_right(solid)
    assert (solid.extent[: solid.surface_count] == 0.0).all()
    vertices, triangles = tessellate_surface(shape, hint)
    assert is_closed_surface(triangles)
    assert _enclosed(vertices, triangles) == pytest.approx(
        tessellate_volume(shape, hint).volume, rel=1e-9
    )


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_margin_grows_the_mesh_and_keeps_the_field(shape):
    """The mesh stays right, and outside of the surface the extent is negative."""
    size = _size(shape)
    hint = size / 4.0
    _assert_right(solid_of(shape, hint, margin=1e-3 * size))
    plain, grown = solid_of(shape, hint), solid_of(shape, hint, margin=1e-3 * size)
    assert (grown.extent[: grown.surface_count] < 0.0).all()
    ratio = (
        VolumeMesh(grown.vertices, grown.tetrahedra).volume
        / VolumeMesh(plain.vertices, plain.tetrahedra).volume
    )
    assert 1.0 < ratio < 1.1


@pytest.mark.parametrize("shape", SHAPES, ids=repr)
def test_same_input_gives_the_same_mesh(shape):
    """Bit for bit, whatever was built in between."""
    first = solid_of(shape, 0.05)
    solid_of(Sphere(1.0), 0.4)
    second = solid_of(shape, 0.05)
    for one, other in zip(first, second, strict=True):
        assert one.tobytes() == other.tobytes()


SCALABLE = [
    Sphere,
    lambda s: Box(s, 2 * s, 3 * s),
    lambda s: Capsule(s, 2 * s),
    lambda s: Cylinder(s, 3 * s),
    lambda s: Cylinder(s, s),
    lambda s: Ellipsoid(s, 2 * s, 3 * s),
    lambda s: Convex(vertices=s * POINTS),
]


@pytest.mark.parametrize("make", SCALABLE)
@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_scale_changes_nothing_but_the_size(make, scale):
    """A body of 0.1 mm and one of 10 km have the same tetrahedra, scaled."""
    # A hint that is no borderline, where rounding would decide about one more division.
    unit, other = solid_of(make(1.0), 0.37), solid_of(make(scale), 0.37 * scale)
    _assert_right(other)
    assert (unit.extent == other.extent).all()
    assert (unit.tetrahedra == other.tetrahedra).all()
    size = np.abs(unit.vertices).max()
    assert np.abs(other.vertices / scale - unit.vertices).max() <= 1e-12 * size
    assert VolumeMesh.trusted(*other[:2]).volume == pytest.approx(
        scale**3 * VolumeMesh.trusted(*unit[:2]).volume, rel=1e-9
    )


lengths = st.floats(min_value=-3.0, max_value=3.0).map(lambda x: 10.0**x)


@pytest.mark.search
@settings(max_examples=times(20), deadline=None)
@given(lengths, lengths, lengths, st.floats(min_value=0.5, max_value=30.0))
def test_all_proportions(a, b, c, fineness):
    """Any sizes between 1 mm and 1 km, in any proportion."""
    for shape in (Box(a, b, c), Capsule(a, b), Cylinder(a, b), Ellipsoid(a, b, c)):
        _assert_right(solid_of(shape, _size(shape) / fineness))


@pytest.mark.search
@settings(max_examples=times(60), deadline=None)
@given(st.floats(min_value=1e-16, max_value=1e-2), st.sampled_from([-1.0, 1.0]))
def test_almost_equal_sizes(difference, sign):
    """Near a cube or a cylinder as wide as long, where the medial axis shrinks to a point."""
    other = 1.0 + sign * difference
    shapes = (Box(1.0, other, 1.0), Box(other, 1.0, other), Cylinder(0.5, other))
    for shape in shapes:
        solid = solid_of(shape, 0.2)
        _assert_right(solid)
        assert VolumeMesh.trusted(*solid[:2]).qualities().min() > 0.0


@pytest.mark.parametrize("shape", [Sphere(1.0), Capsule(1.0, 1.0), Cylinder(1.0, 1.0),
                                   Ellipsoid(1.0, 1.0, 2.0)], ids=repr)  # fmt: skip
class TestHints:
    """Resolution hints of curved shapes."""

    def test_a_missing_one_is_asked_for(self, shape):
        """The message names the shape and the property."""
        for tessellate in (tessellate_surface, tessellate_volume):
            with pytest.raises(PropertyError, match=rf"{shape.type_name}.*resolution_hint"):
                tessellate(shape, None)

    @pytest.mark.parametrize("hint", [0.0, -1.0, math.nan, math.inf])
    def test_a_bad_one_is_refused(self, shape, hint):
        """It must be positive and finite."""
        with pytest.raises(PropertyError, match="positive and finite"):
            tessellate_volume(shape, hint)

    @pytest.mark.parametrize("hint", [1e-7, 1e-300])
    def test_a_tiny_one_is_refused_with_the_count(self, shape, hint):
        """The message has hint, shape, size and the number of elements, and nothing is built."""
        with pytest.raises(MeshError, match=rf"resolution_hint {hint:g} m of .*m in size, asks"):
            tessellate_volume(shape, hint)


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (HalfSpace(), "no bounded surface"),
        (Sphere(0.0), "is a point"),
        (Convex(vertices=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), "flat"),
        (Convex(vertices=[[0, 0, 0]]), "flat"),
    ],
)
def test_shapes_without_a_volume_are_refused(shape, words):
    """The reason is given."""
    with pytest.raises(MeshError, match=words):
        tessellate_volume(shape, 0.1)


def test_open_mesh_is_refused_with_a_remedy():
    """A mesh with a hole has a surface and no volume; the message says what would do."""
    vertices, triangles = tessellate_surface(Box(1.0, 1.0, 1.0))
    shape = Mesh(vertices=vertices, faces=triangles[1:])
    assert len(tessellate_surface(shape)[1]) == 11
    with pytest.raises(MeshError, match=r"not closed.*\.vtk"):
        tessellate_volume(shape)


def test_hull_faces_are_not_cut_into_needles():
    """A face with 40 corners, most of them almost on a line, has no triangle without an area."""
    angles = np.linspace(0.0, 1e-2, 38)
    arc = np.column_stack([np.cos(angles), np.sin(angles)])
    outline = np.concatenate([arc, [[-1.0, 1.0], [-1.0, -1.0]]])
    points = np.concatenate([np.column_stack([outline, np.full(40, z)]) for z in (0.0, 1.0)])
    assert max(len(face) for face in convex_hull(points).faces) == 40
    _assert_right(solid_of(Convex(vertices=points), None))
