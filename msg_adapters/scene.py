"""Parts of a scene: registration requests to the core's objects, and descriptions back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.errors import MessageError
from msg_adapters.names import SceneNames
from msg_adapters.poses import pose_from_msg, pose_to_msg, poses_to_msg
from msg_adapters.properties import (
    properties_from_msg,
    properties_to_msg,
    resolve_files,
    role_to_msg,
)
from msg_adapters.shapes import (
    resolve_file,
    Resolver,
    shape_from_msg,
    shape_kind_to_msg,
    shape_to_msg,
)
from msg_adapters.stamps import stamp_to_msg
from scene_graph_msgs.msg import (
    CollisionFilterStatement,
    FrameDescription,
    FrameInfo,
    GeometryDescription,
    GeometryInfo,
    RoleProperties,
    SourceInfo,
)
from scene_graph_msgs.msg import GeometrySet as GeometrySetMsg
from scene_graph_msgs.msg import Shape as ShapeMsg
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterDeclaration
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import draw_items

__all__ = [
    "filter_from_msg",
    "frame_from_msg",
    "frame_to_msg",
    "frames_to_msg",
    "geometries_to_msg",
    "geometry_set_from_msg",
    "instance_from_msg",
    "instance_to_msg",
    "marker_items",
    "source_to_msg",
]

_ASSIGNED_ROLES = (Role.PROXIMITY, Role.ILLUSTRATION, Role.PERCEPTION)


def frame_from_msg(msg: FrameDescription) -> tuple[GeometryFrame, NDArray[np.float64]]:
    """Return the frame F to register and its first pose ``X_PF``; its parent is ``msg.parent``.

    Raises InvalidPoseError, NameConflictError for an empty name, MessageError for a negative
    group.
    """
    if msg.frame_group < 0:
        raise MessageError(f"frame {quoted(msg.name)}: frame_group {msg.frame_group} is negative")
    X_PF = pose_from_msg(msg.pose, f"frame {msg.name}")
    return GeometryFrame(msg.name, msg.frame_group), X_PF


def frame_to_msg(
    frame: GeometryFrame, X_PF: NDArray[np.float64], parent: str = ""
) -> FrameDescription:
    """Return the request for a frame that starts at ``X_PF`` in the frame called ``parent``."""
    return FrameDescription(
        name=frame.name(),
        parent=parent,
        frame_group=frame.frame_group(),
        pose=pose_to_msg(X_PF),
    )


def instance_from_msg(
    msg: GeometryDescription, resolve: Resolver = resolve_file
) -> GeometryInstance:
    """Return the geometry to register, with its roles.

    Raises the errors of poses, shapes and properties, and MessageError for a role given twice.
    """
    X_PG = pose_from_msg(msg.pose, f"geometry {msg.name}")
    instance = GeometryInstance(X_PG, shape_from_msg(msg.shape, resolve), msg.name)
    roles = [role.role for role in msg.roles]
    if len(set(roles)) != len(roles):
        raise MessageError(f"geometry {quoted(msg.name)} names a role more than once: {roles}")
    for role in msg.roles:
        properties = properties_from_msg(role)
        resolve_files(properties, resolve)
        instance.set_properties(properties)
    return instance


def instance_to_msg(instance: GeometryInstance) -> GeometryDescription:
    """Return the request that registers ``instance``."""
    given = (
        instance.proximity_properties(),
        instance.illustration_properties(),
        instance.perception_properties(),
    )
    return GeometryDescription(
        name=instance.name(),
        shape=shape_to_msg(instance.shape()),
        pose=pose_to_msg(instance.pose()),
        roles=[properties_to_msg(properties) for properties in given if properties is not None],
    )


def geometry_set_from_msg(msg: GeometrySetMsg, names: SceneNames) -> GeometrySet:
    """Return the set; raises UnknownIdError or NameConflictError for names in it."""
    return GeometrySet(
        [names.geometry_id(reference) for reference in msg.geometries],
        [names.frame_id(frame) for frame in msg.frames],
    )


def filter_from_msg(
    statements: Sequence[CollisionFilterStatement], names: SceneNames
) -> CollisionFilterDeclaration:
    """Return the declaration that makes these statements in their order.

    Raises UnknownIdError or NameConflictError for names, MessageError for an unknown operation.
    """
    declaration = CollisionFilterDeclaration()
    within = {
        CollisionFilterStatement.EXCLUDE_WITHIN: declaration.exclude_within,
        CollisionFilterStatement.ALLOW_WITHIN: declaration.allow_within,
    }
    between = {
        CollisionFilterStatement.EXCLUDE_BETWEEN: declaration.exclude_between,
        CollisionFilterStatement.ALLOW_BETWEEN: declaration.allow_between,
    }
    for statement in statements:
        set_A = geometry_set_from_msg(statement.a, names)
        if statement.operation in within:
            within[statement.operation](set_A)
        elif statement.operation in between:
            between[statement.operation](set_A, geometry_set_from_msg(statement.b, names))
        else:
            raise MessageError(f"collision filter operation {statement.operation} is unknown")
    return declaration


def source_to_msg(
    source_id: SourceId,
    name: str,
    *,
    pose_topic: str = "",
    pose_type: str = "",
    configuration_topic: str = "",
    stamp_ns: int = 0,
) -> SourceInfo:
    """Return the description of a source."""
    return SourceInfo(
        id=int(source_id),
        name=name,
        pose_topic=pose_topic,
        pose_type=pose_type,
        configuration_topic=configuration_topic,
        stamp=stamp_to_msg(stamp_ns),
    )


def frames_to_msg(
    inspector: Any,
    names: SceneNames,
    frame_ids: Sequence[FrameId],
    pose_in_world: Callable[[FrameId], NDArray[np.float64]],
) -> list[FrameInfo]:
    """Return the descriptions of frames; ``pose_in_world`` gives ``X_WF`` of each."""
    poses = poses_to_msg(np.array([pose_in_world(f) for f in frame_ids]).reshape(-1, 4, 4))
    parents = [inspector.get_parent_frame(frame_id) for frame_id in frame_ids]
    return [
        FrameInfo(
            id=int(frame_id),
            name=inspector.get_name(frame_id),
            source=names.source_name(frame_id),
            parent_id=int(parent),
            parent=inspector.get_name(parent),
            frame_group=inspector.get_frame_group(frame_id),
            pose=pose,
        )
        for frame_id, parent, pose in zip(frame_ids, parents, poses, strict=True)
    ]


def geometries_to_msg(
    inspector: Any,
    names: SceneNames,
    geometry_ids: Iterable[GeometryId],
    *,
    with_shapes: bool,
    with_properties: bool,
) -> list[GeometryInfo]:
    """Return the descriptions of geometries, with their poses ``X_FG`` in their frames.

    Raises MessageError for a property of a type that messages don't carry.
    """
    result = []
    for geometry_id in geometry_ids:
        roles = _roles(inspector, geometry_id)
        shape = inspector.get_shape(geometry_id)
        description = GeometryDescription(
            name=inspector.get_name(geometry_id),
            shape=shape_to_msg(shape) if with_shapes else ShapeMsg(kind=shape_kind_to_msg(shape)),
            pose=pose_to_msg(inspector.get_pose_in_frame(geometry_id)),
            roles=[_role_to_msg(properties, with_properties) for properties in roles],
        )
        result.append(
            GeometryInfo(
                geometry=names.geometry_name(geometry_id),
                roles=[role_to_msg(properties.role) for properties in roles],
                is_deformable=inspector.is_deformable(geometry_id),
                description=description,
            )
        )
    return result


def _roles(inspector: Any, geometry_id: GeometryId) -> list[GeometryProperties]:
    given = [inspector.get_properties(geometry_id, role) for role in _ASSIGNED_ROLES]
    return [properties for properties in given if properties is not None]


def _role_to_msg(properties: GeometryProperties, with_properties: bool) -> RoleProperties:
    if with_properties:
        return properties_to_msg(properties)
    return RoleProperties(role=role_to_msg(properties.role))


def marker_items(
    inspector: Any,
    names: SceneNames,
    role: Role,
    geometry_ids: Iterable[GeometryId | int],
    *,
    mesh_hulls: bool = False,
) -> list[DrawItem]:
    """Return the drawings of geometries with ``role``, in their order: see ``draw_items``."""
    ids = [names.geometry_id(int(value)) for value in geometry_ids]
    return draw_items(inspector, role, ids, mesh_hulls=mesh_hulls)
