"""A robot that follows velocities by the times of their commands, however late these arrive."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from msg_adapters.stamps import stamp_from_msg, stamp_to_msg
from scene_graph_msgs.msg import JogStatus

__all__ = ["VelocityRobot"]

_TOLD_PERIOD = 0.01

_DELAY = 300_000_000
"""How old (ns) the positions are that it tells: by then it has heard each command of that time."""

_HELD = 100_000_000
"""How long (ns) it holds a velocity."""


class VelocityRobot:
    """Holds each velocity until the next one's stamp, for 0.1 s at most."""

    def __init__(self, client: Any, names: tuple[str, ...], q: Any, moving: slice) -> None:
        """``moving`` are the positions ``q`` of ``names`` that commands move, in their order."""
        self._client, self._names, self._moving = client, names, moving
        self._history = [(0, np.array(q), np.zeros(len(names)))]
        self.commands: list[NDArray[np.float64]] = []
        """The velocities that were sent."""
        self.is_silent = False
        node = client.node
        self._publisher = client.publisher(JointState, "/joint_states")
        self._subscriptions = [
            node.create_subscription(JogStatus, "/scene_graph/jog_status", self._take, 1000),
            node.create_subscription(
                Float64MultiArray, "/scene_graph/jog_velocities", self._hear, 1000
            ),
        ]
        self._timer = node.create_timer(_TOLD_PERIOD, self._tell)

    @property
    def q(self) -> NDArray[np.float64]:
        """Where it was when the newest command was sent."""
        return self._history[-1][1]

    @property
    def passed(self) -> list[NDArray[np.float64]]:
        """Where it has been, by commands."""
        return [q for _, q, _ in self._history]

    @property
    def longest_period(self) -> float:
        """The longest time (s) between two commands that do not begin at rest."""
        stamps = [(stamp, velocity.any()) for stamp, _, velocity in self._history[1:]]
        periods = (after - at for (at, moves), (after, _) in pairwise(stamps) if moves)
        return 1e-9 * max(periods, default=0)

    @property
    def is_at_rest(self) -> bool:
        """Whether the newest command of both topics is rest, and all others agree, too."""
        statuses = [velocity[self._moving] for _, _, velocity in self._history[1:]]
        both = min(len(statuses), len(self.commands))
        return both == 0 or bool(
            np.array_equal(statuses[-both:], self.commands[-both:]) and not statuses[-1].any()
        )

    def close(self) -> None:
        """End."""
        self._client.run(lambda: self._client.node.destroy_timer(self._timer), "timer")
        for each in (*self._subscriptions, self._publisher):
            self._client.destroy(each)

    def _hear(self, message: Any) -> None:
        self.commands.append(np.array(message.data))

    def _take(self, message: Any) -> None:
        stamp, velocity = stamp_from_msg(message.header.stamp), np.zeros(len(self._names))
        velocity[self._moving] = message.velocities
        self._history.append((stamp, self._at(stamp), velocity))

    def _at(self, stamp: int) -> NDArray[np.float64]:
        """Return the positions at a time (ns)."""
        at, q, velocity = next(each for each in reversed(self._history) if each[0] <= stamp)
        return q + velocity * (min(stamp - at, _HELD) * 1e-9)

    def _tell(self) -> None:
        if self.is_silent:
            return
        stamp = stamp_from_msg(self._client.now()) - _DELAY
        message = JointState(name=list(self._names), position=self._at(stamp).tolist())
        message.header.stamp = stamp_to_msg(stamp)
        self._publisher.publish(message)
