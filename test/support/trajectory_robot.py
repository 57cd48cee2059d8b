"""A robot that executes the trajectories it is told, as `joint_trajectory_controller` does."""

from __future__ import annotations

import threading
from typing import Any

from node_harness import Client
import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory

from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from msg_adapters.trajectories import joint_trajectory_from_msg

__all__ = ["TrajectoryRobot"]

PERIOD = 0.01


class TrajectoryRobot:
    """Publishes its joints in a thread of its own."""

    def __init__(self, client: Client, names: tuple[str, ...], start: list[float]) -> None:
        self._client, self.names, self.q = client, names, np.array(start)
        self.heard = client.listen(JointTrajectory, "/scene_graph/trajectory")
        self._publisher = client.publisher(JointState, "/joint_states")
        self.gaps: list[float] = []
        """rad or m: how far joints jumped from one joint state to the next."""
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop."""
        self._ends.set()
        self._thread.join()
        self._client.destroy(self._publisher)
        self._client.forget(self.heard)

    def at(self, message: Any, time_ns: int) -> NDArray[np.float64]:
        """Return where a trajectory has all joints at a time (ns)."""
        names, points = joint_trajectory_from_msg(message)
        curve = points.trajectory()
        time = (time_ns - stamp_from_msg(message.header.stamp)) * 1e-9
        q = self.q.copy()
        q[[self.names.index(name) for name in names]] = curve.value(
            min(max(time, curve.start_time), curve.end_time)
        )
        return q

    def _run(self) -> None:
        while not self._ends.wait(PERIOD):
            now = stamp_from_msg(self._client.now())
            if self.heard.count:
                q = self.at(self.heard.newest, now)
                self.gaps.append(float(np.abs(q - self.q).max()))
                self.q = q
            message = JointState(name=list(self.names), position=self.q.tolist())
            message.header.stamp = stamp_to_msg(now)
            self._publisher.publish(message)
