"""The node as a real process, and a client of it, for tests over DDS on this machine."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import threading
from typing import Any
import weakref

from forked import ForkedProcess
import rclpy
from rclpy.client import Client as ServiceClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.subscription import Subscription
from spinning import DEADLINE, SpinningThread, wait_until
from transports import TRANSPORTS

from msg_adapters.stamps import stamp_from_msg
import scene_graph_msgs.srv

ROOT = Path(__file__).parents[2]
PATIENT = {"shutdown_timeout": 20.0}
"""Parameters of nodes in tests: on a busy machine an end in order may take its time."""

WITH_ITS_PARENT = ["setpriv", "--pdeathsig", "KILL", "--"]
"""Runs a command that is killed when the tests end, however: it would answer others' tests."""

CLIENT_DEPTH = 5000
"""Requests and answers that a client keeps; the default of ROS, 10, loses what is beyond."""


PATH_LISTS = ("AMENT_PREFIX_PATH", "LD_LIBRARY_PATH", "PYTHONPATH")
"""Variables of which a test's value goes before what is there; of others it counts alone."""


def environment(domain: int, extra: Mapping[str, str | None] | None = None) -> dict[str, str]:
    """Return the environment of a process on an isolated domain; None takes a variable away."""
    path = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    values = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(part for part in path if part),
        "PYTHONUNBUFFERED": "1",
        **TRANSPORTS,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_PYTHON_CHECK_FIELDS": "1",
    }
    for name, value in (extra or {}).items():
        if value is None:
            values.pop(name, None)
            continue
        before = values.get(name, "") if name in PATH_LISTS else ""
        values[name] = os.pathsep.join(part for part in (value, before) if part)
    return values


_started: list[tuple[int, subprocess.Popen[Any] | ForkedProcess]] = []


def kill_what_is_left(domain: int) -> None:
    """Kill the nodes that a failed test left in a domain: they would answer the next tests."""
    for where, process in list(_started):
        if where == domain:
            process.kill()
            process.wait()
            _started.remove((where, process))


_nodes: weakref.WeakSet[NodeProcess] = weakref.WeakSet()

LAST_LINES = 60
"""Lines of a node's output that a failed test shows."""


def outputs_of_nodes() -> str:
    """Return the last lines of each node that runs, as a failed test is to show them."""
    parts = []
    for node in _nodes:
        if node.is_alive():
            parts += [f"node {node.process.pid}:", *node.output().splitlines()[-LAST_LINES:]]
    return "\n".join(parts)


RUN_NODE = "from scene_graph_ros.node.main import main\nmain()"


class NodeProcess:
    """The node in a process of its own."""

    def __init__(
        self,
        domain: int,
        parameters: Mapping[str, Any] | None = None,
        *,
        remaps: Iterable[str] = (),
        extra_environment: Mapping[str, str | None] | None = None,
        program: str = RUN_NODE,
        fresh: bool = False,
    ) -> None:
        """Start it; ``program`` is what to run in place of the command, which it is to call.

        A ``fresh`` process is a new interpreter, as a user starts it: two seconds of imports.
        Others are forked from one that has these behind it, and the test workspace's libraries.
        What else the dynamic linker reads of the environment counts in a fresh one only.
        """
        arguments = ["--ros-args"]
        for name, value in {**PATIENT, **(parameters or {})}.items():
            text = str(value).lower() if isinstance(value, bool) else str(value)
            arguments += ["-p", f"{name}:={text}"]
        for remap in remaps:
            arguments += ["-r", remap]
        # Deleted with this object, which lives as long as the process.
        self._log = tempfile.NamedTemporaryFile("a+", suffix=".log")  # noqa: SIM115
        variables = environment(domain, extra_environment)
        self.process: subprocess.Popen[Any] | ForkedProcess
        if fresh:
            self.process = subprocess.Popen(
                [*WITH_ITS_PARENT, sys.executable, "-c", program, *arguments],
                env=variables,
                cwd=ROOT,
                stdout=self._log,
                stderr=subprocess.STDOUT,
            )
        else:
            self.process = ForkedProcess(program, arguments, variables, Path(self._log.name))
        _started.append((domain, self.process))
        _nodes.add(self)

    def output(self) -> str:
        """Return all that the process has printed so far."""
        # The last character may be there in part.
        return Path(self._log.name).read_text(errors="replace")

    def wait_for_output(self, text: str) -> None:
        """Wait until the process printed ``text``; fail at once where it ended before."""

        def printed() -> bool:
            if text in self.output():
                return True
            assert self.process.poll() is None, f"the node ended:\n{self.output()}"
            return False

        wait_until(printed, f"'{text}' in the node's output")

    def is_alive(self) -> bool:
        """Tell whether the process runs."""
        return self.process.poll() is None

    def stop(self, number: int = signal.SIGINT) -> int:
        """Send a signal, wait for the end and return the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(timeout=DEADLINE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise


class Listener:
    """Messages of one topic as they come."""

    def __init__(self, subscription: Any) -> None:
        self.subscription = subscription
        self.messages: deque[Any] = deque(maxlen=1000)
        self.count = 0
        self._lock = threading.Lock()

    def take(self, message: Any) -> None:
        """Keep a message."""
        with self._lock:
            self.count += 1
            self.messages.append(message)

    @property
    def newest(self) -> Any:
        """The newest message, or None."""
        return self.messages[-1] if self.messages else None

    def kept(self) -> list[Any]:
        """Return the messages that came so far; others may come meanwhile."""
        with self._lock:
            return list(self.messages)

    def wait_for(self, condition: Callable[[Any], Any], what: str) -> Any:
        """Return the first message, also of those that came already, that fulfils a condition."""
        seen = 0

        def found() -> Any:
            nonlocal seen
            with self._lock:
                new = list(self.messages)[-(self.count - seen) :] if self.count > seen else []
                seen = self.count
            return next((message for message in new if condition(message)), None)

        return wait_until(found, what)

    def wait_for_newest(self, condition: Callable[[Any], Any], what: str) -> Any:
        """Wait until the newest message fulfils a condition and return it."""
        return wait_until(lambda: (m := self.newest) is not None and condition(m) and m, what)


class Client:
    """A ROS node in this process that talks to the node under test."""

    def __init__(self, domain: int, node_name: str = "/scene_graph") -> None:
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("test_client", context=self.context)
        executor = SingleThreadedExecutor(context=self.context)
        executor.add_node(self.node)
        self._name = node_name
        self._clients: dict[str, Any] = {}
        self._spinning = SpinningThread(executor)

    def close(self) -> None:
        """End this node; fails where the thread that spins it failed."""
        try:
            self._spinning.close()
        finally:
            self.node.destroy_node()
            rclpy.shutdown(context=self.context)

    def run(self, task: Callable[[], Any], what: str) -> Any:
        """Do something in the thread that spins this node; return what it returns."""
        return self._spinning.run(task, what)

    def start_call(self, kind: Any, name: str, request: Any) -> Any:
        """Send a request and return the future of its response."""
        client = self._clients.get(name)
        if client is None:
            # Deep enough for the answers of as many requests as a test sends at once.
            qos = QoSProfile(depth=CLIENT_DEPTH)
            client = self._clients[name] = self.node.create_client(kind, name, qos_profile=qos)
        assert client.wait_for_service(DEADLINE), f"no service {name}: {self._servers(name)}"
        return client.call_async(request)

    def _servers(self, name: str) -> str:
        """Say who reads its requests and who writes responses: as many, where it is there."""
        readers = self.node.get_subscriptions_info_by_topic(f"rq{name}Request", no_mangle=True)
        writers = self.node.get_publishers_info_by_topic(f"rr{name}Reply", no_mangle=True)
        return (
            f"requests are read by {[end.node_name for end in readers]},"
            f" responses written by {[end.node_name for end in writers]}"
        )

    def call_any(self, kind: Any, name: str, request: Any) -> Any:
        """Call a service of any type and return the response."""
        future = self.start_call(kind, name, request)
        wait_until(future.done, f"a response of {name}")
        return future.result()

    def start(self, service: str, **fields: Any) -> Any:
        """Send a request to a service of the node; see ``call``."""
        kind = getattr(scene_graph_msgs.srv, service)
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in service).lstrip("_")
        return self.start_call(kind, f"{self._name}/{words}", kind.Request(**fields))

    def call(self, service: str, **fields: Any) -> Any:
        """Call the service of type ``service`` of the node and return the response."""
        future = self.start(service, **fields)
        wait_until(future.done, f"a response of {service}")
        return future.result()

    def listen(self, kind: Any, topic: str, qos: QoSProfile | int = 10) -> Listener:
        """Subscribe, and wait until the publisher is known."""
        name = topic if topic.startswith("/") else f"{self._name}/{topic}"
        listener = Listener(None)
        listener.subscription = self.node.create_subscription(kind, name, listener.take, qos)
        wait_until(lambda: self.node.count_publishers(name), f"a publisher of {name}")
        return listener

    def forget(self, listener: Listener) -> None:
        """Unsubscribe."""
        self.destroy(listener.subscription)

    def destroy(self, entity: Any) -> None:
        """Destroy a publisher, subscription or client, in the thread that waits for it."""
        destroyed_by = {
            Publisher: self.node.destroy_publisher,
            Subscription: self.node.destroy_subscription,
            ServiceClient: self.node.destroy_client,
        }
        destroy = destroyed_by[type(entity)]
        assert self._spinning.run(lambda: destroy(entity), f"end of {entity}"), f"no {entity}"

    def publisher(self, kind: Any, topic: str, *, best_effort: bool = False) -> Any:
        """Advertise a topic, and wait until somebody listens."""
        qos = QoSProfile(depth=100)
        if best_effort:
            qos.reliability = ReliabilityPolicy.BEST_EFFORT
        publisher = self.node.create_publisher(kind, topic, qos)
        wait_until(publisher.get_subscription_count, f"a subscriber of {topic}")
        return publisher

    def topics(self) -> set[str]:
        """Return the names of all topics that somebody advertises."""
        return {
            name
            for name, _ in self.node.get_topic_names_and_types()
            if self.node.count_publishers(name)
        }

    def now(self) -> Any:
        """Return the time as a message."""
        return self.node.get_clock().now().to_msg()


def diagnostics_values(message: Any, ending: str) -> dict[str, str]:
    """Return the values of the diagnostics entry whose name ends so."""
    for status in message.status:
        if status.name.endswith(ending):
            return {value.key: value.value for value in status.values}
    return {}


def diagnostics_from_now(client: Client, diagnostics: Listener) -> Any:
    """Return diagnostics of which all values were looked up after the call.

    A message gets its stamp after its values, so that the first one with a later stamp may have
    begun before the call; those that come in next may even have waited here since before.
    """
    now = stamp_from_msg(client.now())
    stamps: set[int] = set()

    def is_second(message: Any) -> bool:
        stamp = stamp_from_msg(message.header.stamp)
        if stamp > now:
            stamps.add(stamp)
        return len(stamps) > 1

    return diagnostics.wait_for(is_second, "diagnostics that begin now")


def is_same_message(a: Any, b: Any) -> bool:
    """Tell whether two messages are the same on the wire."""
    return bytes(serialize_message(a)) == bytes(serialize_message(b))
