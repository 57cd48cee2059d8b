"""The thread that takes poses and updates the world, as soon as poses arrive but not too often.

It waits for pose topics, and events of topics, in a wait set of its own: the executors of rclpy
rebuild theirs, with every service and timer of the node, for each single callback, and wake for
each message of a topic whose events they wait for. So the loop's topics are in a callback group
that gives executors nothing to do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
import contextlib
from contextlib import ExitStack
import threading
import time
import traceback
from typing import Any, Protocol

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.runtime.precedence import Precedence

__all__ = ["OwnThreadGroup", "Topic", "UpdateLoop"]

_TAKEN_AT_ONCE = 64
"""Messages taken from one topic before the others have their turn."""

_PAUSE_AFTER_ERROR = 0.1
"""Seconds, so that a fault which stays does not keep a core busy."""


class OwnThreadGroup(MutuallyExclusiveCallbackGroup):
    """Keeps executors away from objects that other threads wait for."""

    def add_entity(self, entity: Any) -> None:
        """Remember nothing: a list of entities would grow as long as the node runs."""

    def can_execute(self, entity: Any) -> bool:
        """Tell whether an executor may wait for ``entity``: never."""
        return False


class Topic(Protocol):
    """A topic that the loop takes messages from."""

    subscription: Any

    def counts(self, data: bytes) -> bool:
        """Tell whether a message is new; one that is not is dropped."""

    def store(self, data: bytes, arrival: int) -> None:
        """Keep a message that arrived at a steady time (ns) for the next update."""


class UpdateLoop:
    """Calls ``update`` in its own thread, by a steady clock."""

    def __init__(
        self,
        node: Node,
        group: OwnThreadGroup,
        update: Callable[[], None],
        *,
        topics: Callable[[], Iterable[Topic]],
        max_rate: Callable[[], float],
        min_rate: Callable[[], float],
        precedence: Precedence,
        name: str = "world",
        received: Callable[[], Callable[[Topic, bytes], None] | None] = lambda: None,
    ) -> None:
        """Update at ``max_rate`` at most while poses arrive, else at ``min_rate``, in Hz.

        Messages are taken from ``topics()``; events of all entities of ``group`` are handled. The
        thread calls ``topics`` at its start and when they changed, and waits for nothing then: so
        entities of the group are made and destroyed there, and nowhere else while it runs. It has
        ``precedence`` but while it waits, and is called ``name``. The function that ``received()``
        returns, asked when the topics changed, is told of each message before its topic is.
        """
        self._node, self._group = node, group
        self._update = update
        self._topics = topics
        self._max_rate, self._min_rate = max_rate, min_rate
        self._precedence, self._name = precedence, name
        self._received = received
        self._tell: Callable[[Topic, bytes], None] | None = None
        self._lock = threading.Lock()
        self._guard: GuardCondition | None = None
        self._thread: threading.Thread | None = None
        self._is_stopped = True
        self._have_topics_changed = True
        self._is_wanted = False
        self._last = float("-inf")
        node.context.on_shutdown(self._wake)
        stop_at_exit(self, UpdateLoop.stop)

    def request(self) -> None:
        """Ask for an update as soon as the largest rate allows; safe from any thread."""
        self._is_wanted = True
        self._wake()

    def topics_changed(self) -> None:
        """Ask for the topics again, and wait for the events there are; safe from any thread."""
        self._have_topics_changed = True
        self._wake()

    def start(self) -> None:
        """Begin to take poses and to update."""
        self._is_stopped = False
        self._guard = GuardCondition(None, None, context=self._node.context)
        # A daemon that is stopped at exit: a program which forgets to destroy its node can end.
        self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread, after the update that it is at."""
        self._is_stopped = True
        self._wake()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        with self._lock:
            if self._guard is not None:
                self._guard.destroy()
                self._guard = None

    def _wake(self) -> None:
        with self._lock:
            if self._guard is not None:
                self._guard.trigger()

    def _is_running(self) -> bool:
        return not self._is_stopped and bool(self._node.context.ok())

    def _are_topics_current(self) -> bool:
        return not self._have_topics_changed

    def _run(self) -> None:
        guard = self._guard
        assert guard is not None
        while self._is_running():
            try:
                self._have_topics_changed = False
                topics = list(self._topics())
                self._tell = self._received()
                with self._precedence.taken():
                    self._serve(topics, guard)
            except Exception:  # noqa: BLE001 - the node survives its own fault, and says so
                if self._is_running():
                    self._node.get_logger().error(
                        f"the {self._name}'s thread failed:\n{traceback.format_exc()}",
                        throttle_duration_sec=1.0,
                    )
                    time.sleep(_PAUSE_AFTER_ERROR)

    def _serve(self, topics: list[Topic], guard: GuardCondition) -> None:
        """Take messages and update until the topics change or the end comes."""
        context = self._node.context
        with ExitStack() as held:
            # What is held is not destroyed meanwhile, whoever asks for that.
            held.enter_context(context.handle)
            held.enter_context(guard.handle)
            by_pointer = {}
            for topic in topics:
                handle = topic.subscription.handle
                held.enter_context(handle)
                by_pointer[handle.pointer] = topic
            events = [w for w in self._node.waitables if w.callback_group is self._group]
            for event in events:
                held.enter_context(event)
            wait_set = rclpy_implementation.WaitSet(
                len(topics), 1, 0, 0, 0, len(events), context.handle
            )
            while self._is_running() and self._are_topics_current():
                wait = self._update_if_due()
                if wait <= 0.0:
                    continue
                wait_set.clear_entities()
                wait_set.add_guard_condition(guard.handle)
                for topic in topics:
                    wait_set.add_subscription(topic.subscription.handle)
                for event in events:
                    event.add_to_wait_set(wait_set)
                with self._precedence.left():
                    wait_set.wait(int(wait * 1e9) + 1)
                taken = wait_set.get_ready_entities("subscription")
                for pointer in taken:
                    self._take(by_pointer[pointer])
                if taken:
                    # Before events, which are rare and many to look at.
                    self._update_if_due()
                for event in events:
                    # What came before may have destroyed this one.
                    if not self._are_topics_current():
                        break
                    if event.is_ready(wait_set):
                        _handle(event)

    def _take(self, topic: Topic) -> None:
        subscription = topic.subscription
        for _ in range(_TAKEN_AT_ONCE):
            taken = subscription.handle.take_message(subscription.msg_type, True)
            if taken is None:
                return
            if not topic.counts(taken[0]):
                continue
            if self._tell is not None:
                self._tell(topic, taken[0])
            topic.store(taken[0], time.monotonic_ns())
            self._is_wanted = True

    def _due(self) -> float:
        """Return the steady time of the next update in seconds."""
        rate = self._max_rate() if self._is_wanted else self._min_rate()
        return self._last + 1.0 / rate

    def _update_if_due(self) -> float:
        """Update if it is time to; return how many seconds it was too early, 0 or less if not."""
        now = time.monotonic()
        wait = self._due() - now
        if wait <= 0.0:
            # Cleared first: what is asked for during the update is done by the next one.
            self._is_wanted = False
            self._last = now
            self._update()
        return wait


def _handle(event: Any) -> None:
    """Call back for an event of a topic; its callbacks await nothing."""
    handling = event.execute(event.take_data())
    with contextlib.suppress(StopIteration):
        handling.send(None)
        raise AssertionError("an event's callback waits")
