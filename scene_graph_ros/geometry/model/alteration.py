"""Edits of registered geometry: roles, shapes, poses and names."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.errors import NameConflictError, OwnershipError, RoleError
from scene_graph_ros.geometry.model.derived import Part
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.instance import checked_properties, checked_shape
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.geometry.model.proximity import with_proximity
from scene_graph_ros.geometry.model.records import (
    GeometryRecord,
    refuse_deformable,
    WORLD_FRAME_ID,
)
from scene_graph_ros.geometry.model.registration import check_name_is_free
from scene_graph_ros.geometry.model.roles import Role, RoleAssign
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.poses import as_pose, compose, inverse

__all__ = ["assign_role", "change_parent", "change_shape", "rename_frame", "rename_geometry"]


def assign_role(
    edit: Edit,
    source_id: SourceId,
    geometry_id: GeometryId,
    properties: Any,
    assign: RoleAssign,
) -> None:
    """Give a geometry the role of the properties, or replace the properties of its role."""
    state = edit.state
    record = state.own_geometry(source_id, geometry_id)
    properties = checked_properties(properties)
    if not isinstance(assign, RoleAssign):
        raise RoleError(f"assign must be RoleAssign.NEW or RoleAssign.REPLACE, not {assign!r}")
    role = properties.role
    has_role = role in record.properties
    label = f"geometry {record.name!r} ({geometry_id!r})"
    if assign is RoleAssign.NEW and has_role:
        raise RoleError(f"{label} has role {role.name} already; RoleAssign.REPLACE replaces it")
    if assign is RoleAssign.REPLACE and not has_role:
        raise RoleError(f"{label} has no role {role.name} that could be replaced")
    if not has_role:
        check_name_is_free(state, record.frame_id, role, record.name)
    if role is Role.PROXIMITY:
        record = with_proximity(record, properties, state.config)
    else:
        if role is Role.PERCEPTION:
            read_perception_properties(properties, record.name)
        changed = {**record.properties, role: properties.read_only_copy()}
        record = record._replace(properties=changed)
    edit.put((state.geometries, geometry_id, record))
    edit.put((state.geometry_by_name, (record.frame_id, role, record.name), geometry_id))
    edit.put((state.with_role[role], geometry_id, None))
    edit.changed(role)


def change_shape(
    edit: Edit,
    source_id: SourceId,
    geometry_id: GeometryId,
    shape: Shape,
    X_FG: Any | None,
) -> None:
    """Replace the shape, and the pose in its frame if one is given; hanging geometry follows."""
    state = edit.state
    record = state.own_geometry(source_id, geometry_id)
    refuse_deformable(record, "its reference mesh stays; register another geometry instead")
    changed = record._replace(shape=checked_shape(shape, record.name))
    if Role.PROXIMITY in changed.properties:
        assert changed.given is not None
        changed = with_proximity(changed, changed.given, state.config)
    if X_FG is not None:
        pose = as_pose(X_FG, f"X_FG of geometry {record.name!r}")
        changed = changed._replace(X_FG=pose, X_PG=_in_parent(state, changed, pose))
    edit.put((state.geometries, geometry_id, changed))
    edit.changed(*changed.properties)
    if X_FG is not None:
        _move_children(edit, changed)


def _in_parent(state: GeometryState, record: GeometryRecord, X_FG: Any) -> Any:
    if record.parent_id is None:
        return X_FG
    X_PG = compose(inverse(state.geometries[record.parent_id].X_FG), X_FG)
    X_PG.setflags(write=False)
    return X_PG


def _move_children(edit: Edit, moved: GeometryRecord) -> None:
    """Place the children of a geometry that has moved anew."""
    state, pending = edit.state, [moved]
    while pending:
        parent = pending.pop()
        for child_id in state.geometry_children.get(parent.id, ()):
            child = state.geometries[child_id]
            X_FG = compose(parent.X_FG, child.X_PG)
            X_FG.setflags(write=False)
            child = child._replace(X_FG=X_FG)
            edit.put((state.geometries, child_id, child))
            edit.changed(*child.properties)
            pending.append(child)


def change_parent(edit: Edit, source_id: SourceId, frame_id: FrameId, parent_id: FrameId) -> None:
    """Have a frame of the source hang on another frame, of any source, with all below it."""
    state = edit.state
    if state.frame(frame_id).id == WORLD_FRAME_ID:
        raise OwnershipError("the world frame hangs on nothing")
    record, parent = state.own_frame(source_id, frame_id), state.frame(parent_id)
    below = [frame_id]
    for each in below:
        below.extend(state.frame_children[each])
    if parent.id in below:
        raise NameConflictError(
            f"frame {record.name!r} cannot hang on {parent.name!r}, which is it or below it"
        )
    if parent.id != record.parent_id:
        edit.drop(state.frame_children[record.parent_id], frame_id)
        edit.put((state.frame_children[parent.id], frame_id, None))
    else:
        edit.move_to_end(state.frame_children[parent.id], frame_id, None)
    hung = {frame_id: record._replace(parent_id=parent.id)}
    for each in below:
        # Parents come before children.
        edit.move_to_end(state.frames, each, hung.get(each, state.frames[each]))
    edit.changed(Part.FRAMES)


def rename_frame(edit: Edit, source_id: SourceId, frame_id: FrameId, name: str) -> None:
    """Give a frame of the source another name, unique within the source."""
    state = edit.state
    if state.frame(frame_id).id == WORLD_FRAME_ID:
        raise OwnershipError("the world frame cannot be renamed")
    record = state.own_frame(source_id, frame_id)
    label = canonical_name("frame", name)
    if state.frame_by_name.get((source_id, label), frame_id) != frame_id:
        raise NameConflictError(
            f"source {state.source_names[source_id]!r} has a frame named {label!r} already"
        )
    edit.drop(state.frame_by_name, (source_id, record.name))
    edit.put((state.frame_by_name, (source_id, label), frame_id))
    edit.put((state.frames, frame_id, record._replace(name=label)))
    edit.changed(Part.FRAMES)


def rename_geometry(edit: Edit, source_id: SourceId, geometry_id: GeometryId, name: str) -> None:
    """Give a geometry of the source another name, unique on its frame for each of its roles."""
    state = edit.state
    record = state.own_geometry(source_id, geometry_id)
    label = canonical_name("geometry", name)
    if label == record.name:
        return
    for role in record.properties:
        check_name_is_free(state, record.frame_id, role, label)
    for role in record.properties:
        edit.drop(state.geometry_by_name, (record.frame_id, role, record.name))
        edit.put((state.geometry_by_name, (record.frame_id, role, label), geometry_id))
    edit.put((state.geometries, geometry_id, record._replace(name=label)))
    edit.changed()
