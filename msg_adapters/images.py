"""Images of cameras as messages: images, clouds of points, and the camera beside them.

Encodings are those of REP-118, depths without a distance those of REP-117, and the camera's
numbers those of REP-104. All is in the optical frame of REP-103: x right, y down, z ahead.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField

from msg_adapters.arrays import uint8s_to_msg
from msg_adapters.poses import header_to_msg
from scene_graph_ros.geometry.perception import CameraIntrinsics, ImageKind, Images
from scene_graph_ros.geometry.perception.image_forms import (
    colors,
    depths,
    millimetres,
    POINT,
    points,
)

__all__ = ["FORMS", "ImageForm", "camera_info_to_msg", "image_to_msg"]

_DISTORTION = [0.0] * 5
"""Of the model "plumb_bob": none."""

_FIELD_TYPES = {"f": PointField.FLOAT32, "u": PointField.UINT32}


class ImageForm(NamedTuple):
    """One form of a camera's image in messages."""

    kinds: frozenset[ImageKind]
    """The images of the core that it is made of."""
    blank: Callable[[CameraIntrinsics], Image | PointCloud2 | CompressedImage]
    """Returns the message but for header and data."""
    pixels: Callable[[CameraIntrinsics, Images], NDArray[Any]]
    """Returns the data: ``(h, w)`` or ``(h, w, channels)``, row by row from above, or a file."""


def _blank_image(encoding: str, pixel_bytes: int) -> Callable[[CameraIntrinsics], Image]:
    def blank(lens: CameraIntrinsics) -> Image:
        return Image(
            height=lens.height,
            width=lens.width,
            encoding=encoding,
            is_bigendian=0,
            step=pixel_bytes * lens.width,
        )

    return blank


def _blank_cloud(lens: CameraIntrinsics) -> PointCloud2:
    assert POINT.fields is not None
    fields = [
        PointField(
            name=name,
            offset=POINT.fields[name][1],
            # Colours are packed into the bits of a float, as viewers expect it.
            datatype=PointField.FLOAT32 if name == "rgb" else _FIELD_TYPES[POINT[name].kind],
            count=1,
        )
        for name in POINT.names or ()
    ]
    return PointCloud2(
        height=lens.height,
        width=lens.width,
        fields=fields,
        is_bigendian=False,
        point_step=POINT.itemsize,
        row_step=POINT.itemsize * lens.width,
        is_dense=False,
    )


def _pixels_of_points(lens: CameraIntrinsics, images: Images) -> NDArray[Any]:
    color, depth, label = images
    assert color is not None
    assert depth is not None
    assert label is not None
    return points(lens, depth, color, label)


def _from(kind: ImageKind, turn: Callable[[Any], NDArray[Any]]) -> Any:
    return lambda lens, images: turn(getattr(images, kind.value))


def _as_it_is(label: NDArray[np.int16]) -> NDArray[np.uint16]:
    # Labels are not negative, so that their bits are the same with and without a sign.
    return label.view(np.uint16)


FORMS: dict[str, ImageForm] = {
    "color": ImageForm(
        frozenset({ImageKind.COLOR}), _blank_image("rgb8", 3), _from(ImageKind.COLOR, colors)
    ),
    "depth": ImageForm(
        frozenset({ImageKind.DEPTH}), _blank_image("32FC1", 4), _from(ImageKind.DEPTH, depths)
    ),
    "depth_raw": ImageForm(
        frozenset({ImageKind.DEPTH}),
        _blank_image("16UC1", 2),
        _from(ImageKind.DEPTH, millimetres),
    ),
    "label": ImageForm(
        frozenset({ImageKind.LABEL}), _blank_image("16UC1", 2), _from(ImageKind.LABEL, _as_it_is)
    ),
    "points": ImageForm(frozenset(ImageKind), _blank_cloud, _pixels_of_points),
}
"""Every form by its name in requests."""


def image_to_msg(
    form: ImageForm, lens: CameraIntrinsics, images: Images, *, stamp_ns: int, frame_id: str
) -> Image | PointCloud2:
    """Return images of the core, of all ``form.kinds``, as a message of that form."""
    msg = form.blank(lens)
    msg.header = header_to_msg(stamp_ns, frame_id)
    msg.data = uint8s_to_msg(form.pixels(lens, images).view(np.uint8))
    return msg


def camera_info_to_msg(lens: CameraIntrinsics, *, stamp_ns: int, frame_id: str) -> CameraInfo:
    """Return a lens without distortion, whose images are rectified as they are."""
    K = lens.matrix()
    return CameraInfo(
        header=header_to_msg(stamp_ns, frame_id),
        height=lens.height,
        width=lens.width,
        distortion_model="plumb_bob",
        d=_DISTORTION,
        k=K.ravel(),
        r=np.eye(3).ravel(),
        p=np.column_stack([K, np.zeros(3)]).ravel(),
    )
