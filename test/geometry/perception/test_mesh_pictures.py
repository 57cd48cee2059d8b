"""The pictures that mesh files name or hold, pixel by pixel: colours known by construction.

Three squares of a metre stand side by side across the view, eight pixels wide each, at z = 1. The
first has four fields, the second a colour alone, the third a colour and a picture. A pixel sees
the picture between two texels of one field, so that it has that field's colour.
"""

from camera_scenes import color_camera, core, depth_camera, instance, pose, WORLD
import numpy as np
from pictured_files import (
    BLUE,
    BOARD,
    board,
    dae,
    data_uri,
    gltf,
    GREEN,
    png,
    RED,
    WHITE,
    write_obj,
)
from PIL import Image
import pytest

from scene_graph_ros.geometry import Mesh, Rgba, SceneGraph
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ExactRenderEngine,
    LightParameter,
    TracedRenderEngine,
)
from scene_graph_ros.geometry.perception.exact.color import color_image
from scene_graph_ros.geometry.perception.exact.view import look, View
from scene_graph_ros.geometry.perception.exact.visibility import find_visible
from scene_graph_ros.geometry.perception.gltf.document import gltf_document
from scene_graph_ros.geometry.perception.picture_bodies import with_one_picture_each
from scene_graph_ros.geometry.perception.srgb import linear, srgb

LENS = CameraIntrinsics(24, 8, 8.0, 8.0, 11.5, 3.5)
CLIPPING = ClippingRange(0.01, 50.0)
AHEAD = pose(p=(-1.5, -0.5, 1.0))
PLAIN, TINT = (0.2, 0.4, 0.6), (0.6, 1.0, 0.2)
OTHER = ((10, 100, 250),) * 2
CLEAR = (204, 229, 255)


def in_eights(color, rows=8):
    """Return eight columns of a colour."""
    return np.broadcast_to(np.array(color, np.uint8), (rows, 8, 3))


def expected_board(fields=BOARD):
    """Return the square of four fields: the camera's y, like v, grows downwards in the image."""
    upper, lower = np.array(fields, np.uint8)
    return np.repeat(np.repeat(np.stack([lower, upper]), 4, 0), 4, 1)


def level(*shares):
    """Return shares of full intensity as levels, rounded to nearest."""
    return [int(255.0 * share + 0.5) for share in shares]


ALL = np.concatenate(
    [
        expected_board(),
        in_eights(level(*PLAIN)),
        in_eights(level(*(t * c / 255.0 for t, c in zip(TINT, (10, 100, 250), strict=True)))),
    ],
    axis=1,
)
UNTINTED = np.concatenate([ALL[:, :16], in_eights(OTHER[0])], axis=1)


def scene(*instances, **engines):
    """Return queries of a scene, by default before the exact renderer."""
    graph = SceneGraph()
    for name, engine in (engines or {"exact": ExactRenderEngine()}).items():
        graph.add_renderer(name, engine)
    source = graph.register_source("scene")
    for one in instances:
        graph.register_anchored_geometry(source, one)
    return graph.query_object(graph.create_default_context())


def image_of(*instances, X=None):
    """Return what the camera sees, and check that a pass of all kinds sees the same."""
    query = scene(*instances)
    X_WC = np.eye(4) if X is None else X
    image = query.render_color_image(color_camera(LENS, CLIPPING), WORLD, X_WC)
    again = query.render_images(depth_camera(LENS, CLIPPING), WORLD, X_WC)
    np.testing.assert_array_equal(again.color, image)
    assert (image[..., 3] == 255).all()
    return image[..., :3]


@pytest.fixture
def pictures(tmp_path):
    """Write the pictures, one of them in a folder; return the folder of all."""
    (tmp_path / "some pictures").mkdir()
    (tmp_path / "board.png").write_bytes(png(board()))
    (tmp_path / "some pictures" / "other.png").write_bytes(png(board((OTHER, OTHER))))
    return tmp_path


def factors(*, tint=TINT):
    """Return glTF's materials."""
    return [
        {"baseColorTexture": {"index": 1}},
        {"baseColorFactor": [*PLAIN, 1.0]},
        {"baseColorTexture": {"index": 0}, "baseColorFactor": [*tint, 1.0]},
    ]


def _obj(folder):
    return write_obj(
        folder, [(None, "board.png"), (PLAIN, None), (TINT, "some pictures\\other.png")]
    )


def _gltf_beside(folder):
    (folder / "a.gltf").write_bytes(gltf(factors(), ["some%20pictures/other.png", "board.png"]))
    return folder / "a.gltf"


def _gltf_inside(folder):
    held = [png(board((OTHER, OTHER))), data_uri("image/png", png(board()))]
    (folder / "a.gltf").write_bytes(gltf(factors(), held))
    return folder / "a.gltf"


def _glb(folder):
    held = [png(board((OTHER, OTHER))), png(board())]
    (folder / "a.glb").write_bytes(gltf(factors(), held, is_binary=True))
    return folder / "a.glb"


def _buffer_beside(folder):
    held = [png(board((OTHER, OTHER))), "board.png"]
    told = gltf(factors(), held, beside=folder / "my buffer.bin")
    (folder / "a.gltf").write_bytes(told)
    return folder / "a.gltf"


def _dae(folder):
    (folder / "a.dae").write_bytes(dae(["board.png", PLAIN, "some%20pictures/other.png"]))
    return folder / "a.dae"


KINDS = {
    "obj": _obj,
    "gltf beside": _gltf_beside,
    "gltf inside": _gltf_inside,
    "buffer beside": _buffer_beside,
    "glb": _glb,
}


@pytest.mark.parametrize("kind", [*KINDS, "dae"])
def test_squares_of_three_materials(pictures, kind):
    """In each type of file; COLLADA has a picture or a colour, not both."""
    write = KINDS.get(kind, _dae)
    image = image_of(instance(Mesh(write(pictures)), AHEAD, "squares"))
    np.testing.assert_array_equal(image, UNTINTED if kind == "dae" else ALL)


def test_what_is_given_goes_before_what_the_file_says(pictures):
    """A picture is then on all of it, a colour is the whole body's; bodies of a file differ."""
    mesh = Mesh(_obj(pictures))
    Image.new("RGB", (2, 2), (7, 8, 9)).save(pictures / "own.png")
    own = instance(mesh, AHEAD, "own", phong=("diffuse_map", pictures / "own.png"))
    np.testing.assert_array_equal(image_of(own), np.broadcast_to((7, 8, 9), (8, 24, 3)))
    mapped = instance(mesh, AHEAD, "mapped", phong=("diffuse_map", pictures / "board.png"))
    np.testing.assert_array_equal(image_of(mapped), np.tile(expected_board(), (1, 3, 1)))
    colored = instance(mesh, AHEAD, "colored", phong=("diffuse", Rgba(0, 0, 1)))
    np.testing.assert_array_equal(image_of(colored), np.broadcast_to(BLUE, (8, 24, 3)))
    # One behind the other, each seen in a half of the rows.
    X_low, X_high = AHEAD.copy(), AHEAD.copy()
    X_low[1, 3], X_high[1, 3] = 0.0, -1.0
    both = image_of(
        instance(mesh, X_low, "plain"),
        instance(mesh, X_high, "own", phong=("diffuse_map", pictures / "own.png")),
    )
    np.testing.assert_array_equal(both[:4], np.broadcast_to((7, 8, 9), (4, 24, 3)))
    np.testing.assert_array_equal(both[4:], ALL[:4])


def test_a_mirrored_mesh_has_its_pictures_mirrored(pictures):
    """From left to right."""
    mirrored = Mesh(_obj(pictures), (-1.0, 1.0, 1.0))
    X = AHEAD.copy()
    X[0, 3] = 1.5
    np.testing.assert_array_equal(image_of(instance(mirrored, X, "squares")), ALL[:, ::-1])


def test_placed_by_the_file(pictures):
    """Scaled by two and moved by half: two of each field across, which begin in the middle.

    By OBJ's -s and -o, and by glTF's extension, there with a second set of coordinates.
    """
    path = write_obj(pictures, [(None, "-clamp off -s 2 1 1 -o 0.5 board.png")], "placed")
    transform = {"scale": [2.0, 1.0], "offset": [0.5, 0.0], "texCoord": 1}
    told = {"baseColorTexture": {"index": 0, "extensions": {"KHR_texture_transform": transform}}}
    other = gltf([told], ["board.png"], coordinates="TEXCOORD_1")
    (pictures / "placed.gltf").write_bytes(other)
    # u = 2 x + 0.5: the field on the right of the picture until x = 1/4, then that on the left.
    lower = [[WHITE] * 2 + [BLUE] * 2] * 4
    upper = [[GREEN] * 2 + [RED] * 2] * 4
    expected = np.tile(np.array(lower + upper, np.uint8), (1, 2, 1))
    for file in (path, pictures / "placed.gltf"):
        image = image_of(instance(Mesh(file), AHEAD, "placed"))
        np.testing.assert_array_equal(image[:, :8], expected, file.name)


def test_alpha_of_files_is_passed_over(pictures):
    """While the same picture, given by a property, is seen through."""
    texels = np.dstack([board(), np.zeros((16, 16), np.uint8)])
    (pictures / "board.png").write_bytes(png(texels))
    mesh = Mesh(_obj(pictures))
    np.testing.assert_array_equal(image_of(instance(mesh, AHEAD, "squares")), ALL)
    nearer = pose(p=(-0.75, -0.25, 0.5))
    glass = instance(
        Mesh(_obj(pictures), 0.5), nearer, "glass", phong=("diffuse_map", pictures / "board.png")
    )
    np.testing.assert_array_equal(image_of(instance(mesh, AHEAD, "squares"), glass), ALL)


def test_seen_through_glass(pictures):
    """Behind a pane of half alpha, half of each colour and half of the pane's."""
    pane = instance(
        Mesh(vertices=[(-3, -3, 0), (3, -3, 0), (0, 6, 0)], faces=[(0, 1, 2)]),
        pose(p=(0.0, 0.0, 0.5)),
        "pane",
        phong=("diffuse", Rgba(1.0, 1.0, 1.0, 0.5)),
    )
    image = image_of(instance(Mesh(_obj(pictures)), AHEAD, "squares"), pane)
    apart = image - (0.5 * ALL.astype(float) + 127.5)
    assert np.abs(apart).max() <= 1.0


def test_from_memory_a_mesh_has_what_it_holds(pictures, recwarn):
    """What a client sends names no files of the node's disk, and nothing is said of it."""
    held = Mesh(contents=_glb(pictures).read_bytes(), file_type="glb")
    np.testing.assert_array_equal(image_of(instance(held, AHEAD, "squares")), ALL)
    white = in_eights(WHITE)
    for path in (_gltf_beside(pictures), _dae(pictures)):
        named = Mesh(contents=path.read_bytes(), file_type=path.suffix)
        image = image_of(instance(named, AHEAD, "squares"))
        np.testing.assert_array_equal(image[:, :8], white)
        np.testing.assert_array_equal(image[:, 8:16], ALL[:, 8:16])
    assert not [str(w.message) for w in recwarn if "picture" in str(w.message)]


def test_bodies_of_one_picture_each_look_the_same(pictures):
    """What the renderers get that know pictures of bodies: the same bytes, seen obliquely."""
    X = pose(5, (0.0, 0.0, 3.0))
    bodies = [instance(Mesh(_obj(pictures)), X, "squares", label=3)]
    bodies.append(instance(Mesh(_glb(pictures), 0.5), pose(p=(0.0, 0.0, 2.0)), "small"))
    Image.new("RGB", (2, 2), (7, 8, 9)).save(pictures / "own.png")
    own = ("diffuse_map", pictures / "own.png")
    bodies.append(instance(Mesh(_obj(pictures)), pose(p=(-1.0, 0.2, 3.0)), "own", phong=own))
    lens = CameraIntrinsics(60, 40, 40.0, 40.0, 29.5, 19.5)
    query = scene(*bodies)
    view = look(query.snapshot, core(lens, CLIPPING), np.eye(4), (1.0, 1.0, 1.0, 1.0))
    split, cover = with_one_picture_each(view.bodies, view.cover)
    assert len(split.kind) == 3 + 3 + 1
    assert split.label.tolist()[:3] == [3, 3, 3]
    again = View(view.sensor, split, cover, view.screen, np.empty((99, view.corners.shape[1])))
    whole = color_image(view, CLEAR)
    find_visible(view.sensor, split, np.ones(7, bool), again.screen, again.corners)
    np.testing.assert_array_equal(color_image(again, CLEAR), whole)
    assert len(np.unique(whole.reshape(-1, 4), axis=0)) > 6


def test_traced(pictures):
    """Inside a field, its colour; a picture and a colour are multiplied as light, not as sRGB."""
    query = scene(
        instance(Mesh(_obj(pictures)), AHEAD, "squares"),
        traced=TracedRenderEngine(lights=(LightParameter(),), ambient=0.0, samples=4, max_depth=2),
    )
    camera = color_camera(LENS, CLIPPING, renderer="traced")
    image = query.render_color_image(camera, WORLD, np.eye(4))[..., :3].astype(float)
    inner = np.zeros((8, 24), bool)
    inner[np.ix_([1, 2, 5, 6], [1, 2, 5, 6, *range(9, 15), *range(17, 23)])] = True
    expected = ALL.astype(float)
    expected[:, 16:] = 255.0 * srgb(linear(TINT) * linear(np.array(OTHER[0]) / 255.0))
    assert np.abs(image - expected)[inner].max() <= 1.0


def test_a_document_for_a_server(pictures):
    """Each picture once, a node for each material of the mesh."""
    import json

    query = scene(instance(Mesh(_obj(pictures)), AHEAD, "squares", label=3))
    view = look(query.snapshot, core(LENS, CLIPPING), np.eye(4), (1.0, 1.0, 1.0, 1.0))
    document = gltf_document(
        view.bodies, view.cover, core(LENS, CLIPPING), np.eye(4), by_label=False
    )
    tree = json.loads(document)
    assert len(tree["images"]) == 2
    matt = [material["pbrMetallicRoughness"] for material in tree["materials"]]
    assert [("baseColorTexture" in one) for one in matt].count(True) == 2
    assert [node["extras"]["label"] for node in tree["nodes"] if "extras" in node] == [3] * 3
