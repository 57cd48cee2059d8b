"""Answers to queries: at once, or when the poses have come that a request asks for."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import time
from typing import Any

from msg_adapters.errors import StaleError, TooLargeError, UnavailableError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.runtime.requests import Answer, Respond
from scene_graph_ros.node.services.queries import QUERIES, QueryScope
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.services.waiting import PendingAnswer, PoseRequirement, Waiting
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["QueryAnswers"]


class QueryAnswers:
    """The services of ``QUERIES``."""

    def __init__(
        self,
        scope: Callable[[], QueryScope],
        waiting: Waiting,
        replies: Replies,
        *,
        parameter: Callable[[str], Any],
        lack_of_kernels: Callable[[str], str],
        record: Callable[[str, float], None],
    ) -> None:
        """Answer within ``scope()``, the world as it is then.

        ``record`` is told the effect that an answer belongs to, and the seconds that it took.
        """
        self._scope_now, self._waiting, self._replies = scope, waiting, replies
        self._parameter, self._lack_of_kernels, self._record = parameter, lack_of_kernels, record

    def answer_to(self, name: str) -> Answer:
        """Return the function that answers requests of the service ``name``."""

        def answer(request: Any, respond: Respond) -> None:
            response = self._replies.empty(name)
            try:
                scope = self._scope(name, request)
                requirement = self._unmet_requirement(scope)
                if requirement is not None and not self._waiting.can_wait(requirement):
                    raise _stale(requirement, scope.snapshot)
            except Exception as error:  # noqa: BLE001 - every request is answered
                respond(self._refuse(name, error))
                return
            if requirement is None:
                respond(self._answer(name, request, response, scope))
            else:
                late_answer = partial(self._answer_later, name, request)
                self._wait(name, PendingAnswer(requirement, late_answer, respond))

        return answer

    def _scope(self, name: str, request: Any) -> QueryScope:
        """Return the base of an answer now. Raises the errors of ``options_from_msg``.

        And UnavailableError for groups of kernels that are not ready; they are compiled.
        """
        scope = self._scope_now()
        groups = QUERIES[name].kernel_groups(scope.snapshot)
        lacks = [self._lack_of_kernels(group) for group in groups]
        if any(lacks):
            raise UnavailableError(f"not yet: {'; '.join(filter(None, lacks))}")
        scope.read_options(request)
        return scope

    def _wait(self, name: str, pending: PendingAnswer) -> None:
        """Answer later, or refuse where too many wait for poses already."""
        limit = self._parameter("max_waiting_requests")
        if not self._waiting.add(pending, limit):
            error = TooLargeError(
                f"{limit} requests wait for poses already, and max_waiting_requests is {limit}"
            )
            pending.send(self._refuse(name, error))

    def _answer_later(self, name: str, request: Any) -> Any:
        """Return the response to a request that has waited: its names are those of by now."""
        try:
            scope = self._scope(name, request)
            requirement = self._unmet_requirement(scope)
            if requirement is not None:
                raise _stale(requirement, scope.snapshot)
        except Exception as error:  # noqa: BLE001 - every request is answered
            return self._refuse(name, error)
        return self._answer(name, request, self._replies.empty(name), scope)

    def _answer(self, name: str, request: Any, response: Any, scope: QueryScope) -> Any:
        query = QUERIES[name]
        try:
            begin = time.perf_counter()
            query.handler(request, response, scope)
            self._replies.finish(response, scope.snapshot)
            if query.effect:
                self._record(query.effect, time.perf_counter() - begin)
        except Exception as error:  # noqa: BLE001 - every request is answered
            return self._refuse(name, error)
        return response

    def _refuse(self, name: str, error: Exception) -> Any:
        return self._replies.refuse(name, self._replies.empty(name), error)

    def _unmet_requirement(self, scope: QueryScope) -> PoseRequirement | None:
        """Return the requirement that a request waits for, None where it is met."""
        options = scope.options
        if options.minimal_stamp_ns <= 0:
            return None
        seconds = min(options.timeout_ns * 1e-9, float(self._parameter("max_wait")))
        requirement = PoseRequirement(
            options.minimal_stamp_ns, options.minimal_stamp_sources, seconds
        )
        return None if requirement.is_met(scope.snapshot) else requirement


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
