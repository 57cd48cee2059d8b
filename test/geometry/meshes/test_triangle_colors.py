"""Colours of triangles by OBJ, MTL, DAE, GLB and PLY files, and what is said of missing ones."""

import json
import struct
from types import SimpleNamespace
import warnings

import numpy as np
import pytest

from scene_graph_ros.geometry import Convex, Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.obj_colors import MtlMaterial, obj_materials, parse_mtl
from scene_graph_ros.geometry.meshes.scene_colors import scene_colors
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors

CORNERS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\n"
MTL = "newmtl rusty red\nKd 0.75 0.25 0\nnewmtl gray\n\tKd 0.5\nnewmtl plain\nNs 10\n"
# A triangle before all materials, a square, a triangle, and one without a colour.
OBJ = f"""mtllib my colours.mtl
{CORNERS}
f 1 2 3
usemtl rusty red
f 1/1 2/2 \\
  3/3 4/4
usemtl gray  # of the material
f 1 2 5
usemtl plain
f 2 3 5
usemtl rusty red
f 3 4 5
"""
RED, GRAY = [0.75, 0.25, 0.0], [0.5, 0.5, 0.5]


def rows(colors):
    """Return the colour of each triangle as a list, None for none."""
    return [colors.palette[i].tolist() if i >= 0 else None for i in colors.row]


def written(folder, **files):
    """Write an OBJ file and what is beside it; return its mesh."""
    for name, text in {"my colours.mtl": MTL, "a.obj": OBJ, **files}.items():
        if text is not None:
            (folder / name).write_text(text)
    return Mesh(folder / "a.obj")


@pytest.mark.filterwarnings(
    "ignore::scene_graph_ros.geometry.meshes.color_warnings.MeshColorWarning"
)
def test_triangles_have_the_colours_of_their_materials(tmp_path):
    """In the order of the file; a square is two triangles; names may have blanks."""
    colors = triangle_colors(written(tmp_path))
    assert rows(colors) == [None, RED, RED, GRAY, None, RED]


def test_line_ends_do_not_matter():
    """Nor do comments, tabs and broken lines."""
    uses = obj_materials(OBJ.replace("\n", "\r\n").encode())
    assert uses.libraries == ["my colours.mtl"]
    assert uses.materials == ["rusty red", "gray", "plain"]
    assert uses.row.tolist() == [-1, 0, 0, 1, 2, 0]


def test_scales_and_hulls(tmp_path):
    """A mirrored mesh has the same colours; a hull has none, and nor have arrays."""
    mesh = written(tmp_path, **{"my colours.mtl": MTL.replace("Ns 10", "Kd 1")})
    mirrored = triangle_colors(mesh.with_scale((1.0, -2.0, 1.0)))
    assert rows(mirrored) == [None, RED, RED, GRAY, [1.0, 1.0, 1.0], RED]
    assert triangle_colors(Convex(tmp_path / "a.obj")) is None
    assert triangle_colors(Mesh(vertices=np.eye(3), faces=[[0, 1, 2]])) is None


def test_an_obj_from_memory_names_no_files():
    """What a client sends reads nothing of the node's disk."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert triangle_colors(Mesh(contents=OBJ, file_type="obj")) is None


@pytest.mark.parametrize(
    ("mtl", "words"),
    [
        (None, "does not exist"),
        (MTL.replace("0.75", "1.75"), "line 2: Kd '1.75 0.25 0': must be from 0 to 1"),
        (MTL.replace("0.75", "nan"), "must be from 0 to 1"),
        (MTL.replace("0.75", "red"), "line 2: Kd 'red 0.25 0'"),
        (MTL.replace("0.75 ", ""), "one or three numbers"),
    ],
)
def test_colours_that_are_missing_are_told(tmp_path, mtl, words):
    """The mesh is there all the same; which file names what, and what is wrong with it."""
    with pytest.warns(MeshColorWarning) as caught:
        assert triangle_colors(written(tmp_path, **{"my colours.mtl": mtl})) is None
    told = str(caught[0].message)
    assert "a.obj' names the materials 'my colours.mtl'" in told
    assert words in told


def test_a_material_without_a_colour_is_told_once(tmp_path):
    """By its name, the first time that the colours are asked for."""
    mesh = written(tmp_path)
    with pytest.warns(MeshColorWarning, match=r"no colour \(Kd\) of material plain"):
        triangle_colors(mesh)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        triangle_colors(mesh)


def test_mtl_by_itself():
    """Colours before the first material are nobody's; the last of two counts."""
    text = b"Kd 1 1 1\nnewmtl a\nKd 0 0 1\nKd 0 1 0\nnewmtl b\n"
    assert parse_mtl(text, "x.mtl") == {"a": MtlMaterial((0.0, 1.0, 0.0)), "b": MtlMaterial()}
    with pytest.raises(MeshError, match=r"x.mtl: line 2: Kd '2'"):
        parse_mtl(b"newmtl a\nKd 2\n", "x.mtl")


def glb(materials):
    """Return a GLB file: a triangle for each material, the k-th at z = k; None has no material."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    shifted = (points + np.array([0.0, 0.0, k]) for k in range(len(materials)))
    data = b"".join(each.astype("<f4").tobytes() for each in shifted)
    given = [m for m in materials if m is not None]
    views = [{"buffer": 0, "byteOffset": 36 * k, "byteLength": 36} for k in range(len(materials))]
    kinds = {"componentType": 5126, "type": "VEC3", "count": 3}
    accessors = [
        {"bufferView": k, "min": [0, 0, k], "max": [1, 1, k], **kinds}
        for k in range(len(materials))
    ]
    primitives = [
        {"attributes": {"POSITION": k}, **({} if m is None else {"material": given.index(m)})}
        for k, m in enumerate(materials)
    ]
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": given,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def test_glb_materials():
    """The factor of the base colour, 51 / 255 and so on; white where a material says nothing.

    None without a material.
    """
    materials = [
        {"name": "a", "pbrMetallicRoughness": {"baseColorFactor": [0.2, 0.4, 0.6, 1.0]}},
        None,
        {"name": "b", "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.0, 0.8, 0.5]}},
        {"name": "white"},
    ]
    colors = triangle_colors(Mesh(contents=glb(materials), file_type="glb"))
    assert rows(colors) == [[0.2, 0.4, 0.6], None, [1.0, 0.0, 0.8], [1.0, 1.0, 1.0]]


DAE = """<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects>{effects}</library_effects>
<library_materials>
<material id="m0"><instance_effect url="#e0"/></material>
<material id="m1"><instance_effect url="#e1"/></material>
</library_materials>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 1 1 0 0 1 0</float_array>
<technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="1" material="s0"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 1 2</p></triangles>
<triangles count="1" material="s1"><input semantic="VERTEX" source="#v" offset="0"/>
<p>0 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g">
<bind_material><technique_common><instance_material symbol="s0" target="#m0"/>
<instance_material symbol="s1" target="#m1"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""


def dae(*colors):
    """Return a COLLADA file of two triangles with a colour each."""
    effect = (
        '<effect id="e{k}"><profile_COMMON><technique sid="c"><lambert><diffuse><color>{color}'
        "</color></diffuse></lambert></technique></profile_COMMON></effect>"
    )
    given = (" ".join(map(str, (*color, 1.0))) for color in colors)
    return DAE.format(effects="".join(effect.format(k=k, color=c) for k, c in enumerate(given)))


def test_collada_materials():
    """Each primitive of a geometry has the diffuse colour of the material bound to it."""
    mesh = Mesh(contents=dae((0.2, 0.4, 0.6), (1.0, 0.0, 0.8)), file_type="dae")
    assert rows(triangle_colors(mesh)) == [[0.2, 0.4, 0.6], [1.0, 0.0, 0.8]]


def test_colours_of_faces_in_ply():
    """Bytes of red, green and blue."""
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nelement face 2\nproperty list uchar int vertex_indices\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2 51 0 255\n3 0 2 3 102 204 0\n"
    )
    colors = triangle_colors(Mesh(contents=text, file_type="ply"))
    assert rows(colors) == [[0.2, 0.0, 1.0], [0.4, 0.8, 0.0]]


def test_a_file_without_colours_has_none():
    """A PLY file of points and triangles alone."""
    text = (
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n"
    )
    assert triangle_colors(Mesh(contents=text, file_type="ply")) is None


def test_colours_that_make_no_sense_cost_no_mesh():
    """Colours of two triangles on a body of three: the warning names the mesh."""
    visual = SimpleNamespace(kind="face", face_colors=np.zeros((2, 4), np.uint8))
    body = SimpleNamespace(faces=np.zeros((3, 3), int), visual=visual)
    graph = {"node": (np.eye(4), "body")}
    scene = SimpleNamespace(geometry={"body": body}, graph=Graph(graph))
    with pytest.warns(MeshColorWarning, match="a mesh: shown without its colours"):
        assert scene_colors(scene, "a mesh") is None


class Graph(dict):
    """The places of bodies, as trimesh has them."""

    @property
    def nodes_geometry(self):
        """All of them."""
        return list(self)
