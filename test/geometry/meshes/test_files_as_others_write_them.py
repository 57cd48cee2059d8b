"""Files as other programs write them: oddities that are read, and what is refused, and why."""

import re
import struct

from boxes_in_one_mesh import Boxes
import numpy as np
from polygon_files import obj, off, ply
import pytest

from scene_graph_ros.geometry import Convex, Mesh
from scene_graph_ros.geometry.errors import InvalidShapeError, MeshError
from scene_graph_ros.geometry.meshes.sources import hull_of, surface_of

BOX = Boxes(((0, 0, 0), (1, 1, 1))).mesh
OBJ, OFF, PLY = (write(BOX.vertices, BOX.faces.tolist()) for write in (obj, off, ply))
WORDS = "solid facet normal outer loop vertex endloop endfacet endsolid"


def stl(words=WORDS, name="cube", end="\n"):
    """Return the box in words."""
    solid, facet, normal, outer, loop, vertex, endloop, endfacet, endsolid = words.split()
    lines = [f"{solid} {name}"]
    for corners in BOX.vertices[BOX.faces]:
        lines += [f"{facet} {normal} 0 0 0", f"{outer} {loop}"]
        lines += [f"{vertex} {x:g} {y:g} {z:g}" for x, y, z in corners]
        lines += [endloop, endfacet]
    return end.join([*lines, f"{endsolid} {name}", ""]).encode("latin-1")


def binary_stl(head=b""):
    """Return the box as numbers, with these bytes at the beginning."""
    rows = [struct.pack("<12fH", 0, 0, 0, *t.ravel(), 0) for t in BOX.vertices[BOX.faces]]
    return head.ljust(80, b"\0") + struct.pack("<I", len(rows)) + b"".join(rows)


def polygons(write):
    """Return the box with a comment in Latin-1."""
    mark = {"off": ("OFF # \n", "OFF # st\xfcck\n"), "ply": ("\n", "\n")}[write.__name__]
    text = write(BOX.vertices, BOX.faces.tolist()).decode("latin-1")
    return text.replace(*mark, 1).encode("latin-1")


READ = {
    "STL in capitals": ("stl", stl(WORDS.upper())),
    "STL with a name of 1100 letters": ("stl", stl(name="x" * 1100)),
    "STL with a name in Latin-1": ("stl", stl(name="st\xfcck")),
    "STL with a comment before solid": ("stl", b"# of a program\n" + stl()),
    "STL with a byte order mark": ("stl", b"\xef\xbb\xbf" + stl()),
    "STL without endsolid": ("stl", stl().rpartition(b"endsolid")[0]),
    "STL with lines that end in carriage returns": ("stl", stl(end="\r")),
    "STL in one line": ("stl", stl(end=" ")),
    "STL with a facet in each line": ("stl", stl(end=" ").replace(b"endfacet", b"endfacet\n")),
    "binary STL with bytes after the last triangle": ("stl", binary_stl() + bytes(92)),
    "binary STL that begins with solid": ("stl", binary_stl(b"solid of a program")),
    "OFF with a comment in Latin-1": ("off", polygons(off)),
    "PLY with a comment in Latin-1": ("ply", polygons(ply)),
    "OFF with its counts behind its name": ("off", OFF.replace(b"OFF # \n", b"OFF")),
    "OBJ with a comment that ends with a backslash": ("obj", b"# C:\\parts\\\n" + OBJ),
    "OBJ with lines that go on": ("obj", OBJ.replace(b" ", b" \\\n")),
}


@pytest.mark.parametrize("name", READ)
def test_oddities_are_read(name):
    """As the box that they have in them."""
    kind, contents = READ[name]
    surface = surface_of(Mesh(contents=contents, file_type=kind))
    assert (len(surface.triangles), surface.is_closed) == (12, True)
    np.testing.assert_array_equal(surface.vertices.max(axis=0), (1, 1, 1))


FACET = "facet 1 does not have three vertices of three numbers"
REFUSED = {
    "STL with six numbers for each vertex": (
        "stl",
        re.sub(rb"vertex (.*)", rb"vertex \1 \1", stl()),
        FACET,
    ),
    "STL with four vertices in a facet, two in the next": (
        "stl",
        re.sub(rb"(?s)(.*?)(endloop.*?loop)\n(vertex.*?)\n(.*)", rb"\1\3\n\2\n\4", stl()),
        FACET,
    ),
    "STL with a comma": ("stl", stl().replace(b"1 ", b"1, ", 1), "facet 1: .*1,"),
    "STL that ends in a facet": ("stl", stl()[:-70], "it ends within facet 12"),
    "OBJ with a vertex before the first": ("obj", OBJ + b"f -9 2 1", "line 21: .*no vertex -9"),
    "OFF with one number for a vertex": ("off", b"OFF\n1 0 0\n5\n", "line 3: "),
    "OFF with a face of minus one": ("off", OFF[:-8] + b"-1 0 1 2", "line 22: "),
    "OFF with more than it states": ("off", OFF + b"3 0 1 2", "line 23: .*goes on after"),
    "PLY with a part of a vertex": ("ply", ply(BOX.vertices, [[0.5, 1, 2]]), "vertex 0.5, there"),
    "PLY with a part of a corner": (
        "ply",
        PLY.replace(b"\n3 ", b"\n3.5 "),
        "a list of 3.5 entries",
    ),
    "PLY with less than no faces": (
        "ply",
        PLY.replace(b"face 12", b"face -1"),
        "an element of '-1' rows",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_could_only_be_guessed_is_refused(name):
    """By its place and its number."""
    kind, contents, reason = REFUSED[name]
    with pytest.raises(MeshError, match=reason):
        surface_of(Mesh(contents=contents, file_type=kind))


def test_index_0_of_obj_is_refused():
    """Also where there is a vertex that it could be taken for."""
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\nv 5 5 5\n"
    with pytest.raises(MeshError, match=r"line 4: there is no vertex 0: 'f 0 1 2'"):
        surface_of(Mesh(contents=text.encode(), file_type="obj"))


def test_a_hull_has_no_vertices_of_triangles_without_area():
    """As the mesh by its triangles has none; a Convex has all of its points."""
    vertices = np.vstack([BOX.vertices, [[3, 0, 0], [4, 0, 0], [5, 0, 0]]])
    for far in ((8, 9, 8), (8, 9, 10)):
        mesh = Mesh(vertices=vertices, faces=np.vstack([BOX.faces, [far]]))
        assert hull_of(mesh).vertices[:, 0].max() == 1.0
        surface = surface_of(mesh)
        assert surface.vertices[surface.triangles][..., 0].max() == 1.0
    assert hull_of(Convex(vertices=vertices)).vertices[:, 0].max() == 5.0


@pytest.mark.parametrize("scale", ["2", "1 1 1", ("1", 1, 1)])
def test_a_scale_in_words_is_refused(scale):
    """By its name and value."""
    with pytest.raises(InvalidShapeError, match="scale"):
        Mesh(vertices=BOX.vertices, faces=BOX.faces, scale=scale)
