"""The action that plans paths: its services and topics, and the work on its goals.

Planning is imported when the first goal's turn comes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
import importlib
import time
from typing import Any
import uuid

from action_msgs.msg import GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
import numpy as np
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from msg_adapters.errors import MessageError, TooLargeError, UnavailableError
from scene_graph_msgs.action import PlanPath
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.located import suggestion
from scene_graph_ros.node.runtime.goals import Goal, GoalEnd, Goals, Work
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.names import PLAN_PATH
from scene_graph_ros.node.runtime.qos import feedback_qos, latched_qos
from scene_graph_ros.node.runtime.requests import RequestLoop
from scene_graph_ros.node.services.queries import kernels_of_clouds
from scene_graph_ros.node.services.replies import Replies
from scene_graph_ros.node.world.planned_path import PlannedPath
from scene_graph_ros.node.world.world import World

__all__ = ["PlanAction", "PlanHooks"]

Heard = Callable[[Any], None]
Done = Callable[[Any, PlannedPath | None], None]


@dataclass(eq=False)
class _Own:
    """A goal of the node's own."""

    heard: Heard
    done: Done
    path: PlannedPath | None = None


RCLError = rclpy_implementation.RCLError

_PLANNERS = {
    "": ("path_plans", ("planning",)),
    "rrt_connect": ("path_plans", ("planning",)),
    "fastest": ("path_plans", ("planning",)),
    "straight": ("straight_plans", ("planning",)),
    "regions": ("region_plans", ("planning", "convex")),
}
"""The module beside this one that works on goals of each planner, and the kernels it calls."""


@dataclass(frozen=True)
class PlanHooks:
    """Parts of the node for its plans.

    ``text`` returns the path and the text of a file; ``found`` gets each path that was found;
    ``record`` the seconds that a goal took; ``lack_of_kernels`` is a sentence about a group of
    kernels that is not ready, "" where it is.
    """

    text: Callable[[str], tuple[str, str]]
    found: Callable[[PlannedPath], None]
    record: Callable[[float], None]
    lack_of_kernels: Callable[[str], str]


class PlanAction:
    """Offers ``~/plan_path``; plans one path at a time, beside everything else."""

    def __init__(
        self,
        node: Node,
        world: World,
        loop: RequestLoop,
        replies: Replies,
        hooks: PlanHooks,
        *,
        parameter: Callable[[str], Any],
    ) -> None:
        """Offer it by ``loop``, before its start."""
        self._node, self._world, self._replies = node, world, replies
        self._hooks, self._parameter = hooks, parameter
        parts = PlanPath.Impl
        publish = partial(node.create_publisher, callback_group=OwnThreadGroup())
        self._publishers = (
            publish(parts.FeedbackMessage, f"{PLAN_PATH}/_action/feedback", feedback_qos()),
            publish(GoalStatusArray, f"{PLAN_PATH}/_action/status", latched_qos()),
        )
        self._own: dict[bytes, _Own] = {}
        status = partial(self._tell, self._publishers[1])
        self.goals = Goals(
            PlanPath,
            Work(
                self._plan,
                self._crowded,
                lambda: _cancelled("its turn had not come yet"),
                _waits,
                lambda: int(parameter("max_waiting_plans")),
            ),
            publish_feedback=self._tell_feedback,
            publish_status=status,
            now=lambda: node.get_clock().now().to_msg(),
        )
        offered = (
            (parts.SendGoalService, "send_goal", self.goals.send),
            (parts.GetResultService, "get_result", self.goals.get_result),
            (CancelGoal, "cancel_goal", self.goals.cancel),
        )
        for kind, name, answer in offered:
            loop.offer(
                kind, f"{PLAN_PATH}/_action/{name}", answer, refuse=partial(self._overload, kind)
            )

    def begin(self, goal: Any, heard: Heard, done: Done) -> Callable[[], None]:
        """Take a goal of the node's own, as any client's; return the function that cancels it.

        It counts as theirs do. ``heard`` is told its feedback, ``done`` its result and the path,
        in threads that must not be held up.
        """
        key = uuid.uuid4().bytes
        uuids = np.frombuffer(key, dtype=np.uint8)
        send = PlanPath.Impl.SendGoalService.Request(goal=goal)
        get = PlanPath.Impl.GetResultService.Request()
        cancel = CancelGoal.Request()
        for id_of in (send.goal_id, get.goal_id, cancel.goal_info.goal_id):
            id_of.uuid = uuids
        self._own[key] = _Own(heard, done)
        # One that is not taken, since all ends, has no result.
        self.goals.send(send, lambda response: None)
        self.goals.get_result(get, lambda response: self._end_own(key, response.result))
        return lambda: self.goals.cancel(cancel, lambda response: None)

    def _end_own(self, key: bytes, result: Any) -> None:
        own = self._own.pop(key)
        own.done(result, own.path)

    def close(self) -> None:
        """End all goals; the loop still answers."""
        self.goals.close()

    def destroy(self) -> None:
        """Stop being advertised."""
        for publisher in self._publishers:
            self._node.destroy_publisher(publisher)

    def _tell_feedback(self, message: Any) -> None:
        self._tell(self._publishers[0], message)
        own = self._own.get(bytes(message.goal_id.uuid))
        if own is not None:
            own.heard(message.feedback)

    def _tell(self, publisher: Any, message: Any) -> None:
        try:
            publisher.publish(message)
        except RCLError:
            # A program may shut ROS down before it destroys the node: nobody is left to hear it.
            if self._node.context.ok():
                raise

    def _plan(self, goal: Goal) -> GoalEnd:
        begin = time.monotonic()
        try:
            module, kernels = _planner(goal.request.planner)
            snapshot = self._world.snapshot
            groups = (*kernels, *kernels_of_clouds(snapshot))
            lacks = [self._hooks.lack_of_kernels(group) for group in groups]
            if any(lacks):
                raise UnavailableError(f"not yet: {'; '.join(filter(None, lacks))}")
            plans = importlib.import_module(f"{__package__}.{module}")
            text = self._hooks.text
            result, path = plans.plan(goal, snapshot, self._parameter, text, self._now)
            if path is not None:
                self._hooks.found(path)
                if goal.id in self._own:
                    self._own[goal.id].path = path
        except Exception as error:  # noqa: BLE001 - every goal has an end
            result = self._replies.refuse("PlanPath", PlanPath.Result(), error)
            return GoalEnd(GoalStatus.STATUS_ABORTED, result)
        self._replies.counts.answered()
        self._hooks.record(time.monotonic() - begin)
        return GoalEnd(_STATUSES.get(result.failure, GoalStatus.STATUS_ABORTED), result)

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _crowded(self, waiting: int) -> Any:
        error = TooLargeError(
            f"{waiting} goals wait for their turn already, and max_waiting_plans is"
            f" {self._parameter('max_waiting_plans')}"
        )
        return self._replies.refuse("PlanPath", PlanPath.Result(), error)

    def _overload(self, kind: Any, error: Exception) -> Any:
        """Return the response to a request that the node has no room for."""
        response = kind.Response()
        if kind is CancelGoal:
            response.return_code = CancelGoal.Response.ERROR_REJECTED
        elif kind is PlanPath.Impl.GetResultService:
            self._replies.refuse("PlanPath", response.result, error)
        return response


_STATUSES = {
    PlanPath.Result.NONE: GoalStatus.STATUS_SUCCEEDED,
    PlanPath.Result.CANCELED: GoalStatus.STATUS_CANCELED,
}


def _planner(planner: str) -> tuple[str, tuple[str, ...]]:
    """Return the planner's names. Raises MessageError for a planner that there is not."""
    if planner not in _PLANNERS:
        known = [name for name in _PLANNERS if name]
        raise MessageError(
            f"planner must be {' or '.join(map(repr, known))}, or empty, not {quoted(planner)}"
            f"{suggestion(planner, known)}"
        )
    return _PLANNERS[planner]


def _cancelled(reason: str) -> Any:
    return PlanPath.Result(failure=PlanPath.Result.CANCELED, reason=f"cancelled: {reason}")


def _waits(goal: Goal, ahead: int) -> None:
    goal.tell(PlanPath.Feedback(state=PlanPath.Feedback.WAITING, ahead=ahead))
