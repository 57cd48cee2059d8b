"""A server renders: what it is sent, what it may answer, and what becomes of one that fails.

The servers of these tests listen on 127.0.0.1 alone.
"""

import base64
from contextlib import contextmanager
from email.parser import BytesParser
import email.policy
import hashlib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
import io
import json
import logging
import math
import threading

from camera_scenes import depth_camera, instance, pose, WORLD
import numpy as np
from PIL import Image
import pytest

from scene_graph_ros.geometry import (
    Box,
    Capsule,
    GeometryInstance,
    HalfSpace,
    Mesh,
    PerceptionProperties,
    Rgba,
    SceneGraph,
    Sphere,
)
from scene_graph_ros.geometry.errors import EngineError
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    ClippingRange,
    ExactRenderEngine,
    GltfClientRenderEngine,
    RenderLabel,
)

LENS = CameraIntrinsics(24, 18, 20.0, 21.0, 10.3, 9.1)
CLIPPING = ClippingRange(0.01, 50.0)
_POLL = 0.01
"""Seconds after which a server looks whether it is to end; by default half a second."""


def form_of(handler):
    """Return the fields of a form as bytes."""
    body = handler.rfile.read(int(handler.headers["Content-Length"]))
    head = f"Content-Type: {handler.headers['Content-Type']}\r\n\r\n".encode()
    message = BytesParser(policy=email.policy.HTTP).parsebytes(head + body)
    return {
        part.get_param("name", header="content-disposition"): part.get_payload(decode=True)
        for part in message.iter_parts()
    }


@contextmanager
def serving(answer):
    """Serve answers, (status, bytes), to forms; yield the address and the forms that came."""
    forms = []

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self):
            forms.append(form_of(self) | {"path": self.path})
            status, contents = answer(forms[-1])
            self.send_response(status)
            self.send_header("Content-Length", str(len(contents)))
            self.end_headers()
            self.wfile.write(contents)

        def log_message(self, *arguments):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(_POLL,), daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}", forms
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def file_of(pixels, kind):
    """Return an image file."""
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, kind)
    return file.getvalue()


def query_of(bodies, engine):
    """Return queries of a scene with the renderers "exact" and "server"."""
    graph = SceneGraph()
    graph.add_renderer("exact", ExactRenderEngine())
    graph.add_renderer("server", engine)
    source = graph.register_source("scene")
    for one in bodies:
        graph.register_anchored_geometry(source, one)
    return graph.query_object(graph.create_default_context())


def images(query, name="server", kinds=None, X=None, depth_range=None):
    """Return images by a renderer."""
    camera = depth_camera(LENS, CLIPPING, renderer=name, depth_range=depth_range)
    return query.render_images(camera, WORLD, np.eye(4) if X is None else X, kinds=kinds)


def matrix_of(node):
    """Return a node's matrix, which glTF has column by column."""
    return np.reshape(node["matrix"], (4, 4)).T


def render_gltf(form):
    """Return the depth that a renderer sees of a document, and its label's colours' labels.

    The document is read by this project's own reader of mesh files, and is exact's to render.
    """
    tree = json.loads(form["scene"])
    root = tree["nodes"][tree["scenes"][0]["nodes"][0]]
    camera = next(node for node in tree["nodes"] if "camera" in node)
    X_WS = matrix_of(root) @ matrix_of(camera) @ np.diag([1.0, -1.0, -1.0, 1.0])
    mesh = Mesh(contents=form["scene"], file_type="gltf")
    # Files have +Y up by their standard, and are turned when read; a document's axes are ours.
    to_y_up = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [0, -1.0, 0, 0], [0, 0, 0, 1.0]])
    query = query_of([instance(mesh, to_y_up, "all")], ExactRenderEngine())
    return images(query, "exact", X=X_WS)


def scene():
    """Return bodies whose triangles are exact, and round ones, in a half space's room."""
    return [
        instance(Box(0.3, 0.2, 0.25), pose(3, (0.1, 0.0, 1.0)), "box", label=300),
        instance(HalfSpace(), floor(), "floor", label=7),
        instance(Capsule(0.1, 0.2), pose(4, (-0.3, 0.1, 1.1)), "capsule", label=258),
    ]


def floor():
    """Return a floor's pose, 0.4 m below a camera that looks ahead: z of the floor is -y."""
    X = pose(p=(0.0, 0.4, 0.0))
    X[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    return X


CAMERA = pose(p=(0.02, 0.01, -0.1))


def test_a_server_sees_what_exact_sees():
    """It renders the document by its camera's node: the same depths, to float32 and triangles."""

    def answer(form):
        return 200, file_of(render_gltf(form).depth, "TIFF")

    with serving(answer) as (url, forms):
        query = query_of(scene(), GltfClientRenderEngine(url))
        depth = images(query, kinds=["depth"], X=CAMERA).depth
    exact = images(query, "exact", X=CAMERA)
    both = np.isfinite(depth) & np.isfinite(exact.depth)
    assert (np.isfinite(depth) == np.isfinite(exact.depth)).mean() > 0.98
    flat = both & (exact.label != 258)
    apart = np.abs(depth - exact.depth)[flat] / exact.depth[flat]
    assert flat.sum() > 150
    assert np.sort(apart)[: int(0.97 * len(apart))].max() < 1e-5  # others are at outlines
    form = {name: value.decode() for name, value in forms[0].items() if name not in ("path",)}
    assert hashlib.sha256(forms[0]["scene"]).hexdigest() == form["scene_sha256"]
    assert forms[0]["path"] == "/render"
    expected = {
        "width": 24,
        "height": 18,
        "near": 0.01,
        "far": 50.0,
        "focal_x": 20.0,
        "focal_y": 21.0,
        "center_x": 10.8,
        "center_y": 9.6,
        "fov_x": 2 * math.atan(12 / 20),
        "fov_y": 2 * math.atan(9 / 21),
        "min_depth": 0.01,
        "max_depth": 50.0,
    }
    assert {name: float(form[name]) for name in expected} == pytest.approx(expected, rel=1e-15)
    assert form["image_type"] == "depth"


def test_all_kinds_are_asked_for_one_by_one():
    """Colour with alpha or without, labels of 16 bits, millimetres; depths by the range."""
    rng = np.random.default_rng(1)
    color = rng.integers(0, 256, (18, 24, 3)).astype(np.uint8)
    label = rng.integers(0, 32768, (18, 24)).astype(np.uint16)
    depth = rng.integers(0, 65536, (18, 24)).astype(np.uint16)
    depth[0, :4] = 0, 65535, 499, 500
    files = {
        b"color": file_of(color, "PNG"),
        b"label": file_of(label, "PNG"),
        b"depth": file_of(depth, "TIFF"),
    }
    with serving(lambda form: (200, files[form["image_type"]])) as (url, forms):
        engine = GltfClientRenderEngine(url + "/", "/v1/render")
        query = query_of(scene(), engine)
        found = images(query, depth_range=(0.5, 20.0))
    assert (found.color[..., :3] == color).all()
    assert (found.color[..., 3] == 255).all()
    assert found.label.dtype == np.int16
    assert (found.label == label).all()
    metres = depth / 1000.0
    expected = np.where(metres < 0.5, 0.0, np.where(metres > 20.0, np.inf, metres))
    np.testing.assert_array_equal(found.depth, expected.astype(np.float32))
    assert found.depth[0, 3] == 0.5
    assert [form["image_type"] for form in forms] == [b"color", b"depth", b"label"]
    assert {form["path"] for form in forms} == {"/v1/render"}
    assert all("min_depth" not in form for form in (forms[0], forms[2]))


def document(bodies, kind="color"):
    """Return the document that a server is sent."""
    empty = file_of(np.zeros((18, 24, 3), np.uint8), "PNG")
    zero = file_of(np.zeros((18, 24), np.uint16), "PNG")
    with serving(lambda form: (200, empty if form["image_type"] == b"color" else zero)) as (
        url,
        forms,
    ):
        images(query_of(bodies, GltfClientRenderEngine(url)), kinds=[kind])
    return json.loads(forms[0]["scene"])


def test_labels_are_colours_without_light():
    """The lower byte is red, the upper one green, in sRGB; and numbers beside."""
    tree = document([*scene(), instance(Sphere(0.1), pose(p=(0, 0, 2)), "ball")], "label")
    bodies = [node for node in tree["nodes"] if "mesh" in node]
    labels = [node["extras"]["label"] for node in bodies]
    assert labels == [300, 7, 258, int(RenderLabel.DONT_CARE)]
    for node, label in zip(bodies, labels, strict=True):
        primitive = tree["meshes"][node["mesh"]]["primitives"][0]
        material = tree["materials"][primitive["material"]]
        red, green, blue, _ = material["pbrMetallicRoughness"]["baseColorFactor"]
        levels = [
            255 * (12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055)
            for c in (red, green, blue)
        ]
        assert np.round(levels).tolist() == [label % 256, label // 256, 0]
        assert "KHR_materials_unlit" in material["extensions"]
    assert tree["extensionsUsed"] == ["KHR_materials_unlit"]


def test_materials_have_colours_pictures_and_alpha(tmp_path):
    """Linear colours; a picture once, its repetitions a transform; nothing without alpha."""
    texels = np.random.default_rng(2).integers(0, 256, (4, 6, 3)).astype(np.uint8)
    Image.fromarray(texels).save(tmp_path / "picture.png")
    covered = []
    for k, scale in enumerate(((2.0, 3.0), (1.0, 1.0))):
        seen = PerceptionProperties()
        seen.add_property("phong", "diffuse_map", tmp_path / "picture.png")
        seen.add_property("phong", "diffuse_scale", scale)
        body = GeometryInstance(pose(p=(0, 0, 1 + k)), Box(0.1, 0.1, 0.1), f"covered {k}")
        body.set_perception_properties(seen)
        covered.append(body)
    half = instance(Sphere(0.1), np.eye(4), "half", phong=("diffuse", Rgba(1.0, 0.5, 0.0, 0.25)))
    gone = instance(Sphere(0.1), np.eye(4), "gone", phong=("diffuse", Rgba(1.0, 0.5, 0.0, 0.0)))
    tree = document([*covered, half, gone])
    assert len(tree["materials"]) == 3
    first = tree["materials"][0]["pbrMetallicRoughness"]
    transform = first["baseColorTexture"]["extensions"]["KHR_texture_transform"]
    assert transform == {"scale": [2.0, 3.0], "offset": [0.0, -2.0]}
    glass = tree["materials"][2]
    assert glass["alphaMode"] == "BLEND"
    # 0.5 in sRGB is 0.21404 in linear light.
    assert glass["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx(
        [1.0, 0.2140411, 0.0, 0.25], abs=1e-7
    )
    assert len(tree["images"]) == 1
    file = base64.b64decode(tree["images"][0]["uri"].partition(",")[2])
    assert (np.array(Image.open(io.BytesIO(file)))[..., :3] == texels).all()


NOISE = np.random.default_rng(5).integers(0, 256, (18, 24, 3)).astype(np.uint8)
GOOD = file_of(np.zeros((18, 24, 3), np.uint8), "PNG")


@pytest.mark.parametrize(
    ("kind", "answer", "words"),
    [
        ("color", (500, b"no <b>GPU</b> here"), "status 500 .*: 'no <b>GPU</b> here'"),
        ("color", (404, b""), "status 404 Not Found"),
        ("color", (200, b""), "color: the answer is no PNG image"),
        ("color", (200, b"text"), "color: the answer is no PNG image"),
        ("color", (200, file_of(NOISE, "PNG")[:500]), "color: the answer is no PNG image"),
        ("color", (200, bytes(2**21)), "its answer has more than 1055488 bytes"),
        (
            "color",
            (200, file_of(np.zeros((24, 18, 3), np.uint8), "PNG")),
            "color: the image has 18 x 24 pixels, not 24 x 18",
        ),
        (
            "color",
            (200, file_of(np.zeros((18, 24), np.uint8), "PNG")),
            "color: the image is of mode 'L', not RGB or RGBA",
        ),
        ("label", (200, GOOD), "label: the image is of mode 'RGB', not I;16"),
        (
            "label",
            (200, file_of(np.full((18, 24), 40000, np.uint16), "PNG")),
            "label: the image has labels that are not from 0 to 32767",
        ),
        ("depth", (200, GOOD), "depth: the answer is no TIFF image"),
        (
            "depth",
            (200, file_of(np.full((18, 24), np.nan, np.float32), "TIFF")),
            "depth: the image has depths that are no numbers",
        ),
    ],
)
def test_what_is_no_answer_is_refused(kind, answer, words):
    """With the server's address, and what it says."""
    with serving(lambda form: answer) as (url, _):
        query = query_of(scene(), GltfClientRenderEngine(url))
        with pytest.raises(EngineError, match=f"render server {url}/render: {words}"):
            images(query, kinds=[kind])


def test_a_server_that_is_slow_or_gone_costs_the_time_that_is_given():
    """No answer, a byte now and then for ever, and nobody at the port."""
    given_up = threading.Event()

    def slow(form):
        given_up.wait(60.0)
        return 200, GOOD

    with serving(slow) as (url, _):
        query = query_of([], GltfClientRenderEngine(url, timeout=0.3))
        with pytest.raises(EngineError, match=r"no answer within 0\.3 s"):
            images(query, kinds=["color"])
        given_up.set()
    with pytest.raises(EngineError, match=r"render server http://127\.0\.0\.1:.*refused"):
        images(query_of([], GltfClientRenderEngine(url)), kinds=["color"])


def test_a_server_that_drips_is_cut_off():
    """It sends a byte every 0.1 s and would for a minute: the time is of all of the answer."""
    given_up = threading.Event()
    bytes_sent = []

    class Dripping(BaseHTTPRequestHandler):
        def do_POST(self):
            form_of(self)
            self.send_response(200)
            self.send_header("Content-Length", "600")
            self.end_headers()
            try:
                while len(bytes_sent) < 600 and not given_up.wait(0.1):
                    self.wfile.write(b"x")
                    self.wfile.flush()
                    bytes_sent.append(1)
            except OSError:  # the client has hung up
                pass

        def log_message(self, *arguments):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Dripping)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, args=(_POLL,), daemon=True).start()
    try:
        engine = GltfClientRenderEngine(f"http://127.0.0.1:{server.server_port}", timeout=0.5)
        with pytest.raises(EngineError, match=r"no answer within 0\.5 s"):
            images(query_of([], engine), kinds=["color"])
        assert len(bytes_sent) < 600
    finally:
        given_up.set()
        server.shutdown()
        server.server_close()


def test_questions_are_logged_and_kept_where_that_is_wanted(caplog, tmp_path, monkeypatch):
    """Without cleanup the document and the answer stay in a folder that the log names."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with serving(lambda form: (200, GOOD)) as (url, _), caplog.at_level(logging.INFO):
        images(query_of(scene(), GltfClientRenderEngine(url)), kinds=["color"])
        assert not caplog.records
        assert not list(tmp_path.iterdir())
        engine = GltfClientRenderEngine(url, verbose=True, cleanup=False)
        images(query_of(scene(), engine), kinds=["color"])
    (folder,) = tmp_path.iterdir()
    assert str(folder) in caplog.text
    assert "color of " in caplog.text
    assert (folder / "color.png").read_bytes() == GOOD
    assert json.loads((folder / "scene.gltf").read_text())["asset"]["version"] == "2.0"


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"base_url": "ftp://127.0.0.1"}, "must begin with http:// or https:// and a host"),
        ({"base_url": "http://"}, "must begin with http"),
        ({"base_url": 7}, "must be text"),
        ({"base_url": "http://a:99999"}, "Port out of range"),
        ({"base_url": "http://me:secret@a"}, "must have no user"),
        ({"base_url": "http://a/\r\nX: y"}, "ASCII characters|control"),
        ({"render_endpoint": "a?b"}, "must have no user, query"),
        ({"verbose": 1}, "verbose must be True or False, not 1"),
        ({"cleanup": "no"}, "cleanup must be True or False"),
        ({"timeout": 0}, "timeout must be a number from 0.001"),
        ({"timeout": math.inf}, "timeout must be a number"),
    ],
)
def test_parameters_are_checked(fields, words):
    """By name and value, before anything is asked."""
    with pytest.raises(EngineError, match=f"GltfClientRenderEngine: .*({words})"):
        GltfClientRenderEngine(**fields)
