"""Commands that jog a robot: taken from their topics, checked, and kept until they are too old.

A command that is refused changes nothing: the one before counts as long as it would have.
"""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any, NamedTuple

from geometry_msgs.msg import TwistStamped
import numpy as np
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from msg_adapters.errors import MessageError
from msg_adapters.jogging import joint_velocities_from_msg, twist_from_msg
from msg_adapters.message_classes import class_of_kind, UnknownKindError
from msg_adapters.poses import meant_name
from msg_adapters.stamps import checked_stamp_from_msg
from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.effects.jog_robot import JogSettings, Wanted
from scene_graph_ros.node.effects.jog_scene import JogScene
from scene_graph_ros.node.runtime.loop import OwnThreadGroup
from scene_graph_ros.node.runtime.names import JOG_JOINTS, JOG_TWIST
from scene_graph_ros.node.runtime.qos import overridable, pose_qos
from scene_graph_ros.planning import SafeVelocityError

__all__ = ["JogCommands"]

_JOINT_JOG = "control_msgs/msg/JointJog"

_QUEUED = 4
"""Messages that the middleware holds until they are taken."""

_NEAR_SINGULAR = 0.05
"""Singular values of a Jacobian below it are damped (Nakamura and Hanafusa, 1986)."""

_DAMPING = 0.05


class _Kept(NamedTuple):
    wanted: Wanted
    until: int
    """ns of the steady clock."""


class _Topic:
    """One topic of commands, as the thread that takes them sees it."""

    def __init__(self, subscription: Any, store: Callable[[Any, int], None]) -> None:
        self.subscription, self._store = subscription, store

    def counts(self, data: bytes) -> bool:
        return True

    def store(self, data: bytes, arrival: int) -> None:
        self._store(deserialize_message(data, self.subscription.msg_type), arrival)


class JogCommands:
    """The newest command; messages are stored and asked for in one thread."""

    def __init__(
        self,
        node: Node,
        group: OwnThreadGroup,
        settings: JogSettings,
        scene: Callable[[], JogScene | None],
        world_frame: str,
        max_lead: Callable[[], float],
    ) -> None:
        """Subscribe; ``max_lead`` returns how far ahead (s) a stamp may be."""
        self._node, self._settings, self._scene = node, settings, scene
        self._world_frame, self._max_lead = world_frame, max_lead
        self._kept: _Kept | None = None
        self.refused, self.refusals, self.taken = "", 0, 0
        """The newest message that was refused, and why; how many were; and how many were not."""
        self.missing = ""
        """Why no velocities of joints are taken, "" where they are."""
        self.topics: list[_Topic] = []
        kinds = [(TwistStamped, JOG_TWIST, self._take_twist)]
        try:
            kinds.append((class_of_kind(_JOINT_JOG), JOG_JOINTS, self._take_joints))
        except UnknownKindError as error:
            self.missing = f"velocities of joints are not taken: {error}"
            node.get_logger().warning(self.missing)
        for kind, name, read in kinds:
            subscription = node.create_subscription(
                kind,
                name,
                _never,
                pose_qos(_QUEUED),
                callback_group=group,
                raw=True,
                qos_overriding_options=overridable(),
            )
            self.topics.append(_Topic(subscription, self._guarded(name, read)))

    def newest(self) -> Wanted | None:
        """Return the newest command, None where it is too old."""
        kept = self._kept
        return None if kept is None or time.monotonic_ns() > kept.until else kept.wanted

    def close(self) -> None:
        """Take no more; to be called while nobody takes messages."""
        for topic in self.topics:
            self._node.destroy_subscription(topic.subscription)
        self.topics.clear()

    def _guarded(
        self, name: str, read: Callable[[Any, JogScene], tuple[Wanted, float]]
    ) -> Callable[[Any, int], None]:
        topic = self._node.resolve_topic_name(name)

        def store(message: Any, arrival: int) -> None:
            try:
                scene = self._scene()
                if scene is None:
                    raise MessageError("there is no robot yet that could be jogged")
                wanted, duration = read(message, scene)
                left = self._time_left(message.header.stamp, duration)
            except SceneGraphError as error:
                self.refused, self.refusals = f"{topic}: {error}", self.refusals + 1
                self._node.get_logger().warning(
                    f"a command is refused: {self.refused}", throttle_duration_sec=1.0
                )
                return
            self._kept = _Kept(wanted, arrival + int(left * 1e9))
            self.taken += 1

        return store

    def _time_left(self, stamp: Any, duration: float) -> float:
        """Return for how long (s) a command counts. Raises MessageError for its stamp."""
        most, said = self._settings.timeout, checked_stamp_from_msg(stamp)
        age = 0.0
        if said != 0:
            age = (self._node.get_clock().now().nanoseconds - said) * 1e-9
        if age > most:
            raise MessageError(f"header.stamp is {age:.3f} s old, and jog_timeout is {most:g} s")
        if -age > self._max_lead():
            raise MessageError(f"header.stamp is {-age:.3f} s ahead of the node's clock")
        return min(duration or most, most) - max(age, 0.0)

    def _take_joints(self, message: Any, scene: JogScene) -> tuple[Wanted, float]:
        given = joint_velocities_from_msg(message, scene.robots.positions, scene.moving)
        names = [scene.robots.tree.position_names[row] for row in given.rows]

        def wanted(now: JogScene, q: NDArray[np.float64]) -> NDArray[np.float64]:
            result = np.zeros(len(q))
            rows = given.rows
            if now is not scene:
                rows = np.array([now.robots.positions.row(n, "joint_names") for n in names], int)
            result[rows] = given.values
            return result

        return wanted, given.duration

    def _take_twist(self, message: Any, scene: JogScene) -> tuple[Wanted, float]:
        if not scene.link:
            raise MessageError("parameter jog_link is empty: no link is there for a twist")
        twist, frame = twist_from_msg(message), meant_name(message.header.frame_id)
        link = ""
        if frame not in ("", self._world_frame):
            try:
                row = scene.robots.links.row(frame, "header.frame_id")
            except SceneGraphError as error:
                raise SafeVelocityError(
                    f"{error}; or {quoted(self._world_frame)}, the frame of the world"
                ) from error
            link = scene.robots.links.names[row]

        def wanted(now: JogScene, q: NDArray[np.float64]) -> NDArray[np.float64]:
            tree = now.robots.tree
            in_world = twist
            if link:
                R_WL = tree.link_poses(q, [link])[0, :3, :3]
                in_world = np.concatenate([R_WL @ twist[:3], R_WL @ twist[3:]])
            result = np.zeros(len(q))
            J = tree.jacobians(q, now.link)[:, now.moving]
            result[now.moving] = _of_twist(J, in_world, tree.velocity_limits[now.moving])
            return result

        return wanted, 0.0


def _of_twist(
    J: NDArray[np.float64], twist: NDArray[np.float64], limits: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the least velocities ``(k,)`` of joints for a twist ``(6,)``, shorter where too fast.

    Near singularities damped: then the link moves otherwise rather than joints without end.
    """
    U, sizes, Vt = np.linalg.svd(J, full_matrices=False)
    near = np.maximum(1.0 - sizes / _NEAR_SINGULAR, 0.0)
    factors = sizes / (sizes**2 + (_DAMPING * near) ** 2 + np.finfo(float).tiny)
    velocity: NDArray[np.float64] = Vt.T @ (factors * (U.T @ twist))
    return velocity / max(1.0, float((np.abs(velocity) / limits).max(initial=0.0)))


def _never(data: bytes) -> None:
    raise AssertionError("the jogging thread takes these messages")
