"""Frames that links of robots carry: attached and detached as requests ask. No rclpy."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg, pose_to_msg
from msg_adapters.robot_configurations import RobotNames
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterDeclaration
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.node.world.scene import Attachment, Edit, SourceRecord

__all__ = ["attach_frame", "detach_frame", "let_go_of"]


def attach_frame(request: Any, response: Any, edit: Edit) -> None:
    """Answer AttachFrame: the frame hangs on the link's, and pairs with it may touch."""
    record = edit.owner(request.source.name, request.source.token)
    frame = _frame(request, edit)
    known = edit.attachments.get(frame)
    if known is not None:
        raise NameConflictError(
            f"frame {quoted(request.frame)} is attached to {quoted(known.link)} already: detach it"
        )
    links = _Links(edit)
    path, link = links.find(request.link, "link")
    others = [links.find(name, "touch_links")[1] for name in request.touch_links]
    if record.robot is not None:
        raise MessageError(f"frame: {quoted(request.frame)} is a robot's own, which joints move")
    if request.with_pose:
        X_LF = pose_from_msg(request.pose, "pose")
    else:
        moment = edit.moment
        assert moment is not None
        X_LF = compose(inverse(moment.pose_in_world(link)), moment.pose_in_world(frame))
    inspector = edit.scene_graph.model_inspector()
    parent = inspector.get_parent_frame(frame)
    pairs = _open_pairs(edit, frame, [link, *others])
    edit.scene_graph.change_parent(record.id, frame, link)
    _filter(edit, pairs, is_filtered=True)
    _put(edit, frame, X_LF)
    edit.attachments[frame] = Attachment(path, parent, pairs)
    response.pose = pose_to_msg(X_LF)


def detach_frame(request: Any, response: Any, edit: Edit) -> None:
    """Answer DetachFrame: the frame hangs on what it did before, and stays where it is."""
    record = edit.owner(request.source.name, request.source.token)
    frame = _frame(request, edit)
    if frame not in edit.attachments:
        raise UnknownIdError(f"frame: {quoted(request.frame)} is not attached to a link")
    response.pose = pose_to_msg(_detach(edit, record, frame))


def let_go_of(edit: Edit, robot: SourceRecord) -> None:
    """Detach all that a robot's links carry, which stays where it is: the robot goes."""
    inspector = edit.scene_graph.model_inspector()
    own = set(robot.robot.link_frames.values())
    sources = {record.id: record for record in edit.records.values()}
    for frame in [f for f in edit.attachments if inspector.get_parent_frame(f) in own]:
        _detach(edit, sources[inspector.get_owning_source_id(frame)], frame)


def _detach(edit: Edit, record: SourceRecord, frame: FrameId) -> Any:
    """Hang a frame on what it hung before; return where it stays, X_WF."""
    known = edit.attachments.pop(frame)
    inspector, moment = edit.scene_graph.model_inspector(), edit.moment
    assert moment is not None
    frames, geometries = inspector.get_all_frame_ids(), set(inspector.get_all_geometry_ids())
    parent = known.parent if known.parent in frames else inspector.world_frame_id()
    X_WF = moment.pose_in_world(frame)
    edit.scene_graph.change_parent(record.id, frame, parent)
    there = tuple(pair for pair in known.pairs if geometries.issuperset(pair))
    _filter(edit, there, is_filtered=False)
    _put(edit, frame, compose(inverse(moment.pose_in_world(parent)), X_WF))
    return X_WF


class _Links:
    """Links of all robots that have a frame, by name."""

    def __init__(self, edit: Edit) -> None:
        there = set(edit.scene_graph.model_inspector().get_all_frame_ids())
        robots = {n: r.robot for n, r in edit.records.items() if r.robot is not None}
        self._frames: dict[str, FrameId] = {
            f"{name}/{link}": frame
            for name, robot in robots.items()
            for link, frame in robot.link_frames.items()
            if frame in there
        }
        self._names = RobotNames("link with geometry", tuple(self._frames), robots)

    def find(self, name: str, field: str) -> tuple[str, FrameId]:
        """Return a link's path and frame; raises UnknownIdError, NameConflictError."""
        path = self._names.names[self._names.row(name, field)]
        return path, self._frames[path]


def _frame(request: Any, edit: Edit) -> FrameId:
    return edit.names().frame_id(request.frame, request.source.name)


def _open_pairs(
    edit: Edit, frame: FrameId, links: Iterable[FrameId]
) -> tuple[tuple[GeometryId, GeometryId], ...]:
    """Return the pairs of what is on a frame or below it with links that are checked as yet."""
    inspector = edit.scene_graph.model_inspector()
    below = [frame]
    for each in below:
        below.extend(inspector.get_child_frames(each))
    own = [g for f in below for g in inspector.get_geometries(f, Role.PROXIMITY)]
    others = [g for f in dict.fromkeys(links) for g in inspector.get_geometries(f, Role.PROXIMITY)]
    filtered = inspector.collision_filtered
    return tuple((a, b) for a in own for b in others if not filtered(a, b))


def _filter(
    edit: Edit, pairs: Iterable[tuple[GeometryId, GeometryId]], *, is_filtered: bool
) -> None:
    """Filter pairs, or have them checked. Raises FilterHistoryError beside transient filters."""
    declaration = CollisionFilterDeclaration()
    others: dict[GeometryId, list[GeometryId]] = {}
    for own, other in pairs:
        others.setdefault(own, []).append(other)
    state = declaration.exclude_between if is_filtered else declaration.allow_between
    for own, several in others.items():
        state(GeometrySet([own]), GeometrySet(several))
    if others:
        edit.scene_graph.collision_filter_manager().apply(declaration)


def _put(edit: Edit, frame: FrameId, X_PF: Any) -> None:
    """Have a frame begin at a pose in its new parent."""
    edit.initial_poses[frame] = np.asarray(X_PF)
    edit.rehung.add(frame)
