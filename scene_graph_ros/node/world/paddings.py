"""Paddings of single pairs, which hold for all requests about robots. No rclpy."""

from __future__ import annotations

import math
from typing import Any

from msg_adapters.errors import MessageError
from msg_adapters.names import SceneNames
from msg_adapters.robot_configurations import padding_from_msg
from scene_graph_ros.geometry.errors import OwnershipError, UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.padded_sides import PaddedSide
from scene_graph_ros.node.world.scene import Edit

__all__ = ["set_padding"]


def set_padding(request: Any, response: Any, edit: Edit) -> None:
    """Answer SetPadding: all pairs, or where one makes no sense none."""
    record = edit.owner(request.source.name, request.source.token)
    counts = {len(request.frames_a), len(request.frames_b), len(request.paddings)}
    if len(counts) > 1:
        raise MessageError(
            f"frames_a, frames_b and paddings have {len(request.frames_a)},"
            f" {len(request.frames_b)} and {len(request.paddings)} entries"
        )
    names, inspector = edit.names(), edit.scene_graph.model_inspector()
    moved, world = _moved(edit), inspector.world_frame_id()
    pairs = zip(request.frames_a, request.frames_b, request.paddings, strict=True)
    for name_a, name_b, value in pairs:
        a, b = (_side(name, names) for name in (name_a, name_b))
        words = f"{quoted(name_a)} and {quoted(name_b)}"
        if a == b:
            noun = "geometry" if isinstance(a, GeometryId) else "frame"
            raise MessageError(f"frames_a and frames_b: {words} are one {noun}, which is no pair")
        given = [each for each in (a, b) if each is not None]
        is_set = not math.isnan(value)
        can_move = len(given) < 2 or any(_frame_of(each, inspector) in moved for each in given)
        if is_set and not can_move:
            raise MessageError(f"frames_a and frames_b: neither of {words} is moved by a robot")
        if not any(e != world and inspector.belongs_to_source(e, record.id) for e in given):
            raise OwnershipError(
                f"frames_a and frames_b: neither of {words} is of source {quoted(record.name)}"
            )
        for pair in ((a, b), (b, a)):
            edit.paddings.pop(pair, None)
        if is_set:
            edit.paddings[a, b] = padding_from_msg(value, "paddings")


def _side(name: str, names: SceneNames) -> PaddedSide:
    """Return the frame or geometry of a name; raises UnknownIdError, NameConflictError."""
    if not name:
        return None
    try:
        return names.frame_id(name)
    except UnknownIdError:
        pass
    try:
        return names.geometry_id(name)
    except UnknownIdError:
        raise UnknownIdError(f"there is no frame or geometry {quoted(name)}") from None


def _frame_of(side: FrameId | GeometryId, inspector: Any) -> FrameId:
    found: FrameId = inspector.get_frame_id(side) if isinstance(side, GeometryId) else side
    return found


def _moved(edit: Edit) -> set[FrameId]:
    """Return the frames of robots' links, and all below them."""
    inspector = edit.scene_graph.model_inspector()
    there = set(inspector.get_all_frame_ids())
    robots = [record.robot for record in edit.records.values() if record.robot is not None]
    found = [frame for robot in robots for frame in robot.carriers.values() if frame in there]
    for each in found:
        found.extend(inspector.get_child_frames(each))
    return set(found)
