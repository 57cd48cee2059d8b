"""glTF files whose buffers are files beside them: read as whole ones are, or refused by name."""

import json

import numpy as np
from pictured_files import gltf
import pytest

from scene_graph_ros.geometry import (
    Convex,
    GeometryInstance,
    Mesh,
    ProximityProperties,
    SceneGraph,
)
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes import io
from scene_graph_ros.geometry.meshes.io import read_mesh, read_mesh_contents
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates


@pytest.fixture
def write(tmp_path):
    """Write two squares and their buffer; ``change`` the document."""

    def make(change=lambda tree: None, suffix="gltf"):
        is_binary = suffix == "glb"
        told = gltf([{}, {}], [], is_binary=is_binary, beside=tmp_path / "a b.bin")
        path = tmp_path / f"squares.{suffix}"
        path.write_bytes(told)
        if not is_binary:
            tree = json.loads(told)
            change(tree)
            path.write_text(json.dumps(tree))
        return path

    return make


def triangles():
    """Return properties by which a mesh is its triangles."""
    properties = ProximityProperties()
    properties.add_property("mesh", "representation", "triangles")
    return properties


@pytest.mark.parametrize("suffix", ["gltf", "glb"])
def test_a_buffer_beside_the_file_is_read(write, suffix):
    """The squares, and where they are on a picture, are where the buffer says."""
    path = write(suffix=suffix)
    vertices, triangles = read_mesh(path)
    # The file has (x, 0, -y), with +Y up; read as (x, y, 0), with +Z up.
    first = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    np.testing.assert_array_equal(vertices, [*first, *np.add(first, (1, 0, 0))])
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    square = [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]
    np.testing.assert_array_equal(texture_coordinates(Mesh(path)), [*square, *square])


def test_proximity_of_a_mesh_with_a_buffer_beside_it(write):
    """Of its triangles and of their hull: a point is 1/3 m above two squares."""
    path = write()
    for shape, properties in ((Mesh(path), triangles()), (Convex(path), ProximityProperties())):
        graph = SceneGraph()
        instance = GeometryInstance(np.eye(4), shape, "plate")
        instance.set_proximity_properties(properties)
        graph.register_anchored_geometry(graph.register_source("s"), instance)
        query = graph.query_object(graph.create_default_context())
        (found,) = query.compute_signed_distance_to_point(np.array((1.25, 0.5, 1 / 3)))
        assert found.distance == pytest.approx(1 / 3, abs=1e-15)
        np.testing.assert_allclose(found.p_GN, (1.25, 0.5, 0.0), atol=1e-15)


def test_buffers_in_folders_below(write, tmp_path):
    """As their addresses are written, in percents."""
    path = write(lambda tree: tree["buffers"][0].update(uri="some%20data/./a%20b.bin"))
    (tmp_path / "some data").mkdir()
    (tmp_path / "a b.bin").rename(tmp_path / "some data" / "a b.bin")
    assert len(read_mesh(path)[1]) == 4


@pytest.mark.parametrize(
    "uri",
    [
        "/etc/passwd",
        "../other.bin",
        "below/../../other.bin",
        "%2e%2e/other.bin",
        "file:///etc/passwd",
        "http://127.0.0.1/a.bin",
        "c:\\a.bin",
    ],
)
def test_a_buffer_outside_the_folder_is_refused(write, tmp_path, uri):
    """By its address; nothing is opened."""
    (tmp_path.parent / "other.bin").write_bytes(bytes(1000))
    path = write(lambda tree: tree["buffers"][0].update(uri=uri))
    with pytest.raises(MeshError, match="is no file in the folder of the mesh's file") as caught:
        read_mesh(path)
    assert repr(uri) in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_buffer_that_is_missing_short_or_large(write, tmp_path, monkeypatch):
    """By mesh, buffer and reason."""
    path = write()
    size = (tmp_path / "a b.bin").stat().st_size
    monkeypatch.setattr(io, "MAX_MESH_BYTES", path.stat().st_size + size - 1)
    with pytest.raises(MeshError, match=f"buffer 'a b.bin': has {size} bytes, the limit is "):
        read_mesh(path)
    monkeypatch.undo()
    (tmp_path / "a b.bin").write_bytes(b"short")
    with pytest.raises(MeshError, match=f"'a%20b.bin' has 5 bytes, not {size}"):
        read_mesh(path)
    (tmp_path / "a b.bin").write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0")
    with pytest.raises(MeshError, match=r"gltf': buffer 'a b.bin': a Git LFS pointer"):
        read_mesh(path)
    (tmp_path / "a b.bin").unlink()
    with pytest.raises(MeshError, match=r"squares.gltf': buffer 'a b.bin' does not exist"):
        read_mesh(path)


def test_from_memory_a_mesh_has_no_files_beside_it(write):
    """What a client sends opens nothing here; what is missing is told."""
    path = write()
    with pytest.raises(MeshError, match=r"sent: its buffer 'a%20b\.bin' is not in it"):
        read_mesh_contents(path.read_bytes(), "gltf", name="sent")


@pytest.mark.parametrize(
    "change",
    [
        lambda tree: tree.update(buffers=7),
        lambda tree: tree.update(buffers=["a"]),
        lambda tree: tree["buffers"][0].update(uri=7),
        lambda tree: tree["buffers"][0].update(uri="data:;base64,x"),
        lambda tree: tree.pop("buffers"),
    ],
)
def test_nonsense_for_a_buffer_is_refused(write, change):
    """Naming the mesh."""
    path = write(change)
    with pytest.raises(
        MeshError, match=r"squares.gltf'.*(unreadable gltf|buffer view 2 reaches beyond)"
    ):
        read_mesh(path)


@pytest.mark.parametrize(
    ("start", "written", "reason"),
    [
        (0, b"glTG", "does not begin as a GLB file does"),
        (4, (1).to_bytes(4, "little"), "of version 1, not 2"),
        (8, (10**6).to_bytes(4, "little"), "bytes, of 1000000 that it states"),
        (16, b"JSOM", "or without JSON"),
    ],
)
def test_a_glb_file_begins_as_one(start, written, reason):
    """Its name, its version, its length and its first part are looked at."""
    whole = bytearray(gltf([{}], [], is_binary=True))
    assert len(read_mesh_contents(bytes(whole), "glb", name="sent")[1]) == 2
    whole[start : start + 4] = written
    with pytest.raises(MeshError, match=f"sent: .*{reason}"):
        read_mesh_contents(bytes(whole), "glb", name="sent")


def test_another_part_is_no_buffer():
    """Between the document and the numbers, or in place of these, there may be none."""
    whole = gltf([{}], [], is_binary=True)
    at = 20 + int.from_bytes(whole[12:16], "little")
    other = whole[:at] + (4).to_bytes(4, "little") + b"XXXX0123" + whole[at:]
    for contents in (other, whole.replace(b"BIN\0", b"BAN\0")):
        with pytest.raises(MeshError, match="reaches beyond its buffer"):
            read_mesh_contents(contents, "glb", name="sent")
