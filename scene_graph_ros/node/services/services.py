"""The services and the action of the node, and their threads.

Queries read a snapshot and run side by side; changes of the scene run one after another. A query
that waits for poses gives its thread back meanwhile, so waiting can't stop the world and costs
nothing. All of them run in threads of their own, apart from the executor of the node.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from msg_adapters.diagnostics import effect_to_msg
from msg_adapters.status import ok_status
import scene_graph_msgs.srv
from scene_graph_msgs.srv import ListEffects
from scene_graph_ros.node.effects.state import EffectReport
from scene_graph_ros.node.runtime.names import service_name
from scene_graph_ros.node.runtime.requests import Answer, RequestLoop
from scene_graph_ros.node.services.edit_answers import EditAnswers
from scene_graph_ros.node.services.plan_action import PlanAction
from scene_graph_ros.node.services.queries import QUERIES
from scene_graph_ros.node.services.query_answers import QueryAnswers
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.services.request_counts import RequestCounts
from scene_graph_ros.node.services.waiting import Waiting
from scene_graph_ros.node.world.edits import EDITS

__all__ = ["Services"]


class Services:
    """All services of the node."""

    def __init__(
        self,
        loop: RequestLoop,
        waiting: Waiting,
        replies: Replies,
        queries: QueryAnswers,
        edits: EditAnswers,
        plans: PlanAction,
        effects: Callable[[], Sequence[EffectReport]],
    ) -> None:
        """Offer them by ``loop``, and start it; ``effects`` are those that ListEffects lists."""
        self._loop, self._waiting, self._replies, self.plans = loop, waiting, replies, plans
        self._effects = effects
        for name in QUERIES:
            self._offer(name, queries.answer_to(name))
        for name in EDITS:
            self._offer(name, _at_once(name, edits.answer_to(name)), is_exclusive=True)
        self._offer("ListEffects", _at_once("ListEffects", self._list_effects))
        loop.start()

    @property
    def counts(self) -> RequestCounts:
        """The requests that were answered and refused."""
        return self._replies.counts

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
            refuse=lambda error: self._replies.refuse(name, self._replies.empty(name), error),
            is_exclusive=is_exclusive,
        )

    def _list_effects(self, request: Any, response: Any) -> ListEffects.Response:
        self.counts.answered()
        response.status = ok_status()
        response.effects = [effect_to_msg(report) for report in self._effects()]
        return response


def _at_once(name: str, callback: Callable[[Any, Any], Any]) -> Answer:
    """Turn a function that fills a response into an answer to requests."""
    return lambda request, respond: respond(callback(request, Replies.empty(name)))
