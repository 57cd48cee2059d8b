"""The topics that sources send on, as asked for: before namespaces and remapping."""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass
from typing import Protocol

from scene_graph_ros.node.runtime.names import default_configuration_topic, default_pose_topic

__all__ = ["Sender", "SourceTopic", "configuration_topic", "pose_topic", "topics_of"]

CONFIGURATION_TYPE = "scene_graph_msgs/msg/DeformableConfigurations"


class Sender(Protocol):
    """What is known of a source: empty topics are the default ones, no type means no poses."""

    @property
    def name(self) -> str:
        """Name of the source."""

    @property
    def pose_type(self) -> str:
        """Type of its pose messages."""

    @property
    def pose_topic(self) -> str:
        """Topic of its poses as given."""

    @property
    def configuration_topic(self) -> str:
        """Topic of its configurations as given."""


@dataclass(frozen=True)
class SourceTopic:
    """A topic that a source sends ``noun`` on, as asked for: before namespaces and remapping."""

    source: str
    noun: str
    topic: str
    type: str
    is_default: bool


def pose_topic(sender: Sender) -> str:
    """Return the topic of a source's poses as asked for."""
    return sender.pose_topic or default_pose_topic(sender.name, sender.pose_type)


def configuration_topic(sender: Sender) -> str:
    """Return the topic of a source's configurations as asked for."""
    return sender.configuration_topic or default_configuration_topic(sender.name)


def topics_of(senders: Iterable[Sender], deforming: Container[str]) -> dict[SourceTopic, None]:
    """Return all topics; ``deforming`` are the names of sources with deformable geometry."""
    topics: dict[SourceTopic, None] = {}
    for sender in senders:
        name, kind = sender.name, sender.pose_type
        if kind:
            topic, is_default = pose_topic(sender), not sender.pose_topic
            topics[SourceTopic(name, "poses", topic, kind, is_default)] = None
        if name in deforming:
            topic, is_default = configuration_topic(sender), not sender.configuration_topic
            kind = CONFIGURATION_TYPE
            topics[SourceTopic(name, "configurations", topic, kind, is_default)] = None
    return topics
