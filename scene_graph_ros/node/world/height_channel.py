"""Heights of height fields: messages of them, validated and applied.

Imported where a source has a height field.
"""

from __future__ import annotations

from collections.abc import Mapping

from sensor_msgs.msg import Image

from msg_adapters.height_images import heights_from_msg
from scene_graph_ros.geometry.errors import InvalidConfigurationError
from scene_graph_ros.geometry.model.height_set import new_heights
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.bounded_channel import NewestChannel
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.fields import NoFieldError, SourceFields
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import HEIGHTS, heights_topic
from scene_graph_ros.node.world.time_limits import TimeLimits

__all__ = ["HeightChannel"]

_BYTES_PER_HEIGHT = 16
"""Of a message: rows may be padded."""


class HeightChannel(NewestChannel[SourceFields]):
    """The topic of heights of one source; of several messages the newest good one counts."""

    noun = HEIGHTS

    def __init__(self, record: SourceRecord, intake: Intake) -> None:
        super().__init__(record, intake, Image)

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {heights_topic(self.record): False}

    def _apply_one(self, kept: Kept, fields: SourceFields, limits: TimeLimits) -> int:
        try:
            geometry = fields.field()
        except NoFieldError as error:
            return self._fault(Fault.UNKNOWN_GEOMETRY, str(error))
        shape = fields.inspector.get_shape(geometry)
        count, size = shape.heights.size, shape.heights.shape
        message = self._read(kept.data, most_bytes(1) + _BYTES_PER_HEIGHT * count)
        if (message.height, message.width) != size:
            return self._fault(
                Fault.WRONG_LENGTH,
                f"a message has {message.height} x {message.width} heights, the field {size[0]} x"
                f" {size[1]}",
            )
        sensed = heights_from_msg(message, count)
        used = limits.of_static() if kept.is_static else limits
        stamp = sensed.stamp_ns or limits.now
        late = used.problem(stamp, stamp if fields.stamp == UNSTAMPED else fields.stamp)
        if late is not None:
            return self._fault(late[0], f"a message of heights {late[1]}")
        name = quoted(fields.inspector.get_name(geometry))
        try:
            heights = new_heights(shape, sensed.heights, f"height field {name}")
        except InvalidConfigurationError as error:
            return self._fault(Fault.NOT_FINITE, str(error))
        fields.put(geometry, heights, stamp)
        self.newest = {"heights in the newest": count}
        self.intake.count(count)
        return 1
