"""Plans: goals of a robot, and the paths that the node found."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import functools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rclpy.action import ActionClient
from rclpy.duration import Duration

from scene_graph_msgs.action import PlanPath
from scene_graph_msgs.msg import MotionLimits, PoseGoal, RobotConfigurations
from scene_graph_ros.client.connection import check, Connection, WorldError
from scene_graph_ros.client.poses import pose_msg

__all__ = ["FoundPlan", "Planner"]

_STATES = {
    getattr(PlanPath.Feedback, name): name.lower()
    for name in ("WAITING", "CHECKING", "SEARCHING", "SHORTENING", "PROVING", "TIMING")
}


@dataclass(frozen=True, eq=False)
class FoundPlan:
    """A path that is proven free, with a trajectory along it; or the reason why there is none."""

    is_success: bool
    reason: str
    """One sentence, empty where there is a plan."""
    names: tuple[str, ...]
    """Of the positions."""
    path: NDArray[np.float64]
    """``(n, k)`` rad or m: configurations that straight edges connect."""
    trajectory: Any
    """``trajectory_msgs/JointTrajectory``, with no points where there is none."""
    clearance: float
    """Metres that all pairs keep beyond their paddings on all of the way."""
    seconds: float
    """How long it took."""

    @property
    def duration(self) -> float:
        """Seconds that the trajectory takes."""
        points = self.trajectory.points
        if not points:
            return 0.0
        end = points[-1].time_from_start
        return float(end.sec) + 1e-9 * float(end.nanosec)

    def __repr__(self) -> str:
        if not self.is_success:
            return f"FoundPlan(is_success=False, reason={self.reason!r})"[:200]
        return (
            f"FoundPlan({len(self.path)} configurations of {len(self.names)} joints,"
            f" {self.duration:.3g} s, clearance={self.clearance:.3g} m)"
        )


class Planner:
    """Sends goals to the node's action and waits for results."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._action: Any = None

    def plan(
        self,
        goal: Mapping[str, float] | None,
        pose: tuple[str, ArrayLike] | None,
        *,
        timeout: float,
        watch: Callable[[str, float], None] | None,
        max_acceleration: float,
        speed: float,
        **fields: Any,
    ) -> FoundPlan:
        """Answer `World.plan`."""
        message = PlanPath.Goal(
            timeout=Duration(seconds=timeout).to_msg(),
            with_trajectory=True,
            limits=MotionLimits(
                max_acceleration=float(max_acceleration), velocity_scaling=float(speed)
            ),
            **fields,
        )
        if (goal is None) == (pose is None):
            raise ValueError("give goal, positions by name, or pose, a link and where it is to be")
        if goal is not None:
            positions = [float(value) for value in goal.values()]
            message.goals = RobotConfigurations(names=list(goal), positions=positions)
        if pose is not None:
            link, X_WL = pose
            message.pose_goals = [
                PoseGoal(link=link, tool=pose_msg((0, 0, 0)), pose=pose_msg(X_WL))
            ]
        ask = functools.partial(self._result, message, timeout, watch)
        return _found(self._connection.patiently(ask))

    def _result(
        self, goal: Any, timeout: float, watch: Callable[[str, float], None] | None
    ) -> Any:
        connection = self._connection
        action = self._ready_action()

        def tell(feedback: Any) -> None:
            if watch is not None:
                said = feedback.feedback
                watch(_STATES.get(said.state, "planning"), float(said.seconds))

        sent = connection.in_thread(lambda: action.send_goal_async(goal, feedback_callback=tell))
        sent.add_done_callback(lambda _: connection.notify())
        connection.wait(sent.done, "the acceptance of the goal")
        handle = sent.result()
        if not handle.accepted:
            raise WorldError("plan_path: the node takes no more goals now", "UNAVAILABLE")
        future = connection.in_thread(handle.get_result_async)
        future.add_done_callback(lambda _: connection.notify())
        try:
            # Others may come before; the node's own limit holds from when its turn has come.
            connection.wait(future.done, "the plan", 10.0 * timeout + connection.timeout)
        except BaseException:
            connection.in_thread(handle.cancel_goal_async)
            raise
        result = future.result().result
        check(result.status, "plan_path")
        return result

    def _ready_action(self) -> Any:
        connection = self._connection
        if self._action is None:
            name = f"{connection.target}/plan_path"
            self._action = ActionClient(connection.node, PlanPath, name)
        try:
            connection.wait(self._action.server_is_ready, "plan_path")
        except WorldError:
            raise WorldError(connection.absence(connection.timeout)) from None
        return self._action

    def close(self) -> None:
        """End."""
        if self._action is not None:
            self._action.destroy()


def _found(result: Any) -> FoundPlan:
    names = tuple(result.path.names)
    positions = np.array(result.path.positions, dtype=np.float64)
    is_success = result.failure == PlanPath.Result.NONE
    return FoundPlan(
        is_success=is_success,
        reason=result.reason,
        names=names,
        path=positions.reshape(-1, max(len(names), 1)),
        trajectory=result.trajectory,
        clearance=float(result.trajectory_clearance if is_success else 0.0),
        seconds=float(result.seconds),
    )
