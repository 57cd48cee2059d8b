"""Names of sources' topics: those that ROS allows, each of one type, none the node's.

Nothing of ROS is imported, so that files can be checked without it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import re

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.effects.declarations import EFFECTS
from scene_graph_ros.node.runtime.names import DIAGNOSTICS, JOG_JOINTS, JOG_TWIST, NODE_NAME
from scene_graph_ros.node.world.source_topics import SourceTopic

__all__ = ["TopicNameError", "expand_topic", "topic_problems"]

OWN_TOPICS = (
    *dict.fromkeys(topic for effect in EFFECTS for topic in effect.topics),
    DIAGNOSTICS,
    JOG_JOINTS,
    JOG_TWIST,
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


def _check_default(topic: SourceTopic) -> None:
    """Refuse a source's name that would be a topic's, and is none by itself."""
    if topic.is_default and topic.source in topic.topic and not re.fullmatch(_PART, topic.source):
        raise TopicNameError(
            f"its topic would be {quoted(topic.topic)}, and {_RULE}; choose another name, or "
            "name a topic in a scene file"
        )
