"""A source of one's own: frames that it moves, geometry on them, and links that carry them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TYPE_CHECKING

from numpy.typing import ArrayLike
from sensor_msgs.msg import JointState, MultiDOFJointState

from scene_graph_msgs.msg import (
    FrameDescription,
    GeometryDescription,
    Property,
    RoleProperties,
    Shape,
    SourceHandle,
)
from scene_graph_ros.client.connection import Connection, WorldError
from scene_graph_ros.client.poses import as_matrix, matrix_of, pose_msg, transform_msg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["Publishers", "Source", "as_what_if", "checked_pose_type", "made_source"]

_MULTI_DOF = "sensor_msgs/msg/MultiDOFJointState"


class Publishers:
    """Publishers of poses and joints; the first message waits until the node listens."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._known: dict[str, Any] = {}

    def _publish(self, topic: str, message: Any) -> None:
        publisher = self._known.get(topic)
        if publisher is None:
            node = self._connection.node
            publisher = self._known[topic] = node.create_publisher(type(message), topic, 10)
        wait = self._connection.wait
        wait(publisher.get_subscription_count, f"a subscription of the node to {topic}")
        publisher.publish(message)

    def move(self, topic: str, poses: Mapping[str, ArrayLike]) -> None:
        """Publish poses of frames by name, stamped now."""
        message = MultiDOFJointState(
            joint_names=list(poses), transforms=[transform_msg(X) for X in poses.values()]
        )
        message.header.stamp = self._connection.node.get_clock().now().to_msg()
        self._publish(topic, message)

    def joints(self, topic: str, positions: Mapping[str, float]) -> Any:
        """Publish positions of joints by name, stamped now, and return the stamp."""
        message = JointState(name=list(positions), position=[float(v) for v in positions.values()])
        message.header.stamp = self._connection.node.get_clock().now().to_msg()
        self._publish(topic, message)
        return message.header.stamp


class Source:
    """Owns frames and geometry in the node, and alone changes them; `World.source` makes it."""

    def __init__(
        self, connection: Connection, publishers: Publishers, handle: SourceHandle, topic: str
    ) -> None:
        self._connection, self._publishers = connection, publishers
        self.handle = handle
        """With the token: who has it may change what the source owns."""
        self.topic = topic

    @property
    def name(self) -> str:
        """The source's name."""
        name: str = self.handle.name
        return name

    def __repr__(self) -> str:
        return f"Source({self.name!r})"[:200]

    def add_frame(self, name: str, X_PF: ArrayLike = (0, 0, 0), *, parent: str = "") -> None:
        """Add a frame at ``X_PF`` ``(4, 4)``, or at a place ``(3,)``, in the world or a parent.

        Raises WorldError where the node refuses, ValueError for an array that is no pose.
        """
        frame = FrameDescription(name=name, parent=parent, pose=pose_msg(X_PF))
        self._connection.ask("RegisterFrame", source=self.handle, frames=[frame])

    def add_geometry(
        self,
        name: str,
        shape: Shape,
        X_FG: ArrayLike = (0, 0, 0),
        *,
        frame: str = "",
        color: Iterable[float] | None = None,
    ) -> int:
        """Add geometry, such as ``box(0.1, 0.1, 0.1)``, on a frame, else anchored to the world.

        It collides and is shown, in ``color`` (red, green, blue, 0 to 1). Returns its id. Raises
        as `add_frame`.
        """
        seen = RoleProperties(role=RoleProperties.ILLUSTRATION)
        if color is not None:
            value = [float(each) for each in color]
            value += [1.0] * (4 - len(value))
            diffuse = Property(group="phong", name="diffuse", type=Property.RGBA, doubles=value)
            seen.properties = [diffuse]
        roles = [RoleProperties(role=RoleProperties.PROXIMITY), seen]
        geometry = GeometryDescription(name=name, shape=shape, pose=pose_msg(X_FG), roles=roles)
        fields: dict[str, Any] = {"source": self.handle, "geometries": [geometry]}
        if frame:
            response = self._connection.ask("RegisterGeometry", frame=frame, **fields)
        else:
            response = self._connection.ask("RegisterAnchoredGeometry", **fields)
        return int(response.geometry_ids[0])

    def move(self, poses: Mapping[str, ArrayLike]) -> None:
        """Publish poses ``(4, 4)`` or positions ``(3,)`` of frames in their parents, by name.

        The first time it waits until the node listens, so that nothing is lost.
        """
        self._publishers.move(self.topic, poses)

    def attach(
        self,
        frame: str,
        link: str,
        X_LF: ArrayLike | None = None,
        *,
        touch_links: Iterable[str] = (),
    ) -> NDArray[np.float64]:
        """Have a robot's link carry a frame, where it is or at ``X_LF``; return X_LF ``(4, 4)``.

        Links that may touch it, as fingers do, are ``touch_links``. Raises as `add_frame`.
        """
        fields: dict[str, Any] = (
            {} if X_LF is None else {"with_pose": True, "pose": pose_msg(X_LF)}
        )
        touch = list(touch_links)
        response = self._connection.ask(
            "AttachFrame", source=self.handle, frame=frame, link=link, touch_links=touch, **fields
        )
        return matrix_of(response.pose)

    def detach(self, frame: str) -> NDArray[np.float64]:
        """Have the link let go; return where the frame stays in the world, ``(4, 4)``."""
        response = self._connection.ask("DetachFrame", source=self.handle, frame=frame)
        return matrix_of(response.pose)

    def remove(self) -> None:
        """Remove the source with all that it owns."""
        self._connection.ask("RemoveSource", source=self.handle)


def made_source(connection: Connection, publishers: Publishers, name: str, token: int) -> Source:
    """Register a source, or get one back by its token. Raises WorldError."""
    try:
        response = connection.ask("RegisterSource", name=name, token=token)
    except WorldError as error:
        if error.code != "NAME_CONFLICT":
            raise
        raise WorldError(
            f"{error}. Remedy: another name, or the token that the source was made with; to move"
            " frames of a source that somebody else has, World.move",
            error.code,
        ) from None
    return Source(connection, publishers, response.source, response.pose_topic)


def checked_pose_type(source: Any) -> None:
    """Raise WorldError unless a source takes the messages of `Publishers.move`."""
    if source.pose_type != _MULTI_DOF:
        raise WorldError(
            f"source {source.name!r} takes {source.pose_type or 'no poses'}, not {_MULTI_DOF}",
            "INVALID_ARGUMENT",
        )


def as_what_if(poses: Mapping[str, ArrayLike]) -> dict[str, Any]:
    """Return frames and numbers of poses in the world's or parent's frame, as WhatIf has them."""
    numbers: list[float] = []
    for X in poses.values():
        pose = pose_msg(as_matrix(X))
        p, q = pose.position, pose.orientation
        numbers += [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
    return {"frames": list(poses), "poses": numbers}
