"""Publishes the messages of a recorded node, for RViz and others."""

from __future__ import annotations

from collections.abc import Iterable
import time
from typing import Any

import rclpy
from rclpy.exceptions import InvalidTopicNameException
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.validate_full_topic_name import validate_full_topic_name
from rosbags.interfaces import QosDurability
from rosbags.rosbag2.metadata import parse_qos

from msg_adapters.message_classes import class_of_kind
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.replay.reader import Recorded, RecordingError

__all__ = ["publish"]

_DISCOVERY = 1.0
"""Seconds that readers have at most to find a topic before its first message."""

_LOOK = 0.01
"""Seconds between two looks whether one has."""


_MOST_DEPTH = 10_000
"""Messages that a publisher keeps."""


def publish(messages: Iterable[Recorded], rate: float) -> int:
    """Publish at ``rate`` times the pace of then, on the topics of then; return how many.

    The node's inputs are left out: a node that listens would take them in again. Ends early
    where it is interrupted.
    """
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("scene_graph_replay", context=context)
    publishers: dict[str, Any] = {}
    begin, first, count = time.monotonic(), None, 0
    try:
        for message in messages:
            if not message.qos:
                continue
            publisher = publishers.get(message.topic)
            if publisher is None:
                publisher = _make_publisher(node, message)
                publishers[message.topic] = publisher
                begin += _await_reader(publisher)
            if first is None:
                begin, first = time.monotonic(), message.time
            wait = begin + (message.time - first) * 1e-9 / rate - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            publisher.publish(message.data)
            count += 1
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.shutdown(context=context)
    return count


def _await_reader(publisher: Any) -> float:
    """Wait until somebody listens, or nobody seems to; return how long that took, in seconds."""
    begin = time.monotonic()
    while not publisher.get_subscription_count() and time.monotonic() < begin + _DISCOVERY:
        time.sleep(_LOOK)
    return time.monotonic() - begin


def _make_publisher(node: Any, message: Recorded) -> Any:
    """Return a publisher as the recording describes it. Raises RecordingError."""
    where = f"the topic {quoted(message.topic)} can't be published"
    try:
        validate_full_topic_name(message.topic)
        kind, profile = class_of_kind(message.kind), _profile(message.qos)
    except (InvalidTopicNameException, ValueError) as error:
        raise RecordingError(f"{where}: {error}") from error
    return node.create_publisher(kind, message.topic, profile)


def _profile(text: str) -> QoSProfile:
    """Return the profile that a recording has as YAML. Raises ValueError for other texts."""
    try:
        (qos, *_) = parse_qos(text)
    except Exception as error:  # the library raises whatever it meets
        raise ValueError(f"its offered QoS can't be read: {quoted(text)}") from error
    depth: Any = qos.depth  # whatever the YAML says
    if not isinstance(depth, int) or depth > _MOST_DEPTH:
        raise ValueError(f"its depth is {quoted(depth)}, at most {_MOST_DEPTH} are kept")
    profile = QoSProfile(depth=max(depth, 1))
    if qos.durability == QosDurability.TRANSIENT_LOCAL:
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile
