import numpy as np
import pytest
import trimesh

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
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import validate
from scene_graph_ros.geometry.tables.shape_table import build_shape_table

_CUBE = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def test_rows_of_primitives():
    """Sizes are halves and radii as documented, boxes tight, the scale the largest extent."""
    shapes = [
        Sphere(2.0),
        Capsule(1.0, 4.0),
        Box(2.0, 4.0, 6.0),
        Cylinder(1.0, 4.0),
        Ellipsoid(1.0, 2.0, 3.0),
        HalfSpace(),
    ]
    table = build_shape_table(shapes, [False] * 6)
    assert table.kind.tolist() == [0, 1, 2, 3, 4, 5]
    assert table.size.tolist() == [
        [2, 0, 0], [1, 2, 0], [1, 2, 3], [1, 2, 0], [1, 2, 3], [0, 0, 0],
    ]  # fmt: skip
    assert table.scale.tolist() == [4, 6, 6, 4, 6, 0]
    assert table.upper[:5].tolist() == [[2, 2, 2], [1, 1, 3], [1, 2, 3], [1, 1, 2], [1, 2, 3]]
    assert np.isinf(table.upper[5]).all()
    assert np.array_equal(table.lower, -table.upper)
    assert (table.hull == -1).all()


def test_equal_sources_share_one_hull_and_other_scales_do_not():
    """Two geometries of one source and scale use the same hull; another scale is another hull."""
    shapes = [
        Convex(vertices=_CUBE),
        Convex(vertices=_CUBE.copy()),
        Convex(vertices=_CUBE, scale=2.0),
    ]
    table = build_shape_table(shapes, [False] * 3)
    assert table.hull.tolist() == [0, 0, 1]
    assert len(table.hulls.vertices) == 16
    assert table.scale.tolist() == [2.0, 2.0, 4.0]


def test_indices_of_packed_hulls_and_surfaces_stay_inside_their_rows():
    """Vertices, neighbours, faces, triangles and nodes of each mesh refer to its own rows."""
    ring, ball = trimesh.creation.torus(1.0, 0.3), trimesh.creation.icosphere(1)
    shapes = [Mesh(vertices=m.vertices, faces=m.faces) for m in (ring, ball)]
    table = build_shape_table([Sphere(1.0), *shapes], [False, True, True])
    assert table.surface.tolist() == [-1, 0, 1]
    assert table.exact.tolist() == [False, True, False]  # the ball is its own hull
    h, s = table.hulls, table.surfaces
    for k in range(2):
        own = range(h.vertex_start[k], h.vertex_start[k + 1])
        first, last = h.neighbor_start[own[0]], h.neighbor_start[own[-1] + 1]
        assert np.isin(h.neighbors[first:last], own).all()
        f, g = h.face_start[k], h.face_start[k + 1]
        corners = h.face_vertices[h.face_vertex_start[f] : h.face_vertex_start[g]]
        assert set(corners) == set(own)
        heights = h.vertices[own] @ h.face_normals[f:g].T
        assert np.allclose(heights.max(axis=0), h.face_offsets[f:g])
        t = slice(s.triangle_start[k], s.triangle_start[k + 1])
        v = range(s.vertex_start[k], s.vertex_start[k + 1])
        assert set(s.triangles[t].ravel()) == set(v)
        assert sorted(s.order[t]) == list(range(t.start, t.stop))
        root = s.node_start[k]
        assert np.array_equal(s.node_lower[root], s.vertices[v].min(axis=0))
        inner = s.node_left[root : s.node_start[k + 1]]
        assert inner[inner >= 0].min() > root
        assert inner[inner >= 0].max() < s.node_start[k + 1]
        assert (-1 - inner[inner < 0]).min() == t.start


def test_mirrored_mesh_faces_outwards_and_is_where_the_mirror_puts_it():
    """A negative factor turns the triangles round, also of an open mesh."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    shape = Mesh(vertices=vertices, faces=[[0, 1, 2]], scale=(-2.0, 1.0, 1.0))
    table = build_shape_table([shape], [True])
    # Mirrored at x = 0, the outward normal +z of the open triangle stays +z.
    assert table.surfaces.normals.tolist() == [[0.0, 0.0, 1.0]]
    assert table.lower[0].tolist() == [-2.0, 0.0, 0.0]


def test_empty_table_has_the_types_of_a_full_one():
    """No shapes make arrays of the same types and dimensions, so one compilation fits both."""

    def types(table):
        flat = [*table[:-2], *table.hulls, *table.surfaces]
        return [(a.dtype, a.ndim, a.flags.c_contiguous, a.flags.writeable) for a in flat]

    full = build_shape_table([Sphere(1.0), Mesh(vertices=_CUBE[:3], faces=[[0, 1, 2]])], [0, 1])
    assert types(build_shape_table([], [])) == types(full)


def test_mesh_without_triangles_is_refused_but_its_points_have_a_hull(tmp_path):
    """A file of points is a Convex, not a Mesh; the message names the file."""
    path = tmp_path / "points.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n")
    assert len(build_shape_table([Convex(path)], [False]).hulls.vertices) == 4
    with pytest.raises(MeshError, match=str(path)):
        build_shape_table([Mesh(path)], [False])


@pytest.mark.parametrize("scale", [1.0, -1e9])
def test_mesh_that_reaches_too_far_is_refused(tmp_path, scale):
    """A file's coordinates, scaled, have the bound that every other size has."""
    path = tmp_path / "far.obj"
    path.write_text("v 0 0 0\nv 1e300 0 0\nv 0 10 0\nf 1 2 3\n")
    for shape in (Convex(path, scale), Mesh(path, scale)):
        with pytest.raises(MeshError, match=r"far\.obj.* scaled by .* further than 1e\+09 m"):
            validate(shape)
