"""The services: statuses, waiting for a stamp, limits, ownership. Their answers are elsewhere.

Queries read a snapshot and run side by side; changes of the scene run one after another. A query
that waits for poses gives its thread back meanwhile, so waiting can't stop the world and costs
nothing. All of them run in threads of their own, apart from the executor of the node.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import nullcontext
from functools import partial
import time
import traceback
from typing import Any, Protocol, TYPE_CHECKING

from rclpy.node import Node

from msg_adapters.diagnostics import effect_to_msg
from msg_adapters.errors import StaleError, TooLargeError, UnavailableError
from msg_adapters.queries import NO_OPTIONS
from msg_adapters.stamps import stamp_to_msg
from msg_adapters.status import ok_status, status_from_exception
from scene_graph_msgs.msg import Status
import scene_graph_msgs.srv
from scene_graph_msgs.srv import ListEffects
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.effects.manager import Effects
from scene_graph_ros.node.runtime.garbage_collection import at_rest
from scene_graph_ros.node.runtime.names import service_name
from scene_graph_ros.node.runtime.requests import Answer, RequestLoop, Respond
from scene_graph_ros.node.services.bodies import prepare
from scene_graph_ros.node.services.plan_action import PlanAction
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.services.request_counts import RequestCounts
from scene_graph_ros.node.services.waiting import PendingAnswer, PoseRequirement, Waiting
from scene_graph_ros.node.world.edits import EDITS, Tools
from scene_graph_ros.node.world.handles import Handle
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.scene import Edit
from scene_graph_ros.node.world.world import World, WorldSnapshot

if TYPE_CHECKING:
    from scene_graph_ros.node.recording.recorder import Recorder
    from scene_graph_ros.node.world.kept_regions import KeptRegions

__all__ = ["Services"]


_LARGE_EDITS = {"LoadScene"}
"""Those that make so many objects that the garbage collector had better rest meanwhile; after a
small one it would have more to look through at once than it has otherwise."""


class ServiceHost(Protocol):
    """The node as its services see it."""

    node: Node
    recorder: Recorder | None

    def parameter(self, name: str) -> Any:
        """Return the value of a parameter of the node."""

    def scene_changed(self) -> None:
        """Follow a change of the scene: subscriptions, effects."""

    def pose_topics(self, snapshot: WorldSnapshot) -> dict[str, str]:
        """Return the absolute name of each source's pose topic."""

    def configuration_topics(self, snapshot: WorldSnapshot) -> dict[str, str]:
        """Return the absolute name of the topic of each source with deformable geometry."""

    def regions(self) -> KeptRegions:
        """Return the kept regions, made when they are first asked for."""

    def is_running(self) -> bool:
        """Tell whether poses are taken in at all."""

    def lack_of_kernels(self, group: str) -> str:
        """Return a sentence about a group's kernels that are not ready; "" where they are."""


class Services:
    """All services of the node."""

    def __init__(self, host: ServiceHost, world: World, effects: Effects, tools: Tools) -> None:
        self._host = host
        self._world = world
        self._effects = effects
        self._tools = tools
        self.counts = RequestCounts()
        self._loop = RequestLoop(
            host.node,
            threads=host.parameter("service_threads"),
            most_waiting=lambda: host.parameter("max_waiting_requests"),
        )
        self._waiting = Waiting(
            world,
            host.is_running,
            post=self._loop.post,
            set_alarm=self._loop.set_alarm,
        )
        for name in QUERIES:
            self._offer(name, self._query_callback(name))
        for name in EDITS:
            self._offer(name, self._at_once(name, self._edit_callback(name)), is_exclusive=True)
        self._offer("ListEffects", self._at_once("ListEffects", self._list_effects))
        self.plans = PlanAction(
            host,
            world,
            self._loop,
            refuse=self._refuse,
            answered=self._plan_answered,
            text=self._tools.scene_text,
        )
        self._loop.start()

    def end_waiting(self) -> None:
        """Answer all requests that wait, here and now: the threads may be about to end."""
        self._waiting.close()

    def close(self) -> None:
        """Stop offering the services."""
        self.plans.close()
        self._loop.close()
        self.plans.destroy()

    def _offer(self, name: str, answer: Answer, *, is_exclusive: bool = False) -> None:
        kind = getattr(scene_graph_msgs.srv, name)
        self._loop.offer(
            kind,
            service_name(name),
            answer,
            refuse=lambda error: self._refuse(name, kind.Response(), error),
            is_exclusive=is_exclusive,
        )

    @staticmethod
    def _at_once(name: str, callback: Callable[[Any, Any], Any]) -> Answer:
        """Turn a function that fills a response into an answer to requests."""
        kind = getattr(scene_graph_msgs.srv, name)
        return lambda request, respond: respond(callback(request, kind.Response()))

    def _query_callback(self, name: str) -> Answer:
        kind = getattr(scene_graph_msgs.srv, name)

        def answer(request: Any, respond: Respond) -> None:
            try:
                scope = self._scope(request)
                requirement = self._unmet_requirement(scope)
                if requirement is not None and not self._can_wait(requirement):
                    raise _stale(requirement, scope.snapshot)
            except Exception as error:  # noqa: BLE001 - every request is answered
                respond(self._refuse(name, kind.Response(), error))
                return
            if requirement is None:
                respond(self._answer(name, request, scope))
            else:
                late_answer = partial(self._answer_later, name, request)
                self._wait(name, PendingAnswer(requirement, late_answer, respond))

        return answer

    def _scope(self, request: Any) -> QueryScope:
        """Return the base of an answer now. Raises the errors of ``options_from_msg``."""
        scope = QueryScope(
            self._world.snapshot,
            NO_OPTIONS,
            self._host.parameter,
            self._host.pose_topics,
            self._host.configuration_topics,
            self._host.regions,
            self._tools.scene_text,
        )
        scope.read_options(request)
        return scope

    def _can_wait(self, requirement: PoseRequirement) -> bool:
        return requirement.seconds > 0.0 and self._host.is_running()

    def _wait(self, name: str, pending: PendingAnswer) -> None:
        """Answer later, or refuse where too many wait for poses already."""
        limit = self._host.parameter("max_waiting_requests")
        if not self._waiting.add(pending, limit):
            error = TooLargeError(
                f"{limit} requests wait for poses already, and max_waiting_requests is {limit}"
            )
            pending.send(self._refuse(name, getattr(scene_graph_msgs.srv, name).Response(), error))

    def _answer_later(self, name: str, request: Any) -> Any:
        """Return the response to a request that has waited: its names are those of by now."""
        try:
            scope = self._scope(request)
            requirement = self._unmet_requirement(scope)
            if requirement is not None:
                raise _stale(requirement, scope.snapshot)
        except Exception as error:  # noqa: BLE001 - every request is answered
            return self._refuse(name, getattr(scene_graph_msgs.srv, name).Response(), error)
        return self._answer(name, request, scope)

    def _answer(self, name: str, request: Any, scope: QueryScope) -> Any:
        query, kind = QUERIES[name], getattr(scene_graph_msgs.srv, name)
        response = kind.Response()
        try:
            self._require_kernels(query.kernel_groups(scope.snapshot))
            begin = time.perf_counter()
            query.handler(request, response, scope)
            self._finish(response, scope.snapshot)
            if query.effect:
                self._effects.record(query.effect, time.perf_counter() - begin)
        except Exception as error:  # noqa: BLE001 - every request is answered
            return self._refuse(name, kind.Response(), error)
        return response

    def _require_kernels(self, groups: Iterable[str]) -> None:
        """Raise UnavailableError for groups of kernels that are not ready; they are compiled."""
        lacks = [self._host.lack_of_kernels(group) for group in groups]
        if any(lacks):
            raise UnavailableError(f"not yet: {'; '.join(filter(None, lacks))}")

    def _edit_callback(self, name: str) -> Callable[..., Any]:
        handler = EDITS[name]

        def answer(request: Any, response: Any) -> Any:
            try:
                if not self._host.parameter("allow_editing"):
                    raise UnavailableError("the parameter allow_editing is false")
                snapshot, handles = self._world.snapshot, self._world.handles
                resolve = self._tools.resolve
                with at_rest() if name in _LARGE_EDITS else nullcontext():
                    prepare(name, request, snapshot.names, snapshot.inspector, resolve)
                    snapshot = self._edit(name, handler, request, response)
                self._host.scene_changed()
                if name == "RegisterSource":
                    self._tell_claim(response.source.name, handles)
                    topics = self._host.pose_topics(snapshot)
                    response.pose_topic = topics.get(response.source.name, "")
                elif name == "RegisterDeformableGeometry":
                    topics = self._host.configuration_topics(snapshot)
                    response.configuration_topic = topics[request.source.name]
                self._finish(response, snapshot)
            except Exception as error:  # noqa: BLE001 - every request is answered
                return self._refuse(name, type(response)(), error)
            return response

        return answer

    def _tell_claim(self, name: str, before: Mapping[str, Handle]) -> None:
        """Log that somebody claimed a source, where the last edit did that."""
        if self._world.handles[name] is not before.get(name) and name in before:
            self._host.node.get_logger().info(
                f"source {quoted(name)} is claimed: the first who asked for it has its handle"
            )

    def _edit(self, name: str, handler: Any, request: Any, response: Any) -> WorldSnapshot:
        """Make an edit, and have it recorded where that is asked for."""
        recorder = self._host.recorder
        if recorder is None:
            _, snapshot = self._world.edit(
                lambda edit: handler(request, response, edit, self._tools), self._effects.prepare
            )
            return snapshot
        text = self._tools.scene_text(request.resource if name == "LoadScene" else "")

        def change(edit: Edit) -> tuple[int, dict[int, list[float]]]:
            first_id = recorder.next_id()
            handler(request, response, edit, self._tools)
            return first_id, {int(f): edit.initial_poses[f].ravel().tolist() for f in edit.rehung}

        def done(changed: tuple[int, dict[int, list[float]]]) -> None:
            first_id, rehung = changed
            ids = [*getattr(response, "frame_ids", ()), *getattr(response, "geometry_ids", ())]
            numbers = [int(i) for i in ids]
            recorder.edited(name, request, first_id, text=text, ids=numbers, rehung=rehung)

        _, snapshot = self._world.edit(change, self._effects.prepare, done=done)
        return snapshot

    def _plan_answered(self, seconds: float) -> None:
        self.counts.answered()
        self._effects.record("planning", seconds)

    def _list_effects(self, request: Any, response: Any) -> ListEffects.Response:
        self.counts.answered()
        response.status = ok_status()
        response.effects = [effect_to_msg(report) for report in self._effects.reports()]
        return response

    def _finish(self, response: Any, snapshot: WorldSnapshot) -> None:
        response.status = ok_status()
        response.scene_version = snapshot.scene_version
        if hasattr(response, "stamp"):
            response.stamp = stamp_to_msg(snapshot.stamp)
        self.counts.answered()

    def _refuse(self, name: str, response: Any, error: Exception) -> Any:
        self.counts.was_refused()
        response.status = status_from_exception(error)
        if hasattr(response, "scene_version"):
            response.scene_version = self._world.snapshot.scene_version
        if response.status.code == Status.INTERNAL_ERROR:
            details = _details(error)
            self._host.node.get_logger().error(f"{name} failed:\n{details}")
        return response

    def _unmet_requirement(self, scope: QueryScope) -> PoseRequirement | None:
        """Return the requirement that a request waits for, None where it is met."""
        options = scope.options
        if options.minimal_stamp_ns <= 0:
            return None
        seconds = min(options.timeout_ns * 1e-9, float(self._host.parameter("max_wait")))
        requirement = PoseRequirement(
            options.minimal_stamp_ns, options.minimal_stamp_sources, seconds
        )
        return None if requirement.is_met(scope.snapshot) else requirement


def _details(error: Exception) -> str:
    """Return an error's traceback and text, quoted safely."""
    where = "".join(traceback.format_tb(error.__traceback__))
    return f"{where}{type(error).__name__}: {quoted(str(error))}"


def _stale(requirement: PoseRequirement, snapshot: WorldSnapshot) -> StaleError:
    name, stamp = requirement.oldest(snapshot)
    waited = f", after {requirement.seconds:.3f} s of waiting" if requirement.seconds > 0.0 else ""
    of = f" of {quoted(name)}" if name else ""
    if stamp == UNSTAMPED:
        record = snapshot.records.get(name)
        silent = () if record is None or record.motion is None else record.motion.silent()
        why = f": nobody says where {quoted(list(silent))} are" if silent else ""
        return StaleError(f"no poses{of} have come that minimal_stamp asks for{why}{waited}")
    lag = (requirement.stamp - stamp) * 1e-9
    return StaleError(f"minimal_stamp is {lag:.6f} s newer than the newest poses{of}{waited}")
