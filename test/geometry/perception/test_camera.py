"""Cameras refuse numbers that make no camera, and place their pixels as the note on axes says."""

from camera_scenes import CLIPPING, core, instance, LENS, pose, scene_of, WORLD
import numpy as np
import pytest

from scene_graph_ros.geometry import Sphere
from scene_graph_ros.geometry.errors import InvalidPoseError, QueryArgumentError
from scene_graph_ros.geometry.perception import (
    CameraIntrinsics,
    CameraProperties,
    ClippingRange,
    ColorRenderCamera,
    DepthCameraProperties,
    DepthRange,
    DepthRenderCamera,
    RenderCameraCore,
)

GOOD = {"width": 4, "height": 3, "fx": 2.0, "fy": 2.5, "cx": 1.5, "cy": 1.0}
NO_NUMBERS = [float("nan"), float("inf"), -float("inf"), "1", None, True, 10**400, 1j]


@pytest.mark.parametrize("name", GOOD)
@pytest.mark.parametrize("value", NO_NUMBERS)
def test_intrinsics_refuse_what_is_no_number(name, value):
    """Every field is refused by its name, with the value."""
    with pytest.raises(QueryArgumentError, match=rf"^CameraIntrinsics: {name} "):
        CameraIntrinsics(**{**GOOD, name: value})


@pytest.mark.parametrize(
    ("name", "value"),
    [("width", 0), ("height", -1), ("width", 2.0), ("height", 2**27), ("fx", 0.0), ("fy", -1.0)],
)
def test_intrinsics_refuse_what_is_out_of_range(name, value):
    """Sizes are whole and positive, focal lengths positive; the value is quoted."""
    with pytest.raises(QueryArgumentError, match=rf"{name} .*{value!r}"):
        CameraIntrinsics(**{**GOOD, name: value})


def test_images_have_a_limit():
    """8192 x 8192 pixels are the most, whatever their shape."""
    CameraIntrinsics(8192, 8192, 1.0, 1.0, 0.0, 0.0)
    with pytest.raises(QueryArgumentError, match="8192 x 8193"):
        CameraIntrinsics(8192, 8193, 1.0, 1.0, 0.0, 0.0)


def test_the_centre_may_be_outside():
    """A crop of a larger image has its centre elsewhere."""
    assert CameraIntrinsics(4, 3, 2.0, 2.0, -100.0, 1e5).cx == -100.0


def test_field_of_view():
    """Half the height over the focal length is the tangent of half the angle: 45 degrees here.

    The centre of 4 x 2 pixels, whose own centres are 0 to 3 and 0 to 1, is (1.5, 0.5).
    """
    lens = CameraIntrinsics.from_fov_y(4, 2, np.pi / 2)
    assert lens == CameraIntrinsics(4, 2, lens.fx, lens.fx, 1.5, 0.5)
    assert lens.fx == pytest.approx(1.0, abs=1e-15)
    expected = [[lens.fx, 0.0, 1.5], [0.0, lens.fx, 0.5], [0.0, 0.0, 1.0]]
    np.testing.assert_array_equal(lens.matrix(), expected)


@pytest.mark.parametrize("angle", [0.0, np.pi, -1.0, *NO_NUMBERS])
def test_field_of_view_must_be_an_angle(angle):
    """Nothing but angles between 0 and pi, both excluded."""
    with pytest.raises(QueryArgumentError, match="fov_y"):
        CameraIntrinsics.from_fov_y(4, 3, angle)


@pytest.mark.parametrize(
    ("kind", "names"), [(ClippingRange, ("near", "far")), (DepthRange, ("min_depth", "max_depth"))]
)
def test_ranges(kind, names):
    """Both ends are positive and finite, and the first is less."""
    assert kind(1, 2) == kind(1.0, 2.0)
    for value in (0.0, -1.0, *NO_NUMBERS):
        with pytest.raises(QueryArgumentError, match=f"{kind.__name__}: {names[0]} "):
            kind(value, 2.0)
        with pytest.raises(QueryArgumentError, match=f"{kind.__name__}: {names[1]} "):
            kind(1.0, value)
    for low, high in ((2.0, 2.0), (3.0, 2.0)):
        with pytest.raises(QueryArgumentError, match=f"{names[0]} must be less .*{low}, {high}"):
            kind(low, high)


def test_a_core_checks_its_parts():
    """Each part is refused by name; a pose as everywhere."""
    for arguments, name in (
        ((1, LENS, CLIPPING), "renderer_name"),
        (("exact", None, CLIPPING), "intrinsics"),
        (("exact", LENS, (0.1, 1.0)), "clipping"),
    ):
        with pytest.raises(QueryArgumentError, match=f"RenderCameraCore: {name} must be a"):
            RenderCameraCore(*arguments)
    with pytest.raises(InvalidPoseError, match="X_BS of a RenderCameraCore"):
        RenderCameraCore("exact", LENS, CLIPPING, 2.0 * np.eye(4))


def test_cameras_check_their_core():
    """A camera is made of a core."""
    for make in (ColorRenderCamera, lambda c: DepthRenderCamera(c, DepthRange(0.1, 1.0))):
        with pytest.raises(QueryArgumentError, match="core must be a RenderCameraCore"):
            make("exact")
    with pytest.raises(QueryArgumentError, match="depth_range must be a DepthRange"):
        DepthRenderCamera(core(), (0.1, 1.0))


def test_depth_must_be_within_the_clipping():
    """What is clipped can't be measured."""
    for low, high in ((CLIPPING.near / 2, 1.0), (1.0, CLIPPING.far * 2)):
        with pytest.raises(QueryArgumentError, match="must be within ClippingRange"):
            DepthRenderCamera(core(), DepthRange(low, high))
    DepthRenderCamera(core(), DepthRange(CLIPPING.near, CLIPPING.far))


def test_there_are_no_windows():
    """A camera that wants one is refused with the reason."""
    with pytest.raises(QueryArgumentError, match="show_window must be False, not True"):
        ColorRenderCamera(core(), show_window=True)


def test_cameras_by_their_older_names():
    """An angle of view, and the depths that are told apart: 0 nearer, inf beyond."""
    ball = instance(Sphere(0.5), pose(p=(0.0, 0.0, 2.0)), "ball", label=3)
    query = scene_of([ball])
    color = CameraProperties(5, 3, 1.0, "exact")
    # The upper edge is half the angle above the axis: 1.5 pixels at tan(1/2).
    assert color.core.intrinsics.fy == pytest.approx(1.5 / np.tan(0.5), rel=1e-15)
    assert query.render_label_image(color, WORLD, np.eye(4))[1, 2] == 3
    for near, far, depth in ((0.1, 5.0, 1.5), (1.6, 5.0, 0.0), (0.1, 1.4, np.inf)):
        camera = DepthCameraProperties(5, 3, 1.0, "exact", near, far)
        assert query.render_depth_image(camera, WORLD, np.eye(4))[1, 2] == np.float32(depth)
    with pytest.raises(QueryArgumentError, match="fov_y must be between 0 and pi, not 0"):
        CameraProperties(5, 3, 0, "exact")
    with pytest.raises(QueryArgumentError, match="min_depth must be less than max_depth"):
        DepthCameraProperties(5, 3, 1.0, "exact", 2.0, 1.0)
