"""One node's services and topics, asked for and waited for in the thread that calls."""

from __future__ import annotations

from collections.abc import Callable
import contextlib
import itertools
import os
import threading
import time
from typing import Any

import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from scene_graph_msgs import srv
from scene_graph_msgs.msg import Status

__all__ = ["Connection", "WorldError", "service_names"]

_numbers = itertools.count(1)
_AGAIN = 0.2
"""Seconds until a node that is not ready yet is asked again."""

_ON_THE_WAY = 1.0
"""Seconds for which a message may be on its way."""
_CODES = {
    getattr(Status, name): name
    for name in dir(Status)
    if name.isupper() and isinstance(getattr(Status, name), int)
}


class WorldError(RuntimeError):
    """A request was not answered, or refused; ``code`` is the name of the status.

    Codes are those of ``scene_graph_msgs/Status``, or "TIMEOUT" where nobody answered.
    """

    def __init__(self, message: str, code: str = "TIMEOUT") -> None:
        super().__init__(message)
        self.code = code


def service_names(kind: str) -> str:
    """Return the name of a service by its type, ``AttachFrame``: ``attach_frame``."""
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in kind).removeprefix("_")


class Connection:
    """A node of its own, which a thread spins, so that any thread may wait for answers.

    It has the context of ``node`` and its namespace, so calls are fine inside of callbacks, too.
    """

    def __init__(
        self, node: Node | None, name: str, namespace: str | None, timeout: float
    ) -> None:
        self.timeout = timeout
        self._own_context = node is None
        context = rclpy.context.Context() if node is None else node.context
        if node is None:
            rclpy.init(context=context)
        where = namespace if namespace is not None else node.get_namespace() if node else "/"
        self.node = rclpy.create_node(
            f"scene_graph_client_{os.getpid()}_{next(_numbers)}",
            namespace=where,
            context=context,
            start_parameter_services=False,
            enable_rosout=False,
        )
        space = self.node.get_namespace().rstrip("/")
        self.target = name if name.startswith("/") else f"{space}/{name}"
        self._clients: dict[str, Any] = {}
        self._changed = threading.Condition()
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        # Whose context it is may end it.
        with contextlib.suppress(ExternalShutdownException):
            self._executor.spin()

    def close(self) -> None:
        """End. May be called again."""
        if self._thread.is_alive():
            self._executor.shutdown()
            self._thread.join()
        self.node.destroy_node()
        if self._own_context:
            self.node.context.try_shutdown()

    def notify(self) -> None:
        """Wake waiting threads: something has come."""
        with self._changed:
            self._changed.notify_all()

    def wait(self, condition: Callable[[], Any], what: str, timeout: float | None = None) -> Any:
        """Wait until ``condition`` is true, and return its value. Raises WorldError in time."""
        seconds = self.timeout if timeout is None else timeout
        end = time.monotonic() + seconds
        with self._changed:
            while not (value := condition()):
                left = end - time.monotonic()
                if left <= 0.0:
                    raise WorldError(f"{what} did not come within {seconds:g} s")
                self._changed.wait(min(left, 0.05))  # the graph of ROS wakes nobody
        return value

    def in_thread(self, function: Callable[[], Any]) -> Any:
        """Call a function in the thread that takes messages, and return its result.

        Where rclpy sends first and takes note afterwards, as with goals of actions,
        an answer that is faster is not taken for one in another thread.
        """
        task = self._executor.create_task(function)
        task.add_done_callback(lambda _: self.notify())
        self.wait(task.done, "the thread of the client")
        return task.result()

    def client(self, kind: Any, name: str, timeout: float | None = None) -> Any:
        """Return the client of a service that is there. Raises WorldError."""
        full = name if name.startswith("/") else f"{self.target}/{name}"
        if full not in self._clients:
            self._clients[full] = self.node.create_client(kind, full)
        client = self._clients[full]
        seconds = self.timeout if timeout is None else timeout
        try:
            self.wait(client.service_is_ready, full, seconds)
        except WorldError:
            raise WorldError(f"{self.absence(seconds)} (asked for {full})") from None
        return client

    def absence(self, seconds: float) -> str:
        """Say that the node is not there, and which are."""
        ending, found = "/describe_scene", []
        for name, types in self.node.get_service_names_and_types():
            if name.endswith(ending) and "scene_graph_msgs/srv/DescribeScene" in types:
                found.append(name.removesuffix(ending))
        domain = os.environ.get("ROS_DOMAIN_ID", "0")
        others = f"there is {', '.join(sorted(found))}" if found else "there is none"
        return (
            f"no node {self.target} answered within {seconds:g} s: in ROS_DOMAIN_ID {domain}"
            f" {others}. Remedy: start one, or give name and namespace of the one there is"
        )

    def call(self, kind: Any, name: str, request: Any, timeout: float | None = None) -> Any:
        """Return the response of any service. Raises WorldError."""
        client = self.client(kind, name, timeout)
        future = client.call_async(request)
        future.add_done_callback(lambda _: self.notify())
        try:
            self.wait(future.done, f"the answer of {client.srv_name}", timeout)
        except BaseException:
            client.remove_pending_request(future)
            raise
        return future.result()

    def ask(self, kind: str, *, timeout: float | None = None, **fields: Any) -> Any:
        """Return the response of one of the node's own services, by its type.

        Raises WorldError with the node's sentence for a refusal.
        """
        service = getattr(srv, kind)

        def asked() -> Any:
            request = service.Request(**fields)
            response = self.call(service, service_names(kind), request, timeout)
            check(response.status, service_names(kind))
            return response

        return self.patiently(asked, timeout)

    def patiently(self, question: Callable[[], Any], timeout: float | None = None) -> Any:
        """Return an answer; again while the node says "not yet", as it compiles kernels.

        Also for a second while the node's states of the robots are old: those just sent, on
        another topic, may come after the question. Raises WorldError for every other refusal, and
        after the timeout.
        """
        begin = time.monotonic()
        end = begin + (self.timeout if timeout is None else timeout)
        while True:
            try:
                return question()
            except WorldError as error:
                now = time.monotonic()
                is_later = error.code == "UNAVAILABLE" and ": not yet: " in str(error)
                is_later |= error.code == "STALE" and now < begin + _ON_THE_WAY
                if not is_later or now > end:
                    raise
            time.sleep(_AGAIN)


def check(status: Any, what: str) -> None:
    """Raise WorldError unless a status is OK."""
    if status.code != Status.OK:
        code = _CODES.get(status.code, str(status.code))
        raise WorldError(f"{what}: {code}: {status.message}", code)
