"""Record the inputs and outputs of a running node: `python -m scene_graph_ros.record FOLDER`.

It listens beside the node, so the recording begins when it is asked for, and can be published
again. The world's beginning is not in it, so it can't be checked: that takes the node's parameter
`record`.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
import signal
import sys
import threading
import time
from typing import Any, NamedTuple

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from msg_adapters.message_classes import class_of_kind, UnknownKindError
from scene_graph_ros.node.recording.events import encode, EVENTS, VERSION
from scene_graph_ros.node.recording.spool import Spool
from scene_graph_ros.node.runtime.names import NODE_NAME
from scene_graph_ros.node.runtime.parameters import defaults

__all__ = ["main"]

_LOOK_PERIOD = 0.5
"""Seconds between two looks at the topics that there are."""

_KEY_PERIOD = 5.0
"""Seconds between whole scenes, where a viewer can begin."""

_QUIET = 0.3
"""Seconds without a message after which no more is on its way, where it is to end."""

_LONGEST_END = 1.5
"""Seconds that it goes on at most after it was told to end."""

_DEPTH = 100
_MARKERS = "visualization_msgs/msg/MarkerArray"
_PIXELS = frozenset(
    f"sensor_msgs/msg/{name}" for name in ("Image", "CompressedImage", "PointCloud2", "CameraInfo")
)
_NOT_ITS_OWN = frozenset({"/rosout", "/parameter_events", "/clock"})
"""Topics of all nodes, which are left out, as are hidden ones: those of actions."""


class _Topic(NamedTuple):
    name: str
    kind: str
    is_output: bool


class _Listener:
    """Subscribes to a node's topics as they come, and hands their messages to a spool."""

    def __init__(self, node: Node, spool: Spool, target: str, *, cameras: bool) -> None:
        self._node, self._spool, self._cameras = node, spool, cameras
        space, _, self._target = target.rpartition("/")
        self._space = space or "/"
        self._heard: dict[_Topic, Any] = {}
        self._keys: list[Any] = []
        self._key_at = time.monotonic() + _KEY_PERIOD
        self._heard_at = 0.0

    def counts(self) -> tuple[int, int]:
        """Return the numbers of recorded topics and of their publishers."""
        heard = [each for each in self._heard.values() if each is not None]
        return len(heard), sum(each.get_publisher_count() for each in heard)

    def look(self) -> None:
        """Follow the topics that the node has now."""
        for topic in self._topics():
            if topic not in self._heard:
                self._heard[topic] = self._try(topic)
        now = time.monotonic()
        if now >= self._key_at:
            self._key_at = now + _KEY_PERIOD
            self._ask_for_keys()

    def _topics(self) -> Iterator[_Topic]:
        if (self._target, self._space) not in self._node.get_node_names_and_namespaces():
            return
        where = self._target, self._space
        out = self._node.get_publisher_names_and_types_by_node(*where)
        into = self._node.get_subscriber_names_and_types_by_node(*where)
        published = {name for name, _ in out}
        for name, kinds in (*out, *into):
            is_pixels = kinds[0] in _PIXELS and "/cameras/" in name
            is_hidden = name in _NOT_ITS_OWN or "/_" in name
            if not is_hidden and (self._cameras or not is_pixels):
                yield _Topic(name, kinds[0], name in published)

    def _try(self, topic: _Topic) -> Any:
        """Subscribe; None, and a word about it, for messages that are not installed here."""
        try:
            return self._subscribe(topic)
        except UnknownKindError as error:
            sys.stderr.write(f"record: {topic.name} can't be recorded: {error}\n")
            return None

    def _subscribe(self, topic: _Topic) -> Any:
        offered = self._node.get_publishers_info_by_topic(topic.name)
        profile = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)
        if offered and all(
            each.qos_profile.reliability == ReliabilityPolicy.RELIABLE for each in offered
        ):
            profile.reliability = ReliabilityPolicy.RELIABLE
        as_offered = QoSProfile(depth=_DEPTH)
        if any(
            each.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered
        ):
            as_offered.durability = DurabilityPolicy.TRANSIENT_LOCAL
        qos = as_offered if topic.is_output else None

        def take(data: bytes) -> None:
            self._heard_at = time.monotonic()
            self._spool.put(topic.name, topic.kind, data, qos=qos)

        kind = class_of_kind(topic.kind)
        return self._node.create_subscription(kind, topic.name, take, profile, raw=True)

    def await_quiet(self) -> None:
        """Wait for messages on their way: until none comes for a moment, or for too long."""
        end = time.monotonic() + _LONGEST_END
        self._heard_at = time.monotonic()
        while (now := time.monotonic()) < min(end, self._heard_at + _QUIET):
            time.sleep(min(end, self._heard_at + _QUIET) - now)

    def _ask_for_keys(self) -> None:
        """Match the markers once more: the node then tells everybody the whole scene."""
        for subscription in self._keys:
            self._node.destroy_subscription(subscription)
        self._keys = [
            self._node.create_subscription(
                class_of_kind(topic.kind), topic.name, _ignore, QoSProfile(depth=1), raw=True
            )
            for topic, subscription in self._heard.items()
            if subscription is not None and topic.kind == _MARKERS and topic.is_output
        ]


def _ignore(data: bytes) -> None:
    """Leave it to the subscription that records it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Record until SIGINT or SIGTERM; return the exit code, as ``--help`` says them."""
    options = _parser().parse_args(arguments)
    target = "/" + options.node.strip("/")
    ending = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ending.set())
    try:
        events = EVENTS.replace("~", target)
        spool = Spool(Path(options.folder), events, options.max_bytes, _tell)
    except OSError as error:
        sys.stderr.write(f"record: {error}\n")
        return 2
    spool.put(events, "std_msgs/msg/String", encode("attached", version=VERSION, node=target))
    _record(spool, target, options.cameras, ending)
    spool.close()
    sys.stdout.write(f"{spool.written} messages in {options.folder}, {spool.dropped} dropped\n")
    if spool.failure:
        return 4
    if spool.end:
        _tell(spool.end)
    return 1 if spool.end else 0


def _tell(problem: str) -> None:
    sys.stderr.write(f"record: {problem}\n")


def _record(spool: Spool, target: str, cameras: bool, ending: threading.Event) -> None:
    context = rclpy.Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node("scene_graph_record", context=context, start_parameter_services=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    listener = _Listener(node, spool, target, cameras=cameras)
    spinning = threading.Thread(target=executor.spin, name="messages", daemon=True)
    spinning.start()
    told = -1, -1
    try:
        while spool.is_open:
            listener.look()
            if listener.counts() != told:
                told = topics, publishers = listener.counts()
                what = f"waiting for {target}"
                if topics:
                    what = f"recording {topics} topics of {target}, from {publishers} publishers"
                sys.stdout.write(what + "\n")
                sys.stdout.flush()
            if ending.wait(_LOOK_PERIOD):
                listener.await_quiet()
                break
    finally:
        executor.shutdown()
        spinning.join()
        node.destroy_node()
        rclpy.shutdown(context=context)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m scene_graph_ros.record",
        description="Record what a running node takes in and puts out, until it is interrupted.",
        epilog="Exit code 1: it reached --max-bytes; 2: it could not begin; 4: the disk is full, "
        "or the folder was removed.",
    )
    parser.add_argument("folder", metavar="FOLDER", help="where to; must not be there yet")
    parser.add_argument(
        "--node", default=f"/{NODE_NAME}", help="absolute name of the node (default: %(default)s)"
    )
    parser.add_argument(
        "--cameras", action="store_true", help="also images and clouds, which are most of it"
    )
    parser.add_argument(
        "--max-bytes",
        type=int,
        default=defaults()["record_max_bytes"],
        help="size at which it ends (default: %(default)s)",
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())
