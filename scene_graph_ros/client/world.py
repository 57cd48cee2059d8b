"""The world that a node holds, as scripts and notebooks see it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import TracebackType
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rclpy.duration import Duration

from scene_graph_msgs.msg import GeometryReference, QueryOptions, WhatIf
from scene_graph_ros.client.answers import contact_table, Distance, distance_table, scene_table
from scene_graph_ros.client.connection import Connection, WorldError
from scene_graph_ros.client.constraints import constraint_msg
from scene_graph_ros.client.execution import Execution
from scene_graph_ros.client.pictures import pixels_of
from scene_graph_ros.client.plans import FoundPlan, Planner
from scene_graph_ros.client.poses import matrix_of
from scene_graph_ros.client.sources import (
    as_what_if,
    checked_pose_type,
    made_source,
    Publishers,
    Source,
)
from scene_graph_ros.client.table import Table

if TYPE_CHECKING:
    from rclpy.node import Node

__all__ = ["World"]


class World:
    """Asks a node of scene_graph_ros and waits for its answers.

    It is a context manager: ``with World() as world``. Every method waits for at most ``timeout``
    seconds, and raises WorldError with a sentence where nobody answers or the node refuses. Names
    of geometries are paths, ``source/frame/geometry``, or the last part where it is unique; frames
    likewise. Poses are ``(4, 4)`` in metres, and where a place is enough ``(3,)``.
    """

    def __init__(
        self,
        node: Node | None = None,
        *,
        name: str = "scene_graph",
        namespace: str | None = None,
        timeout: float = 10.0,
    ) -> None:
        """Talk to the node called ``name`` in ``namespace``, by default that of ``node``, or "/".

        A ``node`` of yours gives its context and namespace; without one rclpy is started for this
        world alone. A thread of the world waits for answers, so calls are fine in callbacks, too.
        """
        self._connection = Connection(node, name, namespace, timeout)
        self._publishers = Publishers(self._connection)
        self._planner = Planner(self._connection)

    def __enter__(self) -> World:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"World({self._connection.target!r})"[:200]

    @property
    def connection(self) -> Connection:
        """Services and topics of the node, where this class has no method."""
        return self._connection

    def close(self) -> None:
        """End; sources stay in the node."""
        self._planner.close()
        self._connection.close()

    def wait_until_ready(self, timeout: float | None = None) -> World:
        """Wait until the node answers, and return this world. Raises WorldError."""
        self._connection.ask("DescribeScene", timeout=timeout)
        return self

    # What is there.

    def geometries(self) -> Table:
        """Return all geometries: ``source``, ``frame``, ``name``, ``id``, and their place (m)."""
        return scene_table(self._connection.ask("DescribeScene"))

    def sources(self) -> dict[str, str]:
        """Return the sources by name, with the topic of their poses; empty where none come."""
        found = self._connection.ask("DescribeScene").sources
        return {source.name: source.pose_topic for source in found}

    def pose(self, name: str) -> NDArray[np.float64]:
        """Return the pose of a frame or a geometry in the world, ``(4, 4)``. Raises WorldError."""
        try:
            answer = self._connection.ask("GetPoseInWorld", frames=[name])
        except WorldError as error:
            if error.code != "UNKNOWN_NAME":
                raise
            reference = GeometryReference(name=name)
            answer = self._connection.ask("GetPoseInWorld", geometries=[reference])
        return matrix_of(answer.poses[0])

    # What touches.

    def contacts(self, where: Mapping[str, ArrayLike] | None = None) -> Table:
        """Return the contacts, the deepest first.

        Columns are ``A``, ``B``, ``depth`` (m), ``point_A``, ``point_B`` (m) and ``normal``, out
        of B into A. ``where`` are poses of frames in their parents, by
        name, that are asked about in place of the present ones; nothing is moved.
        """
        answer = self._connection.ask("ComputePointPairPenetration", options=_options(where))
        return contact_table(answer.table)

    def has_collisions(self, where: Mapping[str, ArrayLike] | None = None) -> bool:
        """Tell whether anything penetrates; ``where`` as in `contacts`."""
        answer = self._connection.ask("HasCollisions", options=_options(where))
        return bool(answer.has_collisions[0])

    def distances(
        self, max_distance: float = 0.1, where: Mapping[str, ArrayLike] | None = None
    ) -> Table:
        """Return pairs up to a distance (m), the nearest first.

        Columns are ``A``, ``B``, ``distance`` (m) and ``normal``; ``where`` as in `contacts`.
        """
        limit = [] if np.isinf(max_distance) else [float(max_distance)]
        answer = self._connection.ask(
            "ComputeSignedDistancePairwise", options=_options(where), max_distance=limit
        )
        return distance_table(answer.table)

    def distance(self, A: str, B: str) -> Distance:
        """Return the distance of two geometries, also where a filter excludes them.

        In the answer A is the one that was registered first. Raises WorldError for a name that is
        unknown or ambiguous.
        """
        answer = self._connection.ask(
            "ComputeSignedDistancePair", geometries_a=[A], geometries_b=[B]
        )
        return Distance.of(answer.pairs[0])

    # Who moves.

    def source(self, name: str, *, token: int = 0) -> Source:
        """Register a source, whose frames and geometry this program adds and moves.

        With a ``token`` of one's own a program that was restarted gets its source back. Raises
        WorldError where the name is taken.
        """
        return made_source(self._connection, self._publishers, name, token)

    def move(self, source: str, poses: Mapping[str, ArrayLike]) -> None:
        """Send poses of frames of a source of the scene, by name, as its tracker would.

        Raises WorldError where there is no such source, or it takes other messages.
        """
        found = self._connection.ask("DescribeScene", source=source).sources
        checked_pose_type(found[0])
        self._publishers.move(found[0].pose_topic, poses)

    def move_joints(self, positions: Mapping[str, float], *, robot: str = "") -> None:
        """Tell positions of joints (rad, m), as a robot's driver would: for a robot without one.

        Returns when the node has taken them, so that the next question is about them. ``robot``
        is the robot's source, where there are several. Raises WorldError where there is no such
        robot or joint, and where the node does not take the positions.
        """
        topics = {
            s.name: s.pose_topic
            for s in self._connection.ask("DescribeScene").sources
            if s.pose_type == "sensor_msgs/msg/JointState"
        }
        source = next(iter(topics)) if len(topics) == 1 and not robot else robot
        if source not in topics:
            names = ", ".join(sorted(topics)) or "none"
            raise WorldError(f"robot {robot!r}: the scene has {names}", "UNKNOWN_NAME")
        stamp = self._publishers.joints(topics[source], positions)
        named = [f"{source}/{joint}" for joint in positions]
        options = QueryOptions(minimal_stamp=stamp, minimal_stamp_sources=named)
        seconds = self._connection.timeout
        options.timeout = Duration(seconds=seconds).to_msg()
        # The node is to be the one that ends the waiting: it says what is missing.
        self._connection.ask("GetPoseInWorld", options=options, timeout=2.0 * seconds)

    # Plans.

    def plan(
        self,
        goal: Mapping[str, float] | None = None,
        *,
        pose: tuple[str, ArrayLike] | None = None,
        group: str = "",
        constraints: Iterable[Any] = (),
        padding: float = 0.0,
        max_acceleration: float = 1.0,
        speed: float = 1.0,
        timeout: float = 5.0,
        seed: int = 0,
        watch: Callable[[str, float], None] | None = None,
    ) -> FoundPlan:
        """Ask for a path from where the robots are, and a trajectory, both proven free.

        ``goal`` are positions of joints by name (rad, m), or ``pose`` a link and where it is to be
        in the world. ``group`` is the SRDF's, whose joints may move; ``padding`` (m) is kept from
        all else; ``max_acceleration`` is in rad/s^2 or m/s^2, ``speed`` the share of the joints'
        velocities. ``watch`` is told the present step, and for how long (s). ``constraints`` on
        links hold at all times: those of `scene_graph_ros.planning`, or LinkConstraint messages.

        Where there is no path the answer says why. Raises WorldError where the node can't work on
        the goal, such as for a name that is unknown, and ValueError for no goal or two.
        """
        return self._planner.plan(
            goal,
            pose,
            timeout=timeout,
            watch=watch,
            max_acceleration=max_acceleration,
            speed=speed,
            group=group,
            constraints=[constraint_msg(each) for each in constraints],
            environment_padding=float(padding),
            seed=seed,
        )

    def execute(
        self,
        plan: FoundPlan,
        topic: str = "joint_trajectory_controller/joint_trajectory",
        *,
        joint_states: str = "joint_states",
        tolerance: float = 0.01,
    ) -> Execution:
        """Send a plan's trajectory to a controller, and return how far it is.

        ``wait()`` of the answer waits until the joints are within ``tolerance`` (rad, m) of their
        ends, as ``joint_states`` tell, ``stop()`` has the robot hold. Raises WorldError where
        there is no trajectory, and where no controller listens.
        """
        return Execution(self._connection, plan, topic, joint_states, tolerance)

    # Pictures.

    def picture(self, camera: str, kind: str = "color") -> NDArray[Any]:
        """Return the image of a camera of the scene: ``(h, w, 3)`` uint8, or ``(h, w)``.

        ``kind`` is "color", "depth" (float32, m; inf where nothing is) or "label" (uint16).
        """
        answer = self._connection.ask("RenderImages", camera=camera, images=[kind])
        return pixels_of(getattr(answer, kind)[0])


def _options(where: Mapping[str, ArrayLike] | None) -> QueryOptions:
    return QueryOptions(what_if=WhatIf(**as_what_if(where or {})))
