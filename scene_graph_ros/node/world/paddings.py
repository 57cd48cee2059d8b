"""Paddings of single pairs, which hold for all requests about robots. No rclpy.

A side of a pair is a frame with all geometry on it, one geometry, or everything (None).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
import math
from typing import Any

from msg_adapters.errors import MessageError
from msg_adapters.names import SceneNames
from msg_adapters.robot_configurations import padding_from_msg
from scene_graph_ros.geometry.errors import OwnershipError, UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.node.world.scene import Edit, PaddedSide

__all__ = ["geometry_paddings", "set_padding"]


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


def geometry_paddings(
    paddings: Mapping[tuple[PaddedSide, PaddedSide], float], inspector: Any
) -> list[tuple[Collection[GeometryId] | None, Collection[GeometryId] | None, float]]:
    """Return the geometries of both sides of each pair, None for all, and the padding (m).

    What is named more exactly comes later, and of what is named alike the newest.
    """
    ordered = sorted(paddings.items(), key=lambda item: sum(map(_exactness, item[0])))
    return [
        (_geometries(a, inspector), _geometries(b, inspector), value) for (a, b), value in ordered
    ]


def _exactness(side: PaddedSide) -> int:
    return 0 if side is None else 1 if isinstance(side, FrameId) else 2


def _geometries(side: PaddedSide, inspector: Any) -> Collection[GeometryId] | None:
    if side is None:
        return None
    if isinstance(side, GeometryId):
        return (side,)
    found: Collection[GeometryId] = inspector.get_geometries(side, Role.PROXIMITY)
    return found


def _side(name: str, names: SceneNames) -> PaddedSide:
    """Return what a name means, a frame first; raises UnknownIdError, NameConflictError."""
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
    found = [frame for robot in robots for frame in robot.link_frames.values() if frame in there]
    for each in found:
        found.extend(inspector.get_child_frames(each))
    return set(found)
