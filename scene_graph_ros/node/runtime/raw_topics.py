"""Subscriptions whose messages stay bytes, taken by the world's own thread."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.qos import overridable, pose_qos

__all__ = ["RawTopic", "RawTopics"]


class RawTopic(Protocol):
    """A topic: the class of its messages, its name as asked for, and as it turned out."""

    kind: Any
    subscription: Any
    topic: str

    @property
    def wanted_topic(self) -> str:
        """Name of the topic, before namespaces and remapping."""


def _never(data: bytes) -> None:
    raise AssertionError("the world's own thread takes these messages")


class RawTopics:
    """Subscribes; takes what best effort publishers offer where that is all there is.

    To be used by the thread that waits for the messages, or while it does not run.
    """

    def __init__(self, node: Node, group: OwnThreadGroup, on_change: Callable[[], None]) -> None:
        """Call ``on_change`` when a subscription is replaced by another."""
        self._node = node
        self._group = group
        self._on_change = on_change

    def subscribe(self, topic: RawTopic, depth: int) -> None:
        """Subscribe; the middleware holds ``depth`` messages until they are taken."""
        self._subscribe(topic, pose_qos(depth), overridable())

    def unsubscribe(self, topic: RawTopic) -> None:
        """End the subscription of ``topic``."""
        if topic.subscription is not None:
            self._node.destroy_subscription(topic.subscription)

    def _subscribe(self, topic: RawTopic, qos: QoSProfile, options: Any = None) -> None:
        topic.subscription = self._node.create_subscription(
            topic.kind,
            topic.wanted_topic,
            _never,
            qos,
            callback_group=self._group,
            event_callbacks=SubscriptionEventCallbacks(
                incompatible_qos=lambda event: self._on_incompatible(topic)
            ),
            raw=True,
            qos_overriding_options=options,
        )
        topic.topic = topic.subscription.topic_name

    def _on_incompatible(self, topic: RawTopic) -> None:
        """Take what a best effort publisher offers; say so where that does not help either."""
        logger = self._node.get_logger()
        old = topic.subscription
        if old.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT:
            logger.warning(f"{topic.topic}: a publisher's quality of service does not fit")
            return
        logger.info(f"{topic.topic}: a publisher offers best effort only, so that is taken")
        self._subscribe(topic, pose_qos(old.qos_profile.depth, is_reliable=False))
        self._node.destroy_subscription(old)
        self._on_change()
