"""The interfaces between an effect that publishes and the node."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import math
import threading
import time
from typing import Any, Protocol, runtime_checkable, TYPE_CHECKING

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from rclpy.serialization import serialize_message

from msg_adapters.definitions import kind_of
from scene_graph_ros.node.effects.answer_thread import Found
from scene_graph_ros.node.effects.receipts import Receipts
from scene_graph_ros.node.runtime.qos import overridable
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.world import WorldSnapshot

if TYPE_CHECKING:
    from scene_graph_ros.node.recording.recorder import Recorder
    from scene_graph_ros.node.world.kept_regions import KeptRegions
    from scene_graph_ros.views.browser.channels import Channels
    from scene_graph_ros.views.moment import Trouble

__all__ = ["Effect", "Host", "Outlet", "WorksAlone"]


class Host(Protocol):
    """The node as its effects see it."""

    node: Node
    group: CallbackGroup
    world_frame: str
    channels: Channels | None
    """Topics that clients of the view in a browser may subscribe to."""

    @property
    def recorder(self) -> Recorder | None:
        """The recorder, None where nothing is recorded."""

    @property
    def troubles(self) -> tuple[Trouble, ...]:
        """Entries of the last diagnostics that warn or worse, while a page is open."""

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""

    def pose_topics(self, snapshot: WorldSnapshot) -> Mapping[str, str]:
        """Return the absolute name of each source's pose topic, subscribed to yet or not."""

    def publishers_changed(self) -> None:
        """Tell that there are other publishers than before."""

    def lack_of_kernels(self, group: str) -> str:
        """Return a sentence about a group's kernels that are not ready; "" where they are."""

    def request_update(self) -> None:
        """Ask for an update soon, also when no poses arrive."""

    def answer(self, name: str, snapshot: WorldSnapshot) -> Any | None:
        """Return an answer about ``snapshot``, computed once for all its publishers.

        None where the effect that has it is off, where it is late, and where it failed, which is
        told under the name of that effect. To be called in an update.
        """

    def newest_answer(self, name: str) -> Found | None:
        """Return the newest answer that came, of an effect whose answers may be late."""

    def newest_plan(self) -> PlannedPath | None:
        """Return the path that was found last, None before the first."""

    def begin_plan(
        self,
        goal: Any,
        heard: Callable[[Any], None],
        done: Callable[[Any, PlannedPath | None], None],
    ) -> Callable[[], None]:
        """Take a goal of plan_path as a client's; return the function that cancels it.

        ``heard`` is told its feedback, ``done`` its result and the path, in threads that must not
        be held up.
        """

    def kept_regions(self) -> KeptRegions | None:
        """Return the regions that are kept, None before the first."""

    def contacts_published(self, snapshot: WorldSnapshot) -> None:
        """Tell that the contacts of ``snapshot`` are on their way."""


class Effect(Protocol):
    """Publishes one thing, in the thread that updates the world."""

    def is_heard(self) -> bool:
        """Whether anybody listens, so that preparing is worth while."""

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do slow first work for a scene before it counts.

        Called where it is heard, in the thread of an edit, beside updates; the answers that it
        needs are there by then.
        """

    def has_work(self) -> bool:
        """Tell whether somebody listens and it is time to publish."""

    def update(self, snapshot: WorldSnapshot) -> None:
        """Publish messages about a snapshot; called only when there is work."""

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Take back the published messages, before the effect ends."""

    def close(self) -> None:
        """Stop being advertised."""

    def counters(self) -> Mapping[str, Any]:
        """Return counts of the work done, for diagnostics and tests."""


@runtime_checkable
class WorksAlone(Protocol):
    """An effect that computes and publishes in a thread of its own.

    Nobody else sees errors there, so it reports them itself. An effect that fails is off until
    the scene changes.
    """

    def failure(self) -> str:
        """Say why it is off, "" while it is not."""

    def stale(self) -> str:
        """Return a sentence about a lost object that it waits for, "" where none is lost."""

    def recent_seconds(self) -> list[float]:
        """Return the times (s) of its last frames."""

    def count(self) -> int:
        """Return the number of frames made."""


class Reader(Protocol):
    """A reader of a topic's messages beside its subscribers."""

    def is_heard(self) -> bool:
        """Tell whether it wants messages."""

    def has_newcomers(self) -> bool:
        """Tell whether the next one had better not wait."""

    def take_key(self) -> bool:
        """Tell whether the next one had better be whole, once."""

    def take_missed(self) -> bool:
        """Tell, once, whether messages were lost on the way."""

    def write(self, data: bytes) -> None:
        """Take a message, serialized, which does not change any more."""

    def close(self) -> None:
        """Expect no more."""


def _readers(host: Host, kind: Any, name: str, topic: str, qos: QoSProfile) -> Iterator[Reader]:
    """Yield the readers of ``topic`` beside subscribers; ``name`` is not resolved yet."""
    tape = None if host.recorder is None else host.recorder.tape(kind, name, topic, qos)
    if tape is not None:
        yield tape
    if host.channels is not None:
        yield host.channels.channel(topic, kind_of(kind))


class Outlet:
    """A publisher that knows whether anybody listens and whether somebody new came.

    Readers that ask for volatile data, as viewers do by default, get nothing from a transient
    local writer's past; so a new match is reported once through ``take_newcomers``. Messages that
    such a writer keeps may build on earlier ones: then none is to be lost, see ``Receipts``.
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
        keeps_for_later = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
        self._publisher = host.node.create_publisher(
            kind,
            topic,
            qos,
            callback_group=host.group,
            event_callbacks=PublisherEventCallbacks(matched=self._matched),
            qos_overriding_options=overridable(),
        )
        self._readers = tuple(_readers(host, kind, topic, self.topic, qos))
        # The profile is by now what parameters made of it.
        keeps_all = qos.history == HistoryPolicy.KEEP_ALL
        self._receipts = (
            Receipts(self._are_all_in, math.inf if keeps_all else qos.depth)
            if keeps_for_later
            else None
        )
        host.publishers_changed()

    def _matched(self, event: Any) -> None:
        # The current count does not change where one reader leaves as another comes.
        if event.total_count_change > 0:
            with self._lock:
                self._newcomers = True
            self._host.request_update()

    def take_newcomers(self) -> bool:
        """Tell whether a subscriber was matched since the last call, or may have missed much."""
        with self._lock:
            newcomers, self._newcomers = self._newcomers, False
        # Each is asked, as it tells only once.
        is_key = sum(reader.take_key() for reader in self._readers) > 0
        return (self._receipts is not None and self._receipts.take_repeat()) or newcomers or is_key

    def take_missed(self) -> bool:
        """Tell whether a subscriber has missed messages, be they additions or deletions.

        To be asked before ``take_newcomers``: one that was given up comes back as a newcomer.
        """
        has_missed = sum(reader.take_missed() for reader in self._readers) > 0
        if self._receipts is None:
            return has_missed
        if self._newcomers:
            self._receipts.note_newcomer()
        return self._receipts.take_missed() or has_missed

    @property
    def topic(self) -> str:
        """Absolute name of the topic."""
        return str(self._publisher.topic_name)

    def is_heard(self) -> bool:
        """Whether there are subscribers or other readers."""
        if any(reader.is_heard() for reader in self._readers):
            return True
        return self._publisher.get_subscription_count() > 0

    def is_due(self) -> bool:
        """Whether there are subscribers that should get a message now."""
        # What asks the middleware most comes last.
        return self.is_heard() and not self._is_early() and not self._is_on_its_way()

    def _is_early(self) -> bool:
        """Tell whether the last message is too short ago, and nobody new has come since."""
        if self._newcomers or self._period is None:
            return False
        if any(reader.has_newcomers() for reader in self._readers):
            return False
        return time.monotonic() - self._last < self._period()

    def _is_on_its_way(self) -> bool:
        """Tell whether a message that was sent may still be lost by sending another."""
        return self._receipts is not None and self._receipts.is_on_its_way()

    def _are_all_in(self) -> bool:
        return bool(self._publisher.wait_for_all_acked(Duration(nanoseconds=0)))

    def publish(self, message: Any) -> None:
        """Publish a message."""
        self._last = time.monotonic()
        self.messages += 1
        if self._receipts is not None:
            self._receipts.sent()
        self._publisher.publish(message)
        heard = [reader for reader in self._readers if reader.is_heard()]
        if heard:
            is_raw = isinstance(message, (bytes, bytearray, memoryview))
            data = bytes(message) if is_raw else serialize_message(message)
            for reader in heard:
                reader.write(data)

    def close(self) -> None:
        """Stop advertising."""
        for reader in self._readers:
            reader.close()
        self._host.node.destroy_publisher(self._publisher)
        self._host.publishers_changed()
