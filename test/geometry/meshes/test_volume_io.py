"""Volume meshes in files, and as the data of a Mesh."""

import meshio
import numpy as np
import pytest

from scene_graph_ros.geometry import Convex, Cylinder, Mesh, Sphere
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import hull_of, surface_of
from scene_graph_ros.geometry.meshes.tessellate import tessellate_surface, tessellate_volume
from scene_graph_ros.geometry.meshes.volume_io import (
    load_volume_mesh,
    parse_volume_mesh,
    save_volume_mesh,
)
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

ASCII_VTK = """# vtk DataFile Version 3.0
one tetrahedron, one triangle, one point too many
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 5 double
9 9 9
0 0 0
1 0 0
0 1 0
0 0 1
CELLS 2 9
4 {0} 2 {1} 4
3 1 2 3
CELL_TYPES 2
10
5
"""


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_what_is_saved_is_loaded_bit_for_bit(tmp_path, suffix):
    """Coordinates and numbering survive."""
    mesh = tessellate_volume(Cylinder(1.0 / 3.0, 1.0), 0.2)
    path = tmp_path / f"cylinder.{suffix}"
    save_volume_mesh(path, mesh)
    assert load_volume_mesh(path) == mesh
    assert parse_volume_mesh(path.read_bytes(), f".{suffix.upper()}", name="it") == mesh


@pytest.mark.parametrize("ends", [(1, 3), (3, 1)])
def test_either_numbering_is_read_as_positive(ends):
    """Other cells and unused points are dropped; a negative tetrahedron is turned."""
    mesh = parse_volume_mesh(ASCII_VTK.format(*ends).encode(), "vtk", name="it")
    assert mesh.num_vertices == 4
    assert mesh.volumes() == pytest.approx([1.0 / 6.0], rel=1e-15)


@pytest.mark.parametrize(
    ("contents", "words"),
    [
        (b"no file of this kind", "unreadable vtk"),
        (ASCII_VTK.format(1, 7).encode(), "not there|unreadable"),
        (
            ASCII_VTK.format(1, 3)
            .replace("2 9\n4 1 2 3 4\n", "1 4\n")
            .replace("TYPES 2\n10\n", "TYPES 1\n")
            .encode(),
            "no tetrahedra, but triangle",
        ),
        (ASCII_VTK.format(1, 2).encode(), "not above 0"),
    ],
)
def test_a_bad_file_is_refused_by_name(contents, words):
    """The message has the name it was given and the reason."""
    with pytest.raises(MeshError, match=f"(?s)my mesh.*({words})"):
        parse_volume_mesh(contents, "vtk", name="my mesh")


def test_missing_file_and_unknown_suffix(tmp_path):
    """Both are named."""
    with pytest.raises(MeshError, match=r"gone\.vtk' does not exist"):
        load_volume_mesh(tmp_path / "gone.vtk")
    with pytest.raises(MeshError, match="no reader of tetrahedra for 'obj'"):
        parse_volume_mesh(b"v 0 0 0", "obj", name="it")
    with pytest.raises(MeshError, match=r"written as \.vtk or \.vtu"):
        save_volume_mesh(tmp_path / "x.obj", tessellate_volume(Sphere(1.0), 1.0))


@pytest.mark.parametrize("scale", [1.0, (1.0, 2.0, 3.0), (1.0, -2.0, 1.0)])
def test_shapes_take_such_a_file(tmp_path, scale):
    """A Mesh has its boundary as surface and its tetrahedra as volume, scaled; also mirrored."""
    path = tmp_path / "cylinder.vtk"
    mesh = tessellate_volume(Cylinder(0.5, 1.0), 0.2)
    save_volume_mesh(path, mesh)
    shape = Mesh(path, scale=scale)
    volume = tessellate_volume(shape)
    VolumeMesh(volume.vertices, volume.tetrahedra)  # raises if anything is wrong
    factor = abs(np.prod(np.broadcast_to(scale, 3)))
    assert volume.volume == pytest.approx(mesh.volume * factor, rel=1e-12)
    assert surface_of(shape).is_closed
    vertices, triangles = tessellate_surface(shape)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    enclosed = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert enclosed == pytest.approx(volume.volume, rel=1e-12)
    on_rims = int(mesh.is_on_boundary().sum()) - 2  # the caps' centres are inside their faces
    assert len(hull_of(Convex(path, scale=scale)).vertices) == on_rims


def test_a_file_of_another_program_is_read(tmp_path):
    """Binary, with 32-bit coordinates and integers, as many programs write it."""
    path = tmp_path / "it.vtk"
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    cells = [("tetra", np.array([[0, 1, 2, 3]], dtype=np.int32))]
    meshio.Mesh(points, cells).write(path, binary=True)
    assert load_volume_mesh(path).volume == pytest.approx(1.0 / 6.0, rel=1e-15)


CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
# Kuhn's six tetrahedra of a cube, all around its diagonal.
KUHN = np.array(
    [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
)


def contents_of(points, tetrahedra, folder):
    """Return the bytes of a VTK file."""
    path = folder / "it.vtk"
    meshio.Mesh(points, [("tetra", tetrahedra)]).write(path)
    return path.read_bytes()


def test_tetrahedra_with_points_of_their_own_are_welded(tmp_path):
    """They are one cube, whose surface is that of the cube."""
    contents = contents_of(CORNERS[KUHN].reshape(-1, 3), np.arange(24).reshape(-1, 4), tmp_path)
    mesh = parse_volume_mesh(contents, "vtk", name="it")
    assert (mesh.num_vertices, len(mesh.boundary_triangles())) == (8, 12)
    assert mesh.volumes().sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(
    "shift", [(0.3, 0.2, 0.1), (0.5, 0.5, 0.0), (0.0, 0.0, 0.0)], ids=["inside", "along", "twice"]
)
@pytest.mark.parametrize("size", [0.4, 1.0])
def test_tetrahedra_that_overlap_are_refused(tmp_path, shift, size):
    """A second cube in the first one or across it, or another one on the same points."""
    points = np.vstack([CORNERS, CORNERS * size + shift])
    contents = contents_of(points, np.vstack([KUHN, KUHN + 8]), tmp_path)
    with pytest.raises(MeshError, match=r"my mesh: .*(overlap|belongs to 4 tetrahedra)"):
        parse_volume_mesh(contents, "vtk", name="my mesh")


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_other_solid_cells_are_refused(tmp_path, suffix):
    """Beside tetrahedra a hexahedron is a part of the solid; triangles and lines are none."""
    points = np.vstack([CORNERS, CORNERS + np.array([1.0, 0.0, 0.0])])
    path = tmp_path / f"it.{suffix}"
    flat = [("triangle", [(8, 9, 10)]), ("line", [(8, 9)]), ("vertex", [(8,)])]
    meshio.Mesh(points, [("tetra", KUHN), *flat]).write(path)
    assert load_volume_mesh(path).volumes().sum() == pytest.approx(1.0, rel=1e-12)
    hexahedron = ("hexahedron", [(8, 9, 11, 10, 12, 13, 15, 14)])
    meshio.Mesh(points, [("tetra", KUHN), hexahedron]).write(path)
    with pytest.raises(MeshError, match=f"it.{suffix}.*beside tetrahedra there are hexahedron"):
        load_volume_mesh(path)


def test_tetrahedra_that_touch_are_taken(tmp_path):
    """Two cubes with a face in common, one of them with points of its own."""
    points = np.vstack([CORNERS, CORNERS + np.array([1.0, 0.0, 0.0])])
    mesh = parse_volume_mesh(
        contents_of(points, np.vstack([KUHN, KUHN + 8]), tmp_path), "vtk", name="it"
    )
    assert (mesh.num_vertices, len(mesh.boundary_triangles())) == (12, 20)
