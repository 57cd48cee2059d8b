"""The robot that is jogged, and the filter of its velocities, as of a snapshot of the world.

Imported with the effect `jog`. It is where its last positions were, moved on by the velocities
that were sent since their stamp; where these are not known, or too old, it brakes.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.node.effects.jog_scene import jog_scene, JogScene
from scene_graph_ros.node.world.intake import UNSTAMPED
from scene_graph_ros.node.world.world import STATIC, WorldSnapshot
from scene_graph_ros.planning import SafeStep, SafeVelocity
from scene_graph_ros.trajectories import MotionLimits

__all__ = ["JogRobot", "JogSettings", "JogStep", "Wanted"]

Wanted = Callable[[JogScene, NDArray[np.float64]], NDArray[np.float64]]
"""Returns the velocities ``(nq,)`` that a command asks for, of a scene at a configuration."""

_MOST_SENT = 4096
"""Velocities that are remembered: four seconds at the highest rate."""

_MOST_NAMED = 5
"""Joints that a reason names."""


class JogSettings(NamedTuple):
    """The parameters of jogging, without ``jog_``; see ``jog_parameters``."""

    part: str
    link: str
    rate: float
    keep: float
    gain: float
    acceleration: float
    self_padding: float
    obstacle_speed: float
    timeout: float
    max_state_age: float
    max_pose_age: float

    @classmethod
    def of(cls, parameter: Callable[[str], Any]) -> JogSettings:
        """Return the node's."""
        others = (parameter(f"jog_{name}") for name in cls._fields[1:])
        return cls(parameter("jog"), *others)


class JogStep(NamedTuple):
    """The velocities for the next period, ``(nq,)`` rad/s and m/s as all arrays of it."""

    scene: JogScene | None
    """None where there is no robot that could be jogged."""
    asked: NDArray[np.float64]
    velocity: NDArray[np.float64]
    positions: NDArray[np.float64] | None
    """Where the robot is, None where that is not known."""
    safe: SafeStep | None
    """The filter's answer, None where the robot brakes without one."""
    reason: str
    """Why it brakes, "" where it does not."""


_NONE = np.zeros(0)


class JogRobot:
    """Filters velocities of one robot; for one thread."""

    def __init__(self, settings: JogSettings) -> None:
        """Take the settings; the robot is looked for with the first snapshot."""
        self._settings = settings
        self.scene: JogScene | None = None
        """The newest one, which other threads may read, too."""
        self._snapshot: WorldSnapshot | None = None
        self._barrier: SafeVelocity | None = None
        self._velocity = _NONE
        self._sent: deque[tuple[int, NDArray[np.float64]]] = deque(maxlen=_MOST_SENT)

    @property
    def is_at_rest(self) -> bool:
        """Whether the velocity that was sent last is zero."""
        return not self._velocity.any()

    def see(self, snapshot: WorldSnapshot) -> str:
        """Follow the world; return why its robot can't be jogged, "" where it can."""
        if snapshot is self._snapshot:
            return "" if self._barrier is not None else "the robot can't be jogged"
        try:
            self._follow(snapshot)
        except SceneGraphError as error:
            self._snapshot = self._barrier = None
            return str(error)
        self._snapshot = snapshot
        return ""

    def step(self, asked: Wanted | None, now: int) -> JogStep:
        """Return the velocities from ``now`` (ns of the node's clock) for a period.

        ``asked`` returns the velocities asked for, of a scene and a configuration; without it
        rest is. To be called when ``see`` returned "".
        """
        scene, snapshot, barrier = self.scene, self._snapshot, self._barrier
        assert scene is not None
        assert snapshot is not None
        assert barrier is not None
        reason = self._unknown(scene, snapshot, now) or self._stale_others(scene, snapshot, now)
        if reason:
            return self.brake(reason, now)
        settings, period = self._settings, 1.0 / self._settings.rate
        q = self._by_now(scene, snapshot, now)
        obstacles = None
        if settings.obstacle_speed > 0.0:
            obstacles = dict.fromkeys(scene.moving_frames, settings.obstacle_speed)
        try:
            wanted = np.zeros(len(q)) if asked is None else asked(scene, q)
            safe = barrier.filter(q, wanted, period, self._velocity, obstacles)
        except SceneGraphError as error:
            return self.brake(str(error), now)
        self._send(safe.velocity, now)
        return JogStep(scene, wanted, safe.velocity, q, safe, "")

    def brake(self, reason: str, now: int) -> JogStep:
        """Return the velocities of a robot that brakes along its line, as proven before."""
        if self._barrier is None:
            # The model that limits its acceleration is gone.
            velocity = np.zeros_like(self._velocity)
        else:
            velocity = self._barrier.brake(1.0 / self._settings.rate, self._velocity)
        self._send(velocity, now)
        return JogStep(self.scene, np.zeros_like(velocity), velocity, None, None, reason)

    def _send(self, velocity: NDArray[np.float64], now: int) -> None:
        self._velocity = velocity
        self._sent.append((now, velocity))

    # What a snapshot says.

    def _follow(self, snapshot: WorldSnapshot) -> None:
        """Have a filter of this moment. Raises SceneGraphError where the robot can't be jogged."""
        settings, before = self._settings, self.scene
        core = snapshot.query.snapshot
        robots = snapshot.robots.planning(core, snapshot.bases)
        checker = robots.checker(core, environment_padding=0.0, self_padding=settings.self_padding)
        scene = before
        if before is None or robots is not before.robots:
            scene = jog_scene(robots, checker, snapshot, settings.part, settings.link)
        assert scene is not None
        if self._barrier is None or before is None or not scene.goes_on(before):
            limits = MotionLimits.of_tree(
                robots.tree, accelerations=settings.acceleration, positions=scene.moving
            )
            barrier = SafeVelocity(checker, settings.keep, settings.gain, limits)
            self._velocity = _by_name(self._velocity, before, scene)
            self._sent.clear()
            self._barrier = barrier
        else:
            self._barrier.move_to(checker)
        self.scene = scene

    def _unknown(self, scene: JogScene, snapshot: WorldSnapshot, now: int) -> str:
        """Say why it is not known where the robot is, "" where it is."""
        stamp, most = snapshot.source_stamp(scene.robot), self._settings.max_state_age
        if stamp == UNSTAMPED:
            stamps = snapshot.stamps[scene.robot].joint_stamps
            never = [name for name, each in stamps.items() if each == UNSTAMPED]
            more = len(never) - _MOST_NAMED
            listed = ", ".join(never[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
            return f"nobody has reported where {listed or 'the joints'} of {scene.robot} are"
        return _too_old(f"the positions of {scene.robot}", stamp, now, most, "jog_max_state_age")

    def _stale_others(self, scene: JogScene, snapshot: WorldSnapshot, now: int) -> str:
        """Name a source around the robot that is not heard any more, "" where all are."""
        most = self._settings.max_pose_age
        if most == 0.0:
            return ""
        for name in scene.others:
            stamp = snapshot.source_stamp(name)
            if stamp == UNSTAMPED:
                return f"nobody has said where {name} is, and jog_max_pose_age is {most:g} s"
            old = _too_old(f"the poses of {name}", stamp, now, most, "jog_max_pose_age")
            if old:
                return old
        return ""

    def _by_now(self, scene: JogScene, snapshot: WorldSnapshot, now: int) -> NDArray[np.float64]:
        """Return the configuration ``(nq,)`` at a time (ns)."""
        q = scene.robots.present(snapshot.positions)
        stamp = snapshot.source_stamp(scene.robot)
        tree, moved = scene.robots.tree, q.copy()
        for begin, end, velocity in self._since(stamp, now):
            moved += velocity * ((end - begin) * 1e-9)
        return np.clip(moved, np.minimum(tree.lower, q), np.maximum(tree.upper, q))

    def _since(self, stamp: int, now: int) -> Iterator[tuple[int, int, NDArray[np.float64]]]:
        """Yield the intervals (ns) from a stamp on, and the velocity that was sent for each."""
        end = now
        for at, velocity in reversed(self._sent):
            if end <= stamp:
                return
            begin = max(at, stamp)
            if begin < end:
                yield begin, end, velocity
                end = begin


def _too_old(what: str, stamp: int, now: int, most: float, parameter: str) -> str:
    """Say that something is older than a parameter allows (s), "" where it is not."""
    age = 0.0 if stamp == STATIC else (now - stamp) * 1e-9
    return f"{what} are {age:.3f} s old, and {parameter} is {most:g} s" if age > most else ""


def _by_name(
    velocity: NDArray[np.float64], before: JogScene | None, scene: JogScene
) -> NDArray[np.float64]:
    """Return a velocity in the order of another scene's positions; what is new there rests."""
    result = np.zeros(scene.robots.tree.num_positions)
    if before is not None and len(velocity):
        known = dict(zip(before.robots.tree.position_names, velocity, strict=True))
        for row in scene.moving:
            result[row] = known.get(scene.robots.tree.position_names[row], 0.0)
    return result
