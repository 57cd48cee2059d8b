"""COLLADA files: all digits, all transforms, and what is not read refused by its name."""

from dae_files import corner, FACES, INPUT, POINTS, skinned
import numpy as np
import pytest

from scene_graph_ros.geometry import Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes import dae_file
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.io import read_colored_mesh, read_mesh_contents
from scene_graph_ros.geometry.meshes.polygons import CROSSED
from scene_graph_ros.geometry.meshes.sources import surface_of
from scene_graph_ros.geometry.meshes.texture_coordinates import texture_coordinates

STRIP = "<tristrips count='1'>" + INPUT + "<p>0 1 2 3 0 1</p></tristrips>"
FAN = "<trifans count='2'>" + INPUT + "<p>3 0 1 2 0</p><p>0 2 1</p></trifans>"


def surface(**words):
    """Return the surface of the corner of a box in such a file."""
    return surface_of(Mesh(contents=corner(**words), file_type="dae"))


def placed(node, **words):
    """Return the vertices of the corner where the content of a node places them."""
    scene = f'<node>{node}<instance_geometry url="#g"/></node>'
    return read_mesh_contents(corner(scene=scene, **words), "dae", name="a corner")[0]


def refusal(**words):
    """Return the message."""
    with pytest.raises(MeshError) as caught:
        read_mesh_contents(corner(**words), "dae", name="a corner")
    assert str(caught.value).startswith("a corner: ")
    return str(caught.value)


def test_numbers_keep_their_digits():
    """As many as a double has, in vertices and in transforms."""
    text = "0 0 0 1.00000000001 0 0 0 1 0 0 0 0.1"
    vertices = read_mesh_contents(corner(numbers=text), "dae", name="a corner")[0]
    assert (vertices.max(axis=0) == (1.00000000001, 1.0, 0.1)).all()
    moved = placed("<translate>1e5 0.1 0</translate><scale>0.1 3 7</scale>")
    np.testing.assert_array_equal(moved[[0, 1]], [(1e5, 0.1, 0), (1e5 + 0.1, 0.1, 0)])


@pytest.mark.parametrize(
    ("node", "expected"),
    [
        ("<translate>5 0 0</translate><rotate>0 0 1 90</rotate><scale>2 3 4</scale>", (5, 2, 0)),
        ("<rotate>0 0 7 -270</rotate>", (0, 1, 0)),
        ("<rotate>0 0 1 360</rotate><rotate>0 0 0 0</rotate>", (1, 0, 0)),
        ("<rotate>1 1 1 120</rotate>", (0, 1, 0)),
        ("<matrix>0 -1 0 2 1 0 0 3 0 0 1 4 0 0 0 1</matrix>", (2, 4, 4)),
        ("<scale>-1 1 1</scale>", (-1, 0, 0)),
    ],
)
def test_transforms_are_applied_in_their_order(node, expected):
    """To the corner at (1, 0, 0); a mirrored body has its inside inside."""
    np.testing.assert_allclose(placed(node)[1], expected, atol=1e-15)
    scene = f'<node>{node}<node><instance_geometry url="#g"/></node></node>'
    found = surface(scene=scene)
    assert found.is_closed
    a, b, c = (found.vertices[found.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0
    assert not found.report.repairs


@pytest.mark.parametrize("faces", [STRIP, FAN])
def test_strips_and_fans(faces):
    """Each triangle runs as the first one does."""
    found = surface(faces=faces)
    assert (len(found.triangles), found.is_closed) == (4, True)
    assert not found.report.repairs


@pytest.mark.parametrize(
    "words",
    [
        {"numbers": " ".join(f"{x} {y} {z} 9" for x, y, z in POINTS), "stride": 4},
        {"numbers": " ".join(f"9 {x} {y} {z}" for x, y, z in POINTS), "params": ["", *"XYZ"]},
        {"numbers": " ".join(f"{z} {x} {y}" for x, y, z in POINTS), "params": "ZXY"},
        {"numbers": "7 7 " + " ".join(map(str, np.ravel(POINTS))), "offset": 2},
        {"space": ""},
        {"space": 'xmlns="http://www.collada.org/2008/03/COLLADASchema"'},
    ],
)
def test_numbers_are_where_the_accessor_says(words):
    """With a stride, an offset, parameters without a name; and in any namespace."""
    found = surface(**{"stride": len(words.get("params", "XYZ")), **words})
    assert (len(found.triangles), found.is_closed) == (4, True)
    np.testing.assert_array_equal(np.unique(found.vertices, axis=0), np.unique(POINTS, axis=0))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (skinned(), "bent by the controller '#k'"),
        (skinned('<node><instance_geometry url="#g"/></node>'), "bent by the controller '#k'"),
        ({"scene": '<node><instance_geometry url="#h"/></node>'}, "no geometry '#h'"),
        ({"scene": '<node><instance_geometry url="b.dae#g"/></node>'}, "no geometry 'b.dae#g'"),
        ({"scene": '<node><instance_node url="b.dae#n"/></node>'}, "no node 'b.dae#n'"),
        ({"shown": ""}, "it shows no scene"),
        ({"shown": '<instance_visual_scene url="#z"/>'}, "no visual_scene '#z'"),
        ({"faces": f'<triangles count="1">{INPUT}<p>0 1 9</p></triangles>'}, "vertex 9, there"),
        ({"faces": f'<triangles count="1">{INPUT}<p>0 1 -1</p></triangles>'}, "vertex -1, there"),
        ({"faces": f'<triangles count="2">{INPUT}<p>0 1 2</p></triangles>'}, "1 of 2 triangles"),
        ({"faces": f"<triangles>{INPUT}<p>0 1 2 3</p></triangles>"}, "4 corners of triangles"),
        ({"faces": f"<triangles>{INPUT}<p>0 1 2.5</p></triangles>"}, "2.5"),
        ({"faces": "<triangles><p>0 1 2</p></triangles>"}, "triangles without vertices"),
        ({"faces": f"<polygons>{INPUT}<ph><p>0 1 2</p></ph></polygons>"}, "with holes"),
        ({"faces": "<tetrahedra/>"}, "geometry 'g' has 'tetrahedra', not read"),
        ({"mesh": "convex_mesh"}, "geometry 'g' is of the kind 'convex_mesh'"),
        ({"params": "XY"}, "the source '#p' has no X, Y, Z"),
        ({"numbers": "0 0 0 1 0 0"}, "the source '#p' has fewer than 4 rows"),
        ({"count": 3}, "vertex 3, there are 3"),
        ({"unit": "0"}, "its unit is 0.0 m"),
        ({"unit": "nan"}, "its unit is nan m"),
        ({"unit": "a foot"}, "a foot"),
    ],
)
def test_what_is_not_read_is_refused_by_its_name(words, reason):
    """Also where there is something beside it that could be read."""
    assert reason in refusal(**words)


@pytest.mark.parametrize(
    ("node", "reason"),
    [
        ("<skew>45 0 1 0 1 0 0</skew>", "a node has a skew"),
        ("<lookat>0 0 5 0 0 0 0 1 0</lookat>", "a node has a lookat"),
        ("<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 2</matrix>", "the last row of a matrix"),
        ("<matrix>1 0 0 0</matrix>", "matrix has 4 numbers"),
        ("<scale>1 2</scale>", "scale has 2 numbers"),
        ("<translate>1 2 x</translate>", "'x'"),
        ("<rotate>0 0 0 30</rotate>", "axis without a direction"),
        ("<rotate>0 0 1 inf</rotate>", "unreadable dae"),
    ],
)
def test_a_transform_that_is_not_read_is_refused(node, reason):
    """Below it; beside it, as of a camera, it does not matter."""
    beside = f'<node>{node}</node><node><instance_geometry url="#g"/></node>'
    assert surface(scene=beside).is_closed
    below = f'<node>{node}<node><instance_geometry url="#g"/></node></node>'
    assert reason in refusal(scene=below)


def test_bodies_are_counted_before_they_are_placed(monkeypatch):
    """Each time that one is placed."""
    scene = '<node><instance_geometry url="#g"/></node>' * 3
    monkeypatch.setattr(dae_file, "MAX_CORNERS", 12)
    assert len(read_mesh_contents(corner(scene=scene), "dae", name="a corner")[0]) == 12
    monkeypatch.setattr(dae_file, "MAX_CORNERS", 11)
    assert "more than 11 vertices or triangles" in refusal(scene=scene)


def test_of_sources_with_one_id_that_of_the_geometry_is_meant():
    """As a gripper's file has it: two geometries whose sources are called alike."""
    whole = corner().decode()
    geometry = whole[whole.index("<geometry") : whole.index("</library_geometries>")]
    other = geometry.replace('id="g"', 'id="h"').replace(">0 0 0 1 0 0 0", ">0 0 0 5 0 0 0")
    contents = whole.replace("</library_geometries>", other + "</library_geometries>")
    contents = contents.replace("</node>", '<instance_geometry url="#h"/></node>', 1)
    vertices = read_mesh_contents(contents.encode(), "dae", name="two corners")[0]
    assert (len(vertices), vertices[:, 0].tolist()) == (8, [0, 1, 0, 0, 0, 5, 0, 0])


def test_lines_and_curves_are_no_surface():
    """Beside triangles they do not matter; alone there is nothing."""
    lines = f'<lines count="1">{INPUT}<p>0 1</p></lines>'
    assert surface(faces=lines + FACES).is_closed
    assert "there are no vertices" in refusal(faces=lines)


def test_a_crossed_polygon_is_told_where_it_is_placed():
    """In metres, in the mesh's frame."""
    faces = f'<polylist count="1">{INPUT}<vcount>4</vcount><p>0 3 1 2</p></polylist>'
    numbers = "0 0 0 1 0 0 1 1 0 0 1 0"
    scene = '<node><translate>100 0 0</translate><instance_geometry url="#g"/></node>'
    contents = corner(numbers=numbers, faces=faces, scene=scene, unit="0.01")
    (repair,) = read_colored_mesh(contents, "dae", name="a corner").repairs
    assert (repair.kind, repair.count, repair.point) == (CROSSED, 1, (1.0, 0.0, 0.0))


def look(diffuse, params="", images="", more="", uv=True):
    """Return the corner with a material that has a diffuse part."""
    inputs = INPUT
    sources = ""
    if uv:
        for k, numbers in enumerate(("0 0 1 0 0 1 1 1", "0 0 0.5 0 0 0.5 0.5 0.5")):
            inputs += f'<input semantic="TEXCOORD" source="#t{k}" offset="0" set="{k}"/>'
            sources += (
                f'<source id="t{k}"><float_array id="ta{k}">{numbers}</float_array>'
                f'<technique_common><accessor source="#ta{k}" count="4" stride="2">'
                '<param name="S"/><param name="T"/></accessor></technique_common></source>'
            )
    return corner(
        faces=sources
        + FACES.replace(INPUT, inputs).replace("<triangles", '<triangles material="s"'),
        scene='<node><instance_geometry url="#g"><bind_material><technique_common>'
        f'<instance_material symbol="s" target="#m">{more}</instance_material>'
        "</technique_common></bind_material></instance_geometry></node>",
        libraries=f"<library_images>{images}</library_images><library_effects><effect id='e'>"
        f"<profile_COMMON>{params}<technique sid='c'><lambert>{diffuse}</lambert></technique>"
        "</profile_COMMON></effect></library_effects><library_materials><material id='m'>"
        "<instance_effect url='#e'/></material></library_materials>",
    )


IMAGE = '<image id="i"><init_from>a.png</init_from></image>'
SAMPLED = (
    '<newparam sid="f"><surface type="2D"><init_from>i</init_from></surface></newparam>'
    '<newparam sid="s"><sampler2D><source>f</source></sampler2D></newparam>'
)


@pytest.mark.parametrize(
    ("words", "color", "address"),
    [
        (("<diffuse><color>0.25 0.5 0.75 1</color></diffuse>",), (0.25, 0.5, 0.75), None),
        (("",), (1, 1, 1), None),
        (
            (
                '<diffuse><param ref="q"/></diffuse>',
                '<newparam sid="q"><float4>0.5 0 1 1</float4></newparam>',
            ),
            (0.5, 0, 1),
            None,
        ),
        (('<diffuse><texture texture="s"/></diffuse>', SAMPLED, IMAGE), (1, 1, 1), "a.png"),
        (('<diffuse><texture texture="i"/></diffuse>', "", IMAGE), (1, 1, 1), "a.png"),
        (
            (
                '<diffuse><texture texture="s"/></diffuse>',
                '<newparam sid="s"><sampler2D><instance_image url="#i"/></sampler2D></newparam>',
                '<image id="i"><init_from><ref>b.png</ref></init_from></image>',
            ),
            (1, 1, 1),
            "b.png",
        ),
    ],
)
def test_looks(words, color, address):
    """A colour, a parameter, or a picture by its sampler or its own name; of 1.4 and 1.5."""
    mesh = read_colored_mesh(look(*words), "dae", name="a corner")
    np.testing.assert_array_equal(mesh.colors, [color] * 4)
    assert (mesh.pictures is None) == (address is None)
    if address is not None:
        assert mesh.pictures.pictures[0].address == address
        assert mesh.pictures.row.tolist() == [0] * 4


def test_looks_that_lead_nowhere_cost_no_mesh():
    """The mesh is read, and there is a warning."""
    with pytest.warns(MeshColorWarning, match="a corner: shown without its colours"):
        mesh = read_colored_mesh(
            look('<diffuse><texture texture="z"/></diffuse>'), "dae", name="a corner"
        )
    assert (len(mesh.triangles), mesh.colors, mesh.pictures) == (4, None, None)


@pytest.mark.parametrize(("number", "size"), [(0, 1.0), (1, 0.5)])
def test_texture_coordinates_are_those_that_the_material_binds(number, size):
    """Of two sets, that of the texture's name."""
    bound = f'<bind_vertex_input semantic="U" input_semantic="TEXCOORD" input_set="{number}"/>'
    texture = '<diffuse><texture texture="s" texcoord="U"/></diffuse>'
    mesh = Mesh(contents=look(texture, SAMPLED, IMAGE, bound), file_type="dae")
    found = texture_coordinates(mesh)
    assert (found.shape, found.max()) == ((4, 3, 2), size)
    bare = Mesh(contents=look("", uv=False), file_type="dae")
    with pytest.raises(MeshError, match="has no texture coordinates"):
        texture_coordinates(bare)
