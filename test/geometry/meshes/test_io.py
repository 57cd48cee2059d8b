import re

import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import MESH_FILE_TYPES, read_mesh, read_mesh_contents
from scene_graph_ros.geometry.meshes.sources import load_surface

_QUAD = b"""
# a square and a triangle, with all ways to write a corner
o first
v 0 0 0 1.0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 1
vt 0.5 0.5
f 1/1/1 2//1 3/1 4
o second
v 0 0 2
f -1 1 \\
2
"""


def _volume(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def test_obj_of_two_objects_is_one_mesh():
    """Polygons become fans, negative indices count back, and continued lines are joined."""
    vertices, triangles = read_mesh_contents(_QUAD, "obj", name="quad")
    assert vertices[4].tolist() == [0.0, 0.0, 2.0]
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3], [4, 0, 1]]


@pytest.mark.parametrize("suffix", ["stl", "ply", "off", "glb", "obj", "dae"])
def test_every_format_gives_the_same_solid(tmp_path, suffix):
    """A box written by trimesh comes back with its volume, whatever the format."""
    box = trimesh.creation.box((0.2, 0.3, 0.5))
    path = tmp_path / f"box.{suffix}"
    box.export(path)
    vertices, triangles = read_mesh(path)
    assert _volume(vertices, triangles) == pytest.approx(0.2 * 0.3 * 0.5, rel=1e-6)


def test_bodies_of_a_scene_are_placed_by_their_transforms(tmp_path):
    """A scene of two bodies is one mesh, each body where its node puts it, also mirrored."""
    scene = trimesh.Scene()
    body = trimesh.creation.box((1.0, 1.0, 1.0))
    scene.add_geometry(body, transform=trimesh.transformations.translation_matrix([5, 0, 0]))
    scene.add_geometry(body, transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    path = tmp_path / "scene.glb"
    scene.export(path)
    vertices, triangles = read_mesh(path)
    assert vertices[:, 0].min() == pytest.approx(-0.5)
    assert vertices[:, 0].max() == pytest.approx(5.5)
    assert _volume(vertices, triangles) == pytest.approx(2.0)


def test_unit_of_collada_is_applied(tmp_path):
    """A DAE in centimetres is read in metres."""
    path = tmp_path / "box.dae"
    trimesh.creation.box((20.0, 20.0, 20.0)).export(path)
    text = path.read_text()
    assert '<unit meter="1.0"' in text or "<up_axis>" in text
    if "<unit" in text:
        head, tail = text.split("<unit", 1)
        text = head + '<unit meter="0.01" name="centimeter" />' + tail.split("/>", 1)[1]
    else:
        text = text.replace("<up_axis>", '<unit meter="0.01" name="centimeter" /><up_axis>')
    path.write_text(text)
    assert np.ptp(read_mesh(path)[0]) == pytest.approx(0.2)


@pytest.mark.parametrize("axis", ["X_UP", "Y_UP", "Z_UP"])
def test_up_axis_of_collada_is_not_applied(tmp_path, axis):
    """A DAE is read as its numbers are, whichever axis it calls up."""
    path = tmp_path / "box.dae"
    trimesh.creation.box((1.0, 2.0, 3.0)).export(path)
    text = re.sub(r"<up_axis>\w+</up_axis>", "", path.read_text())
    path.write_text(text.replace("</asset>", f"<up_axis>{axis}</up_axis></asset>"))
    assert f"<up_axis>{axis}</up_axis></asset>" in path.read_text()
    np.testing.assert_allclose(np.ptp(read_mesh(path)[0], axis=0), (1.0, 2.0, 3.0), rtol=1e-12)


@pytest.mark.parametrize(
    ("contents", "suffix", "reason"),
    [
        (b"", "obj", "empty"),
        (b" \n", "stl", "empty"),
        (b"# nothing\n", "obj", "no vertices"),
        (b"v 0 0 nan\n", "obj", "vertex 0 is not finite"),
        (b"v 0 0\n", "obj", "line 1: a vertex needs three numbers"),
        (b"v 0 0 0\nf 1 2 3\n", "obj", "a face refers to vertex 2, there are 1"),
        (b"v 0 0 0\nf 1 1\n", "obj", "line 2: a face needs three corners"),
        (b"v 0 0 zero\n", "obj", "line 1"),
        (b"hello", "xyzzy", "no reader for 'xyzzy'"),
        (b"not a glb", "glb", "unreadable gl"),
        (b"x" * 80 + (1000).to_bytes(4, "little") + b"short", "stl", "before its last triangle"),
    ],
)
def test_bad_contents_are_refused_with_file_and_reason(tmp_path, contents, suffix, reason):
    """The message names the file and says what is wrong with it."""
    path = tmp_path / f"bad.{suffix}"
    path.write_bytes(contents)
    with pytest.raises(MeshError, match=reason) as caught:
        read_mesh(path)
    assert str(path) in str(caught.value)


def test_missing_file_and_folder_are_refused(tmp_path):
    """A file that is not there, and one that is none, raise MeshError with the path."""
    with pytest.raises(MeshError, match=r"nowhere\.obj.*does not exist"):
        read_mesh(tmp_path / "nowhere.obj")
    with pytest.raises(MeshError, match=str(tmp_path)):
        read_mesh(tmp_path)


@pytest.mark.parametrize("suffix", MESH_FILE_TYPES)
def test_a_git_lfs_pointer_is_called_one(tmp_path, suffix):
    """Of every format, those of tetrahedra too."""
    path = tmp_path / f"part.{suffix}"
    path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
    with pytest.raises(MeshError, match="a Git LFS pointer, not the file itself: run git lfs"):
        load_surface(Mesh(path))
