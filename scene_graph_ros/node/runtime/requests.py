"""Threads that take the requests of services and answer them, one after another and side by side.

The executors of rclpy rebuild their wait set, with every service, timer and topic of the node, in
Python for each single callback; under load that is the longest part of an answer's time.
Here one thread waits, for the services alone. When a request comes it takes it, lets the next
thread wait, and answers the request itself: nothing is handed over.

There is a thread more than requests are answered at the same time. So one always waits, however
busy the others are, and takes requests out of the middleware, which silently throws away those
that it can't keep. Requests beyond the limit are refused.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
import math
import threading
import time
import traceback
from typing import Any

from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from msg_adapters.errors import TooLargeError
from msg_adapters.size import size_of
from scene_graph_ros.node.runtime.backlog import Backlog, Work
from scene_graph_ros.node.runtime.late_responses import LateResponses
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.own_threads import stop_at_exit
from scene_graph_ros.node.runtime.qos import service_qos

__all__ = ["Answer", "Refuse", "RequestLoop", "Respond"]

Respond = Callable[[Any], None]
"""Sends the response of one request; from any thread, now or later."""

Answer = Callable[[Any, Respond], None]
"""Answers a request."""

Refuse = Callable[[Exception], Any]
"""Returns the response to a request that is not answered, and why."""

_TAKEN_AT_ONCE = 64
"""Requests taken from one service before the others have their turn."""

_MOST_BYTES = 2**28
"""Of requests that wait: a quarter of a gigabyte, ten of the largest by the default limits."""

_PAUSE_AFTER_ERROR = 0.1
"""Seconds, so that a fault which stays does not keep a core busy."""

_FOREVER = -1
"""Nanoseconds that mean to wait without end."""

_NO_ALARM: tuple[float, Callable[[], None]] = (math.inf, lambda: None)


@dataclass(frozen=True)
class _Offer:
    """A service and its answer; of the exclusive ones one request at a time is answered."""

    service: Any
    name: str
    answer: Answer
    refuse: Refuse
    is_exclusive: bool


def _never(request: Any, response: Any) -> Any:
    raise AssertionError("threads of their own take these requests")


class RequestLoop:
    """Answers requests of services in threads of its own."""

    def __init__(self, node: Node, *, threads: int, most_waiting: Callable[[], int]) -> None:
        """Answer as many requests side by side as there are ``threads``.

        Of others ``most_waiting`` wait at most.
        """
        self._node, self._count = node, threads + 1
        self._group = OwnThreadGroup()
        self._offers: list[_Offer] = []
        self._backlog = Backlog(
            at_once=threads, most_requests=most_waiting, most_bytes=_MOST_BYTES
        )
        self._turn = threading.Lock()
        self._lock = threading.Lock()
        self._alarm = _NO_ALARM
        self._guard: GuardCondition | None = None
        self._held = ExitStack()
        self._late = LateResponses(partial(node.get_logger().warning, throttle_duration_sec=1.0))
        self._threads: list[threading.Thread] = []
        self._is_stopped = True

    def offer(
        self,
        kind: Any,
        name: str,
        answer: Answer,
        *,
        refuse: Refuse,
        is_exclusive: bool = False,
    ) -> None:
        """Offer a service, before the start; only one exclusive request is answered at a time."""
        service = self._node.create_service(
            kind, name, _never, qos_profile=service_qos(), callback_group=self._group
        )
        self._offers.append(_Offer(service, service.service_name, answer, refuse, is_exclusive))

    def start(self) -> None:
        """Begin to take requests."""
        self._is_stopped = False
        context = self._node.context
        self._guard = GuardCondition(None, None, context=context)
        # What is held is not destroyed meanwhile, whoever asks for that.
        self._held.enter_context(context.handle)
        self._held.enter_context(self._guard.handle)
        for offer in self._offers:
            self._held.enter_context(offer.service.handle)
        count = len(self._offers)
        self._wait_set = rclpy_implementation.WaitSet(0, 1, 0, 0, count, 0, context.handle)
        context.on_shutdown(self._wake)
        stop_at_exit(self, RequestLoop.close)
        # Daemons that are stopped at exit: a program which forgets to destroy its node can end.
        self._threads = [
            threading.Thread(target=self._run, name=f"requests {i}", daemon=True)
            for i in range(self._count)
        ]
        for thread in self._threads:
            thread.start()

    def post(self, task: Callable[[], None]) -> None:
        """Have something done in one of the threads; safe from any thread."""
        self._backlog.add(task)
        self._wake()

    def set_alarm(self, at: float, task: Callable[[], None]) -> None:
        """Have something done once at a steady time (s), in place of the task set before."""
        with self._lock:
            self._alarm = (at, task)
        self._wake()

    def close(self) -> None:
        """Stop offering the services, after the requests that are being answered."""
        self._is_stopped = True
        self._wake()
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join()
        with self._lock:
            self._held.close()
            if self._guard is not None:
                self._guard.destroy()
                self._guard = None
        self._late.close()
        for offer in self._offers:
            self._node.destroy_service(offer.service)
        self._offers.clear()

    def _wake(self) -> None:
        with self._lock:
            if self._guard is not None:
                self._guard.trigger()

    def _is_running(self) -> bool:
        return not self._is_stopped and bool(self._node.context.ok())

    def _run(self) -> None:
        while self._is_running():
            try:
                work = self._backlog.take() or self._next()
                if work is not None:
                    self._do(work)
            except Exception:  # noqa: BLE001 - the node survives its own fault, and says so
                if self._is_running():
                    self._node.get_logger().error(
                        f"answering a request failed:\n{traceback.format_exc()}",
                        throttle_duration_sec=1.0,
                    )
                    time.sleep(_PAUSE_AFTER_ERROR)

    def _do(self, work: Work) -> None:
        try:
            work.do()
        finally:
            self._backlog.done(work)

    def _next(self) -> Work | None:
        """Wait until there is something to do; None at the end. One thread at a time waits."""
        with self._turn:
            while self._is_running():
                work = self._backlog.take()
                if work is not None:
                    return work
                if not self._is_alarm_over():
                    self._wait()
        # The others are to see the end, too.
        self._wake()
        return None

    def _is_alarm_over(self) -> bool:
        """Add the alarm's task to the others, and return True, where its time has come."""
        alarm = self._alarm
        if time.monotonic() < alarm[0]:
            return False
        with self._lock:
            # Unless another was set meanwhile.
            if self._alarm is alarm:
                self._alarm = _NO_ALARM
        self._backlog.add(alarm[1])
        return True

    def _wait(self) -> None:
        """Wait for requests, the alarm or a call of ``_wake``; take the requests."""
        wait_set, guard = self._wait_set, self._guard
        assert guard is not None
        wait_set.clear_entities()
        wait_set.add_guard_condition(guard.handle)
        offers = {}
        for offer in self._offers:
            handle = offer.service.handle
            wait_set.add_service(handle)
            offers[handle.pointer] = offer
        wait_set.wait(_nanoseconds_until(self._alarm[0]))
        for pointer in wait_set.get_ready_entities("service"):
            self._take(offers[pointer])

    def _take(self, offer: _Offer) -> None:
        service = offer.service
        for _ in range(_TAKEN_AT_ONCE):
            request, header = service.handle.service_take_request(service.srv_type.Request)
            if header is None:
                return
            respond = partial(self._respond, offer, header)
            answer = partial(offer.answer, request, respond)
            try:
                self._backlog.add_request(
                    answer, partial(size_of, request), is_exclusive=offer.is_exclusive
                )
            except TooLargeError as error:
                respond(offer.refuse(error))

    def _respond(self, offer: _Offer, header: Any, response: Any) -> None:
        self._late.send(offer.name, partial(offer.service.send_response, response, header))


def _nanoseconds_until(at: float) -> int:
    if at == math.inf:
        return _FOREVER
    return max(int((at - time.monotonic()) * 1e9) + 1, 0)
