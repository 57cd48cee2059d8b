"""The services: statuses, waiting for a stamp, limits, ownership. What they answer is elsewhere.

Queries read a snapshot and run side by side; changes of the scene run one after another. A query
that waits for poses gives its thread back meanwhile, so waiting can't stop the world, not even
under a single-threaded executor.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Generator
import time
import traceback
from typing import Any, Protocol

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.node import Node

from msg_adapters.diagnostics import effect_to_msg
from msg_adapters.errors import StaleError, UnavailableError
from msg_adapters.queries import Options, options_from_msg
from msg_adapters.stamps import duration_from_msg, stamp_from_msg, stamp_to_msg
from msg_adapters.status import ok_status, status_from_exception
from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_msgs.srv import ListEffects
from scene_graph_ros.node.edits import EDITS, Tools
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.names import default_pose_topic, service_name
from scene_graph_ros.node.queries import Asked, QUERIES
from scene_graph_ros.node.world import World, WorldSnapshot

__all__ = ["Services"]


class ServiceHost(Protocol):
    """What the node offers to its services."""

    node: Node

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""

    def scene_changed(self) -> None:
        """Follow a change of the scene: subscriptions, effects."""

    def pose_topics(self) -> dict[str, str]:
        """Return the absolute name of each source's pose topic."""

    def is_running(self) -> bool:
        """Tell whether poses are taken in at all."""


class _Pause:
    """Awaiting it lets the executor do other work and come back."""

    def __await__(self) -> Generator[None, None, None]:
        yield


class Services:
    """All services of the node."""

    def __init__(self, host: ServiceHost, world: World, effects: Effects, tools: Tools) -> None:
        self._host = host
        self._world = world
        self._effects = effects
        self._tools = tools
        self.requests: Counter[str] = Counter()
        self.refused: Counter[str] = Counter()
        queries, changes = ReentrantCallbackGroup(), MutuallyExclusiveCallbackGroup()
        self._services = [
            self._create(name, self._query_callback(name), queries) for name in QUERIES
        ]
        self._services += [
            self._create(name, self._edit_callback(name), changes) for name in EDITS
        ]
        self._services.append(self._create("ListEffects", self._list_effects, queries))

    def close(self) -> None:
        """Stop offering the services."""
        for service in self._services:
            self._host.node.destroy_service(service)
        self._services.clear()

    def _create(self, name: str, callback: Callable[..., Any], group: Any) -> Any:
        kind = getattr(scene_graph_msgs.srv, name)
        return self._host.node.create_service(
            kind, service_name(name), callback, callback_group=group
        )

    def _query_callback(self, name: str) -> Callable[..., Any]:
        query = QUERIES[name]

        async def answer(request: Any, response: Any) -> Any:
            try:
                snapshot = self._world.snapshot
                options = Options(({},), 0, (), 0, True)
                if hasattr(request, "options"):
                    snapshot = await self._new_enough(request.options)
                    options = options_from_msg(request.options, snapshot.names)
                begin = time.perf_counter()
                asked = Asked(
                    snapshot,
                    options,
                    self._host.parameter,
                    self._world.records,
                    self._host.pose_topics(),
                )
                count = len(options.configurations)
                asked.require("max_configurations_per_request", count, "configurations")
                query.handler(request, response, asked)
                self._finish(name, response, snapshot)
                if query.effect:
                    self._effects.record(query.effect, time.perf_counter() - begin)
            except Exception as error:  # noqa: BLE001 - every request is answered
                return self._refuse(name, type(response)(), error)
            return response

        return answer

    def _edit_callback(self, name: str) -> Callable[..., Any]:
        handler = EDITS[name]

        def answer(request: Any, response: Any) -> Any:
            try:
                if not self._host.parameter("allow_editing"):
                    raise UnavailableError("the parameter allow_editing is false")
                _, snapshot = self._world.edit(
                    lambda edit: handler(request, response, edit, self._tools)
                )
                self._host.scene_changed()
                if name == "RegisterSource":
                    response.pose_topic = self._pose_topic(response.source.name)
                self._finish(name, response, snapshot)
            except Exception as error:  # noqa: BLE001 - every request is answered
                return self._refuse(name, type(response)(), error)
            return response

        return answer

    def _pose_topic(self, source: str) -> str:
        record = self._world.records[source]
        topic = record.pose_topic or default_pose_topic(source, record.pose_type)
        return self._host.pose_topics().get(source) or str(
            self._host.node.resolve_topic_name(topic)
        )

    def _list_effects(self, request: Any, response: Any) -> ListEffects.Response:
        self.requests["ListEffects"] += 1
        response.status = ok_status()
        response.effects = [
            effect_to_msg(
                report.name,
                is_on=report.is_on,
                reason=report.reason,
                topics=report.topics,
                count=report.count,
                mean_seconds=report.mean_seconds,
                max_seconds=report.max_seconds,
            )
            for report in self._effects.reports()
        ]
        return response

    def _finish(self, name: str, response: Any, snapshot: WorldSnapshot) -> None:
        self.requests[name] += 1
        response.status = ok_status()
        response.scene_version = snapshot.scene_version
        if hasattr(response, "stamp"):
            response.stamp = stamp_to_msg(snapshot.stamp)

    def _refuse(self, name: str, response: Any, error: Exception) -> Any:
        self.requests[name] += 1
        response.status = status_from_exception(error)
        self.refused[name] += 1
        response.scene_version = self._world.snapshot.scene_version
        if response.status.code == Status.INTERNAL_ERROR:
            details = "".join(traceback.format_exception(error))
            self._host.node.get_logger().error(f"{name} failed:\n{details}")
        return response

    async def _new_enough(self, options: Any) -> WorldSnapshot:
        """Return a snapshot with the minimal stamp; raises StaleError where none comes in time."""
        minimal = stamp_from_msg(options.minimal_stamp)
        snapshot = self._world.snapshot
        for source in options.minimal_stamp_sources:
            snapshot.names.source_id(source)
        timeout = min(
            duration_from_msg(options.timeout) * 1e-9, float(self._host.parameter("max_wait"))
        )
        deadline = time.monotonic() + timeout
        while not _is_new_enough(snapshot, minimal, options.minimal_stamp_sources):
            if time.monotonic() >= deadline or not self._host.is_running():
                lag = (minimal - snapshot.stamp) * 1e-9
                raise StaleError(
                    f"minimal_stamp is {lag:.6f} s newer than the newest poses"
                    + (f", after {timeout:.3f} s of waiting" if timeout > 0.0 else "")
                )
            await _Pause()
            snapshot = self._world.snapshot
        return snapshot


def _is_new_enough(snapshot: WorldSnapshot, minimal: int, sources: list[str]) -> bool:
    if minimal <= 0:
        return True
    if not sources:
        return snapshot.stamp >= minimal
    return all(snapshot.source_stamps.get(source, 0) >= minimal for source in sources)
