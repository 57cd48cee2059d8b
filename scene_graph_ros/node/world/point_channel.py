"""Points of clouds: messages of them, validated and applied.

Imported where a source has a cloud.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from sensor_msgs.msg import PointCloud2

from msg_adapters.point_clouds import points_from_msg, SensedPoints
from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.sensed import SensedGeometry
from scene_graph_ros.node.world.sensor_channel import RefusedError, SensorChannel
from scene_graph_ros.node.world.sensor_state import SensorFrame, SensorState
from scene_graph_ros.node.world.source_topics import points_topic
from scene_graph_ros.sensing.cloud_view import CloudView

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.model.ids import GeometryId
    from scene_graph_ros.sensing import DepthRules, SelfFilter

__all__ = ["PointChannel"]

_BYTES_PER_POINT = 64
"""Of a message: cameras send 16 to 32, lidars up to 48."""


class PointChannel(SensorChannel[SensedPoints]):
    """The clouds of one source."""

    noun = "points"
    _message, _key = "cloud", "points"

    def __init__(self, record: SourceRecord, intake: Intake, most_points: int) -> None:
        """Read messages of ``most_points`` at most."""
        super().__init__(record, intake, PointCloud2, most_points)

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {points_topic(self.record): False}

    def _read_message(self, data: bytes) -> SensedPoints:
        most = most_bytes(1) + _BYTES_PER_POINT * self._most_points
        if len(data) > most:
            raise RefusedError(
                Fault.TOO_LARGE, f"a message has {len(data)} bytes, at most {most} are read"
            )
        message = self._read(data, most)
        count = message.width * message.height
        if count > self._most_points:
            raise RefusedError(
                Fault.TOO_LARGE,
                f"a message has {count} points, more than max_points_per_cloud,"
                f" {self._most_points}",
            )
        return points_from_msg(message, self._most_points, needs_frame=not self._settings.frame)

    def _lack(self, reading: SensedPoints, state: SensorState) -> None:
        return None

    def _sensor_frame(
        self, name: str, filled: SensedGeometry, geometry: GeometryId, state: SensorState
    ) -> SensorFrame:
        """As `SensorChannel`; raises UnknownIdError where no ray's origin is known."""
        its = self._settings
        if its.remembers and not its.frame and name == filled.world_frame:
            raise UnknownIdError(
                "a cloud is in the world frame, so nobody knows where its rays begin, which clear"
                " what it remembers: send it in the sensor's frame, or name that in the scene"
                " file, sources: points: frame"
            )
        return super()._sensor_frame(name, filled, geometry, state)

    def _view(
        self,
        reading: SensedPoints,
        state: SensorState,
        X_WS: NDArray[np.float64],
        rules: DepthRules,
        own: SelfFilter,
    ) -> CloudView:
        return CloudView.of(
            reading.points, X_WS, rules, own, cells=reading.cells, size=reading.size
        )

    def _said(self, reading: SensedPoints) -> dict[str, int]:
        return {"no points in the newest (not finite)": reading.left_out}
