"""The model's records of a source, a frame and a geometry: immutable rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import DeformableError
from scene_graph_ros.geometry.model.deformable import Deformable
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.properties import GeometryProperties, ProximityProperties
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = [
    "WORLD_FRAME_ID",
    "FrameRecord",
    "GeometryRecord",
    "deformable_of",
    "refuse_deformable",
]

WORLD_FRAME_ID = FrameId.get_new_id()
"""The one frame that never moves; the same in every scene graph."""


class FrameRecord(NamedTuple):
    """A registered frame F with its parent frame P; the world is its own parent."""

    id: FrameId
    source_id: SourceId
    parent_id: FrameId
    name: str
    frame_group: int


class GeometryRecord(NamedTuple):
    """A registered geometry G on frame F; its parent P is F or another geometry on F."""

    id: GeometryId
    source_id: SourceId
    frame_id: FrameId
    parent_id: GeometryId | None
    name: str
    shape: Shape
    X_PG: NDArray[np.float64]
    X_FG: NDArray[np.float64]
    properties: Mapping[Role, GeometryProperties]
    deformable: Deformable | None = None
    given: ProximityProperties | None = None
    """Those of the proximity role as they were given, without the scene's."""

    @property
    def is_anchored(self) -> bool:
        """Whether the geometry hangs on the world, and is rigid."""
        return self.frame_id == WORLD_FRAME_ID and self.deformable is None


def refuse_deformable(record: GeometryRecord, what: str) -> None:
    """Raise DeformableError, saying ``what``, if a geometry is deformable."""
    if record.deformable is not None:
        raise DeformableError(f"geometry {record.name!r} ({record.id!r}) is deformable: {what}")


def deformable_of(record: GeometryRecord) -> Deformable:
    """Return a deformable geometry's record. Raises DeformableError for a rigid one."""
    if record.deformable is None:
        raise DeformableError(
            f"geometry {record.name!r} ({record.id!r}) is rigid: it has a pose, and neither a"
            " volume mesh nor a configuration"
        )
    return record.deformable
