"""Cameras of messages: what is registered, what is told of it, what is refused."""

import math

from geometry_msgs.msg import Point, Pose, Quaternion
import numpy as np
import pytest
from scene_requests import camera as described

from msg_adapters.cameras import scene_camera_from_msg, scene_camera_to_msg
from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.model.names import InvalidNameError

NAN, INF = math.nan, math.inf


def read(message):
    """Return the camera that source "arm" registers."""
    return scene_camera_from_msg(message, "arm", "exact")


def test_each_number_has_its_place():
    """A quarter turn about z; distinct numbers elsewhere."""
    quarter = Quaternion(z=math.sqrt(0.5), w=math.sqrt(0.5))
    camera = read(
        described(
            "eye",
            "hand",
            images=("label", "color"),
            rate=12.5,
            pose=Pose(position=Point(x=1.0, y=2.0, z=3.0), orientation=quarter),
            width=7,
            height=5,
            fov_y=0.0,
            fx=3.5,
            fy=4.5,
            cx=2.75,
            cy=1.25,
            clipping_near=0.25,
            clipping_far=8.0,
            depth_min=0.5,
            depth_max=4.0,
        )
    )
    assert (camera.name, camera.source, camera.frame, camera.rate) == ("eye", "arm", "hand", 12.5)
    assert camera.outputs == {"color", "label"}
    X_PC = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]
    np.testing.assert_allclose(camera.X_PC, X_PC, atol=1e-15)
    core = camera.camera.core
    lens, clipping, depths = core.intrinsics, core.clipping, camera.camera.depth_range
    assert (lens.width, lens.height, lens.fx, lens.fy) == (7, 5, 3.5, 4.5)
    assert (lens.cx, lens.cy) == (2.75, 1.25)
    assert (clipping.near, clipping.far) == (0.25, 8.0)
    assert (depths.min_depth, depths.max_depth) == (0.5, 4.0)
    assert core.renderer_name == "exact"


def test_what_is_left_out_has_a_meaning():
    """The world, depths as clipped, a lens by the angle: half of 3 pixels at tan(1/2)."""
    camera = read(described("eye"))
    assert camera.frame == "world"
    assert camera.camera.depth_range.max_depth == 100.0
    assert camera.camera.core.intrinsics.fx == pytest.approx(1.5 / math.tan(0.5), rel=1e-15)


def test_a_camera_that_was_told_can_be_registered_again():
    """The same message comes back, word for word."""
    told = scene_camera_to_msg(read(described("eye", "hand", fov_y=1.2, clipping_far=7.0)))
    assert told.source == "arm"
    assert told.camera.description.fov_y == 0.0
    assert scene_camera_to_msg(read(told.camera)) == told


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"width": 0}, "width must be .* not 0"),
        ({"height": 2**32 - 1}, "height must be .* not 4294967295"),
        ({"width": 2**14, "height": 2**14}, "16384 x 16384 are more than"),
        ({"fov_y": NAN}, "fov_y must be between 0 and pi, not nan"),
        ({"fov_y": math.pi}, "fov_y must be between 0 and pi"),
        ({"fov_y": 0.0}, "fx must be .* not 0"),
        ({"fov_y": 0.0, "fx": 1.0, "fy": -2.0}, "fy must be .* not -2"),
        ({"fov_y": 0.0, "fx": 1.0, "fy": 1.0, "cx": INF}, "cx must be .* not inf"),
        ({"cy": 2.0}, "fov_y or the lens, not both"),
        ({"clipping_near": 0.0}, "near must be .* not 0"),
        ({"clipping_far": INF}, "far must be .* not inf"),
        ({"clipping_near": 2.0, "clipping_far": 1.0}, "near must be less than far"),
        ({"depth_max": 5.0}, "min_depth must be .* not 0"),
        ({"depth_min": 1.0, "depth_max": 101.0}, "must be within"),
        ({"pose": Pose(position=Point(x=NAN), orientation=Quaternion(w=1.0))}, "nan"),
        ({"pose": Pose(orientation=Quaternion(w=2.0))}, "description.pose"),
    ],
)
def test_numbers_that_no_camera_has_are_refused(fields, words):
    """By the names of camera and field, with the value."""
    with pytest.raises(MessageError, match=f"camera 'eye': .*{words}"):
        read(described("eye", **fields))


@pytest.mark.parametrize("rate", [0.0, -1.0, 1001.0, NAN, INF])
def test_a_rate_out_of_range_is_refused(rate):
    """It is quoted."""
    with pytest.raises(QueryArgumentError, match=f"camera 'eye': rate .* not {rate}"):
        read(described("eye", rate=rate))


@pytest.mark.parametrize("images", [(), ("depth", "depht"), ("depth_raw",)])
def test_images_that_no_camera_offers_are_refused(images):
    """Those of the service that renders are more; a camera has them with depth."""
    with pytest.raises(QueryArgumentError, match="camera 'eye': outputs must be some of"):
        read(described("eye", images=images))


@pytest.mark.parametrize("name", ["", "a/b", "0eye", "an eye", "x" * 65])
def test_names_that_make_no_topic_are_refused(name):
    """A camera's name is part of its topics'."""
    with pytest.raises(InvalidNameError, match="name of a camera must"):
        read(described(name))
