"""Execution of a trajectory by a controller that takes JointTrajectory messages on a topic."""

from __future__ import annotations

from collections.abc import Callable
import time

from builtin_interfaces.msg import Duration
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from scene_graph_ros.client.connection import Connection, WorldError
from scene_graph_ros.client.plans import FoundPlan

__all__ = ["Execution"]


class Execution:
    """A trajectory that was sent to a controller, and how far the robot has come.

    How far is told by the joint states that the robot sends; `World.execute` makes it.
    """

    def __init__(
        self,
        connection: Connection,
        plan: FoundPlan,
        topic: str,
        joint_states: str,
        tolerance: float,
    ) -> None:
        if not plan.trajectory.points:
            raise WorldError(
                f"there is no trajectory to execute: {plan.reason or 'none was planned'}",
                "INVALID_ARGUMENT",
            )
        self._connection, self._tolerance = connection, tolerance
        self._names: list[str] = list(plan.trajectory.joint_names)
        self._goal = dict(zip(self._names, plan.trajectory.points[-1].positions, strict=True))
        self._now: dict[str, float] = {}
        self.duration = plan.duration
        """Seconds that the trajectory takes."""
        node = connection.node
        self._states = node.create_subscription(JointState, joint_states, self._take, 10)
        self._publisher = node.create_publisher(JointTrajectory, topic, 10)
        self.is_stopped = False
        """Whether `stop` was called."""
        try:
            connection.wait(
                self._publisher.get_subscription_count, f"a controller that listens to {topic}"
            )
        except BaseException:
            self._close()
            raise
        self._begin = time.monotonic()
        self._publisher.publish(plan.trajectory)

    def _take(self, message: JointState) -> None:
        self._now.update(zip(message.name, message.position, strict=False))
        self._connection.notify()

    def _close(self) -> None:
        node = self._connection.node
        node.destroy_subscription(self._states)
        node.destroy_publisher(self._publisher)

    def __repr__(self) -> str:
        return f"Execution(progress={self.progress:.2f}, is_done={self.is_done})"

    @property
    def progress(self) -> float:
        """From 0 to 1, by time; 1 only where the joints have arrived."""
        if self.is_done:
            return 1.0
        share = (time.monotonic() - self._begin) / self.duration if self.duration else 1.0
        return min(share, 0.99)

    @property
    def distances(self) -> dict[str, float]:
        """How far each joint is from its end, rad or m; inf before it was heard of."""
        return {
            name: abs(self._now[name] - end) if name in self._now else float("inf")
            for name, end in self._goal.items()
        }

    @property
    def is_done(self) -> bool:
        """Whether all joints are within the tolerance of their ends."""
        return max(self.distances.values()) <= self._tolerance

    def wait(
        self, timeout: float | None = None, watch: Callable[[float], None] | None = None
    ) -> None:
        """Wait until the joints have arrived; ``watch`` is told the progress meanwhile.

        ``timeout`` (s) is the robot's time beyond the trajectory's duration. Raises
        WorldError, with the joint that is farthest, where it does not come in time.
        """
        extra = self._connection.timeout if timeout is None else timeout
        left = max(self._begin + self.duration - time.monotonic(), 0.0) + extra

        def is_over() -> bool:
            if watch is not None:
                watch(self.progress)
            return self.is_done or self.is_stopped

        try:
            self._connection.wait(is_over, "the end of the trajectory", left)
        except WorldError:
            name, distance = max(self.distances.items(), key=lambda item: item[1])
            heard = (
                f"is {distance:.4g} from its end" if name in self._now else "was never heard of"
            )
            raise WorldError(
                f"the robot did not arrive within {self.duration + extra:.3g} s: joint {name!r}"
                f" {heard}, and may be {self._tolerance:g}"
            ) from None

    def stop(self, seconds: float = 0.2) -> None:
        """Have the controller hold the present positions, reached in ``seconds``.

        That replaces the trajectory. Raises WorldError where a joint was never heard of: then
        nobody knows where to stop.
        """
        missing = [name for name in self._names if name not in self._now]
        if missing:
            raise WorldError(f"joint {missing[0]!r} was never heard of: stop the robot otherwise")
        point = JointTrajectoryPoint(
            positions=[float(self._now[name]) for name in self._names],
            velocities=[0.0] * len(self._names),
            time_from_start=Duration(
                sec=int(seconds), nanosec=round(1e9 * (seconds - int(seconds)))
            ),
        )
        self.is_stopped = True
        self._publisher.publish(JointTrajectory(joint_names=self._names, points=[point]))
        self._connection.notify()

    def close(self) -> None:
        """Listen no more; the robot goes on."""
        self._close()
