"""Goals of an action: taken, worked on one after another, cancelled, and their results kept.

An action is three services and two topics (*Actions*, design.ros2.org). rclpy's server of them
lives in an executor, which other work may keep busy. This one is asked by the threads that answer
the node's services, whoever spins the node, and works in a thread of its own, which is there as
long as there is a goal. Nothing here knows the middleware.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
import threading
import time
from typing import Any, NamedTuple

from action_msgs.msg import GoalInfo, GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from builtin_interfaces.msg import Time
import numpy as np

from scene_graph_ros.node.runtime.own_threads import stop_at_exit

__all__ = ["Goal", "GoalEnd", "Goals", "Work"]

_KEPT_RESULTS = 100
"""Results that may still be asked for; of more the oldest are forgotten."""

_KEPT_SECONDS = 60.0
"""How long a result may still be asked for."""

_MOST_ASKING = 100
"""Requests that wait for the result of one goal; more are told its status at once."""

_ENDS = (GoalStatus.STATUS_SUCCEEDED, GoalStatus.STATUS_CANCELED, GoalStatus.STATUS_ABORTED)

Respond = Callable[[Any], None]


class GoalEnd(NamedTuple):
    """How a goal ended: one of the last three values of GoalStatus, and the result."""

    status: int
    result: Any


@dataclass(eq=False)
class Goal:
    """One goal, from its request to its end."""

    id: bytes
    request: Any
    stamp: Time
    publish: Callable[[Goal, Any], None]
    status: int = GoalStatus.STATUS_ACCEPTED
    result: Any = None
    ended_at: float = 0.0
    asking: list[Respond] = field(default_factory=list)

    @property
    def is_cancelled(self) -> bool:
        """Whether it is to be ended; the work on it has to look."""
        return self.status == GoalStatus.STATUS_CANCELING

    @property
    def has_ended(self) -> bool:
        """Whether there is a result."""
        return self.status in _ENDS

    def tell(self, feedback: Any) -> None:
        """Publish feedback."""
        self.publish(self, feedback)

    def info(self) -> GoalInfo:
        """Return its id and when it was accepted."""
        info = GoalInfo(stamp=self.stamp)
        info.goal_id.uuid = np.frombuffer(self.id, dtype=np.uint8)
        return info


class Work(NamedTuple):
    """The work on goals."""

    do: Callable[[Goal], GoalEnd]
    """Returns the end of a goal, looks now and then whether it was cancelled, raises nothing."""
    crowd: Callable[[int], Any]
    """Returns the result of a goal that is not taken, as so many wait already."""
    cancelled: Callable[[], Any]
    """Returns the result of a goal that was cancelled before its turn came."""
    waits: Callable[[Goal, int], None]
    """Is told of a goal that so many others are before."""
    most_waiting: Callable[[], int]
    """Returns how many may wait, beside the one that is worked on."""


class Goals:
    """All goals of one action; any thread may call."""

    def __init__(
        self,
        action: Any,
        work: Work,
        *,
        publish_feedback: Callable[[Any], None],
        publish_status: Callable[[Any], None],
        now: Callable[[], Time],
    ) -> None:
        """Have goals of the type ``action`` worked on; ``now`` is the node's time."""
        self._action, self._work, self._now = action, work, now
        self._publish_feedback, self._publish_status = publish_feedback, publish_status
        self._lock = threading.RLock()
        self._goals: dict[bytes, Goal] = {}
        self._queue: deque[Goal] = deque()
        self._thread: threading.Thread | None = None
        self._is_closed = False

    # What clients ask for.

    def send(self, request: Any, respond: Respond) -> None:
        """Answer a request to take a goal; one whose id is known is rejected.

        One that is one too many is taken, and aborted, as a rejection has no words.
        """
        response = self._action.Impl.SendGoalService.Response()
        goal = Goal(bytes(request.goal_id.uuid), request.goal, self._now(), self._send_feedback)
        with self._lock:
            self._forget_old()
            response.accepted = goal.id not in self._goals and not self._is_closed
            response.stamp = goal.stamp
            if not response.accepted:
                respond(response)
                return
            self._goals[goal.id] = goal
            respond(response)
            waiting = len(self._queue)
            if self._thread is not None and waiting >= self._work.most_waiting():
                self._end(goal, GoalEnd(GoalStatus.STATUS_ABORTED, self._work.crowd(waiting)))
                return
            self._queue.append(goal)
            self._show_status()
            if self._thread is None:
                self._begin()
            else:
                self._work.waits(goal, len(self._queue))

    def cancel(self, request: Any, respond: Respond) -> None:
        """Answer a request to cancel a goal, those up to a time, or all."""
        response = CancelGoal.Response(return_code=CancelGoal.Response.ERROR_NONE)
        key, stamp = bytes(request.goal_info.goal_id.uuid), request.goal_info.stamp
        with self._lock:
            chosen = [goal for goal in self._chosen(key, stamp) if not goal.has_ended]
            if any(key) and key not in self._goals:
                response.return_code = CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
            elif any(key) and self._goals[key].has_ended:
                response.return_code = CancelGoal.Response.ERROR_GOAL_TERMINATED
            response.goals_canceling = [goal.info() for goal in chosen]
            respond(response)
            self._cancel(chosen)

    def get_result(self, request: Any, respond: Respond) -> None:
        """Answer a request for a result when it is there.

        For a goal that is not known, or long gone, at once, with STATUS_UNKNOWN.
        """
        with self._lock:
            self._forget_old()
            goal = self._goals.get(bytes(request.goal_id.uuid))
            if goal is None or goal.has_ended or len(goal.asking) >= _MOST_ASKING:
                respond(self._response(goal))
            else:
                goal.asking.append(respond)

    def close(self) -> None:
        """Cancel all goals, answer their clients, and end."""
        with self._lock:
            self._is_closed = True
            self._cancel([goal for goal in self._goals.values() if not goal.has_ended])
            thread = self._thread
        if thread is not None and thread is not threading.current_thread():
            thread.join()

    # The work on goals.

    def _begin(self) -> None:
        # A daemon that is stopped at exit: a program which forgets its node can end.
        self._thread = threading.Thread(target=self._run, name="goals", daemon=True)
        stop_at_exit(self, Goals.close)
        self._thread.start()

    def _run(self) -> None:
        while (goal := self._next()) is not None:
            end = self._work.do(goal)
            with self._lock:
                self._end(goal, end)
            # Not to be kept alive until the next one comes.
            del goal, end

    def _next(self) -> Goal | None:
        """Take the goal whose turn it is; where there is none, this is no thread any more."""
        with self._lock:
            if not self._queue:
                self._thread = None
                return None
            goal = self._queue.popleft()
            goal.status = GoalStatus.STATUS_EXECUTING
            self._show_status()
            for ahead, other in enumerate(self._queue, 1):
                self._work.waits(other, ahead)
            return goal

    def _cancel(self, goals: Iterable[Goal]) -> None:
        for goal in goals:
            goal.status = GoalStatus.STATUS_CANCELING
            if goal in self._queue:
                self._queue.remove(goal)
                self._end(goal, GoalEnd(GoalStatus.STATUS_CANCELED, self._work.cancelled()))
        self._show_status()

    def _end(self, goal: Goal, end: GoalEnd) -> None:
        goal.status, goal.result, goal.ended_at = end.status, end.result, time.monotonic()
        # What was asked for may be large.
        goal.request = None
        asking, goal.asking = goal.asking, []
        self._show_status()
        for respond in asking:
            respond(self._response(goal))

    # What is said of them.

    def _chosen(self, key: bytes, stamp: Time) -> Iterable[Goal]:
        """Return the goals that a request to cancel means: without id and time, all."""
        until = (stamp.sec, stamp.nanosec)
        means_all = not any(key) and not any(until)
        for goal in self._goals.values():
            is_before = any(until) and (goal.stamp.sec, goal.stamp.nanosec) <= until
            if means_all or goal.id == key or is_before:
                yield goal

    def _response(self, goal: Goal | None) -> Any:
        response = self._action.Impl.GetResultService.Response()
        response.status = GoalStatus.STATUS_UNKNOWN if goal is None else goal.status
        if goal is not None and goal.has_ended:
            response.result = goal.result
        return response

    def _send_feedback(self, goal: Goal, feedback: Any) -> None:
        message = self._action.Impl.FeedbackMessage(feedback=feedback)
        message.goal_id = goal.info().goal_id
        self._publish_feedback(message)

    def _show_status(self) -> None:
        goals = self._goals.values()
        states = [GoalStatus(goal_info=goal.info(), status=goal.status) for goal in goals]
        self._publish_status(GoalStatusArray(status_list=states))

    def _forget_old(self) -> None:
        ended = sorted((g for g in self._goals.values() if g.has_ended), key=lambda g: g.ended_at)
        oldest = time.monotonic() - _KEPT_SECONDS
        surplus = len(ended) - _KEPT_RESULTS
        for count, goal in enumerate(ended):
            if count < surplus or goal.ended_at < oldest:
                del self._goals[goal.id]
