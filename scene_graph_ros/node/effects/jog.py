"""Jogging: velocities that are asked for, as commands that keep a robot's distance.

Imported where the parameter `jog` names a robot. It takes commands and computes in a thread of its
own, at `jog_rate` while something is asked for or the robot moves, and else not at all.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
import time
import traceback
from typing import Any

import numpy as np
from rclpy.duration import Duration
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory

from msg_adapters.arrays import float64s_to_msg
from msg_adapters.jogging import velocities_to_msg, velocity_point_to_msg
from msg_adapters.poses import header_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_msgs.msg import JogStatus
from scene_graph_ros.node.effects.effect import Host, Outlet
from scene_graph_ros.node.effects.jog_commands import JogCommands
from scene_graph_ros.node.effects.jog_robot import JogRobot, JogSettings, JogStep
from scene_graph_ros.node.runtime.loop import OwnThreadGroup, Topic, UpdateLoop
from scene_graph_ros.node.runtime.names import JOG_STATUS, JOG_VELOCITIES
from scene_graph_ros.node.runtime.precedence import Precedence
from scene_graph_ros.node.runtime.qos import contact_qos, overridable
from scene_graph_ros.node.world.world import WorldSnapshot

__all__ = ["Jog"]

_RECENT = 1000
"""Ticks whose times are remembered."""

_IDLE_RATE = 0.5
"""Hz: how often the thread looks whether there is something to do; commands wake it."""

_SAME = 1e-9
"""rad/s or m/s: velocities that differ by less are the same."""

_LAST_SECONDS = 0.1
"""How long the end waits for the last command to arrive."""


class Jog:
    """Follows commands, in a thread of its own."""

    def __init__(self, host: Host) -> None:
        """Advertise and subscribe."""
        self._host, self._node = host, host.node
        self._settings = settings = JogSettings.of(host.parameter)
        self._is_trajectory = host.parameter("jog_output") == "trajectory"
        self._status = Outlet(host, JogStatus, JOG_STATUS, contact_qos())
        self._publisher = self._node.create_publisher(
            JointTrajectory if self._is_trajectory else Float64MultiArray,
            JOG_VELOCITIES,
            contact_qos(),
            callback_group=host.group,
            qos_overriding_options=overridable(),
        )
        host.publishers_changed()
        self._robot = JogRobot(settings)
        group = OwnThreadGroup()
        self._commands = JogCommands(
            self._node,
            group,
            settings,
            lambda: self._robot.scene,
            host.world_frame,
            lambda: float(host.parameter("max_pose_lead")),
        )
        self._snapshot: WorldSnapshot | None = None
        self._is_active = self._is_closed = False
        self._reason = self._failure = ""
        self._seconds: deque[float] = deque(maxlen=_RECENT)
        self._spent: deque[float] = deque(maxlen=_RECENT)
        """Of the processor, for the same ticks."""
        self._ticks = self._late = 0
        self._last_tick: int | None = None
        self._loop = UpdateLoop(
            self._node,
            group,
            self._tick,
            topics=self._topics,
            max_rate=lambda: settings.rate,
            min_rate=lambda: settings.rate if self._is_active else _IDLE_RATE,
            precedence=Precedence(),
            name="jog",
        )
        self._loop.start()

    # As an effect.

    def is_heard(self) -> bool:
        """Tell whether somebody takes the velocities, or reads the status."""
        return self._publisher.get_subscription_count() > 0 or self._status.is_heard()

    def prepare(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: slow work is done in a thread of its own."""

    def has_work(self) -> bool:
        """Tell that snapshots are wanted."""
        return True

    def update(self, snapshot: WorldSnapshot) -> None:
        """Hand the snapshot to that thread."""
        is_first, self._snapshot = self._snapshot is None, snapshot
        if is_first:
            self._loop.request()

    def vanish(self, snapshot: WorldSnapshot) -> None:
        """Do nothing: the end sends rest."""

    def close(self) -> None:
        """End; the last command is rest."""
        self._loop.stop()
        self._is_closed = True
        self._commands.close()
        scene = self._robot.scene
        if scene is not None and not self._robot.is_at_rest:
            rest = np.zeros(len(scene.robots.tree.position_names))
            self._send(JogStep(scene, rest, rest, None, None, ""), self._now())
            self._publisher.wait_for_all_acked(Duration(seconds=_LAST_SECONDS))
        self._node.destroy_publisher(self._publisher)
        self._status.close()
        self._host.publishers_changed()

    def failure(self) -> str:
        """Return the error of the last tick, "" where there was none."""
        return self._failure

    def stale(self) -> str:
        """Say why the robot brakes, "" while it does not."""
        return self._reason

    def recent_seconds(self) -> list[float]:
        """Return the times (s) of the last ticks."""
        return list(self._seconds)

    def count(self) -> int:
        """Return the number of ticks."""
        return self._ticks

    def counters(self) -> Mapping[str, Any]:
        """Return counts of commands, and times of ticks."""
        commands = self._commands
        return {
            "commands taken": commands.taken,
            "commands refused": commands.refusals,
            "last refused": commands.refused or "none",
            "joint commands": commands.missing or "taken",
            "ticks that came a period late": self._late,
            **_quantiles("tick", list(self._seconds)),
            **_quantiles("tick's processor time", list(self._spent)),
        }

    # In its own thread.

    def _topics(self) -> list[Topic]:
        return list(self._commands.topics)

    def _now(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)

    def _tick(self) -> None:
        """Send the velocities of the next period, where something is asked for or moves."""
        asked, snapshot = self._commands.newest(), self._snapshot
        if snapshot is None:
            return
        begin, spent, now = time.perf_counter(), time.thread_time(), self._now()
        try:
            trouble = self._robot.see(snapshot)
            if asked is None and self._robot.is_at_rest and not self._is_active:
                # By now the names of commands are known.
                self._reason = trouble
                return
            self._count_late()
            step = self._robot.brake(trouble, now) if trouble else self._robot.step(asked, now)
            self._failure = ""
        except Exception as error:  # noqa: BLE001 - the robot brakes, and the node goes on
            self._failure = f"{type(error).__name__}: {error}"
            self._node.get_logger().error(
                f"jogging failed:\n{traceback.format_exc()}", throttle_duration_sec=1.0
            )
            step = self._robot.brake(self._failure, now)
        self._reason = step.reason
        self._is_active = asked is not None or not self._robot.is_at_rest
        if not self._is_active:
            self._last_tick = None
        self._send(step, now)
        self._tell(step, now, is_asked=asked is not None)
        self._seconds.append(time.perf_counter() - begin)
        self._spent.append(time.thread_time() - spent)
        self._ticks += 1

    def _count_late(self) -> None:
        """Count ticks before which the last velocity was held for longer than was proven."""
        now, last = time.monotonic_ns(), self._last_tick
        if last is not None and (now - last) * 1e-9 > 2.0 / self._settings.rate:
            self._late += 1
        self._last_tick = now

    def _send(self, step: JogStep, now: int) -> None:
        scene = step.scene
        if scene is None:
            return
        velocities = step.velocity[scene.moving]
        if not self._is_trajectory:
            self._publisher.publish(velocities_to_msg(velocities))
            return
        period = 1.0 / self._settings.rate
        # A controller of positions stays where it is, where it is not known where that is.
        positions = np.zeros(0)
        if step.positions is not None:
            positions = step.positions[scene.moving] + period * velocities
        self._publisher.publish(
            velocity_point_to_msg(scene.joint_names, velocities, positions, now, int(period * 1e9))
        )

    def _tell(self, step: JogStep, now: int, *, is_asked: bool) -> None:
        """Publish the status, where somebody reads it."""
        if not self._status.is_heard():
            return
        message = JogStatus(
            header=header_to_msg(now, self._host.world_frame),
            state=self._state(step, is_asked=is_asked),
            reason=step.reason,
            proven_until=stamp_to_msg(now),
            refused=self._commands.refused,
            refusals=self._commands.refusals,
        )
        scene, safe, snapshot = step.scene, step.safe, self._snapshot
        if scene is not None:
            message.names = list(scene.names)
            message.asked = float64s_to_msg(step.asked[scene.moving])
            message.velocities = float64s_to_msg(step.velocity[scene.moving])
        if safe is not None and snapshot is not None:
            message.proven_until = stamp_to_msg(now + int(1e9 * safe.proven_until))
            message.brake_time = safe.brake_time
            name = snapshot.names.geometry_name
            if safe.nearest is not None:
                message.nearest_a, message.nearest_b = map(name, safe.nearest.pair)
                message.nearest_distance = safe.nearest.distance
            message.active_a = [name(each.pair[0]) for each in safe.active]
            message.active_b = [name(each.pair[1]) for each in safe.active]
            message.active_distances = float64s_to_msg([each.distance for each in safe.active])
        self._status.publish(message)

    def _state(self, step: JogStep, *, is_asked: bool) -> int:
        if step.safe is None or not is_asked:
            is_idle = not is_asked and not step.velocity.any()
            return int(JogStatus.IDLE if is_idle else JogStatus.BRAKING)
        if not step.safe.is_kept:
            return int(JogStatus.LOSING)
        is_same = np.abs(step.velocity - step.asked).max(initial=0.0) <= _SAME
        return int(JogStatus.FOLLOWING if is_same else JogStatus.HELD)


def _quantiles(what: str, seconds: list[float]) -> dict[str, float]:
    """Return the median and two more quantiles of times (s), by name; 0 for none."""
    values = np.percentile(seconds, [50.0, 99.0, 99.9]) if seconds else np.zeros(3)
    words = ("median", "99th percentile", "99.9th percentile")
    return {f"{what} {w} (s)": float(s) for w, s in zip(words, values, strict=True)}
