"""Edits that remove sources, frames, geometries and roles, with all that hangs on them."""

from __future__ import annotations

from collections.abc import Iterable

from scene_graph_ros.geometry.errors import OwnershipError
from scene_graph_ros.geometry.model.derived import Part
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.records import GeometryRecord, WORLD_FRAME_ID
from scene_graph_ros.geometry.model.roles import checked_role, Role
from scene_graph_ros.geometry.model.state import GeometryState

__all__ = ["remove_frame", "remove_geometry", "remove_role", "remove_source"]


def remove_geometry(edit: Edit, source_id: SourceId, geometry_id: GeometryId) -> None:
    """Remove a geometry of the source and every geometry that hangs on it."""
    edit.state.own_geometry(source_id, geometry_id)
    _remove_geometries(edit, _with_all_below(edit.state, [geometry_id]))


def remove_frame(edit: Edit, source_id: SourceId, frame_id: FrameId) -> None:
    """Remove a frame of the source, the frames below it and all their geometries."""
    state = edit.state
    if state.frame(frame_id).id == WORLD_FRAME_ID:
        raise OwnershipError("the world frame cannot be removed")
    state.own_frame(source_id, frame_id)
    frames = _frames_below(state, [frame_id])
    _remove_frames(edit, frames)
    _remove_geometries(edit, _geometries_on(state, frames))


def remove_source(edit: Edit, source_id: SourceId) -> None:
    """Remove a source with all its frames and geometries."""
    state = edit.state
    state.require_source(source_id)
    if source_id == state.frames[WORLD_FRAME_ID].source_id:
        raise OwnershipError("the source of the world frame cannot be removed")
    frames = _frames_below(state, state.source_frames[source_id])
    _remove_frames(edit, frames)
    on_world = state.frame_geometries[WORLD_FRAME_ID]
    anchored = [i for i in on_world if state.geometries[i].source_id == source_id]
    _remove_geometries(edit, [*_geometries_on(state, frames), *_with_all_below(state, anchored)])
    edit.drop(state.source_by_name, state.source_names[source_id])
    edit.drop(state.source_names, source_id)
    edit.drop(state.source_frames, source_id)
    edit.changed(Part.FRAMES)


def remove_role(edit: Edit, source_id: SourceId, target: FrameId | GeometryId, role: Role) -> int:
    """Take a role from a geometry, or from the source's geometries on a frame; count them.

    UNASSIGNED, which is the absence of roles, is taken from none.
    """
    state = edit.state
    checked_role(role)
    if isinstance(target, FrameId):
        state.require_source(source_id)
        if target != WORLD_FRAME_ID:
            state.own_frame(source_id, target)
        candidates = [
            state.geometries[i]
            for i in state.frame_geometries[target]
            if state.geometries[i].source_id == source_id
        ]
    else:
        candidates = [state.own_geometry(source_id, target)]
    affected = [record for record in candidates if role in record.properties]
    for record in affected:
        properties = {r: p for r, p in record.properties.items() if r is not role}
        edit.put((state.geometries, record.id, record._replace(properties=properties)))
    _unlist_roles(edit, affected, (role,))
    return len(affected)


def _unlist_roles(
    edit: Edit, records: Iterable[GeometryRecord], roles: Iterable[Role] = Role
) -> None:
    """Take some roles of geometries from the indices, and say that these roles have changed."""
    state, near = edit.state, []
    for record in records:
        for role in roles:
            if role in record.properties:
                edit.drop(state.with_role[role], record.id)
                edit.drop(state.geometry_by_name, (record.frame_id, role, record.name))
                edit.changed(role)
                if role is Role.PROXIMITY:
                    near.append(record.id)
    if near:
        state.filters.forget(edit, near)


def _frames_below(state: GeometryState, frame_ids: Iterable[FrameId]) -> list[FrameId]:
    """Return frames, and all that hang on them."""
    found = dict.fromkeys(frame_ids)
    pending = list(found)
    while pending:
        children = [i for i in state.frame_children[pending.pop()] if i not in found]
        found.update(dict.fromkeys(children))
        pending += children
    return list(found)


def _remove_frames(edit: Edit, frame_ids: Iterable[FrameId]) -> None:
    state = edit.state
    for frame_id in frame_ids:
        record = state.frames[frame_id]
        edit.drop(state.frames, frame_id)
        edit.drop(state.frame_by_name, (record.source_id, record.name))
        edit.drop(state.source_frames[record.source_id], frame_id)
        edit.drop(state.frame_children[record.parent_id], frame_id)
        edit.drop(state.frame_children, frame_id)
        edit.drop(state.frame_geometries, frame_id)
    edit.changed(Part.FRAMES)


def _geometries_on(state: GeometryState, frame_ids: Iterable[FrameId]) -> list[GeometryId]:
    """Return all geometries on frames: a child geometry is on its parent's frame."""
    return [i for frame_id in frame_ids for i in state.frame_geometries[frame_id]]


def _with_all_below(state: GeometryState, geometry_ids: Iterable[GeometryId]) -> list[GeometryId]:
    """Return geometries, and all that hang on them."""
    found = dict.fromkeys(geometry_ids)
    pending = list(found)
    while pending:
        children = state.geometry_children.get(pending.pop(), {})
        pending += [i for i in children if i not in found]
        found.update(dict.fromkeys(children))
    return list(found)


def _remove_geometries(edit: Edit, geometry_ids: Iterable[GeometryId]) -> None:
    state = edit.state
    records = {i: state.geometries[i] for i in geometry_ids}
    left: dict[GeometryId, set[GeometryId]] = {}
    for geometry_id, record in records.items():
        edit.drop(state.geometries, geometry_id)
        edit.drop(state.geometry_children, geometry_id)
        edit.drop(state.frame_geometries[record.frame_id], geometry_id)
        parent_id = record.parent_id
        if parent_id is not None and parent_id not in records:
            siblings = state.geometry_children[parent_id]
            edit.drop(siblings, geometry_id)
            left.setdefault(parent_id, set(siblings)).discard(geometry_id)
    for parent_id, siblings_left in left.items():
        if not siblings_left:
            edit.drop(state.geometry_children, parent_id)
    edit.changed()
    _unlist_roles(edit, records.values())
