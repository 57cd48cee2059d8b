"""Publishes what a recorded node published, for RViz and others."""

from __future__ import annotations

from collections.abc import Iterable
import importlib
import time
from typing import Any

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosbags.interfaces import QosDurability
from rosbags.rosbag2.metadata import parse_qos

from scene_graph_ros.replay.reader import Recorded

__all__ = ["publish"]

_DISCOVERY = 1.0
"""Seconds that readers have at most to find a topic before its first message."""

_LOOK = 0.01
"""Seconds between two looks whether one has."""


def publish(messages: Iterable[Recorded], rate: float) -> int:
    """Publish at ``rate`` times the pace of then, on the topics of then; return how many.

    What the node took in is left out: a node that listens would take it in again. Ends early
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
                publisher = node.create_publisher(
                    _class(message.kind), message.topic, _profile(message.qos)
                )
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


def _class(kind: str) -> Any:
    package, _, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def _profile(text: str) -> QoSProfile:
    qos = parse_qos(text)[0]
    profile = QoSProfile(depth=max(qos.depth, 1))
    if qos.durability == QosDurability.TRANSIENT_LOCAL:
        profile.durability = DurabilityPolicy.TRANSIENT_LOCAL
    return profile
