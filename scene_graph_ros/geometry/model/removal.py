"""Removing sources, frames, geometries and roles from a state, with all that hangs on them."""

from __future__ import annotations

from collections.abc import Iterable
import dataclasses

from scene_graph_ros.geometry.errors import OwnershipError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.records import GeometryRecord, WORLD_FRAME_ID
from scene_graph_ros.geometry.model.roles import checked_role, Role
from scene_graph_ros.geometry.model.state import GeometryState, ROLES

__all__ = ["remove_frame", "remove_geometry", "remove_role", "remove_source"]


def remove_geometry(state: GeometryState, source_id: SourceId, geometry_id: GeometryId) -> None:
    """Remove a geometry of the source and every geometry that hangs on it."""
    state.own_geometry(source_id, geometry_id)
    _remove_geometries(state, [geometry_id])


def remove_frame(state: GeometryState, source_id: SourceId, frame_id: FrameId) -> None:
    """Remove a frame of the source, the frames below it and all their geometries."""
    if state.frame(frame_id).id == WORLD_FRAME_ID:
        raise OwnershipError("the world frame cannot be removed")
    state.own_frame(source_id, frame_id)
    _remove_frames(state, [frame_id])


def remove_source(state: GeometryState, source_id: SourceId) -> None:
    """Remove a source with all its frames and geometries."""
    state.require_source(source_id)
    if source_id == state.frames[WORLD_FRAME_ID].source_id:
        raise OwnershipError("the source of the world frame cannot be removed")
    _remove_frames(state, list(state.source_frames[source_id]))
    anchored = state.frame_geometries[WORLD_FRAME_ID]
    _remove_geometries(state, [i for i in anchored if state.geometries[i].source_id == source_id])
    del state.source_by_name[state.source_names.pop(source_id)]
    del state.source_frames[source_id]
    state.changed(frames=True)


def remove_role(
    state: GeometryState, source_id: SourceId, target: FrameId | GeometryId, role: Role
) -> int:
    """Take a role from a geometry, or from the source's geometries on a frame; count them.

    UNASSIGNED, which is the absence of roles, is taken from none.
    """
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
        _unlist_role(state, record, role)
        properties = {r: p for r, p in record.properties.items() if r is not role}
        state.geometries[record.id] = dataclasses.replace(record, properties=properties)
    if affected:
        state.changed(roles=(role,))
    return len(affected)


def _unlist_role(state: GeometryState, record: GeometryRecord, role: Role) -> None:
    del state.with_role[role][record.id]
    del state.geometry_by_name[record.frame_id, role, record.name]
    if role is Role.PROXIMITY:
        state.filters.forget(record.id)


def _remove_frames(state: GeometryState, frame_ids: list[FrameId]) -> None:
    pending = [frame_id for frame_id in frame_ids if frame_id in state.frames]
    while pending:
        frame_id = pending.pop()
        record = state.frames.get(frame_id)
        if record is None:
            continue
        pending.extend(state.frame_children.pop(frame_id))
        _remove_geometries(state, list(state.frame_geometries.pop(frame_id)))
        del state.frames[frame_id]
        del state.frame_by_name[record.source_id, record.name]
        del state.source_frames[record.source_id][frame_id]
        siblings = state.frame_children.get(record.parent_id)
        if siblings is not None:
            del siblings[frame_id]
    state.changed(frames=True)


def _remove_geometries(state: GeometryState, geometry_ids: Iterable[GeometryId]) -> None:
    pending = list(geometry_ids)
    roles: set[Role] = set()
    while pending:
        record = state.geometries.pop(pending.pop(), None)
        if record is None:
            continue
        pending.extend(state.geometry_children.pop(record.id, ()))
        for role in record.properties:
            _unlist_role(state, record, role)
        roles.update(record.properties)
        # Its frame or parent may be on its way out, and no longer listed.
        state.frame_geometries.get(record.frame_id, {}).pop(record.id, None)
        if record.parent_id is not None:
            siblings = state.geometry_children.get(record.parent_id, {})
            siblings.pop(record.id, None)
            if not siblings:
                state.geometry_children.pop(record.parent_id, None)
    state.changed(roles=[role for role in ROLES if role in roles])
