"""Motions that pages have executed: published as trajectories, one at a time.

Imported only where the parameter `browser_execute` asks for it.
"""

from __future__ import annotations

import threading
from typing import Any

from trajectory_msgs.msg import JointTrajectory

from msg_adapters.errors import UnavailableError
from msg_adapters.stamps import duration_from_msg, stamp_from_msg, stamp_to_msg
from scene_graph_ros.node.effects.effect import Host
from scene_graph_ros.node.runtime.names import TRAJECTORY
from scene_graph_ros.node.runtime.qos import contact_qos, overridable

__all__ = ["PageExecution"]


class PageExecution:
    """Publishes trajectories; any thread may call."""

    def __init__(self, host: Host) -> None:
        """Advertise the topic."""
        self._node = host.node
        self._publisher = host.node.create_publisher(
            JointTrajectory,
            TRAJECTORY,
            contact_qos(),
            callback_group=host.group,
            qos_overriding_options=overridable(),
        )
        host.publishers_changed()
        self._host = host
        self._lock = threading.Lock()
        self._last: JointTrajectory | None = None
        self.count = 0
        """Trajectories that were published."""

    def begin(self, trajectory: JointTrajectory, now: int) -> None:
        """Have a motion begin now (ns). Raises UnavailableError while another one goes on."""
        with self._lock:
            self._require_rest(now)
            trajectory.header.stamp = stamp_to_msg(now)
            self._publish(trajectory)

    def require_rest(self, now: int) -> None:
        """Raise UnavailableError while a motion goes on."""
        with self._lock:
            self._require_rest(now)

    def replace(self, trajectory: JointTrajectory, before: JointTrajectory) -> None:
        """Have a motion go on in place of another. Raises UnavailableError for a third one."""
        with self._lock:
            if self._last is not before:
                raise UnavailableError("the motion that it replaces was replaced by another page")
            self._publish(trajectory)

    def executing(self, now: int) -> JointTrajectory | None:
        """Return the motion that is executed at a time (ns), None where there is none."""
        with self._lock:
            return self._last if self._seconds_left(now) > 0.0 else None

    def close(self) -> None:
        """Stop being advertised."""
        self._node.destroy_publisher(self._publisher)
        self._host.publishers_changed()

    def _require_rest(self, now: int) -> None:
        left = self._seconds_left(now)
        if left > 0.0:
            raise UnavailableError(
                f"another motion is executed for {left:.1f} s: wait for its end, or replace it"
            )

    def _seconds_left(self, now: int) -> float:
        last: Any = self._last
        if last is None:
            return 0.0
        end = stamp_from_msg(last.header.stamp) + duration_from_msg(
            last.points[-1].time_from_start
        )
        return max(0.0, (end - now) * 1e-9)

    def _publish(self, trajectory: JointTrajectory) -> None:
        self._last = trajectory
        self._publisher.publish(trajectory)
        self.count += 1
        seconds = duration_from_msg(trajectory.points[-1].time_from_start) * 1e-9
        self._node.get_logger().info(
            f"a page has a motion of {seconds:.2f} s executed: {len(trajectory.points)} points of"
            f" {', '.join(trajectory.joint_names)}"
        )
