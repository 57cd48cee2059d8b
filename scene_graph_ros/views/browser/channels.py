"""Topics that are offered to clients beside the page, and the messages that wait for each client.

A publisher writes to a channel, from any thread, and never waits. A client that is slow loses the
oldest messages; the channel is told, so that a message that others build on can be sent anew.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import functools
import itertools
import threading
import time
from typing import NamedTuple, TYPE_CHECKING

from scene_graph_ros.views.browser.foxglove import (
    advertisement,
    ChannelInfo,
    message_data,
    server_info,
    status_error,
    time_data,
    unadvertisement,
)
from scene_graph_ros.views.browser.waiting import Load, Waiting

if TYPE_CHECKING:
    from scene_graph_ros.views.browser.assets import Asset

__all__ = ["Channel", "Channels", "Subscriber"]

_MOST_WAITING = 1 << 24
"""Bytes that may wait for a client, 16 MiB, beside the newest message of each channel."""

_OVERHEAD = 200
"""Bytes that a message takes in memory beside its own."""

_LONGEST_WAIT = 1.0
"""Seconds after which a message that waits is left out, if there is a newer one."""

_MOST_ERRORS = 8
"""Errors that wait to be told to a client; more are not."""

TIME_PERIOD = 0.05
"""Seconds between two messages that tell a client the simulated time."""


class Channels:
    """All topics that are offered now."""

    def __init__(
        self,
        name: str,
        definition: Callable[[str], str],
        *,
        clock: Callable[[], int] = time.time_ns,
        is_simulated: Callable[[], bool] = lambda: False,
        wanted: Callable[[], None] = lambda: None,
        assets: Callable[[str], Asset] | None = None,
    ) -> None:
        """``name`` is told to clients, with ``definition(kind)`` of the channels' messages.

        ``clock`` returns the time of messages in ns, which clients are told by itself where it
        ``is_simulated``. ``wanted`` is called when a channel is to be written to soon. ``assets``
        returns the file of an address, or raises AssetError; without it none are offered.
        """
        self.assets = assets
        self.waiting = Waiting()
        """What waits for these and other clients of the server."""
        self.name, self.clock, self.is_simulated, self.wanted = name, clock, is_simulated, wanted
        self.definition = functools.lru_cache(None)(definition)
        self.session = str(time.time_ns())
        self.lock = threading.Lock()
        self.open: dict[int, Channel] = {}
        self.subscribers: set[Subscriber] = set()
        self._numbers = itertools.count(1)
        self.sent = 0
        """Messages that went out."""
        self.dropped = 0
        """Messages that clients were too slow for."""

    def channel(self, topic: str, kind: str) -> Channel:
        """Offer a topic with messages of type ``kind``, ``package/msg/Name``, in CDR."""
        with self.lock:
            channel = Channel(self, next(self._numbers), topic, kind)
            self.open[channel.number] = channel
            self._wake_all()
        return channel

    def join(
        self, wake: Callable[[], None], cut_off: Callable[[], None] = lambda: None
    ) -> Subscriber:
        """Return a client that is new; ``wake`` is called when there is something to take.

        ``cut_off`` ends its connection, where too much waits for all clients together.
        """
        subscriber = Subscriber(self, wake, cut_off)
        with self.lock:
            self.subscribers.add(subscriber)
        return subscriber

    def close(self, channel: Channel) -> None:
        """Offer a topic no longer."""
        with self.lock:
            if self.open.pop(channel.number, None) is not None:
                for subscriber in list(channel.subscribers):
                    subscriber.forget(channel)
                self._wake_all()

    def make_room(self) -> None:
        """Drop the oldest messages while too much waits for all clients.

        With the lock held.
        """
        while self.waiting.is_over():
            oldest = [
                (since, k, subscriber)
                for k, subscriber in enumerate(self.subscribers)
                if (since := subscriber.waits_since()) is not None
            ]
            if not oldest:
                break
            min(oldest)[2].drop_oldest()

    def _wake_all(self) -> None:
        for subscriber in self.subscribers:
            subscriber.wake()


class Channel:
    """One topic; a reader like others for whoever publishes."""

    def __init__(self, channels: Channels, number: int, topic: str, kind: str) -> None:
        self._channels = channels
        self.number, self.topic, self.kind = number, topic, kind
        self.subscribers: dict[Subscriber, int] = {}
        """Who listens, and the number of that subscription; the lock of all channels guards it."""
        self._has_newcomers = self._has_missed = False

    @property
    def info(self) -> ChannelInfo:
        """The channel as clients know it."""
        definition = self._channels.definition(self.kind)
        return ChannelInfo(self.number, self.topic, self.kind, definition)

    def is_heard(self) -> bool:
        """Tell whether a client subscribes to it."""
        return bool(self.subscribers)

    def has_newcomers(self) -> bool:
        """Tell whether the next message had better not wait."""
        return self._has_newcomers

    def take_key(self) -> bool:
        """Tell whether somebody came, or missed messages, since the last call."""
        with self._channels.lock:
            has_newcomers, self._has_newcomers = self._has_newcomers, False
        return has_newcomers

    def take_missed(self) -> bool:
        """Tell whether a client missed messages since the last call."""
        with self._channels.lock:
            has_missed, self._has_missed = self._has_missed, False
        return has_missed

    def write(self, data: bytes) -> None:
        """Send a message to whoever subscribes; ``data`` must not change any more."""
        if self.subscribers:
            message = _Message(time.monotonic(), self._channels.clock(), data)
            with self._channels.lock:
                for subscriber, number in self.subscribers.items():
                    subscriber.put(self, number, message)
                self._channels.make_room()

    def close(self) -> None:
        """Be offered no longer."""
        self._channels.close(self)

    def ask(self, *, has_missed: bool) -> None:
        """Have the next message be whole, with the lock held; then call ``Channels.wanted``."""
        self._has_newcomers = True
        self._has_missed |= has_missed


class _Message(Load):
    """A message that some clients have not taken yet."""

    __slots__ = ("data", "since", "time")

    def __init__(self, since: float, time_ns: int, data: bytes) -> None:
        super().__init__(len(data) + _OVERHEAD)
        self.since, self.time, self.data = since, time_ns, data


class _Item(NamedTuple):
    subscription: int
    message: _Message


class Subscriber:
    """One client: its subscriptions, and the messages that it has not taken yet."""

    def __init__(
        self, channels: Channels, wake: Callable[[], None], cut_off: Callable[[], None]
    ) -> None:
        self._channels, self.wake, self._cut_off = channels, wake, cut_off
        self.tells_time = channels.is_simulated()
        self._is_greeted = False
        self._told: set[int] | None = None
        self._errors: deque[str] = deque(maxlen=_MOST_ERRORS)
        self._subscriptions: dict[int, Channel] = {}
        # In the order in which channels are to be served.
        self._waiting: dict[Channel, deque[_Item]] = {}
        self._waiting_bytes = 0
        self._missing: set[Channel] = set()
        self._time_at = float("-inf")

    def subscribe(self, subscription: int, number: int) -> None:
        """Subscribe to a channel by its number; a wrong number is told to the client."""
        channels = self._channels
        with channels.lock:
            channel = channels.open.get(number)
            if channel is None:
                self.complain(f"channel {number} is not offered")
            elif subscription in self._subscriptions or self in channel.subscribers:
                self.complain(
                    f"subscription {subscription} of channel {number} is there already, or the "
                    "channel has another"
                )
            else:
                self._subscriptions[subscription] = channel
                channel.subscribers[self] = subscription
                channel.ask(has_missed=False)
        channels.wanted()

    def unsubscribe(self, subscription: int) -> None:
        """Get that no longer."""
        with self._channels.lock:
            channel = self._subscriptions.get(subscription)
            if channel is None:
                self.complain(f"there is no subscription {subscription}")
            else:
                self.forget(channel)

    def complain(self, text: str) -> None:
        """Tell the client of its mistake."""
        self._errors.append(text)
        self.wake()

    def leave(self) -> None:
        """Be no client any more."""
        with self._channels.lock:
            self._channels.subscribers.discard(self)
            for channel in list(self._subscriptions.values()):
                self.forget(channel)
        self._channels.waiting.end(self)

    # With the lock of all channels held.

    def forget(self, channel: Channel) -> None:
        """Be told nothing more of a channel."""
        del self._subscriptions[channel.subscribers.pop(self)]
        for item in self._waiting.pop(channel, ()):
            self._let_go(item.message)
        self._missing.discard(channel)

    def put(self, channel: Channel, subscription: int, message: _Message) -> None:
        """Have a message wait to be taken."""
        self._waiting.setdefault(channel, deque()).append(_Item(subscription, message))
        self._channels.waiting.hold(message)
        self._waiting_bytes += message.size
        while self._waiting_bytes > _MOST_WAITING:
            longer = [c for c, items in self._waiting.items() if len(items) > 1]
            if not longer:
                break
            self._drop(max(longer, key=self._bytes_of))
        self.wake()

    def waits_since(self) -> float | None:
        """Return since when the oldest message waits (steady, s), None where none does."""
        return min((items[0].message.since for items in self._waiting.values()), default=None)

    def drop_oldest(self) -> None:
        """Lose the message that has waited for longest, also if no newer one of it waits."""
        channel = min(self._waiting, key=lambda c: self._waiting[c][0].message.since)
        self._drop(channel)
        if not self._waiting[channel]:
            del self._waiting[channel]

    def _bytes_of(self, channel: Channel) -> int:
        return sum(item.message.size for item in self._waiting[channel])

    def _drop(self, channel: Channel) -> None:
        self._let_go(self._waiting[channel].popleft().message)
        self._missing.add(channel)
        self._channels.dropped += 1

    def _let_go(self, message: _Message) -> None:
        self._waiting_bytes -= message.size
        self._channels.waiting.release(message)

    # For whoever sends.

    def take(self) -> str | tuple[bytes, ...] | None:
        """Return the next message for the client, None where nothing waits.

        Texts, or the parts of bytes. The one before has gone out by then.
        """
        self._channels.waiting.end(self)
        return self._take_news() or self._take_time() or self._take_data()

    def is_sent(self, load: Load) -> None:
        """Count a load beside the messages, until the next message is taken."""
        self._channels.waiting.end(self)
        self._channels.waiting.begin(self, load, self._cut_off)

    def _take_news(self) -> str | None:
        """Return the next news: of the server, of channels, of mistakes."""
        channels = self._channels
        if not self._is_greeted:
            self._is_greeted = True
            offered = {"tells_time": self.tells_time, "has_assets": channels.assets is not None}
            return server_info(channels.name, channels.session, **offered)
        with channels.lock:
            is_first, told = self._told is None, self._told or set()
            gone = told - channels.open.keys()
            if gone:
                self._told = told - gone
                return unadvertisement(gone)
            new = [c for number, c in channels.open.items() if number not in told]
            self._told = set(channels.open)
        if new or is_first:
            return advertisement(channel.info for channel in new)
        return status_error(self._errors.popleft()) if self._errors else None

    def _take_time(self) -> tuple[bytes] | None:
        now = time.monotonic()
        if not self.tells_time or now - self._time_at < TIME_PERIOD:
            return None
        self._time_at = now
        return (time_data(self._channels.clock()),)

    def _take_data(self) -> tuple[bytes, bytes] | None:
        """Return the next message of the channel that has waited longest for its turn."""
        channels = self._channels
        with channels.lock:
            channel = next(iter(self._waiting), None)
            item = None if channel is None else self._take_item(channel)
            asks = [each for each in self._missing if each not in self._waiting]
            for each in asks:
                self._missing.discard(each)
                each.ask(has_missed=True)
        if asks:
            channels.wanted()
        if item is None:
            return None
        message = item.message
        channels.waiting.begin(self, message, self._cut_off)
        channels.waiting.release(message)
        return message_data(item.subscription, message.time, message.data)

    def _take_item(self, channel: Channel) -> _Item:
        """Take the oldest message of a channel that is not too old, and have its turn be last."""
        items = self._waiting.pop(channel)
        self._waiting[channel] = items
        too_old = time.monotonic() - _LONGEST_WAIT
        while len(items) > 1 and items[0].message.since < too_old:
            self._drop(channel)
        item = items.popleft()
        self._waiting_bytes -= item.message.size
        if not items:
            del self._waiting[channel]
        self._channels.sent += 1
        return item
