"""Mesh files with mistakes: solids, or refused by MeshError, in bounded time and memory."""

from __future__ import annotations

import base64
from functools import cache
import json
from pathlib import Path
import random
import re
import tempfile
from typing import Any

from fuzzing import fuzz, Target
import meshio
import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.io import read_mesh_contents
from scene_graph_ros.geometry.meshes.surfaces import build_surface
from scene_graph_ros.geometry.meshes.volume_io import parse_volume_mesh

NUMBERS = (
    "nan", "inf", "-inf", "1e308", "-1e308", "1e-320", "0", "-1", "1e999", "4294967295",
    "2147483648", "99999999999", "1" + "0" * 400, "0x10", "1_0", "", "1,5", "true",
)  # fmt: skip
"""What takes the place of a number in a text."""

VALUES = (
    None, True, -1, 0, 1, 5, 2**31, 2**53, 1e308, float("nan"), float("inf"), "", "a", "../x",
    "data:,", "/dev/zero", [], {}, [0], [None], {"a": 1}, [1e308] * 16, [0, 0, 0, 0],
)  # fmt: skip
"""What takes the place of a value in a glTF document."""

POINTS = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]]
SIDES = [
    [0, 1, 2, 3, 4, 5],
    [11, 10, 9, 8, 7, 6],
    *([i, i + 6, (i + 1) % 6 + 6, (i + 1) % 6] for i in range(6)),
]
CORNERS = [[x, y, z] for z in (0, 1) for x, y, _ in POINTS]


def dae() -> bytes:
    """Return an L of polygons below nested nodes."""
    numbers = " ".join(str(x) for v in CORNERS for x in v)
    indices = " ".join(str(i) for p in SIDES for i in p)
    counts = " ".join(str(len(p)) for p in SIDES)
    text = (
        '<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">'
        '<asset><unit meter="0.01"/><up_axis>Z_UP</up_axis></asset>'
        '<library_geometries><geometry id="g"><mesh><source id="s">'
        f'<float_array id="a" count="36">{numbers}</float_array>'
        '<technique_common><accessor source="#a" count="12" stride="3">'
        '<param name="X" type="float"/><param name="Y" type="float"/>'
        '<param name="Z" type="float"/></accessor></technique_common></source>'
        '<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>'
        '<polylist count="8"><input semantic="VERTEX" source="#v" offset="0"/>'
        f"<vcount>{counts}</vcount><p>{indices}</p></polylist></mesh></geometry>"
        '</library_geometries><library_nodes><node id="n"><translate>1 2 3</translate>'
        '<instance_geometry url="#g"/></node></library_nodes>'
        '<library_visual_scenes><visual_scene id="w"><node id="m"><matrix>'
        "1 0 0 1 0 1 0 2 0 0 -1 3 0 0 0 1</matrix>"
        '<instance_node url="#n"/><instance_geometry url="#g"/></node></visual_scene>'
        '</library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>'
    )
    return text.encode()


def gltf_tree() -> dict[str, Any]:
    """Return a document with normalized, sparse and morphed positions, strips and instances."""
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    positions = np.round(box.vertices * 32767).astype("<i2")
    parts = [
        np.pad(positions, ((0, 0), (0, 1))).tobytes(),
        box.faces.astype("<u2").tobytes(),
        np.array([0, 3], "<u2").tobytes(),
        np.array([[1, 0, 0], [0, 1, 0]], "<f4").tobytes(),
        np.zeros((8, 3), "<f4").tobytes(),
        np.array([[0, 0, 0], [3, 0, 0]], "<f4").tobytes(),
        np.array([0, 1, 2, 3], "<u2").tobytes(),
    ]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": len(part)}
        for start, part in zip(starts, parts, strict=False)
    ]
    views[0]["byteStride"] = 8
    sparse = {
        "count": 2,
        "indices": {"bufferView": 2, "componentType": 5123},
        "values": {"bufferView": 3},
    }
    kinds = [(0, 5122, 8, "VEC3"), (1, 5123, 36, "SCALAR"), (4, 5126, 8, "VEC3")]
    kinds += [(5, 5126, 2, "VEC3"), (6, 5123, 4, "SCALAR")]
    accessors = [
        {"bufferView": view, "componentType": kind, "count": count, "type": shape}
        for view, kind, count, shape in kinds
    ]
    accessors[0]["normalized"] = True
    accessors[2]["sparse"] = sparse
    body = {"attributes": {"POSITION": 0}, "indices": 1, "targets": [{"POSITION": 2}]}
    strip = {"attributes": {"POSITION": 2}, "indices": 4, "mode": 5, "targets": [{"POSITION": 2}]}
    instances = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 3}}}
    data = base64.b64encode(b"".join(parts)).decode()
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {"mesh": 0, "scale": [2, 1, -1], "children": [1]},
            {"mesh": 0, "rotation": [0, 0, 0.6, 0.8], "extensions": instances, "children": [2]},
            {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]},
        ],
        "meshes": [{"primitives": [body, strip], "weights": [0.5]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [
            {
                "byteLength": starts[-1],
                "uri": f"data:application/octet-stream;base64,{data}",
            }
        ],
    }


@cache
def bases() -> dict[str, bytes]:
    """Return a right file in each format and encoding; the suffix is up to the underscore."""
    box, text = trimesh.creation.box((1.0, 2.0, 3.0)), "".join
    corners = text(f"{x} {y} {z}\n" for x, y, z in CORNERS)
    sides = text(f"{len(p)} {' '.join(map(str, p))}\n" for p in SIDES)
    faces = text("f " + " ".join(f"{i - 12}//" for i in p) + "\n" for p in SIDES)
    head = "ply\nformat {} 1.0\nelement vertex 12\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    head += "element face 8\nproperty list uchar int vertex_indices\nend_header\n"
    data = np.array(CORNERS, "<f4").tobytes()
    data += b"".join(bytes([len(p)]) + np.array(p, "<i4").tobytes() for p in SIDES)
    result = {
        "obj": ("o a\n" + text(f"v {x} {y} {z}\n" for x, y, z in CORNERS) + faces).encode(),
        "off": f"OFF\n12 8 0\n{corners}{sides}".encode(),
        "ply_ascii": (head.format("ascii") + corners + sides).encode(),
        "ply": head.format("binary_little_endian").encode() + data,
        "stl": box.export(file_type="stl"),
        "stl_ascii": box.export(file_type="stl_ascii").encode(),
        "dae": dae(),
        "glb": box.export(file_type="glb"),
        "gltf": json.dumps(gltf_tree()).encode(),
    }
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    cells = np.array(
        [[0, 4, 6, 7], [0, 6, 2, 7], [0, 2, 3, 7], [0, 3, 1, 7], [0, 1, 5, 7], [0, 5, 4, 7]]
    )
    mesh = meshio.Mesh(cube, [("tetra", cells)])
    with tempfile.TemporaryDirectory() as folder:
        for kind, options in (
            ("vtk", {"binary": True}),
            ("vtk_ascii", {"binary": False}),
            ("vtu", {"binary": True}),
            ("vtu_ascii", {"binary": False}),
        ):
            path = Path(folder, f"mesh.{kind.partition('_')[0]}")
            meshio.write(path, mesh, **options)
            result[kind] = path.read_bytes()
    return result


def make(rng: random.Random) -> list[Any]:
    """Return a kind of file, and changes to be made one after another."""
    kind = rng.choice(list(bases()))
    ways = ["flip", "cut", "delete", "repeat", "swap"]
    ways += [] if kind in ("stl", "ply", "glb", "vtk") else 3 * ["number"]
    ways += 8 * ["value"] if kind == "gltf" else []
    return [kind, *(change(rng, rng.choice(ways)) for _ in range(rng.choice([1, 1, 2, 4, 9])))]


def change(rng: random.Random, way: str) -> Any:
    """Return a change: how, where as a share of the file, and with what."""
    place = rng.random()
    if way == "flip":
        return way, place, rng.randrange(1, 256)
    if way == "number":
        return way, place, rng.choice(NUMBERS)
    if way == "value":
        return way, place, rng.choice([*range(len(VALUES)), "drop", "copy", "move"])
    return way, place, rng.choice([1, 2, 4, 12, 50, 400])


def changed(kind: str, changes: list[Any]) -> bytes:
    """Return a file after the changes."""
    data = bytearray(bases()[kind])
    for way, share, value in changes:
        place = min(int(share * len(data)), max(len(data) - 1, 0))
        if way == "flip" and data:
            data[place] ^= value
        elif way == "cut":
            del data[place:]
        elif way == "delete":
            del data[place : place + value]
        elif way == "repeat":
            data[place:place] = bytes(data[place : place + value]) * 4
        elif way == "swap":
            data[place : place + 2 * value] = bytes(data[place : place + 2 * value])[::-1]
        elif way == "number":
            found = [m.span() for m in re.finditer(rb"(?<![\w.+-])-?\d[\d.]*(?:e[+-]?\d+)?", data)]
            if found:
                start, end = found[int(share * len(found))]
                data[start:end] = value.encode()
        elif way == "value":
            data = bytearray(with_value(bytes(data), share, value))
    return bytes(data)


def with_value(data: bytes, share: float, value: Any) -> bytes:
    """Return a glTF document in which one entry has another value, is gone, or is doubled."""
    try:
        tree = json.loads(data)
    except ValueError:
        return data
    slots: list[tuple[Any, Any]] = []
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, dict | list):
            keys = list(node) if isinstance(node, dict) else range(len(node))
            slots += [(node, key) for key in keys]
            waiting += [node[key] for key in keys]
    if not slots:
        return data
    index = int(share * len(slots))
    node, key = slots[index]
    if value == "drop":
        del node[key]
    elif value in ("copy", "move"):
        other, place = slots[(index * 7919 + 13) % len(slots)]
        node[key] = json.loads(json.dumps(other[place])) if place in keys_of(other) else None
    else:
        node[key] = VALUES[value]
    return json.dumps(tree).encode()


def keys_of(node: Any) -> Any:
    """Return what a container can be asked for."""
    return node if isinstance(node, dict) else range(len(node))


def run(steps: list[Any]) -> None:
    """Read a file as a solid: finite and in range, or there is an error that names it."""
    if not steps or not isinstance(steps[0], str):
        return
    kind, *changes = steps
    file_type, message = kind.partition("_")[0], "the mesh"
    try:
        if file_type in ("vtk", "vtu"):
            volume = parse_volume_mesh(changed(kind, changes), file_type, name="the mesh")
            vertices, triangles = volume.vertices, volume.boundary_triangles()
        else:
            vertices, triangles = read_mesh_contents(
                changed(kind, changes), file_type, name="the mesh"
            )
        assert np.isfinite(vertices).all()
        assert not triangles.size or 0 <= triangles.min() <= triangles.max() < len(vertices)
        # What is larger is refused by load_surface, by its own limit.
        if len(triangles) and np.abs(vertices).max() < 1e7:
            surface = build_surface(vertices, triangles, name="the mesh")
            assert np.isfinite(surface.normals).all()
            assert str(surface.report)
    except MeshError as error:
        message = str(error)
    assert message.startswith("the mesh"), message
    assert 8 <= len(message) < 100_000


def test_what_is_changed_was_right():
    """Each file is read without a change, with an area and an inside."""
    for kind in bases():
        run([kind])
    vertices, triangles = read_mesh_contents(bases()["gltf"], "gltf", name="the mesh")
    assert len(triangles) > 3 * 12
    assert build_surface(vertices, triangles, name="the mesh").report.parts >= 4


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_mesh_files_with_mistakes():
    """Nothing but MeshError, by the file's name; no hang, no memory beyond the file's promises."""
    fuzz(Target("mesh files", make, run), 1000)
