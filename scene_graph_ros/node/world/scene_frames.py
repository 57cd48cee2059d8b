"""The frames of a source between two versions of the scene. No rclpy here."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, TYPE_CHECKING

import numpy as np

from scene_graph_ros.node.world.intake import SourceFrames, UNSTAMPED

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scene_graph_ros.geometry.model.ids import FrameId

__all__ = ["bring_poses", "frames_of"]


def frames_of(
    source: str,
    ids: tuple[FrameId, ...],
    inspector: Any,
    initial: Mapping[FrameId, NDArray[np.float64]],
    old: SourceFrames | None,
    world_frame: str,
    *,
    is_rehung: bool,
) -> SourceFrames:
    """Return a source's frames, where they begin; ``old`` ones where nothing of them changed."""
    names = tuple(inspector.get_name(frame_id) for frame_id in ids)
    parents = _parents(ids, inspector, world_frame)
    is_as_before = old is not None and (old.ids, old.names, old.parents) == (ids, names, parents)
    if old is not None and is_as_before and not is_rehung:
        return old
    X_PF = np.tile(np.eye(4), (len(ids), 1, 1))
    for row, frame_id in enumerate(ids):
        if frame_id in initial:
            X_PF[row] = initial[frame_id]
    stamps = np.full(len(ids), UNSTAMPED, dtype=np.int64)
    return SourceFrames(source, ids, names, parents, X_PF, stamps)


def _parents(ids: Iterable[Any], inspector: Any, world_frame: str) -> tuple[str, ...]:
    world = inspector.world_frame_id()
    parents = [inspector.get_parent_frame(frame_id) for frame_id in ids]
    return tuple(world_frame if p == world else inspector.get_name(p) for p in parents)


def bring_poses(old: SourceFrames, new: SourceFrames, rehung: frozenset[FrameId]) -> None:
    """Put frames where they were, also those whose place in the order is another by now."""
    rows = np.array([old.row_of_id.get(frame_id, -1) for frame_id in new.ids], dtype=np.int64)
    stays = np.array([frame_id not in rehung for frame_id in new.ids], dtype=np.bool_)
    kept = (rows >= 0) & stays
    new.X_PF[kept], new.stamps[kept] = old.X_PF[rows[kept]], old.stamps[rows[kept]]
    new.is_static[kept] = old.is_static[rows[kept]]
