"""The topics of sources as a node resolves them: absolute, after namespaces and remapping."""

from __future__ import annotations

import contextlib
import functools

from rclpy.node import Node

from scene_graph_ros.node.topic_names import expand_topic, topic_problems, TopicNameError
from scene_graph_ros.node.world.scene import Edit
from scene_graph_ros.node.world.source_topics import SourceTopic, topics_of
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["ResolvedTopics"]

_KEPT = 4096
"""Names of topics of which the absolute ones are remembered."""


class ResolvedTopics:
    """Tells the absolute names of sources' topics, and refuses those that can't be."""

    def __init__(self, node: Node) -> None:
        """Resolve as ``node`` does."""
        self._node = node
        # Each new topic is compared with all others.
        self._resolve = functools.lru_cache(_KEPT)(self._absolute)

    def of(self, snapshot: WorldSnapshot, noun: str) -> dict[str, str]:
        """Return the topic of each source that sends "poses", "configurations", "points", ...."""
        names = {}
        for topic in _topics_of(snapshot):
            if topic.noun == noun:
                # None for a source that the program which embeds the node gave a bad name.
                with contextlib.suppress(TopicNameError):
                    names[topic.source] = self._resolve(topic.topic)
        return names

    def check(self, edit: Edit, before: WorldSnapshot) -> None:
        """Raise TopicNameError for a new topic of a source that can't be subscribed to."""
        old = _topics_of(before)
        now = topics_of(
            edit.records.values(),
            edit.deforming(),
            edit.sensing(),
            edit.with_fields(),
            edit.with_grids(),
        )
        new = [topic for topic in now if topic not in old]
        if new:
            kept = [topic for topic in now if topic in old]
            for _, problem in topic_problems(new, kept, self._resolve):
                raise TopicNameError(problem)

    def _absolute(self, topic: str) -> str:
        """Return the absolute name of a topic after remapping; raises TopicNameError."""
        node = self._node
        expand_topic(topic, node=node.get_name(), namespace=node.get_namespace())
        return expand_topic(node.resolve_topic_name(topic))


def _topics_of(snapshot: WorldSnapshot) -> dict[SourceTopic, None]:
    return topics_of(
        snapshot.records.values(),
        snapshot.deforming,
        snapshot.sensing,
        snapshot.with_fields,
        snapshot.with_grids,
    )
