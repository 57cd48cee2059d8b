import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.surface_mesh import read_obj_to_surface_mesh, SurfaceMesh

_TETRAHEDRON = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 2.0]]
_FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_measures_of_a_right_tetrahedron():
    """Areas are halves of rectangles, the volume a sixth of the block, the normals outward."""
    mesh = SurfaceMesh(_TETRAHEDRON, _FACES)
    assert mesh.num_vertices == 4
    assert mesh.num_triangles == 4
    # The slanted side: half of |(-3, 4, 0) x (-3, 0, 2)| = half of |(8, 6, 12)|.
    assert mesh.areas == pytest.approx([6.0, 3.0, 4.0, 0.5 * np.sqrt(244.0)])
    assert mesh.total_area == pytest.approx(13.0 + 0.5 * np.sqrt(244.0))
    assert mesh.face_normals[0] == pytest.approx([0.0, 0.0, -1.0])
    assert mesh.volume == pytest.approx(3.0 * 4.0 * 2.0 / 6.0)
    assert mesh.is_closed
    assert mesh.element_centroids[0] == pytest.approx([1.0, 4 / 3, 0.0])
    assert mesh.bounding_box()[1] == pytest.approx([3.0, 4.0, 2.0])
    assert mesh.cartesian_from_barycentric(3, [0.5, 0.5, 0.0]) == pytest.approx([1.5, 2.0, 0.0])


def test_centroid_is_weighted_by_area():
    """Of a large and a small triangle, the centroid lies near the large one."""
    mesh = SurfaceMesh(
        [[0, 0, 0], [3, 0, 0], [0, 3, 0], [0, 0, 8], [1, 0, 8], [0, 1, 8]],
        [[0, 1, 2], [3, 4, 5]],
    )
    assert mesh.centroid == pytest.approx(np.array([9 * 1 + 1 / 3, 9 * 1 + 1 / 3, 8]) / 10)
    assert not mesh.is_closed
    with pytest.raises(MeshError, match="not closed"):
        mesh.volume  # noqa: B018


def test_arrays_cannot_be_written():
    """A mesh is immutable, and does not share memory with what it was made of."""
    source = np.array(_TETRAHEDRON)
    mesh = SurfaceMesh(source, _FACES)
    source[0] = 7.0
    assert mesh.vertices[0].tolist() == [0.0, 0.0, 0.0]
    for array in (mesh.vertices, mesh.triangles, mesh.areas, mesh.face_normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("vertices", "triangles", "reason"),
    [
        (_TETRAHEDRON, [], "no triangles"),
        ([], _FACES, "no vertices"),
        (_TETRAHEDRON, [[0, 1, 4]], r"triangle 0 refers to vertices \[0, 1, 4\]"),
        ([[0, 0, np.inf]], [[0, 0, 0]], "vertex 0 is not finite"),
        ([[0, 0, 0], [0, 1e13, 0]], [[0, 0, 1]], r"vertex 1 is not within 1e\+12 m"),
        ([[0, 0, 0], [0, 1e300, 0]], [[0, 0, 1]], r"vertex 1 is not within 1e\+12 m"),
        (_TETRAHEDRON, [[0, 1, 1.5]], "triangles must be .* whole numbers"),
        (_TETRAHEDRON, [[0, 1, 2, 3], [3, 2, 1, 0], [0, 2, 3, 1]], r"not \(3, 4\)"),
        (_TETRAHEDRON, [[0, 1, 2], [0, 1]], "triangles must be"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], r"vertices must be \(n, 3\), not \(3, 2\)"),
        ("points", _FACES, "vertices must be"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices, triangles, reason):
    """The message says which entry is wrong."""
    with pytest.raises(MeshError, match=reason):
        SurfaceMesh(vertices, triangles)


def test_file_is_read_and_scaled(tmp_path):
    """The scale multiplies coordinates; a scale that is not positive is refused."""
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert read_obj_to_surface_mesh(path, 2.0).total_area == pytest.approx(2.0)
    for bad in (-1.0, 0.0, np.nan, "2", True):
        with pytest.raises(MeshError, match=f"scale .* {bad!r}"):
            read_obj_to_surface_mesh(path, bad)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("size", [1e-150, 1e-9, 1.0, 1e11])
def test_all_is_finite_at_any_size(size):
    """Areas, normals, volume and weights; at 1e-150 there is no area in numbers."""
    mesh = SurfaceMesh(size * np.array(_TETRAHEDRON), _FACES)
    for values in (mesh.areas, mesh.face_normals, mesh.volume, mesh.centroid, mesh.total_area):
        assert np.isfinite(values).all()
    if size > 1e-150:
        weights = mesh.calc_barycentric(mesh.element_centroids[0], 0)
        np.testing.assert_allclose(weights, 1.0 / 3.0, rtol=1e-14)


def test_a_scale_beyond_all_floats_is_refused(tmp_path):
    """By its vertex, without a warning."""
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 1e10 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match="vertex 1 is not finite"):
        read_obj_to_surface_mesh(path, 1e308)
