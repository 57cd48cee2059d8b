"""Stamps of poses against the node's clock: the limits of each update, and jumps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TYPE_CHECKING

from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.node import Node

from scene_graph_ros.node.diagnostics import Monitor
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.subscriptions import Subscriptions
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.node.world.world import World

if TYPE_CHECKING:
    from scene_graph_ros.node.recording.recorder import Recorder

__all__ = ["ClockWatch"]


class ClockWatch:
    """Has stamps forgotten that the clock makes impossible, and counts its jumps."""

    def __init__(
        self,
        node: Node,
        world: World,
        subscriptions: Subscriptions,
        monitor: Monitor,
        parameter: Callable[[str], Any],
        recorder: Callable[[], Recorder | None],
        request_update: Callable[[], None],
    ) -> None:
        """Watch the node's clock until `close`."""
        self._node, self._world, self._subscriptions = node, world, subscriptions
        self._monitor, self._parameter, self._recorder = monitor, parameter, recorder
        self._request_update = request_update
        self._jump_handle = node.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._on_jump,
        )

    def close(self) -> None:
        """Watch no more."""
        self._jump_handle.unregister()

    def limits(self) -> TimeLimits:
        """Return the limits of stamps at this moment."""
        return TimeLimits(
            self._node.get_clock().now().nanoseconds,
            int(self._parameter("max_pose_age") * 1e9),
            int(self._parameter("max_pose_lead") * 1e9),
        )

    def forget_impossible_stamps(self, limits: TimeLimits) -> None:
        """Forget stamps from a future that the limits no longer allow; the world is locked.

        They were taken before simulated time began, or before the system's clock was put back,
        of which nobody is told. To keep them would make all poses until then out of order.
        """
        now, _, last = limits.bounds()
        lead = self._world.snapshot.stamp - now
        if self._world.snapshot.stamp > last:
            self._monitor.clock_jumps += 1
            self._node.get_logger().warning(
                f"the clock began, or was put back: poses are stamped {lead * 1e-9:.3f} s in "
                "its future, so their stamps are forgotten"
            )
            self._forget(last, last)

    def _forget(self, after: int, recorded: int | None) -> None:
        """Forget stamps later than that; the poses hold."""
        self._world.forget_stamps(after)
        self._subscriptions.forget(after)
        recorder = self._recorder()
        if recorder is not None:
            recorder.stamps_forgotten(recorded)

    def _on_jump(self, jump: TimeJump) -> None:
        self._monitor.clock_jumps += 1
        self._node.get_logger().warning(
            "the clock jumped back or changed its source: stamps of earlier poses are forgotten"
        )
        with self._world.lock:
            self._subscriptions.discard()
            self._forget(UNSTAMPED, None)
        self._request_update()
