"""Sets of geometries, named one by one or by the frames they hang on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.one_line import cut

__all__ = ["GeometrySet"]

Id = FrameId | GeometryId


class GeometrySet:
    """Geometry ids, and frame ids that stand for all geometries on these frames.

    The set checks nothing: which geometries a frame has is looked up when the set is used.
    """

    __slots__ = ("_frame_ids", "_geometry_ids")

    def __init__(self, *ids: Id | Iterable[Id] | GeometrySet) -> None:
        """Take ids, iterables of ids, or sets: ``GeometrySet(frame)``, ``GeometrySet([ball])``."""
        self._frame_ids: set[FrameId] = set()
        self._geometry_ids: set[GeometryId] = set()
        self.add(*ids)

    def add(self, *ids: Id | Iterable[Id] | GeometrySet) -> None:
        """Add ids, iterables of ids, or sets. Raises UnknownIdError for all else."""
        item: Any
        for item in ids:
            if isinstance(item, FrameId):
                self._frame_ids.add(item)
            elif isinstance(item, GeometryId):
                self._geometry_ids.add(item)
            elif isinstance(item, GeometrySet):
                self._frame_ids |= item._frame_ids
                self._geometry_ids |= item._geometry_ids
            elif isinstance(item, Iterable) and not isinstance(item, (str, bytes)):
                self.add(*item)
            else:
                raise UnknownIdError(f"a GeometrySet holds FrameIds and GeometryIds: {item!r}")

    def frame_ids(self) -> frozenset[FrameId]:
        """Return the frames of the set."""
        return frozenset(self._frame_ids)

    def geometry_ids(self) -> frozenset[GeometryId]:
        """Return the geometries that were added by their own id."""
        return frozenset(self._geometry_ids)

    def copy(self) -> GeometrySet:
        """Return an independent set."""
        return GeometrySet(self._frame_ids, self._geometry_ids)

    def __repr__(self) -> str:
        members = [*sorted(self._frame_ids), *sorted(self._geometry_ids)]
        return cut(f"GeometrySet({', '.join(map(repr, members))})")
