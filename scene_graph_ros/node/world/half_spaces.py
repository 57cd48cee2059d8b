"""Two half spaces that move against each other: the one pair that no query has an answer for."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry import HalfSpace, Role
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["check_half_spaces"]


def check_half_spaces(inspector: Any) -> None:
    """Raise UnsupportedPairError for the first pair of half spaces that would be checked.

    Every query about all pairs would fail, for everybody. Pairs on one frame, pairs of anchored
    ones and filtered pairs are never checked.
    """
    planes = [
        geometry_id
        for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY)
        if isinstance(inspector.get_shape(geometry_id), HalfSpace)
    ]
    moving = [plane for plane in planes if not inspector.is_anchored(plane)]
    for id_A in moving:
        for id_B in planes:
            if id_A != id_B and not inspector.collision_filtered(id_A, id_B):
                raise UnsupportedPairError(
                    f"geometry {_path(id_A, inspector)} and geometry {_path(id_B, inspector)} are "
                    "half spaces that move against each other, and how far these are apart has no "
                    "answer: filter the pair, or leave one of them without the proximity role"
                )


def _path(geometry_id: Any, inspector: Any) -> str:
    frame_id = inspector.get_frame_id(geometry_id)
    source = inspector.get_owning_source_name(geometry_id)
    frame, name = inspector.get_name(frame_id), inspector.get_name(geometry_id)
    return quoted(f"{source}/{frame}/{name}")
