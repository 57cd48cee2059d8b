"""The service that renders: cameras of the scene and of the request, poses to try, limits."""

from __future__ import annotations

import numpy as np
import pytest

from scene_graph_msgs.msg import (
    CameraDescription,
    LabelTable,
    QueryOptions,
    RendererDescription,
    Status,
    WhatIf,
)

SCENE = """
version: 1
sources: [{name: cell}, {name: arm}]
frames: [{name: hand, source: arm, pose: {xyz: [0, 0, 1]}}]
geometries:
  - name: wall
    source: cell
    pose: {xyz: [0, 0, 5]}
    shape: {type: box, size: [50, 50, 2]}
    color: [0, 0, 1]
    label: 3
  - {name: plain, source: cell, pose: {xyz: [0, 0, -1]}, shape: {type: box, size: [9, 9, 1]}}
renderers: [{name: dark, type: exact, default_clear_color: [0, 0, 0]}]
cameras:
  - {name: eye, source: arm, frame: hand, size: [4, 3], fov_y: 1, images: [depth]}
"""
# The wall's face is at z = 4, the hand at z = 1.


@pytest.fixture(scope="module")
def ask(start_node, client, tmp_path_factory):
    """Ask a node with a camera before a wall."""
    path = tmp_path_factory.mktemp("render") / "scene.yaml"
    path.write_text(SCENE)
    folders = str(tmp_path_factory.getbasetemp())
    start_node({"scene": path, "max_pixels_per_request": 1000, "resource_folders": folders})
    return lambda **fields: client.call("RenderImages", **fields)


def described(**fields):
    """Return a camera that looks along z from the world's origin."""
    camera = CameraDescription(width=4, height=3, fov_y=1.0, **fields)
    camera.pose.orientation.w = 1.0
    return camera


def pixels(image, dtype, *channels):
    """Return the pixels of an image."""
    return np.frombuffer(bytes(image.data), dtype).reshape(image.height, image.width, *channels)


def test_a_camera_of_the_scene_answers_with_all_kinds(ask):
    """Depth in both forms, colour, label with its table, points; lens and pose beside them."""
    answer = ask(camera="eye", images=["color", "depth", "depth_raw", "label", "points"])
    assert answer.status.code == Status.OK, answer.status.message
    np.testing.assert_array_equal(pixels(answer.depth[0], np.float32), 3.0)
    np.testing.assert_array_equal(pixels(answer.depth_raw[0], np.uint16), 3000)
    np.testing.assert_array_equal(pixels(answer.label[0], np.uint16), 3)
    assert (pixels(answer.color[0], np.uint8, 3) == [0, 0, 255]).all()
    cloud = answer.points[0]
    assert (cloud.width, cloud.height, cloud.point_step) == (4, 3, 20)
    z = np.frombuffer(bytes(cloud.data), np.float32).reshape(3, 4, 5)[..., 2]
    np.testing.assert_array_equal(z, 3.0)
    frames = {image.header.frame_id for image in (answer.depth[0], cloud, answer.camera_info)}
    assert frames == {"eye_optical_frame"}
    assert (answer.camera_info.width, answer.camera_info.height) == (4, 3)
    assert answer.poses[0].position.z == 1.0
    table = dict(zip(answer.labels.geometries.name, answer.labels.labels, strict=True))
    assert table == {"wall": 3, "plain": LabelTable.DONT_CARE}


def test_poses_to_try_have_an_image_each(ask):
    """In their order; the world is as it was."""
    poses = [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.5, 0.0, 0.0, 0.0, 1.0]
    options = QueryOptions(what_if=WhatIf(frames=["arm/hand"], poses=poses))
    answer = ask(camera="eye", images=["depth"], options=options)
    assert answer.status.code == Status.OK, answer.status.message
    assert [float(pixels(d, np.float32)[1, 2]) for d in answer.depth] == [2.0, 4.5]
    assert [pose.position.z for pose in answer.poses] == [2.0, -0.5]
    assert list(answer.color) == []
    assert list(answer.labels.labels) == []


@pytest.mark.parametrize("frame", ["", "world", "hand", "arm/hand"])
def test_a_camera_can_be_described(ask, frame):
    """On any frame, with ranges and a lens of its own."""
    fov = described(frame=frame, depth_min=0.25, depth_max=3.5)
    lens = described(frame=frame, fx=2.0, fy=3.0, cx=1.5, cy=1.0)
    lens.fov_y = 0.0
    far = 3.0 if "hand" in frame else 4.0
    for camera, expected in ((fov, far if far < 3.5 else np.inf), (lens, far)):
        answer = ask(description=camera, images=["depth"])
        assert answer.status.code == Status.OK, answer.status.message
        np.testing.assert_array_equal(pixels(answer.depth[0], np.float32), np.float32(expected))
        assert answer.depth[0].header.frame_id == ""
    assert np.reshape(answer.camera_info.k, (3, 3)).tolist() == [[2, 0, 1.5], [0, 3, 1], [0, 0, 1]]


@pytest.mark.parametrize(
    ("fields", "code", "message"),
    [
        ({"camera": "eye"}, Status.INVALID_ARGUMENT, "images must be some of color, depth, dep"),
        ({"camera": "eye", "images": ["ir"]}, Status.INVALID_ARGUMENT, "images: 'ir' is none of"),
        ({"camera": "eyf"}, Status.UNKNOWN_NAME, "no camera 'eyf'; did you mean 'eye'?"),
        ({"camera": "eye", "description": {}}, Status.INVALID_ARGUMENT, "camera or description"),
        ({"description": {"frame": "foot"}}, Status.UNKNOWN_NAME, "there is no frame 'foot'"),
        ({"description": {"fov_y": 4.0}}, Status.INVALID_ARGUMENT, "fov_y must be between 0 and"),
        ({"description": {"fx": 4.0}}, Status.INVALID_ARGUMENT, "give fov_y or the lens, not bo"),
        ({"description": {"width": 0}}, Status.INVALID_ARGUMENT, "width must be a whole number"),
        ({"description": {"clipping_near": float("nan")}}, Status.INVALID_ARGUMENT, "near must b"),
        ({"description": {"depth_max": 1.0}}, Status.INVALID_ARGUMENT, "min_depth must be betwe"),
        (
            {"description": {"width": 400}},
            Status.TOO_LARGE,
            "pixels: 1200 are more than max_pixels_per",
        ),
    ],
)
def test_what_can_not_be_rendered_is_refused(ask, fields, code, message):
    """By name and value, with a status of its own."""
    request = dict(fields)
    if "description" in fields:
        request["description"] = described()
        for name, value in fields["description"].items():
            setattr(request["description"], name, value)
    if fields != {"camera": "eye"}:
        request.setdefault("images", ["depth"])
    answer = ask(**request)
    assert message in answer.status.message
    assert answer.status.code == code
    assert list(answer.depth) == []


OBJ = """mtllib paint.mtl
v -1 -1 0
v 0 -1 0
v 1 -1 0
v -1 1 0
v 0 1 0
v 1 1 0
usemtl red
f 1 2 5 4
usemtl teal
f 2 3 6 5
"""
PAINTED = """
version: 1
sources: [{{name: painter}}]
geometries:
  - name: canvas
    source: painter
    pose: {{xyz: [0, 0, -10]}}
    shape: {{type: mesh, file: {path}}}
    roles: {{perception: {{}}}}
"""


def test_meshes_have_the_colours_of_their_files(ask, client, tmp_path):
    """A mesh of two materials a metre ahead, facing the camera: half of the image each."""
    path = tmp_path / "canvas.obj"
    path.write_text(OBJ)
    (tmp_path / "paint.mtl").write_text("newmtl red\nKd 0.6 0 0\nnewmtl teal\nKd 0 0.4 0.8\n")
    loaded = client.call("LoadScene", text=PAINTED.format(path=path))
    assert loaded.status.code == Status.OK, loaded.status.message
    camera = described()
    camera.pose.position.z = -11.0
    answer = ask(description=camera, images=["color"])
    assert answer.status.code == Status.OK, answer.status.message
    image = pixels(answer.color[0], np.uint8, 3)
    assert (image[:, :2] == [153, 0, 0]).all()
    assert (image[:, 2:] == [0, 102, 204]).all()
    assert client.call("RemoveSource", source=loaded.sources[0]).status.code == Status.OK


def test_the_renderer_may_be_another(ask):
    """One of the scene by name, or one of this request: its background is beside the wall."""
    away = described()
    away.pose.orientation.x, away.pose.orientation.w = 1.0, 0.0  # turned about x by half a turn
    away.pose.position.z = -2.0

    def background(camera="", **renderer):
        described_here = {} if camera else {"description": away}
        answer = ask(
            camera=camera,
            images=["color", "depth"],
            renderer=RendererDescription(**renderer),
            **described_here,
        )
        assert answer.status.code == Status.OK, answer.status.message
        return pixels(answer.color[0], np.uint8, 3)[0, 0].tolist()

    assert background() == [204, 229, 255]
    assert background(name="dark") == [0, 0, 0]
    own = {"type": "exact", "parameters": "default_clear_color: [1, 0.2, 0]"}
    assert background(**own) == [255, 51, 0]
    assert background(type="traced", parameters="samples: 1") == [204, 229, 255]
    # Of a camera of the scene, which sees the wall.
    assert background("eye", **own) == [0, 0, 255]


@pytest.mark.parametrize(
    ("renderer", "code", "reason"),
    [
        ({"name": "drak"}, Status.UNKNOWN_NAME, "there is no renderer 'drak'"),
        ({"name": "dark", "type": "exact"}, Status.INVALID_ARGUMENT, "give a renderer's name, or"),
        (
            {"parameters": "samples: 3"},
            Status.INVALID_ARGUMENT,
            "renderer.type must be 'exact' or",
        ),
        (
            {"type": "gltf_client"},
            Status.INVALID_ARGUMENT,
            "renderer.type: 'gltf_client': the node",
        ),
        (
            {"type": "traced", "parameters": "samples: x"},
            Status.INVALID_ARGUMENT,
            "renderer.parameters:1: samples: must be an integer, got 'x'",
        ),
        # 4 x 3 pixels of 256 samples, 16 by default, and 16 surfaces, 3 by default.
        (
            {"type": "traced", "parameters": "{samples: 256, max_depth: 16}"},
            Status.TOO_LARGE,
            "pixels: 1152 are more than max_pixels_per_request",
        ),
    ],
)
def test_renderers_that_are_refused(ask, renderer, code, reason):
    """Before anything is rendered, with field and value."""
    answer = ask(
        description=described(), images=["color"], renderer=RendererDescription(**renderer)
    )
    assert answer.status.code == code, answer.status.message
    assert reason in answer.status.message
