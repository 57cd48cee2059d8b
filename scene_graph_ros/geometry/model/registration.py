"""Edits that add sources, frames and geometries."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.errors import DeformableError, NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.deformable import Deformable
from scene_graph_ros.geometry.model.derived import Part
from scene_graph_ros.geometry.model.edit import Edit
from scene_graph_ros.geometry.model.frame import GeometryFrame
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.model.perception_properties import read_perception_properties
from scene_graph_ros.geometry.model.proximity import with_proximity
from scene_graph_ros.geometry.model.records import (
    FrameRecord,
    GeometryRecord,
    refuse_deformable,
    WORLD_FRAME_ID,
)
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.state import GeometryState, ROLES
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import compose

__all__ = [
    "add_frame",
    "add_geometry",
    "add_source",
    "check_deformable_frame",
    "check_instance",
    "check_name_is_free",
]


def add_source(edit: Edit, name: str) -> SourceId:
    """Add a source; an empty name becomes one made of its id."""
    state = edit.state
    source_id = SourceId.get_new_id()
    if not isinstance(name, str):
        raise NameConflictError(f"the name of a source must be text, not {quoted(name)}")
    label = canonical_name("source", name) if name else f"source_{int(source_id)}"
    if label in state.source_by_name:
        raise NameConflictError(
            f"the source name {label!r} is taken by {state.source_by_name[label]!r}"
        )
    edit.put(
        (state.source_names, source_id, label),
        (state.source_by_name, label, source_id),
        (state.source_frames, source_id, {}),
    )
    edit.changed(Part.FRAMES)
    return source_id


def add_frame(
    edit: Edit, source_id: SourceId, frame: GeometryFrame, parent_id: FrameId
) -> FrameId:
    """Add a frame below a frame of the same source, or below the world."""
    state = edit.state
    state.require_source(source_id)
    if not isinstance(frame, GeometryFrame):
        raise TypeError(f"register_frame needs a GeometryFrame, not {quoted(frame)}")
    if state.frame(parent_id).id != WORLD_FRAME_ID:
        state.own_frame(source_id, parent_id)
    source = state.source_names[source_id]
    if frame.id() in state.frames:
        raise NameConflictError(f"frame {frame.name()!r} ({frame.id()!r}) is registered already")
    if (source_id, frame.name()) in state.frame_by_name:
        raise NameConflictError(f"source {source!r} has a frame named {frame.name()!r} already")
    record = FrameRecord(frame.id(), source_id, parent_id, frame.name(), frame.frame_group())
    edit.put(
        (state.frames, record.id, record),
        (state.frame_by_name, (source_id, record.name), record.id),
        (state.source_frames[source_id], record.id, None),
        (state.frame_children[parent_id], record.id, None),
        (state.frame_children, record.id, {}),
        (state.frame_geometries, record.id, {}),
    )
    edit.changed(Part.FRAMES)
    return record.id


def check_name_is_free(state: GeometryState, frame_id: FrameId, role: Role, name: str) -> None:
    """Raise NameConflictError if a geometry on the frame has this role and name."""
    taken = state.geometry_by_name.get((frame_id, role, name))
    if taken is not None:
        raise NameConflictError(
            f"frame {state.frames[frame_id].name!r} has a geometry named {name!r} with role"
            f" {role.name} already: {taken!r}"
        )


def check_instance(instance: Any) -> None:
    """Raise TypeError unless it is a GeometryInstance."""
    if not isinstance(instance, GeometryInstance):
        raise TypeError(f"registering a geometry needs a GeometryInstance, not {quoted(instance)}")


def check_deformable_frame(state: GeometryState, source_id: SourceId, frame_id: FrameId) -> None:
    """Raise DeformableError unless the frame is the world; UnknownIdError for unknown ids."""
    state.require_source(source_id)
    record = state.frame(frame_id)
    if record.id != WORLD_FRAME_ID:
        raise DeformableError(
            f"a deformable geometry cannot hang on frame {record.name!r} ({frame_id!r}): its"
            " vertices move on their own, so its frame is the world"
        )


def add_geometry(
    edit: Edit,
    source_id: SourceId,
    parent: FrameId | GeometryId,
    instance: GeometryInstance,
    deformable: Deformable | None = None,
) -> GeometryId:
    """Add a geometry on a frame, the world or another geometry, with the roles it has.

    With ``deformable`` it is one, and its parent must be the world.
    """
    state = edit.state
    state.require_source(source_id)
    record = _record(state, source_id, parent, instance, deformable)
    if record.id in state.geometries:
        raise NameConflictError(
            f"geometry {record.name!r} ({record.id!r}) is registered already:"
            " register a new instance or a clone"
        )
    for role, properties in record.properties.items():
        check_name_is_free(state, record.frame_id, role, record.name)
        if role is Role.PROXIMITY:
            record = with_proximity(record, properties, state.config)
        elif role is Role.PERCEPTION:
            read_perception_properties(properties, record.name)
    edit.put(
        (state.geometries, record.id, record),
        (state.frame_geometries[record.frame_id], record.id, None),
    )
    if record.parent_id is not None:
        siblings = state.geometry_children.get(record.parent_id)
        if siblings is None:
            edit.put((state.geometry_children, record.parent_id, {record.id: None}))
        else:
            edit.put((siblings, record.id, None))
    for role in record.properties:
        edit.put(
            (state.geometry_by_name, (record.frame_id, role, record.name), record.id),
            (state.with_role[role], record.id, None),
        )
    edit.changed(*record.properties)
    return record.id


def _record(
    state: GeometryState,
    source_id: SourceId,
    parent: Any,
    instance: GeometryInstance,
    deformable: Deformable | None,
) -> GeometryRecord:
    """Return the record of an instance on its parent, which the source must be allowed to use."""
    X_PG = instance.pose()
    if isinstance(parent, FrameId):
        if parent != WORLD_FRAME_ID:
            state.own_frame(source_id, parent)
        frame_id, parent_id, X_FG = parent, None, X_PG
    elif isinstance(parent, GeometryId):
        parent_record = state.own_geometry(source_id, parent)
        refuse_deformable(parent_record, "nothing can hang on it")
        frame_id, parent_id = parent_record.frame_id, parent
        X_FG = compose(parent_record.X_FG, X_PG)
        X_FG.setflags(write=False)
    else:
        raise UnknownIdError(
            f"a geometry hangs on a FrameId or a GeometryId, not on {quoted(parent)}"
        )
    return GeometryRecord(
        id=instance.id(),
        source_id=source_id,
        frame_id=frame_id,
        parent_id=parent_id,
        name=instance.name(),
        shape=instance.shape(),
        X_PG=X_PG,
        X_FG=X_FG,
        properties={
            properties.role: properties.read_only_copy()
            for role in ROLES
            if (properties := instance.properties(role)) is not None
        },
        deformable=deformable,
    )
