"""Volume meshes: what they refuse, and what follows from their tetrahedra."""

import itertools

import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.surfaces import is_closed_surface
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

CORNER = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
# Two tetrahedra over the triangle 1, 2, 3, with apexes at the origin and at (1, 1, 1).
PAIR = np.concatenate([CORNER, [[1.0, 1.0, 1.0]]])
PAIR_CORNERS = [[0, 1, 2, 3], [1, 2, 3, 4]]


def test_volumes_are_those_of_the_corner_of_a_cube():
    """The corner of a unit cube has a sixth of it; that of the other piece is 1/3."""
    mesh = VolumeMesh(PAIR, PAIR_CORNERS)
    # The other piece, by its edges from vertex 1: |det(-1 1 0; -1 0 1; 0 1 1)| / 6 = 2 / 6.
    assert mesh.volumes() == pytest.approx([1.0 / 6.0, 2.0 / 6.0], rel=1e-15)
    assert mesh.volume == pytest.approx(0.5, rel=1e-15)


def test_boundary_is_closed_and_faces_outwards():
    """The face between the two is inside; the other six are the boundary, outward."""
    mesh = VolumeMesh(PAIR, PAIR_CORNERS)
    triangles = mesh.boundary_triangles()
    assert len(triangles) == 6
    assert [1, 2, 3] not in np.sort(triangles, axis=1).tolist()
    assert is_closed_surface(triangles)
    a, b, c = (PAIR[triangles[:, k]] for k in range(3))
    # The divergence theorem: outward faces give the volume with a positive sign.
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(0.5, rel=1e-14)
    assert mesh.is_on_boundary().all()


def test_regular_tetrahedron_has_quality_one():
    """Alternate corners of a cube are a regular tetrahedron."""
    corners = [[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]
    mesh = VolumeMesh(np.array(corners, dtype=float), [[0, 1, 2, 3]])
    assert mesh.qualities() == pytest.approx([1.0], rel=1e-14)
    flat = VolumeMesh(mesh.vertices * [1.0, 1.0, 1e-6], [[0, 1, 2, 3]])
    assert 0.0 < flat.qualities()[0] < 1e-5


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))))
def test_volume_of_a_sliver_keeps_its_digits_in_every_numbering(order):
    """Three corners within 1e-9 of each other, one far away: the volume is exact all the same."""
    tiny = 2.0**-30
    points = np.array([[1.0, 1.0, 1.0], [0.0, 0.0, 0.0], [tiny, 0.0, 0.0], [0.0, tiny, 0.0]])
    mesh = VolumeMesh.trusted(points[list(order)], np.array([[0, 1, 2, 3]]))
    assert abs(mesh.volumes()[0]) == tiny**2 / 6.0


def test_arrays_are_copies_that_nobody_can_change():
    """A mesh keeps its data whatever happens to the arrays it came from."""
    points = PAIR.copy()
    mesh = VolumeMesh(points, PAIR_CORNERS)
    points[:] = 0.0
    assert (mesh.vertices == PAIR).all()
    with pytest.raises(ValueError, match="read-only"):
        mesh.vertices[0, 0] = 1.0
    assert mesh == VolumeMesh(PAIR, PAIR_CORNERS)
    assert hash(mesh) == hash(VolumeMesh(PAIR, PAIR_CORNERS))
    assert mesh != VolumeMesh(CORNER, [[0, 1, 2, 3]])


@pytest.mark.parametrize(
    ("vertices", "tetrahedra", "words"),
    [
        (CORNER, np.zeros((0, 4), dtype=int), "n > 0"),
        (CORNER, [[0, 1, 2]], r"\(n, 4\)"),
        (CORNER[:, :2], [[0, 1, 2, 3]], r"\(n, 3\)"),
        (CORNER, [[0.5, 1, 2, 3]], "int64"),
        (np.where(CORNER == 1.0, np.nan, CORNER), [[0, 1, 2, 3]], "vertex 1 is not finite"),
        (CORNER * 1e13, [[0, 1, 2, 3]], r"vertex 1 is not within 1e\+12 m"),
        (CORNER * 1e300, [[0, 1, 2, 3]], r"vertex 1 is not within 1e\+12 m"),
        (CORNER, [[0, 1, 2, 4]], "tetrahedron 0 refers to vertices"),
        (CORNER, [[0, 2, 1, 3]], "volume -0.166667, not above 0"),
        (CORNER, [[0, 1, 2, 2]], "not above 0"),
        (PAIR, [[0, 1, 2, 3]], "vertex 4 belongs to no tetrahedron"),
        (
            np.concatenate([PAIR, [[2.0, 2.0, 2.0]]]),
            [*PAIR_CORNERS, [1, 2, 3, 5]],
            "belongs to 3 tetrahedra",
        ),
        (
            np.concatenate([CORNER, [[-1.0, -1.0, -1.0]]]),
            [[0, 1, 2, 3], [4, 1, 2, 3]],
            "on the same side",
        ),
    ],
)
def test_what_is_no_mesh_is_refused_by_name(vertices, tetrahedra, words):
    """The message says which element is wrong, and how."""
    with pytest.raises(MeshError, match=words):
        VolumeMesh(vertices, tetrahedra)
