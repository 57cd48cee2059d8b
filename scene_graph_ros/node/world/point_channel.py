"""Points of clouds: messages of them, validated and applied.

Imported where a source has a cloud.
"""

from __future__ import annotations

from collections.abc import Mapping

from sensor_msgs.msg import PointCloud2

from msg_adapters.point_clouds import points_from_msg
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.node.world.bounded_channel import NewestChannel
from scene_graph_ros.node.world.clouds import NoCloudError, SourceClouds
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import points_topic
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["PointChannel"]

_BYTES_PER_POINT = 64
"""Of a message: cameras send 16 to 32, lidars up to 48."""


class PointChannel(NewestChannel[SourceClouds]):
    """The topic of points of one source; of several messages the newest good one counts."""

    noun = "points"

    def __init__(self, record: SourceRecord, intake: Intake, most_points: int) -> None:
        """Read messages of ``most_points`` at most."""
        super().__init__(record, intake, PointCloud2)
        self._most_points = most_points

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {points_topic(self.record): False}

    def _apply_one(self, kept: Kept, clouds: SourceClouds, limits: TimeLimits) -> int:
        most = most_bytes(1) + _BYTES_PER_POINT * self._most_points
        if len(kept.data) > most:
            return self._fault(
                Fault.TOO_LARGE, f"a message has {len(kept.data)} bytes, at most {most} are read"
            )
        message = self._read(kept.data, most)
        count = message.width * message.height
        if count > self._most_points:
            return self._fault(
                Fault.TOO_LARGE,
                f"a message has {count} points, more than max_points_per_cloud,"
                f" {self._most_points}",
            )
        sensed = points_from_msg(message, self._most_points)
        used = limits.of_static() if kept.is_static else limits
        stamp = sensed.stamp_ns or limits.now
        try:
            cloud = clouds.cloud()
            frame = clouds.frame(sensed.frame_id, cloud)
        except NoCloudError as error:
            return self._fault(Fault.UNKNOWN_GEOMETRY, str(error))
        except (UnknownIdError, NameConflictError) as error:
            return self._fault(Fault.UNKNOWN_FRAME, str(error), sensed.frame_id)
        late = used.problem(stamp, clouds.stamps.get(cloud, stamp))
        if late is not None:
            return self._fault(late[0], f"a cloud {late[1]}")
        clouds.put(cloud, sensed.points, frame, stamp)
        self.newest = {
            "points in the newest": len(sensed.points),
            "no points in the newest (not finite)": sensed.left_out,
        }
        self.intake.count(len(sensed.points))
        return 1
