"""Where the files of meshes put their pictures, and what is said of those that can't be shown."""

import json
import warnings

import numpy as np
from pictured_files import board, dae, data_uri, gltf, huge_png, png, write_obj
from PIL import Image
import pytest

from scene_graph_ros.geometry import Convex, Mesh
from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes import textures
from scene_graph_ros.geometry.meshes import triangle_pictures as module
from scene_graph_ros.geometry.meshes.color_warnings import MeshColorWarning
from scene_graph_ros.geometry.meshes.obj_colors import parse_mtl
from scene_graph_ros.geometry.meshes.triangle_colors import triangle_colors
from scene_graph_ros.geometry.meshes.triangle_pictures import triangle_pictures

SQUARE = [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]]


@pytest.fixture
def folder(tmp_path):
    """Have a picture in a folder."""
    (tmp_path / "board.png").write_bytes(png(board()))
    return tmp_path


def told(caught):
    """Return what warnings say."""
    return [str(one.message) for one in caught]


def test_of_two_materials_one_has_a_picture(folder):
    """A square is two triangles; what has no picture is numbered -1, and at 0 on none."""
    mesh = Mesh(write_obj(folder, [((0.5, 0.5, 0.5), None), (None, "board.png")]))
    found = triangle_pictures(mesh)
    assert [picture.place for picture in found.pictures] == [str(folder / "board.png")]
    assert found.row.tolist() == [-1, -1, 0, 0]
    np.testing.assert_array_equal(found.coordinates, [*np.zeros((2, 3, 2)), *SQUARE])
    assert triangle_pictures(Convex(mesh.path)) is None
    plain = write_obj(folder, [((0.5, 0.5, 0.5), None)], "plain")
    assert triangle_pictures(Mesh(plain)) is None


def test_names_are_relative_to_the_file_that_has_them(folder):
    """A library in a folder names pictures there; a name with blanks, an absolute one, an URI."""
    (folder / "looks").mkdir()
    (folder / "looks" / "my board.png").write_bytes(png(board()))
    path = write_obj(folder, [(None, "my board.png")], "a")
    path.write_text(path.read_text().replace("mtllib a.mtl", "mtllib looks/a.mtl"))
    (folder / "a.mtl").rename(folder / "looks" / "a.mtl")
    place = str(folder / "looks" / "my board.png")
    assert triangle_pictures(Mesh(path)).pictures[0].place == place
    for k, name in enumerate((place, f"file://{place}".replace(" ", "%20"))):
        (folder / f"{k}.dae").write_bytes(dae([name]))
        assert triangle_pictures(Mesh(folder / f"{k}.dae")).pictures[0].place == place


def test_one_picture_of_two_materials_is_one(folder):
    """Also where they place it in another way."""
    mesh = Mesh(write_obj(folder, [(None, "board.png"), (None, "-o 0.25 0.5 board.png")]))
    found = triangle_pictures(mesh)
    assert len(found.pictures) == 1
    np.testing.assert_allclose(found.coordinates[2:], np.add(SQUARE, (0.25, 0.5)))


def test_turned_by_gltf(folder):
    """By a right angle, counter-clockwise as seen, about the upper left corner of the picture.

    Its upper edge, from there to the right, is then its way up: (1, 1) goes to (0, 2), and
    (0, 0), which is below that corner, to the right of it, (1, 1).
    """
    extension = {"KHR_texture_transform": {"rotation": np.pi / 2}}
    material = {"baseColorTexture": {"index": 0, "extensions": extension}}
    (folder / "a.gltf").write_bytes(gltf([material], ["board.png"]))
    found = triangle_pictures(Mesh(folder / "a.gltf")).coordinates
    np.testing.assert_allclose(found[0], [(1, 1), (1, 2), (0, 2)], atol=1e-12)
    np.testing.assert_allclose(found[1], [(1, 1), (0, 2), (0, 1)], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "write", "reason"),
    [
        ("none.png", None, "none.png' does not exist"),
        ("C:\\pictures\\none.png", None, "C:/pictures/none.png' does not exist"),
        ("text.png", lambda path: path.write_text("no picture"), "no readable PNG or JPEG file"),
        ("a.bmp", lambda path: Image.new("RGB", (2, 2)).save(path), "no readable PNG or JPEG"),
        (
            "large.png",
            lambda path: path.write_bytes(huge_png()),
            "8193 x 8192 are more than 67108864 pixels",
        ),
    ],
)
@pytest.mark.parametrize("kind", ["obj", "dae", "gltf"])
def test_pictures_that_cant_be_shown_are_told(folder, name, write, reason, kind):
    """By mesh, name and reason, once; the mesh is there without it, and with its others."""
    if write is not None:
        write(folder / name)
    path = folder / f"squares.{kind}"
    if kind == "obj":
        write_obj(folder, [((0.25, 0.5, 0.75), name), (None, "board.png")])
    elif kind == "dae":
        path.write_bytes(dae([name, "board.png"]))
    else:
        path.write_bytes(
            gltf([{"baseColorTexture": {"index": k}} for k in (0, 1)], [name, "board.png"])
        )
    with pytest.warns(MeshColorWarning) as caught:
        found = triangle_pictures(Mesh(path))
    (text,) = told(caught)
    assert f"squares.{kind}' names {name!r}, shown without: " in text
    assert reason in text
    assert found.row.tolist() == [-1, -1, 0, 0]
    colors = triangle_colors(Mesh(path))
    own = [0.25, 0.5, 0.75] if kind == "obj" else [1.0, 1.0, 1.0]
    assert colors.palette[colors.row[0]].tolist() == own
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        triangle_pictures(Mesh(path))


def test_pictures_of_one_file_are_limited_together(folder, monkeypatch):
    """Those that would make too many pixels are left out, and not read after that."""
    monkeypatch.setattr(module, "MAX_TEXELS", 600)
    read = []
    monkeypatch.setattr(
        module, "picture_texture", lambda file: read.append(file) or textures.picture_texture(file)
    )
    for k in range(4):
        Image.new("L", (16, 16), k).save(folder / f"{k}.png")
    mesh = Mesh(write_obj(folder, [(None, f"{k}.png") for k in range(4)]))
    with pytest.warns(MeshColorWarning) as caught:
        found = triangle_pictures(mesh)
    assert found.row.tolist() == [0, 0, 1, 1, -1, -1, -1, -1]
    assert len(read) == 3
    assert ["more than 600 pixels" in text for text in told(caught)] == [True, True]


def test_coordinates_that_cant_be_read_cost_the_pictures_alone(folder):
    """The line is told; the mesh is there."""
    path = write_obj(folder, [(None, "board.png")])
    path.write_text(path.read_text().replace("vt 1 1", "vt one 1"))
    with pytest.warns(MeshColorWarning, match=r"shown without its pictures: .*line 7: could not"):
        assert triangle_pictures(Mesh(path)) is None


def test_triangles_without_coordinates_are_told(folder):
    """How many, and which is the first; the others have the picture."""
    path = write_obj(folder, [(None, "board.png")])
    path.write_text(path.read_text() + "f 1 2 3\n")
    with pytest.warns(MeshColorWarning) as caught:
        found = triangle_pictures(Mesh(path))
    assert "1 triangles, from 2 on, have a picture and no texture coordinates" in told(caught)[0]
    assert found.row.tolist() == [0, 0, -1]
    assert not found.coordinates[2].any()


@pytest.mark.parametrize(
    "spoil",
    [
        lambda tree: tree["textures"].pop(),
        lambda tree: tree["images"][0].pop("uri"),
        lambda tree: tree["images"][0].update(uri=7),
        lambda tree: tree["images"][0].update(uri="data:image/png;base64,x"),
        lambda tree: tree["textures"].__setitem__(0, [3]),
        lambda tree: tree["materials"][0]["pbrMetallicRoughness"].update(baseColorTexture=5),
        lambda tree: tree["images"][0].update(bufferView=99),
    ],
)
def test_references_of_gltf_that_lead_nowhere(folder, spoil):
    """The mesh is there, without pictures, and that is said."""
    tree = json.loads(gltf([{"baseColorTexture": {"index": 0}}], ["board.png"]))
    spoil(tree)
    (folder / "a.gltf").write_text(json.dumps(tree))
    with pytest.warns(MeshColorWarning, match="a.gltf': shown without its pictures, which are un"):
        assert triangle_pictures(Mesh(folder / "a.gltf")) is None
    assert triangle_colors(Mesh(folder / "a.gltf")).palette.tolist() == [[1.0, 1.0, 1.0]]


def test_a_file_of_a_picture_that_is_in_another(folder):
    """Data that is no picture is told by the image's number."""
    (folder / "a.glb").write_bytes(
        gltf([{"baseColorTexture": {"index": 0}}], [b"no picture"], is_binary=True)
    )
    with pytest.warns(MeshColorWarning, match=r"names 'image 0', shown without: image 0 of mesh"):
        assert triangle_pictures(Mesh(folder / "a.glb")) is None


def test_map_kd():
    """Options are read to their ends; the name is the rest of the line."""

    def read(text):
        return parse_mtl(f"newmtl a\nmap_Kd {text}\n".encode(), "x.mtl")["a"].picture

    assert read("a b.png").address == "a b.png"
    assert read("-clamp on -mm 0 1 -bm 2 -s 2 3 4 my -1 b.png").address == "my -1 b.png"
    assert read("-o 0.5 a.png").placement == ((1.0, 0.0, 0.5), (0.0, 1.0, 0.0))
    assert read("-s 2 -3 -o 1 2 3 a.png").placement == ((2.0, 0.0, 1.0), (0.0, -3.0, 2.0))
    for text, reason in (("-s 2", "names no file"), ("-s a.png", "a number is missing behind -s")):
        with pytest.raises(MeshError, match=f"x.mtl: line 2: map_Kd '{text}': {reason}"):
            read(text)


def test_data_addresses(folder):
    """A picture in the address itself, as base64 or in percents."""
    held = png(board())
    percents = "data:image/png," + "".join(f"%{byte:02x}" for byte in held)
    for k, uri in enumerate((data_uri("image/png", held), percents)):
        (folder / f"{k}.gltf").write_bytes(gltf([{"baseColorTexture": {"index": 0}}], [uri]))
        (file,) = triangle_pictures(Mesh(folder / f"{k}.gltf")).pictures
        assert file.contents == held
