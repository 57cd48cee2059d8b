"""Takes messages as bytes in a thread that waits for nothing else, and notes when they came."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
import threading
import time
from typing import Any

import rclpy
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import MarkerArray

from msg_adapters.wire.layout import layout
from scene_graph_msgs.msg import ContactArray

__all__ = ["Listener"]

_WAIT = 20_000_000
"""Nanoseconds after which the end of listening is noticed."""


class Listener:
    """Listens to contacts and to markers of a node, by its name."""

    def __init__(
        self, domain: int, name: str = "scene_graph", *, with_markers: bool = True
    ) -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("listener", context=self.context)
        self._stamp_at = _place_of_stamp()
        self.arrivals: list[tuple[int, int]] = []
        """(stamp, arrival) of each contact message, nanoseconds of the system's clock."""
        self.newest: bytes = b""
        self.markers = 0
        self._subscriptions = [
            (self._on_contacts, self._subscribe(ContactArray, f"/{name}/contacts", 100))
        ]
        if with_markers:
            topic = f"/{name}/markers/proximity"
            self._subscriptions.append((self._on_markers, self._subscribe(MarkerArray, topic, 1)))
        self._is_stopped = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _subscribe(self, kind: Any, topic: str, depth: int) -> Any:
        qos = QoSProfile(depth=depth)
        return self.node.create_subscription(kind, topic, lambda data: None, qos, raw=True)

    def _on_contacts(self, data: bytes) -> None:
        now, place = time.time_ns(), self._stamp_at
        seconds = int.from_bytes(data[place : place + 4], "little")
        stamp = seconds * 10**9 + int.from_bytes(data[place + 4 : place + 8], "little")
        self.arrivals.append((stamp, now))
        self.newest = data

    def _on_markers(self, data: bytes) -> None:
        self.markers += 1

    def _run(self) -> None:
        with ExitStack() as held:
            held.enter_context(self.context.handle)
            by_pointer = {}
            for callback, subscription in self._subscriptions:
                held.enter_context(subscription.handle)
                by_pointer[subscription.handle.pointer] = (callback, subscription)
            count = len(self._subscriptions)
            wait_set = rclpy_implementation.WaitSet(count, 0, 0, 0, 0, 0, self.context.handle)
            while not self._is_stopped:
                wait_set.clear_entities()
                for _, subscription in self._subscriptions:
                    wait_set.add_subscription(subscription.handle)
                wait_set.wait(_WAIT)
                for pointer in wait_set.get_ready_entities("subscription"):
                    callback, subscription = by_pointer[pointer]
                    taken = subscription.handle.take_message(subscription.msg_type, True)
                    if taken is not None:
                        callback(taken[0])

    def wait_for_contacts(self, check: Callable[[], None], seconds: float = 120.0) -> float:
        """Wait for a contact message and return how long it took.

        ``check`` raises where a process ended; TimeoutError is raised after ``seconds``.
        """
        begin = time.monotonic()
        while not self.arrivals:
            if time.monotonic() - begin > seconds:
                raise TimeoutError(f"no contacts from the node within {seconds:g} s")
            check()
            time.sleep(0.002)
        return time.monotonic() - begin

    def contacts(self) -> int:
        """Return how many contacts the newest message has."""
        return len(deserialize_message(self.newest, ContactArray).points) if self.newest else 0

    def close(self) -> None:
        """End listening."""
        self._is_stopped = True
        self._thread.join()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def _place_of_stamp() -> int:
    return layout(ContactArray()).begin("header.stamp.sec")
