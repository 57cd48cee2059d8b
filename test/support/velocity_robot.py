"""A robot that follows velocities, as its controller would: it moves with each command."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

__all__ = ["VelocityRobot"]

_TOLD_PERIOD = 0.01


class VelocityRobot:
    """Moves for one period with each command that comes, and tells where it is."""

    def __init__(
        self, client: Any, topic: str, names: tuple[str, ...], q: Any, moving: slice, period: float
    ) -> None:
        """``moving`` are the positions ``q`` of ``names`` that commands move, in their order."""
        self._client, self._names, self._moving, self._period = client, names, moving, period
        self._lock = threading.Lock()
        self.q = np.array(q)
        self.passed = [self.q.copy()]
        """Where it has been."""
        self.commands: list[np.ndarray] = []
        self.is_silent = False
        self._publisher = client.publisher(JointState, "/joint_states")
        self._subscription = client.node.create_subscription(
            Float64MultiArray, topic, self._take, 100
        )
        self._timer = client.node.create_timer(_TOLD_PERIOD, self._tell)

    def close(self) -> None:
        """End."""
        self._client.run(lambda: self._client.node.destroy_timer(self._timer), "timer")
        self._client.destroy(self._subscription)
        self._client.destroy(self._publisher)

    def _take(self, message: Any) -> None:
        velocity = np.array(message.data)
        with self._lock:
            self.q = self.q.copy()
            self.q[self._moving] += self._period * velocity
            self.passed.append(self.q)
            self.commands.append(velocity)
        self._tell()

    def _tell(self) -> None:
        if self.is_silent:
            return
        message = JointState(name=list(self._names), position=self.q.tolist())
        message.header.stamp = self._client.now()
        self._publisher.publish(message)
