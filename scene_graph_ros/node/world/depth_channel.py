"""Images of depth, and their lens: messages of them, validated and applied.

Imported where a source has the settings of such images.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sensor_msgs.msg import CameraInfo, Image

from msg_adapters.depth_images import depth_from_msg, DepthImage, lens_from_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.bounded_channel import NewestChannel
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.sensed import SensedGeometry
from scene_graph_ros.node.world.sensor_channel import RefusedError, SensorChannel
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import CAMERA_INFO, DEPTH_IMAGES
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.sensing.depth_view import DepthView

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from scene_graph_ros.node.world.sensor_state import SensorState
    from scene_graph_ros.sensing import DepthRules, SelfFilter

__all__ = ["DepthChannel", "InfoChannel"]

_BYTES_PER_PIXEL = 8
"""Of a message: rows may be padded."""


class DepthChannel(SensorChannel[DepthImage]):
    """The images of one source."""

    noun = DEPTH_IMAGES
    _message, _key = "image", "depth"

    def __init__(self, record: SourceRecord, intake: Intake, most_points: int) -> None:
        """Keep ``most_points`` at most."""
        super().__init__(record, intake, Image, most_points)
        assert record.depth is not None
        self._of_images = record.depth

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {self._of_images.image_topic: False}

    def _read_message(self, data: bytes) -> DepthImage:
        most = self._most_points * self._of_images.step**2
        return depth_from_msg(self._read(data, most_bytes(1) + _BYTES_PER_PIXEL * most), most)

    def _lack(self, reading: DepthImage, state: SensorState) -> tuple[Fault, str] | None:
        if state.lens is None:
            topic = quoted(self._of_images.info_topic)
            return Fault.NO_CAMERA_INFO, f"no lens came on {topic} for an image"
        lens, size = state.lens.lens, reading.depth.shape
        if size != (lens.height, lens.width):
            raise RefusedError(
                Fault.WRONG_LENGTH,
                f"an image has {size[1]} x {size[0]} pixels, its lens {lens.width} x"
                f" {lens.height}",
            )
        return None

    def _view(
        self,
        reading: DepthImage,
        state: SensorState,
        X_WS: NDArray[np.float64],
        rules: DepthRules,
        own: SelfFilter,
    ) -> DepthView:
        assert state.lens is not None
        return DepthView.of(reading.depth, state.lens.lens, X_WS, rules, own)


class InfoChannel(NewestChannel[SensedGeometry]):
    """The lens of one source's images."""

    noun = CAMERA_INFO

    def __init__(self, record: SourceRecord, intake: Intake) -> None:
        super().__init__(record, intake, CameraInfo)
        assert record.depth is not None
        self._settings = record.depth
        self._data = b""

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {self._settings.info_topic: False}

    def _apply_one(self, kept: Kept, target: SensedGeometry, limits: TimeLimits) -> int:
        state = target.sensors[self.record.name]
        message = self._read(kept.data, most_bytes(1))
        state.lens = lens_from_msg(message, rectified=self._settings.is_rectified)
        lens = state.lens.lens
        self.newest = {
            "lens (pixels)": f"{lens.width} x {lens.height}, fx {lens.fx:g}, fy {lens.fy:g},"
            f" cx {lens.cx:g}, cy {lens.cy:g}"
        }
        self.intake.count(1)
        return 1
