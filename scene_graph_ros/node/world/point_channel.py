"""Points of clouds: messages of them, validated and applied.

Imported where a source has a cloud.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import threading

from sensor_msgs.msg import PointCloud2

from msg_adapters.point_clouds import points_from_msg
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.node.world.clouds import NoCloudError, SourceClouds
from scene_graph_ros.node.world.intake import Fault, Intake, TimeLimits
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept, SourceChannel
from scene_graph_ros.node.world.source_topics import points_topic

__all__ = ["QUEUED", "PointChannel"]

QUEUED = 2
"""Messages kept per source between two updates: they are large, and the newest good one counts."""

_BYTES_PER_POINT = 64
"""Of a message: cameras send 16 to 32, lidars up to 48."""


class PointChannel(SourceChannel[Kept, SourceClouds]):
    """The topic of points of one source.

    Of several messages between two updates the newest good one is applied, and no older one is
    read.
    """

    noun = "points"

    def __init__(self, record: SourceRecord, intake: Intake, most_points: int) -> None:
        """Read messages of ``most_points`` at most."""
        super().__init__(record, intake, PointCloud2)
        self._most_points = most_points
        self._lock = threading.Lock()
        self._kept: deque[Kept] = deque()

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {points_topic(self.record): False}

    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Keep a message that arrived at a steady time (ns)."""
        statistics = self.intake.statistics
        statistics.arrived(arrival, is_static=is_static)
        with self._lock:
            if len(self._kept) == QUEUED:
                self._kept.popleft()
                statistics.superseded += 1
            self._kept.append(Kept(data, arrival, is_static))

    def take(self) -> list[Kept]:
        """Take all messages that were kept, oldest first."""
        with self._lock:
            taken = list(self._kept)
            self._kept.clear()
        return taken

    def apply(self, kept: list[Kept], target: SourceClouds, limits: TimeLimits) -> int | None:
        """Apply the newest message that is good; return when it arrived, None without one."""
        for older, one in zip(range(len(kept) - 1, -1, -1), reversed(kept), strict=True):
            arrival = super().apply([one], target, limits)
            if arrival is not None:
                self.intake.statistics.superseded += older
                return arrival
        return None

    def _worth_reading(self, kept: list[Kept]) -> list[Kept]:
        return kept

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

    def _fault(self, fault: Fault, detail: str, frame: str = "") -> int:
        """Count a message as faulty; return that nothing was applied."""
        self.intake.fault(fault, frame, detail)
        return 0
