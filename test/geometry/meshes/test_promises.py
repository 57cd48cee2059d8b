"""Mesh files that promise more than they hold, or unfold to more than anybody wants."""

import json
import struct

import meshio
import numpy as np
import pytest
import trimesh

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes import limited_inflate, obj_file, promises
from scene_graph_ros.geometry.meshes.io import read_mesh_contents
from scene_graph_ros.geometry.meshes.volume_io import parse_volume_mesh


def refusal(contents, file_type):
    """Return the message with which a mesh is refused, which must name it."""
    with pytest.raises(MeshError) as caught:
        read_mesh_contents(contents, file_type, name="bomb")
    assert str(caught.value).startswith("bomb: ")
    return str(caught.value)


def gltf(**tree):
    """Write a glTF file of nothing but its tree."""
    return json.dumps({"asset": {"version": "2.0"}, **tree}).encode()


def test_stl_of_four_billion_triangles():
    """A header is not believed that states more triangles than the file has bytes."""
    contents = bytes(80) + (2**32 - 1).to_bytes(4, "little") + bytes(50)
    assert "of 4294967295 that it states" in refusal(contents, "stl")


@pytest.mark.parametrize("count", ["4000000000", "9" * 5000])
@pytest.mark.parametrize("kind", ["ascii 1.0", "binary_little_endian 1.0"])
def test_ply_of_four_billion_vertices(count, kind):
    """PLY states its counts in words."""
    header = f"ply\nformat {kind}\nelement vertex {count}\nproperty float x\nend_header\n"
    assert "can't hold what it states: element vertex" in refusal(header.encode(), "ply")


def test_gltf_of_four_billion_zeros():
    """An accessor without a buffer is all zeros, and takes memory all the same."""
    accessors = [{"count": 4_000_000_000, "componentType": 5126, "type": "VEC3"}]
    assert "it states 4000000000 vertices" in refusal(gltf(accessors=accessors), "gltf")


def test_gltf_that_places_one_body_a_million_times():
    """Bodies count where they are placed: a hundred thousand nodes of a thousand vertices."""
    tree = {
        "accessors": [{"count": 1000, "bufferView": 0, "componentType": 5126, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}] * 100_000,
    }
    chunk = gltf(**tree)
    header = b"glTF" + struct.pack("<III", 2, 20 + len(chunk), len(chunk)) + b"JSON"
    assert "it states 100001000 vertices" in refusal(chunk, "gltf")
    assert "it states 100001000 vertices" in refusal(header + chunk, "glb")


@pytest.mark.parametrize(
    "contents",
    [
        b"{" * 5,
        b"[" * 100_000,
        b"[]",
        gltf(accessors=[{"count": -1}]),
        b'{"accessors": [{"count": 1e999}]}',
        b"7",
    ],
)
def test_gltf_that_is_none(contents):
    """What is no glTF is refused, however deep it is nested."""
    assert "unreadable glTF" in refusal(contents, "gltf")


def collada(nodes):
    """Write a COLLADA file whose scene places the node n0 of a library."""
    scene = '<visual_scene id="s"><node id="r"><instance_node url="#n0"/></node></visual_scene>'
    library = f"<library_nodes>{nodes}</library_nodes>"
    scenes = f"<library_visual_scenes>{scene}</library_visual_scenes>"
    return f"<COLLADA>{library}{scenes}</COLLADA>".encode()


def test_collada_that_doubles_forty_times():
    """Nodes that place the next one twice place the last one 2^40 times."""
    twice = '<instance_node url="#n{0}"/><instance_node url="#n{0}"/>'
    nodes = [f'<node id="n{i}">{twice.format(i + 1)}</node>' for i in range(40)]
    nodes.append('<node id="n40"><instance_geometry url="#g"/></node>')
    assert "it places bodies" in refusal(collada("".join(nodes)), "dae")


def test_collada_that_doubles_nothing():
    """Nor may nodes without a body in the end: they are gone through, too."""
    twice = '<instance_node url="#n{0}"/><instance_node url="#n{0}"/>'
    nodes = "".join(f'<node id="n{i}">{twice.format(i + 1)}</node>' for i in range(40))
    assert "it places nodes" in refusal(collada(nodes + '<node id="n40"/>'), "dae")


def test_collada_without_end():
    """A node that places itself, elements nested without end, and entities are refused."""
    loop = collada('<node id="n0"><instance_node url="#n0"/></node>')
    assert "more than 100 deep" in refusal(loop, "dae")
    assert "line 1: nested more than 100 deep" in refusal(b"<a>" * 60_000, "dae")
    text = b'<!DOCTYPE a [<!ENTITY x "y">]><COLLADA>&x;</COLLADA>'
    assert "entity 'x': entities are refused" in refusal(text, "dae")


def test_bodies_are_counted_before_they_are_put_together(monkeypatch):
    """What a parser returned is not copied once for each place where there are too many."""
    monkeypatch.setattr("scene_graph_ros.geometry.meshes.io.MAX_CORNERS", 20)
    box = trimesh.creation.box((1.0, 1.0, 1.0)).export(file_type="glb")
    assert len(read_mesh_contents(box, "glb", name="box")[0]) == 8
    monkeypatch.setattr("scene_graph_ros.geometry.meshes.io.MAX_CORNERS", 5)
    assert "more than 5 vertices or triangles" in refusal(box, "glb")


def test_obj_is_counted_line_by_line(monkeypatch):
    """The line that is one too many is named."""
    monkeypatch.setattr(obj_file, "MAX_CORNERS", 4)
    assert "line 5: more than 4 vertices" in refusal(b"v 0 0 0\n" * 5, "obj")
    assert "line 2: more than 4 vertices" in refusal(b"v 0 0 0\nf" + b" 1" * 7, "obj")


@pytest.mark.parametrize("index", ["9" * 30, "-" + "9" * 30, "9" * 5000])
def test_obj_with_an_index_beyond_all_numbers(index):
    """An index that no array could have is refused with its line."""
    assert "line 2: " in refusal(f"v 0 0 0\nf 1 1 {index}\n".encode(), "obj")


@pytest.mark.parametrize("kind", ["zip", "zae", "tar.gz", "bz2", "xdmf", "svg"])
def test_archives_and_files_of_files_are_not_read(kind):
    """What unpacks, or reads other files, is not among what is read."""
    assert "known are dae, glb, gltf, obj, off, ply, stl, vtk, vtu" in refusal(b"PK", kind)


def test_limits_are_those_of_the_documentation():
    """Twenty million vertices or triangles, a hundred thousand places."""
    assert (promises.MAX_CORNERS, promises.MAX_PLACES) == (20_000_000, 100_000)


VTK = "# vtk DataFile Version {}\nx\n{}\nDATASET UNSTRUCTURED_GRID\n"


@pytest.mark.parametrize(
    "words", ["POINTS 4000000000 double", "CELLS 1 4000000000", "CELLS 99999 1"]
)
@pytest.mark.parametrize("kind", ["ASCII", "BINARY"])
def test_vtk_of_four_billion_points(words, kind):
    """Old VTK files state their counts in words."""
    contents = (VTK.format("3.0", kind) + words + "\n0 0 0\n").encode()
    assert f"can't hold what it states: {words[:12]}" in refusal_of_volume(contents, "vtk")


def test_vtk_of_a_regular_grid():
    """A grid of a billion points is three numbers in the file."""
    contents = b"# vtk DataFile Version 3.0\nx\nASCII\nDataset structured_points\n"
    contents += b"DIMENSIONS 1000 1000 1000\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    assert "not in STRUCTURED_POINTS" in refusal_of_volume(contents, "vtk")


@pytest.mark.parametrize("compression", ["zlib", "lzma"])
def test_vtu_that_unpacks_to_more_than_it_may(tmp_path, monkeypatch, compression):
    """Blocks are unpacked up to the limit, counted over the whole file."""
    path = tmp_path / "mesh.vtu"
    mesh = meshio.Mesh(np.eye(4, 3), [("tetra", np.array([[0, 1, 2, 3]]))])
    mesh.point_data["zeros"] = np.zeros((4, 3))
    meshio.vtu.write(path, mesh, compression=compression)
    contents = path.read_bytes()
    assert parse_volume_mesh(contents, "vtu", name="bomb").num_tetrahedra == 1
    # Points are 96 bytes, and so are the zeros; the tetrahedron takes 32 and more.
    monkeypatch.setattr(limited_inflate, "MAX_UNPACKED", 200)
    assert "it unpacks to more than 200 bytes" in refusal_of_volume(contents, "vtu")


def refusal_of_volume(contents, file_type):
    """Return the message with which tetrahedra are refused."""
    with pytest.raises(MeshError) as caught:
        parse_volume_mesh(contents, file_type, name="bomb")
    assert str(caught.value).startswith("bomb: ")
    return str(caught.value)
