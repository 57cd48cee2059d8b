"""The topics of one camera, each with its images and its message."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2

from msg_adapters.compressed_images import COMPRESSED_FORMS
from msg_adapters.images import camera_info_to_msg, FORMS, ImageForm
from msg_adapters.labels import label_table_to_msg
from msg_adapters.poses import pose_stamped_to_msg
from msg_adapters.wire.images import BulkWire
from scene_graph_msgs.msg import LabelTable
from scene_graph_ros.geometry.perception import CameraDescription, ImageKind
from scene_graph_ros.node.effects.camera_frame import CameraFrame, optical_frame
from scene_graph_ros.node.effects.declarations import camera_topics
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.runtime.made_once import made_once
from scene_graph_ros.node.runtime.names import CAMERAS
from scene_graph_ros.node.runtime.qos import image_qos, latched_qos

__all__ = ["CameraTopic", "open_topics"]

_FORM_OF = {
    "color/image": (Image, FORMS["color"]),
    "color/image/compressed": (CompressedImage, COMPRESSED_FORMS["color"]),
    "depth/image": (Image, FORMS["depth"]),
    "depth/image/compressedDepth": (CompressedImage, COMPRESSED_FORMS["depth"]),
    "depth/image_raw": (Image, FORMS["depth_raw"]),
    "depth/image_raw/compressedDepth": (CompressedImage, COMPRESSED_FORMS["depth_raw"]),
    "label/image": (Image, FORMS["label"]),
    "label/image/compressed": (CompressedImage, COMPRESSED_FORMS["label"]),
    "points": (PointCloud2, FORMS["points"]),
}
"""The type and the form of the messages of a topic that shows pixels."""


@dataclass(frozen=True, eq=False)
class CameraTopic:
    """A topic, the images that its messages are made of, and the function that makes these."""

    name: str
    outlet: Outlet
    make: Callable[[CameraFrame], Any]
    kinds: frozenset[ImageKind] = frozenset()
    is_of_scene: bool = False
    """Whether its messages say the same as long as the scene is the same."""


class _Pixels:
    """Makes the messages of a form."""

    def __init__(self, form: ImageForm, camera: CameraDescription) -> None:
        self._form, self._lens = form, camera.camera.core.intrinsics
        self._frame_id = optical_frame(camera)

    @made_once
    def _wire(self) -> BulkWire:
        return BulkWire(serialize_message, self._form.blank(self._lens), self._frame_id)

    def __call__(self, frame: CameraFrame) -> bytes:
        pixels = self._form.pixels(self._lens, frame.images)
        return self._wire.data(frame.snapshot.stamp, pixels)


def open_topics(host: Host, camera: CameraDescription) -> list[CameraTopic]:
    """Advertise the topics of a camera, where ``camera_topics`` says."""
    topics: list[CameraTopic] = []
    try:
        topics.extend(_open(host, camera, name) for name in camera_topics(camera))
    except Exception:
        for topic in topics:
            topic.outlet.close()
        raise
    return topics


def _open(host: Host, camera: CameraDescription, name: str) -> CameraTopic:
    what = name.removeprefix(f"{CAMERAS}/{camera.name}/")

    def outlet(kind: Any, qos: QoSProfile) -> Outlet:
        return Outlet(host, kind, name, qos)

    if what in _FORM_OF:
        kind, form = _FORM_OF[what]
        return CameraTopic(name, outlet(kind, image_qos()), _Pixels(form, camera), form.kinds)
    if what == "label/table":
        return CameraTopic(name, outlet(LabelTable, latched_qos()), _table, is_of_scene=True)
    if what == "pose":
        qos = latched_qos()
        return CameraTopic(name, outlet(PoseStamped, qos), lambda f: _pose(f, host.world_frame))
    assert what.endswith("/camera_info"), what
    return CameraTopic(name, outlet(CameraInfo, image_qos()), lambda f: _info(f, camera))


def _table(frame: CameraFrame) -> LabelTable:
    snapshot = frame.snapshot
    return label_table_to_msg(
        snapshot.inspector, snapshot.names, scene_version=snapshot.scene_version
    )


def _pose(frame: CameraFrame, world_frame: str) -> PoseStamped:
    return pose_stamped_to_msg(frame.X_WC, stamp_ns=frame.snapshot.stamp, frame_id=world_frame)


def _info(frame: CameraFrame, camera: CameraDescription) -> CameraInfo:
    lens, stamp = camera.camera.core.intrinsics, frame.snapshot.stamp
    return camera_info_to_msg(lens, stamp_ns=stamp, frame_id=optical_frame(camera))
