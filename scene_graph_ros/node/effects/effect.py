"""What an effect that publishes has to offer, and what it gets from the node."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import threading
import time
from typing import Any, Protocol

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile

from scene_graph_ros.node.qos import overridable
from scene_graph_ros.node.world import WorldSnapshot

__all__ = ["Effect", "Host", "Outlet"]

_ACKNOWLEDGE_SECONDS = 1.0
"""Longest wait for a reliable reader's acknowledgement: far longer than a round trip, short
enough that a reader which vanished without a word does not hold up the others noticeably."""


class Host(Protocol):
    """What the node offers to its effects."""

    node: Node
    group: CallbackGroup
    world_frame: str

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""

    def publishers_changed(self) -> None:
        """Tell that there are other publishers than before."""

    def request_update(self) -> None:
        """Ask for an update soon, also when no poses arrive."""

    def effect(self, name: str) -> Any:
        """Return another effect that publishes, or None while it is off."""

    def contacts_published(self, snapshot: WorldSnapshot) -> None:
        """Tell that the contacts of ``snapshot`` are on their way."""


class Effect(Protocol):
    """Computes and publishes one thing, in the thread that updates the world."""

    def has_work(self) -> bool:
        """Tell whether somebody listens and it is time to publish."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Compute and publish for a snapshot; called only when there is work."""

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take back what was published, before the effect ends."""

    def close(self) -> None:
        """Stop being advertised."""

    def counters(self) -> Mapping[str, Any]:
        """Return how much work was done and how, for diagnostics and tests."""


class Outlet:
    """A publisher that knows whether anybody listens and whether somebody new came.

    Readers that ask for volatile data, as viewers do by default, get nothing from a transient
    local writer's past; so a new match is reported once through ``take_newcomers``.
    """

    def __init__(
        self,
        host: Host,
        kind: Any,
        topic: str,
        qos: QoSProfile,
        *,
        period: Callable[[], float] | None = None,
    ) -> None:
        """Advertise ``topic``; ``period`` returns seconds between messages (None: no limit)."""
        self._host = host
        self._lock = threading.Lock()
        self._newcomers = False
        self._period = period
        self._last = float("-inf")
        self.messages = 0
        self._keeps_one = qos.depth == 1
        self._publisher = host.node.create_publisher(
            kind,
            topic,
            qos,
            callback_group=host.group,
            event_callbacks=PublisherEventCallbacks(matched=self._matched),
            qos_overriding_options=overridable(),
        )
        host.publishers_changed()

    def _matched(self, event: Any) -> None:
        # The current count does not change where one reader leaves as another comes.
        if event.total_count_change > 0:
            with self._lock:
                self._newcomers = True
            self._host.request_update()

    def take_newcomers(self) -> bool:
        """Tell whether a subscriber was matched since the last call."""
        with self._lock:
            newcomers, self._newcomers = self._newcomers, False
        return newcomers

    @property
    def topic(self) -> str:
        """Absolute name of the topic."""
        return str(self._publisher.topic_name)

    def is_heard(self) -> bool:
        """Tell whether there are subscribers."""
        return self._publisher.get_subscription_count() > 0

    def is_due(self) -> bool:
        """Tell whether there are subscribers who should get a message now."""
        # What asks the middleware most comes last.
        return self.is_heard() and not self._is_early() and not self._is_on_its_way()

    def _is_early(self) -> bool:
        """Tell whether the last message is too short ago, and nobody new has come since."""
        if self._newcomers or self._period is None:
            return False
        return time.monotonic() - self._last < self._period()

    def _is_on_its_way(self) -> bool:
        """Tell whether the last message may still be lost by sending another.

        Of a topic that keeps one message the next takes the place of one that a reliable reader
        has not got yet. A reader that is gone or stuck is waited for a second at most.
        """
        if not self._keeps_one or time.monotonic() - self._last > _ACKNOWLEDGE_SECONDS:
            return False
        return not self._publisher.wait_for_all_acked(Duration(nanoseconds=0))

    def publish(self, message: Any) -> None:
        """Publish a message."""
        self._last = time.monotonic()
        self.messages += 1
        self._publisher.publish(message)

    def close(self) -> None:
        """Stop advertising."""
        self._host.node.destroy_publisher(self._publisher)
        self._host.publishers_changed()
