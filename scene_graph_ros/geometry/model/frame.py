"""Frames before their registration."""

from __future__ import annotations

import numbers
from typing import Any

from scene_graph_ros.geometry.model.ids import FrameId
from scene_graph_ros.geometry.model.names import canonical_name
from scene_graph_ros.geometry.one_line import cut
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["GeometryFrame"]


class GeometryFrame:
    """A named frame with an id of its own and an optional group number within its source."""

    __slots__ = ("_frame_group", "_id", "_name")

    def __init__(self, frame_name: str, frame_group_id: int = 0) -> None:
        """Raise NameConflictError for an empty name, ValueError for a negative group."""
        self._name = canonical_name("frame", frame_name)
        group: Any = frame_group_id
        if isinstance(group, bool) or not isinstance(group, numbers.Integral) or group < 0:
            raise ValueError(
                f"frame_group_id of frame {self._name!r} must be a non-negative integer,"
                f" not {quoted(group)}"
            )
        self._frame_group = int(group)
        self._id = FrameId.get_new_id()

    def id(self) -> FrameId:
        """Return the id that the frame will keep when it is registered."""
        return self._id

    def name(self) -> str:
        """Return the name, without blanks at its ends."""
        return self._name

    def frame_group(self) -> int:
        """Return the group number."""
        return self._frame_group

    def __repr__(self) -> str:
        group: Any = f", {self._frame_group}" if self._frame_group else ""
        return cut(f"GeometryFrame({self._name!r}{group})")
