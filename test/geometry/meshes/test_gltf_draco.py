"""glTF whose triangles are packed: Draco is read by an extra, others are refused by name."""

import importlib.util
import json

import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import read_mesh_contents

DracoPy = pytest.importorskip("DracoPy", reason="the extra draco is not installed")

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], dtype=np.float32)
FACES = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def glb(extension, data):
    """Return a GLB file of one tetrahedron whose triangles an extension packs."""
    tree = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [extension],
        "extensionsRequired": [extension],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
        "nodes": [{"mesh": 0, "translation": [0.0, 0.0, 5.0]}],
        "meshes": [
            {
                "primitives": [
                    {
                        "attributes": {"POSITION": 0},
                        "indices": 1,
                        "extensions": {
                            extension: {"bufferView": 0, "attributes": {"POSITION": 0}}
                        },
                    }
                ]
            }
        ],
        "accessors": [
            {
                "componentType": 5126,
                "count": len(POINTS),
                "type": "VEC3",
                "min": POINTS.min(axis=0).tolist(),
                "max": POINTS.max(axis=0).tolist(),
            },
            {"componentType": 5125, "count": FACES.size, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    packed = data + b"\0" * (-len(data) % 4)
    chunks = [
        np.array([len(text)], "<u4").tobytes() + b"JSON" + text,
        np.array([len(packed)], "<u4").tobytes() + b"BIN\0" + packed,
    ]
    body = b"".join(chunks)
    return b"glTF" + np.array([2, 12 + len(body)], "<u4").tobytes() + body


@pytest.fixture(scope="module")
def draco():
    """Return a GLB file that Draco packs, with 14 bits a coordinate."""
    data = DracoPy.encode(POINTS, FACES, quantization_bits=14, preserve_order=True)
    return glb("KHR_draco_mesh_compression", data)


def test_draco_is_unpacked(draco):
    """The corners are as good as 14 bits of the size have them, placed and turned to +Z up."""
    vertices, triangles = read_mesh_contents(draco, "glb", name="mesh")
    # The file's (x, y, z) is moved by (0, 0, 5), and becomes (x, -z, y).
    expected = np.stack([POINTS[:, 0], -POINTS[:, 2] - 5.0, POINTS[:, 1]], axis=1)
    found = {tuple(np.round(row, 3)) for row in vertices[triangles].reshape(-1, 3).tolist()}
    assert found == {tuple(np.round(row, 3)) for row in expected.tolist()}
    volume = np.linalg.det(vertices[triangles] - vertices.mean(axis=0)).sum() / 6.0
    assert volume == pytest.approx(1.0, abs=1e-3)


def test_without_the_extra_it_is_named(draco, monkeypatch):
    """It says how to install it."""
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name == "DracoPy" else find(name)
    )
    with pytest.raises(MeshError, match=r"takes the package DracoPy, .*: pip install DracoPy"):
        read_mesh_contents(draco, "glb", name="mesh")


@pytest.mark.parametrize("data", [b"", b"DRACO", b"\0" * 64])
def test_what_is_no_draco_is_refused(data):
    """Also a head without a body."""
    with pytest.raises(MeshError, match="mesh"):
        read_mesh_contents(glb("KHR_draco_mesh_compression", data), "glb", name="mesh")


def test_a_part_of_draco_is_refused(draco):
    """Cut at any place."""
    whole = DracoPy.encode(POINTS, FACES, preserve_order=True)
    for end in range(0, len(whole) - 1, 7):
        with pytest.raises(MeshError):
            read_mesh_contents(glb("KHR_draco_mesh_compression", whole[:end]), "glb", name="mesh")


@pytest.mark.parametrize(
    "extension", ["EXT_meshopt_compression", "KHR_meshopt_compression", "ACME_soup"]
)
def test_other_extensions_are_refused_by_their_name(extension):
    """They say what the triangles are, so nothing can be read without them."""
    with pytest.raises(MeshError, match=extension):
        read_mesh_contents(glb(extension, b"\0" * 16), "glb", name="mesh")
