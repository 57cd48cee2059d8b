"""Descriptions of robots that come by a topic: the text of a URDF, latched as a rule.

Reading one takes as long as a scene file, so it is done in a thread of its own, which makes an
edit of the world: all of it or nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.node import Node
from std_msgs.msg import String

from msg_adapters.errors import MessageError
from scene_graph_ros.geometry.files import MAX_TEXT_BYTES
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.intake import Intake
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Inputs, Kept, SourceChannel
from scene_graph_ros.node.world.source_topics import description_topic
from scene_graph_ros.node.world.world import World

__all__ = ["DESCRIPTIONS", "Describe", "DescriptionChannel", "DescriptionInputs"]

DESCRIPTIONS = "descriptions"

Describe = Callable[[str, str, Callable[[str], None]], None]
"""Has a source become as a text says; tells why it is not, or "" where it is."""


class DescriptionChannel(SourceChannel[Kept, None]):
    """The topic on which a robot is described; a text that is not new is passed over.

    The channel stays when the robot becomes another: its record is that of the beginning.
    """

    noun = DESCRIPTIONS

    def __init__(self, record: SourceRecord, intake: Intake, describe: Describe) -> None:
        """Call ``describe`` with the name of the source, each new text, and a callback."""
        super().__init__(record, intake, String)
        self._describe = describe
        self._newest = b""
        self.failure = ""
        """Why the robot is not as it was described last; "" where it is, or will be."""

    def _told(self, failure: str) -> None:
        """Take note of the outcome of the newest text."""
        self.failure = failure

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {description_topic(self.record): True}

    def store(self, data: bytes, arrival: int, *, is_static: bool = False) -> None:
        """Have the robot become as a message describes it, unless it is that already."""
        self.intake.statistics.arrived(arrival, is_static=True)
        if data == self._newest:
            self.intake.statistics.superseded += 1
            return
        self._newest = data
        try:
            text = self._read(data, MAX_TEXT_BYTES).data
        except MessageError as error:
            self.intake.fault(Fault.MALFORMED, "", str(error))
            self.failure = str(error)
            return
        self._describe(self.record.name, text, self._told)

    def take(self) -> list[Kept]:
        """Return nothing: descriptions do not wait for an update."""
        return []

    def _worth_reading(self, kept: list[Kept]) -> list[Kept]:
        return kept

    def _apply_one(self, kept: Kept, target: None, limits: Any) -> int:
        return 0


class DescriptionInputs(Inputs[DescriptionChannel]):
    """All subscriptions to descriptions of robots."""

    def __init__(
        self,
        node: Node,
        world: World,
        group: OwnThreadGroup,
        on_change: Callable[[], None],
        describe: Describe,
    ) -> None:
        """Call ``describe`` with the name of a source, a new text, and a callback."""
        super().__init__(node, world, group, on_change, noun=DESCRIPTIONS, queued=1)
        self._describe = describe

    def _wanted(self) -> Iterable[str]:
        records = self._world.snapshot.records
        return [name for name, record in records.items() if record.description is not None]

    def _is_same(self, old: SourceRecord, new: SourceRecord) -> bool:
        return old.description is new.description

    def _target(self, name: str) -> None:
        return None

    def _make(self, record: SourceRecord) -> DescriptionChannel:
        return DescriptionChannel(record, Intake(record.name, self._warn), self._describe)
