import itertools

from mesh_distances import signed_distances
import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry import Convex, Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.meshes.sources import hull_of, surface_of
from scene_graph_ros.geometry.meshes.surfaces import build_surface, is_convex_surface


def _box():
    box = trimesh.creation.box((2.0, 2.0, 2.0))
    return np.array(box.vertices), np.array(box.faces)


def _soup(vertices, triangles):
    """Return the same triangles with three vertices of their own each, as STL has them."""
    return vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def test_soup_of_triangles_is_welded_and_closed():
    """Vertices with equal coordinates are one, so a mesh from STL is closed."""
    surface = build_surface(*_soup(*_box()), name="box")
    assert (len(surface.vertices), len(surface.triangles)) == (8, 12)
    assert surface.is_closed


def test_pseudonormals_of_a_box_point_along_diagonals():
    """At a corner, three right angles give (1, 1, 1)/sqrt 3; at an edge, the mean of two sides."""
    surface = build_surface(*_box(), name="box")
    assert np.allclose(surface.vertex_pseudonormals, surface.vertices / np.sqrt(3.0))
    for triangle, normals in zip(surface.triangles, surface.edge_pseudonormals, strict=True):
        for k in range(3):
            middle = surface.vertices[[triangle[k], triangle[(k + 1) % 3]]].mean(axis=0)
            assert np.allclose(normals[k], middle / np.linalg.norm(middle))


def test_duplicates_and_collapsed_triangles_are_dropped():
    """Of triangles on the same vertices one stays; a triangle with a vertex twice goes."""
    vertices, triangles = _box()
    more = np.concatenate([triangles, triangles[:2], triangles[3:4, ::-1], [[0, 0, 1]]])
    surface = build_surface(vertices, more, name="box")
    assert len(surface.triangles) == 12
    assert surface.is_closed


def test_needle_on_an_edge_leaves_the_mesh_closed():
    """A triangle without area closes the mesh by its edges, but is no part of the surface."""
    # A tetrahedron whose edge AB is split at M in one face only; the needle A M B closes the gap.
    a, b, c, d = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    m = 0.5 * (a + b)
    triangles = [[0, 4, 3], [4, 1, 3], [0, 1, 4], [0, 2, 1], [0, 3, 2], [1, 2, 3]]
    surface = build_surface(np.array([a, b, c, d, m]), np.array(triangles), name="needle")
    assert surface.is_closed
    assert len(surface.triangles) == 5
    assert np.allclose(np.linalg.norm(surface.vertex_pseudonormals, axis=1), 1.0)
    middle = np.flatnonzero((surface.vertices == m).all(axis=1))[0]
    # M lies on the edge between the sides y = 0 and z = 0.
    assert np.allclose(surface.vertex_pseudonormals[middle], [0.0, -1.0, -1.0] / np.sqrt(2.0))


@pytest.mark.parametrize("places", [[0.3], [0.2, 0.6], [0.1, 0.2, 0.7, 0.8, 0.9]])
@pytest.mark.parametrize("turned", [False, True])
def test_needles_beside_needles_leave_an_edge_between_its_faces(places, turned):
    """Of a wedge's edge one face has it whole, the other in pieces: its sides are those of both.

    Each needle reaches from the last point to the far end, so that the way leads over all of them.
    """
    A, B, P, Q, R, S = range(6)
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0.3), (1, 1, 0.3), (0, 1, -0.3), (1, 1, -0.3)]
    vertices = np.array(corners + [(x, 0, 0) for x in places], dtype=float)
    ring = [A, *range(6, 6 + len(places)), B]
    triangles = [(A, B, S), (A, S, R), (P, S, Q), (P, R, S), (A, R, P), (B, Q, S)]
    # The whole edge, needles from B, and fans of what is beyond.
    triangles += [(B, a, b) for a, b in itertools.pairwise(ring[:-1])]
    triangles += [(b, a, Q) for a, b in itertools.pairwise(ring)] + [(A, P, Q)]
    triangles = np.array(triangles)
    if turned:
        vertices, triangles = vertices * (1, 1, -1), triangles[:, ::-1]
    mesh = Mesh(vertices=vertices, faces=triangles)
    report = surface_of(mesh).report
    assert (report.parts, report.is_closed, report.repairs) == (1, True, ()), str(report)
    way = np.linspace(np.pi / 2 - 0.3, -np.pi / 2 + 0.3, 9)
    outside = np.stack([0 * way, -np.cos(way), np.sin(way)], axis=1)
    asked = np.concatenate([(x, 0, 0) + 0.05 * outside for x in (0.05, 0.15, 0.45, 0.95)])
    np.testing.assert_allclose(signed_distances(mesh, asked), 0.05, rtol=1e-9)


def test_inside_out_mesh_is_turned():
    """A closed mesh whose triangles face inwards is turned, so inside is inside."""
    vertices, triangles = _box()
    surface = build_surface(vertices, triangles[:, ::-1], name="box")
    centroids = surface.vertices[surface.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", centroids, surface.normals) > 0.0).all()


def test_a_missing_triangle_leaves_a_sheet():
    """It leaves three edges of one triangle, and says where."""
    vertices, triangles = _box()
    surface = build_surface(vertices, triangles[1:], name="open")
    assert (surface.is_closed, surface.solid_parts, surface.report.sheets) == (False, 0, 1)
    assert len(surface.open_edges) == 3
    assert "3 edges are open, one at (" in surface.report.reason


def test_triangles_turned_around_are_turned_back_and_reported():
    """How a closed part is oriented follows from its neighbours and its volume."""
    vertices, triangles = _box()
    twisted = triangles.copy()
    twisted[[0, 5]] = twisted[[0, 5], ::-1]
    surface = build_surface(vertices, twisted, name="twisted")
    assert surface.is_closed
    centroids = surface.vertices[surface.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", centroids, surface.normals) > 0.0).all()
    assert [(r.kind, r.count) for r in surface.report.repairs] == [("triangles turned", 2)]


def test_mesh_without_area_is_refused():
    """Triangles on a line, or none at all, are no surface."""
    line = np.outer(np.arange(4.0), [1.0, 1.0, 1.0])
    with pytest.raises(MeshError, match=r"wire.*no triangle with an area"):
        build_surface(line, np.array([[0, 1, 2], [1, 2, 3]]), name="wire")
    with pytest.raises(MeshError, match="no triangle with an area"):
        build_surface(line, np.zeros((0, 3), dtype=int), name="points")


@pytest.mark.parametrize("n", [1, 4, 5, 37])
def test_every_triangle_is_in_one_leaf_and_inside_all_boxes_above(n):
    """The tree's leaves hold each triangle once, and each box holds what is below it."""
    rng = np.random.default_rng(n)
    vertices = rng.normal(size=(3 * n, 3))
    surface = build_surface(vertices, np.arange(3 * n).reshape(n, 3), name="soup")
    corners = surface.vertices[surface.triangles]
    found, pending = [], [(0, [])]
    while pending:
        node, above = pending.pop()
        path = [*above, node]
        if surface.node_left[node] >= 0:
            pending += [(surface.node_left[node], path), (surface.node_right[node], path)]
            continue
        slot = -1 - surface.node_left[node]
        for t in surface.order[slot : slot + surface.node_right[node]]:
            found.append(t)
            assert (corners[t] >= surface.node_lower[path].max(axis=0)).all()
            assert (corners[t] <= surface.node_upper[path].min(axis=0)).all()
    assert sorted(found) == list(range(n))


def test_convex_surfaces_are_recognized():
    """A ball's triangulation is its own hull, a torus is not, nor is an open box."""
    for mesh, expected in (
        (trimesh.creation.icosphere(2), True),
        (trimesh.creation.torus(1.0, 0.3), False),
    ):
        surface = build_surface(np.array(mesh.vertices), np.array(mesh.faces), name="mesh")
        assert is_convex_surface(surface, convex_hull(surface.vertices)) is expected
    vertices, triangles = _box()
    opened = build_surface(vertices, triangles[1:], name="open")
    assert not is_convex_surface(opened, convex_hull(vertices))


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_what_is_smaller_than_numbers_can_tell_is_refused():
    """By its size; what is a little larger is a solid with a cavity, and a point is a point."""
    outer, rows = _box()
    faces = np.vstack([rows, rows[:, ::-1] + 8])
    corners = np.vstack([outer, 0.5 * outer])

    def shapes(size, scale=1.0):
        mesh = Mesh(vertices=size * corners, faces=faces, scale=scale)
        return mesh, Convex(vertices=size * corners, scale=scale)

    for size in (1e-29, 1e-9):
        mesh, convex = shapes(size)
        assert surface_of(mesh).report.cavities == 1
        assert len(hull_of(mesh).vertices) == len(hull_of(convex).vertices) == 8
    for size in (1e-31, 1e-100, 1e-160, 1e-320):
        for shape in shapes(size):
            with pytest.raises(MeshError, match="smaller than 1e-30 m"):
                hull_of(shape)
    for shape in shapes(1e-25, 1e-8):
        with pytest.raises(MeshError, match=r"scaled by \(1e-08, 1e-08, 1e-08\) it is smaller"):
            hull_of(shape)
    assert len(hull_of(Convex(vertices=np.zeros((2, 3)))).vertices) == 1
