"""Files that nest or promise too much are refused while they are read."""

import json
import struct
import zlib

import pytest

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.iris.regions_yaml import load_iris_regions_yaml_file
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.files import MAX_MESH_BYTES
from scene_graph_ros.geometry.meshes import limited_inflate
from scene_graph_ros.geometry.meshes.promises import check_promises, MAX_NODE_DEPTH
from scene_graph_ros.geometry.meshes.textures import MAX_TEXELS, read_texture
from scene_graph_ros.located import SceneFileError
from scene_graph_ros.scene_files.yaml_document import parse_yaml


def _gltf(nodes: list[dict[str, object]]) -> bytes:
    return json.dumps({"asset": {"version": "2.0"}, "nodes": nodes}).encode()


def _chain(count: int) -> list[dict[str, object]]:
    return [{"children": [i + 1]} for i in range(count - 1)] + [{}]


@pytest.mark.parametrize(
    ("nodes", "reason"),
    [
        (_chain(MAX_NODE_DEPTH + 1), "deep in each other"),
        (_chain(50_000), "deep in each other"),
        ([{"children": [1]}, {"children": [0]}], "in loops"),
        ([{"children": [0]}], "in loops"),
        ([{"children": [2]}, {"children": [2]}, {}], "two parents"),
        ([{}] * 100_001, "100001 nodes"),
        ([{"children": [7]}], "unreadable glTF"),
        ([{"children": 3}], "unreadable glTF"),
    ],
)
def test_nodes_of_gltf_are_counted_before_anybody_follows_them(nodes, reason):
    """A parser would compose the poses of all parents of each."""
    with pytest.raises(MeshError, match=reason):
        check_promises(_gltf(nodes), "gltf", "mesh")


def test_nodes_that_are_deep_enough_are_read():
    """A skeleton has some tens."""
    check_promises(_gltf(_chain(MAX_NODE_DEPTH)), "gltf", "mesh")


def test_a_volume_file_unpacks_to_no_more_than_it_might_have_had():
    """The limit of files is that of what is unpacked, over all blocks."""
    assert limited_inflate.MAX_UNPACKED == MAX_MESH_BYTES


def test_a_picture_is_refused_by_the_size_that_it_declares(tmp_path):
    """Before a pixel is unpacked: some hundred bytes declare 40 GB."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        crc = zlib.crc32(kind + data)
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", crc)

    size = struct.pack(">IIBBBBB", 100_000, 100_000, 8, 6, 0, 0, 0)
    path = tmp_path / "bomb.png"
    lines = zlib.compress(bytes(100_000))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", size) + chunk(b"IDAT", lines))
    with pytest.raises(MeshError, match=f"more than {MAX_TEXELS} pixels"):
        read_texture(path)


@pytest.mark.parametrize("text", ["[" * 100_000, "{a: " * 100_000, "- " * 100_000])
def test_yaml_that_is_nested_deeply_is_refused(tmp_path, text):
    """As a scene, and as regions."""
    with pytest.raises(SceneFileError, match="deep"):
        parse_yaml(text, "file")
    path = tmp_path / "regions.yaml"
    path.write_text(text)
    with pytest.raises(ConvexSetError, match="no YAML"):
        load_iris_regions_yaml_file(path)
