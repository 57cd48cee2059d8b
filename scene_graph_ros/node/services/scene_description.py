"""The answer to DescribeScene: sources, frames, geometries, cameras and renderers of a moment."""

from __future__ import annotations

from typing import Any

from msg_adapters.properties import role_from_msg
from msg_adapters.scene import frames_to_msg, geometries_to_msg, source_to_msg
from scene_graph_ros.node.services.queries import QueryScope
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_stamps import STATIC

__all__ = ["describe"]


def describe(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer DescribeScene."""
    snapshot = scope.snapshot
    records = sorted(snapshot.records.values(), key=lambda record: record.id)
    if request.source:
        source_id = snapshot.names.source_id(request.source)
        records = [record for record in records if record.id == source_id]
    _describe_sources(response, scope, records)
    _describe_geometry(request, response, scope, records)
    # Either adapter is imported with the first of its kind.
    if snapshot.cameras:
        from msg_adapters.cameras import scene_camera_to_msg

        owners = {record.name for record in records}
        cameras = [camera for _, camera in sorted(snapshot.cameras.items())]
        response.cameras = [scene_camera_to_msg(c) for c in cameras if c.source in owners]
    renderers = snapshot.query.snapshot.state.renderers
    if renderers:
        from msg_adapters.renderers import renderer_to_msg

        response.renderers = [renderer_to_msg(*each) for each in sorted(renderers.items())]


def _describe_sources(response: Any, scope: QueryScope, records: list[SourceRecord]) -> None:
    """Fill the sources: ids, names, topics, and the stamp of each one's newest poses."""
    snapshot = scope.snapshot
    pose_topics = scope.topics(snapshot, "poses")
    configuration_topics = scope.topics(snapshot, "configurations")
    response.sources = [
        source_to_msg(
            record.id,
            record.name,
            pose_topic=pose_topics.get(record.name, ""),
            pose_type=record.pose_type,
            configuration_topic=configuration_topics.get(record.name, ""),
            stamp_ns=_shown(snapshot.source_stamp(record.name)),
        )
        for record in records
    ]


def _shown(stamp: int) -> int:
    """Return a stamp as answers say it: 0 where no message was heard, or none is needed."""
    return 0 if stamp == STATIC else max(stamp, 0)


def _describe_geometry(
    request: Any, response: Any, scope: QueryScope, records: list[SourceRecord]
) -> None:
    """Fill the frames, and the geometries that have the role asked for."""
    snapshot = scope.snapshot
    inspector, names = snapshot.inspector, snapshot.names
    role = role_from_msg(request.role) if request.role else None
    frames = sorted(f for record in records for f in inspector.frames_for_source(record.id))
    pose_in_world = snapshot.query.snapshot.pose_in_world
    response.frames = frames_to_msg(inspector, names, frames, pose_in_world)
    geometries = sorted(
        geometry
        for record in records
        for geometry in inspector.get_geometries_for_source(record.id)
        if role is None or role in inspector.get_roles(geometry)
    )
    response.geometries = geometries_to_msg(
        inspector,
        names,
        geometries,
        with_shapes=request.with_shapes,
        with_properties=request.with_properties,
    )
