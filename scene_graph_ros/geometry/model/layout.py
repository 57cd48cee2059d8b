"""Rows for kernels: frames parents first, geometries of a role by id."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.records import FrameRecord, GeometryRecord

__all__ = ["FrameLayout", "RoleArrays", "frame_layout", "role_arrays"]

IntArray = NDArray[np.int64]


class FrameLayout(NamedTuple):
    """The frames of a model in rows; row 0 is the world, parents come before children."""

    ids: tuple[FrameId, ...]
    names: tuple[str, ...]
    row: dict[FrameId, int]
    parent: IntArray
    """(f,) row of each frame's parent; the world is its own."""
    is_flat: bool
    """Whether the parent of every frame is the world."""
    source_rows: dict[SourceId, IntArray]
    """Rows of a source's frames in the order of their registration."""


class RoleArrays(NamedTuple):
    """The geometries with one role in rows sorted by id."""

    ids: IntArray
    """(n,) integer values of the ids, ascending."""
    geometry_ids: tuple[GeometryId, ...]
    frame: NDArray[np.int32]
    """(n,) row of the frame each geometry hangs on; 0 is the world."""
    X_FG: NDArray[np.float64]
    """(n, 4, 4) pose in that frame."""
    all_rows: IntArray
    """(n,) 0, 1, ..."""
    moving_rows: IntArray
    """(m,) those that are not on the world frame."""
    same_frames: slice | None
    """The rows of the geometries' frames, where each has the next frame for itself and is at its
    origin, so that all poses are those of frames; else None."""


def frame_layout(
    records: Iterable[FrameRecord], source_frames: Mapping[SourceId, Iterable[FrameId]]
) -> FrameLayout:
    """Lay out frames that are given with parents before children, the world first.

    ``source_frames`` are those of each source in the order of their registration.
    """
    frames = tuple(records)
    row = {record.id: i for i, record in enumerate(frames)}
    world = frames[0].id
    rows = {s: [row[i] for i in own if i != world] for s, own in source_frames.items()}
    parent = np.array([row[record.parent_id] for record in frames], dtype=np.int64)
    return FrameLayout(
        ids=tuple(record.id for record in frames),
        names=tuple(record.name for record in frames),
        row=row,
        parent=parent,
        is_flat=not parent.any(),
        source_rows={s: np.array(r, dtype=np.int64) for s, r in rows.items()},
    )


def role_arrays(records: Iterable[GeometryRecord], layout: FrameLayout) -> RoleArrays:
    """Lay out geometries that are given in the order of their ids."""
    chosen = list(records)
    X_FG = np.empty((len(chosen), 4, 4))
    for i, record in enumerate(chosen):
        X_FG[i] = record.X_FG
    frame = np.array([layout.row[record.frame_id] for record in chosen], dtype=np.int32)
    all_rows = np.arange(len(chosen))
    are_frames = len(chosen) > 0 and (frame == frame[0] + all_rows).all()
    are_frames = are_frames and (np.eye(4) == X_FG).all()
    return RoleArrays(
        ids=np.array([int(record.id) for record in chosen], dtype=np.int64),
        geometry_ids=tuple(record.id for record in chosen),
        frame=frame,
        X_FG=X_FG,
        all_rows=all_rows,
        moving_rows=np.flatnonzero(frame),
        same_frames=slice(int(frame[0]), int(frame[0]) + len(chosen)) if are_frames else None,
    )
