"""A client of the node whose robot stops when its path does not hold any more."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
import time
from typing import Any

import rclpy
from visualization_msgs.msg import Marker

from common.world_planner import pointing_down, RATE, WorldPlanner
from msg_adapters.trajectories import joint_trajectory_from_msg
from scene_graph_msgs.msg import PlanHolds

AHEAD = 0.045
"""Seconds of its trajectory at full speed that the robot goes at most beyond what the node has
looked at; slower trajectories take longer for the same way."""
BACK = 0.5
"""Seconds of its way that the robot goes back where it stops."""


class LookingPlanner(WorldPlanner):
    """Plans, and follows trajectories as a controller does: joint states at a rate."""

    def __init__(self, speed: float) -> None:
        """Go at a share of the joints' velocities."""
        super().__init__(with_pictures=True, with_contacts=False)
        self._speed = speed
        self._sent: list[int] = []
        self._sent_at: list[float] = []
        """When states of the trajectory were sent, ns, and which times of it they were, s."""
        self.moments: list[list[float]] = []
        """Configurations that the robot was in."""

    def _is_ahead(self, at: float, goal_id: bytes) -> bool:
        """Tell whether a time of the trajectory is too far beyond where the robot looked.

        That is where it was at the stamp of the newest image that the path was proven for, which
        is the proof's stamp.
        """
        stamp = self._about(goal_id)[-1].header.stamp
        row = bisect_right(self._sent, stamp.sec * 10**9 + stamp.nanosec) - 1
        return at > (self._sent_at[row] if row >= 0 else 0.0) + AHEAD / self._speed

    def wait_for_node(self) -> None:
        """Wait until the node offers the action and listens to the robot."""
        heard = self.joints.get_subscription_count
        self.wait(lambda: self.action.server_is_ready() and heard(), "the node")

    @property
    def seen(self) -> int:
        """The points of the cloud, as its marker has them."""
        clouds = [m for m in self.markers.values() if m.type == Marker.SPHERE_LIST]
        return max((len(marker.points) for marker in clouds), default=0)

    def look(self, seconds: float) -> None:
        """Stand still and take what the node says."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.05)

    def plan_to(
        self, link: str, point: Sequence[float], group: str, padding: float
    ) -> tuple[Any, bytes]:
        """Plan a trajectory as `reach`, whether it still holds or not; the result and its id."""
        goal = pointing_down(link, point, group, padding)
        result, goal_id = self.plan(goal, 60.0, 5.0, self._speed)
        if result.status.code or result.failure:
            raise SystemExit(f"no plan: {result.status.message}{result.reason}")
        return result, goal_id

    def holds_now(self, goal_id: bytes) -> bool:
        """Wait until the node says whether a path holds; return that."""
        return bool(self.wait(lambda: self._about(goal_id), "whether the path holds")[-1].holds)

    def _about(self, goal_id: bytes) -> list[PlanHolds]:
        return [m for m in self.holds if bytes(m.goal_id.uuid) == goal_id]

    def follow(self, message: Any, goal_id: bytes) -> str:
        """Follow a trajectory; return "" at its end, or why it holds no more, a little before.

        Where it stops the robot goes back the way it came for a moment: what it sees at the last
        instant is nearer than the padding with which the next path is to begin.
        """
        names, points = joint_trajectory_from_msg(message.trajectory)
        trajectory = points.trajectory()
        self.holds_now(goal_id)
        self._sent, self._sent_at = [], []
        reached, why = self._move(names, trajectory, 0.0, trajectory.end_time, goal_id)
        if why:
            self._move(names, trajectory, reached, max(reached - BACK, 0.0), b"")
        return why

    def _move(
        self, names: Sequence[str], trajectory: Any, first: float, last: float, goal_id: bytes
    ) -> tuple[float, str]:
        """Send joint states from one time of a trajectory to another, as fast as it says.

        Returns the last time, and why the path of that id held no more, or "".
        """
        count, direction = 0, 1.0 if last >= first else -1.0
        due = time.monotonic()
        while True:
            gone = min(count / RATE, abs(last - first))
            rclpy.spin_once(self.node, timeout_sec=max(due - time.monotonic(), 0.0))
            at, said = first + direction * gone, self._about(goal_id)
            if said and not said[-1].holds:
                return at, said[-1].reason
            if time.monotonic() < due:
                continue
            due = time.monotonic() + 1.0 / RATE
            if goal_id and self._is_ahead(at, goal_id):
                continue  # it stands, as it tells ten times a second
            q = trajectory.value(at).tolist()
            self._sent.append(self.node.get_clock().now().nanoseconds)
            self._sent_at.append(at)
            self.tell_joints(names, q)
            self.moments.append(q)
            if gone == abs(last - first):
                return last, ""
            count += 1
