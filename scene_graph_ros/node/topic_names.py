"""The topics that sources send on: names that ROS allows, each of one type, none the node's own.

Nothing of ROS is imported, so that files can be checked without it.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass
import re
from typing import Protocol

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.effects.declarations import EFFECTS
from scene_graph_ros.node.names import (
    default_configuration_topic,
    default_pose_topic,
    DIAGNOSTICS,
    NODE_NAME,
)

__all__ = [
    "SourceTopic",
    "TopicNameError",
    "check_topics",
    "configuration_topic",
    "expand_topic",
    "pose_topic",
    "topic_problems",
    "topics_of",
]

CONFIGURATION_TYPE = "scene_graph_msgs/msg/DeformableConfigurations"

OWN_TOPICS = (
    *dict.fromkeys(topic for effect in EFFECTS for topic in effect.topics),
    DIAGNOSTICS,
    "~/transition_event",
    "/clock",
    "/parameter_events",
    "/rosout",
)
"""What the node itself publishes or hears."""

_LONGEST = 247
"""Characters of an absolute name: the middleware allows 255 with a prefix of its own."""

_PART = r"[A-Za-z_][A-Za-z0-9_]*"
_ABSOLUTE = re.compile(rf"(/{_PART})+")
_RULE = "parts between slashes are letters, digits and '_' and begin with no digit"


class TopicNameError(SceneGraphError, ValueError):
    """A topic whose name ROS does not allow, or that is used for something else already."""


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


def expand_topic(topic: str, *, node: str = NODE_NAME, namespace: str = "/") -> str:
    """Return the absolute name of a topic, before remapping; raises TopicNameError."""
    space = namespace.rstrip("/")
    name = topic
    if topic == "~" or topic.startswith("~/"):
        name = f"{space}/{node}{topic[1:]}"
    for word, value in (("{node}", node), ("{ns}", namespace), ("{namespace}", namespace)):
        name = name.replace(word, value)
    if not name.startswith("/"):
        name = f"{space}/{name}"
    if not _ABSOLUTE.fullmatch(name):
        raise TopicNameError(f"{quoted(topic)} can't be the name of a topic: {_RULE}")
    if len(name) > _LONGEST:
        raise TopicNameError(
            f"{quoted(topic)} is too long for a topic: {len(name)} characters with its "
            f"namespace, of {_LONGEST}"
        )
    return name


def topic_problems(
    new: Iterable[SourceTopic],
    old: Iterable[SourceTopic] = (),
    resolve: Callable[[str], str] = expand_topic,
) -> Iterator[tuple[SourceTopic, str]]:
    """Yield each of the ``new`` topics that can't be subscribed to beside the ``old``, and why.

    ``resolve`` returns the absolute name of a topic, or raises TopicNameError.
    """
    taken = {resolve(topic): ("", "the node itself") for topic in OWN_TOPICS}
    for topic in old:
        try:
            taken.setdefault(resolve(topic.topic), (topic.type, f"source {quoted(topic.source)}"))
        except TopicNameError:
            # Can't be subscribed to, so it is in nobody's way.
            continue
    for topic in new:
        who = f"source {quoted(topic.source)}"
        try:
            _check_default(topic)
            name = resolve(topic.topic)
        except TopicNameError as error:
            yield topic, f"{who} can't send {topic.noun}: {error}"
            continue
        kind, owner = taken.setdefault(name, (topic.type, who))
        if kind != topic.type:
            uses = f"{owner} uses it" + (f" for {kind}" if kind else "")
            yield topic, f"{who} can't send {topic.type} on {name!r}: {uses}"


def check_topics(
    new: Iterable[SourceTopic], old: Iterable[SourceTopic], resolve: Callable[[str], str]
) -> None:
    """Raise TopicNameError for the first of `topic_problems`."""
    for _, problem in topic_problems(new, old, resolve):
        raise TopicNameError(problem)


def _check_default(topic: SourceTopic) -> None:
    """Refuse a source's name that would be a topic's, and is none by itself."""
    if topic.is_default and topic.source in topic.topic and not re.fullmatch(_PART, topic.source):
        raise TopicNameError(
            f"its topic would be {quoted(topic.topic)}, and {_RULE}; choose another name, or "
            "name a topic in a scene file"
        )
