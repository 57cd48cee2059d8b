"""glTF as its standard has it: a table of what a file says, and the triangles that it means."""

import base64
import json

import numpy as np
import pytest

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import read_mesh_contents

POINTS = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], dtype=float)
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
HALF_TURN = [0.0, 0.0, 1.0, 0.0]
"""About z, x first: (x, y, z) becomes (-x, -y, z)."""


def turned(points):
    """Return points (n, 3) of a file with +Y up as they are to be, with +Z up."""
    x, y, z = np.asarray(points, dtype=float).T
    return np.stack([x, -z, y], axis=1)


class File:
    """A document with one mesh of one primitive, whose numbers are put into one buffer."""

    def __init__(self):
        self.data, self.views, self.accessors = b"", [], []
        self.primitive = {"attributes": {"POSITION": self.add(np.float32(POINTS))}}
        self.primitive["indices"] = self.add(np.uint16(FACES).reshape(-1, 1))
        self.tree = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [self.primitive]}],
        }

    def view(self, array, stride=None):
        """Append an array to the buffer; return the number of its view."""
        self.data += b"\0" * (-len(self.data) % 4)
        told = {"buffer": 0, "byteOffset": len(self.data), "byteLength": array.nbytes}
        self.views.append(told if stride is None else {**told, "byteStride": stride})
        self.data += array.tobytes()
        return len(self.views) - 1

    def add(self, array, **more):
        """Append an accessor of an array (n, k); return its number."""
        codes = {"f4": 5126, "i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125}
        self.accessors.append(
            {
                "bufferView": self.view(array),
                "componentType": codes[array.dtype.str[1:]],
                "count": len(array),
                "type": {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}[array.shape[1]],
                **more,
            }
        )
        return len(self.accessors) - 1

    def position(self, array, **more):
        """Have other positions."""
        self.primitive["attributes"]["POSITION"] = self.add(array, **more)

    def read(self):
        """Return what is read of it, as corners (m, 3, 3)."""
        address = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        tree = {**self.tree, "accessors": self.accessors, "bufferViews": self.views}
        tree["buffers"] = [{"byteLength": len(self.data), "uri": address}]
        vertices, triangles = read_mesh_contents(json.dumps(tree).encode(), "gltf", name="file")
        return vertices[triangles]


def plain(file):
    """Floats and an index."""
    return POINTS[FACES]


def without_index(file):
    """Each three points are a triangle."""
    file.position(np.float32(POINTS[FACES].reshape(-1, 3)))
    del file.primitive["indices"]
    return POINTS[FACES]


def normalized(dtype):
    """Return a case of integers that are fractions of the largest one."""

    def case(file):
        most = np.iinfo(dtype).max
        numbers = np.zeros(
            (4, 4), dtype
        )  # four to a row, as rows begin at multiples of four bytes
        numbers[:, :3] = np.round(POINTS / 3.0 * most)
        view = file.view(numbers, stride=numbers.itemsize * 4)
        code = {"u1": 5121, "i1": 5120, "u2": 5123, "i2": 5122}[numbers.dtype.str[1:]]
        accessor = {"bufferView": view, "componentType": code, "count": 4, "type": "VEC3"}
        file.accessors.append({**accessor, "normalized": True})
        file.primitive["attributes"]["POSITION"] = len(file.accessors) - 1
        file.tree["extensionsRequired"] = file.tree["extensionsUsed"] = ["KHR_mesh_quantization"]
        return (numbers[:, :3] / most)[FACES]

    case.__name__ = f"normalized {np.dtype(dtype)}"
    return case


def lowest_of_a_signed_fraction(file):
    """-128 is -1, as -127 is."""
    numbers = np.int8([(-128, 0, 0, 0), (127, 0, 0, 0), (0, 127, 0, 0), (0, 0, 127, 0)])
    file.position(numbers, type="VEC3", normalized=True)
    file.views[-1]["byteStride"] = 4
    return np.array([(-1, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])[FACES]


def integers_that_a_node_scales(file):
    """Not normalized: gltfpack's default."""
    file.position(np.uint16(np.column_stack([POINTS, np.zeros(4)])), type="VEC3")
    file.views[-1]["byteStride"] = 8
    file.tree["nodes"][0]["scale"] = [0.5, 0.25, 2.0]
    return (POINTS * (0.5, 0.25, 2.0))[FACES]


def sparse(file):
    """Two of four points are others than the base has."""
    at, new = np.uint16([[1], [3]]), np.float32([(5, 0, 0), (0, 0, 7)])
    file.position(np.float32(POINTS))
    file.accessors[-1]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": file.view(at), "componentType": 5123},
        "values": {"bufferView": file.view(new)},
    }
    points = POINTS.copy()
    points[[1, 3]] = new
    return points[FACES]


def sparse_on_zeros(file):
    """Without a base the others are zero."""
    sparse(file)
    del file.accessors[-1]["bufferView"]
    return np.array([(0, 0, 0), (5, 0, 0), (0, 0, 0), (0, 0, 7)], dtype=float)[FACES]


def strip(file):
    """Every other triangle is turned; the standard's order of corners."""
    file.primitive.update(mode=5, indices=file.add(np.uint8([[0], [1], [2], [3]])))
    return POINTS[[(0, 1, 2), (1, 3, 2)]]


def fan(file):
    """All triangles have the first corner."""
    file.primitive.update(mode=6, indices=file.add(np.uint8([[3], [0], [1], [2], [0]])))
    return POINTS[[(0, 1, 3), (1, 2, 3), (2, 0, 3)]]


def fan_beside_triangles(file):
    """Both are in the mesh."""
    other = dict(file.primitive, mode=6, indices=file.add(np.uint8([[3], [0], [1], [2]])))
    file.tree["meshes"][0]["primitives"].append(other)
    return np.concatenate([POINTS[FACES], POINTS[[(0, 1, 3), (1, 2, 3)]]])


def lines_beside_triangles(file):
    """Lines are no surface."""
    other = dict(file.primitive, mode=1, indices=file.add(np.uint8([[3], [0]])))
    file.tree["meshes"][0]["primitives"].append(other)
    return POINTS[FACES]


def morphed_by_the_mesh(file):
    """Targets are added by the mesh's weights."""
    moves = [np.float32(np.outer(np.arange(4), axis)) for axis in ((1, 0, 0), (0, 0, 1))]
    file.primitive["targets"] = [{"POSITION": file.add(move)} for move in moves]
    file.tree["meshes"][0]["weights"] = [0.5, -2.0]
    return (POINTS + 0.5 * moves[0] - 2.0 * moves[1])[FACES]


def morphed_by_the_node(file):
    """A node's weights are used in place of the mesh's."""
    morphed_by_the_mesh(file)
    file.tree["nodes"][0]["weights"] = [0.0, 1.0]
    return (POINTS + np.outer(np.arange(4), (0, 0, 1)))[FACES]


def instances(file):
    """A mesh that is placed three times, turned and scaled."""
    places = np.float32([(0, 0, 0), (10, 0, 0), (0, 10, 0)])
    turns = np.float32([(0, 0, 0, 1), HALF_TURN, (0, 0, 0, 1)])
    scales = np.float32([(1, 1, 1), (1, 1, 1), (2, 3, 4)])
    file.tree["nodes"][0]["extensions"] = {
        "EXT_mesh_gpu_instancing": {
            "attributes": {
                "TRANSLATION": file.add(places),
                "ROTATION": file.add(turns),
                "SCALE": file.add(scales),
            }
        }
    }
    second = POINTS * (-1, -1, 1) + places[1]
    third = POINTS * (2, 3, 4) + places[2]
    return np.concatenate([p[FACES] for p in (POINTS, second, third)])


def nested_nodes(file):
    """A child is placed where its parent is, by a matrix by columns."""
    matrix = np.diag([2.0, 2.0, 2.0, 1.0])
    matrix[:3, 3] = 1, 2, 3
    file.tree["nodes"] = [
        {"matrix": matrix.T.ravel().tolist(), "children": [1]},
        {"mesh": 0, "rotation": HALF_TURN, "translation": [0, 5, 0]},
    ]
    return (2.0 * (POINTS * (-1, -1, 1) + (0, 5, 0)) + (1, 2, 3))[FACES]


def mirrored_node(file):
    """Its triangles are turned round, so that they look outwards."""
    file.tree["nodes"][0]["scale"] = [-1.0, 1.0, 1.0]
    return (POINTS * (-1, 1, 1))[np.array(FACES)[:, ::-1]]


def another_scene(file):
    """Only the scene that is named is read."""
    file.tree["nodes"].append({"mesh": 0, "translation": [7, 0, 0]})
    file.tree.update(scene=1, scenes=[{"nodes": [0]}, {"nodes": [1]}])
    return (POINTS + np.array([7, 0, 0]))[FACES]


def unknown_extension_that_is_only_used(file):
    """What is not required may be ignored."""
    file.tree["extensionsUsed"] = ["XYZ_unheard_of", "KHR_materials_clearcoat"]
    return POINTS[FACES]


RIGHT = [
    plain, without_index, normalized(np.uint8), normalized(np.int8), normalized(np.uint16),
    normalized(np.int16), lowest_of_a_signed_fraction, integers_that_a_node_scales, sparse,
    sparse_on_zeros, strip, fan, fan_beside_triangles, lines_beside_triangles, morphed_by_the_mesh,
    morphed_by_the_node, instances, nested_nodes, mirrored_node, another_scene,
    unknown_extension_that_is_only_used,
]  # fmt: skip


def around(corners):
    """Return triangles (m, 3, 3) sorted, each from its smallest corner on: order means nothing."""
    rows = [np.roll(t, -min(range(3), key=lambda k, t=t: tuple(t[k])), axis=0) for t in corners]
    return np.array(sorted(np.round(np.array(rows), 5).reshape(-1, 9).tolist()))


@pytest.mark.parametrize("case", RIGHT, ids=lambda case: case.__name__)
def test_a_file_means_what_the_standard_says(case):
    """Turned from +Y up to +Z up; each triangle runs as it does in the file."""
    file = File()
    expected = turned(case(file).reshape(-1, 3)).reshape(-1, 3, 3)
    np.testing.assert_allclose(around(file.read()), around(expected), atol=2e-5)


def required(name):
    """Return a change by which a file requires an extension."""
    return lambda file: file.tree.update(extensionsRequired=[name], extensionsUsed=[name])


REFUSED = {
    "EXT_meshopt_compression": (required("EXT_meshopt_compression"), "EXT_meshopt_compression"),
    "an extension of nobody": (required("XYZ_unheard_of"), "requires the extension 'XYZ_unheard"),
    "a skin": (lambda file: file.tree["nodes"][0].update(skin=0), "bent by a skin"),
    "glTF 1": (lambda file: file.tree["asset"].update(version="1.0"), "it is glTF '1.0', not 2.x"),
    "a mode of no kind": (lambda file: file.primitive.update(mode=9), "no mode 9"),
    "an index too large": (
        lambda file: file.primitive.update(indices=file.add(np.uint8([[0], [1], [4]]))),
        "there is no vertex 4",
    ),
    "corners that are no triangles": (
        lambda file: file.primitive.update(indices=file.add(np.uint8([[0], [1]]))),
        "2 corners are no triangles",
    ),
    "signed indices": (
        lambda file: file.primitive.update(indices=file.add(np.int8([[0], [1], [2]]))),
        "indices must be unsigned",
    ),
    "an accessor beyond its view": (
        lambda file: file.accessors[0].update(count=5),
        "reaches beyond buffer view 0",
    ),
    "a mesh counted from the end": (
        lambda file: file.tree["nodes"][0].update(mesh=-1),
        "no entry -1 of its meshes",
    ),
    "a scene counted from the end": (
        lambda file: file.tree.update(scene=-1),
        "no entry -1 of its scenes",
    ),
    "a view counted from the end": (
        lambda file: file.accessors[0].update(bufferView=-1),
        "no entry -1 of its bufferViews",
    ),
    "a truth for an index": (
        lambda file: file.tree["nodes"][0].update(mesh=False),
        "no entry False of its meshes",
    ),
    "a rotation of zeros": (
        lambda file: file.tree["nodes"][0].update(rotation=[0, 0, 0, 0]),
        "rotation .*not of length 1",
    ),
    "a rotation that is not finite": (
        lambda file: file.tree["nodes"][0].update(rotation=[0, 0, float("nan"), 1]),
        "the rotation .*nan",
    ),
    "a rotation of length 2": (
        lambda file: file.tree["nodes"][0].update(rotation=[0, 2, 0, 0]),
        "rotation .*not of length 1",
    ),
    "a perspective": (
        lambda file: file.tree["nodes"][0].update(
            matrix=[1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
        ),
        r"last row of a node's matrix is \[0.5, 0.0",
    ),
    "two poses": (
        lambda file: file.tree["nodes"][0].update(
            matrix=np.eye(4).ravel().tolist(), translation=[0, 0, 1]
        ),
        "a matrix and another pose",
    ),
    "a weight beyond all floats": (
        lambda file: (
            file.primitive.update(targets=[{"POSITION": file.add(np.float32(POINTS))}]),
            file.tree["meshes"][0].update(weights=[1e300]),
        ),
        "is not finite",
    ),
    "a morph target of other points": (
        lambda file: (
            file.primitive.update(targets=[{"POSITION": file.add(np.float32(POINTS[:3]))}]),
            file.tree["meshes"][0].update(weights=[1.0]),
        ),
        "a morph target has 3 points",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_understood_is_refused_by_name(name):
    """With the mesh and the reason; nothing stands in for it."""
    change, reason = REFUSED[name]
    file = File()
    change(file)
    with pytest.raises(MeshError, match=f"^file: .*{reason}|^file.*{reason}"):
        file.read()
