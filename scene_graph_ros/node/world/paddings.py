"""Paddings of single pairs of frames, which hold for all requests about robots. No rclpy."""

from __future__ import annotations

import math
from typing import Any

from msg_adapters.errors import MessageError
from msg_adapters.robot_configurations import padding_from_msg
from scene_graph_ros.geometry.errors import OwnershipError
from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.quoting import quoted
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
    moved = _moved(edit)
    pairs = zip(request.frames_a, request.frames_b, request.paddings, strict=True)
    for name_a, name_b, value in pairs:
        a, b = names.frame_id(name_a), names.frame_id(name_b)
        words = f"{quoted(name_a)} and {quoted(name_b)}"
        if a == b:
            raise MessageError(f"frames_a and frames_b: {words} are one frame, which is no pair")
        if a not in moved and b not in moved:
            raise MessageError(f"frames_a and frames_b: neither of {words} is moved by a robot")
        world = inspector.world_frame_id()
        if not any(
            each != world and inspector.belongs_to_source(each, record.id) for each in (a, b)
        ):
            raise OwnershipError(
                f"frames_a and frames_b: neither of {words} is of source {quoted(record.name)}"
            )
        pair = (min(a, b), max(a, b))
        edit.paddings.pop(pair, None)
        if not math.isnan(value):
            edit.paddings[pair] = padding_from_msg(value, "paddings")


def _moved(edit: Edit) -> set[FrameId]:
    """Return the frames of robots' links, and all below them."""
    inspector = edit.scene_graph.model_inspector()
    there = set(inspector.get_all_frame_ids())
    robots = [record.robot for record in edit.records.values() if record.robot is not None]
    found = [frame for robot in robots for frame in robot.link_frames.values() if frame in there]
    for each in found:
        found.extend(inspector.get_child_frames(each))
    return set(found)
