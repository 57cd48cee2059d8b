"""Which geometries of a role are drawn, where they were drawn last, and what vanished."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = [
    "HALF_SPACE_EXTENT",
    "HALF_SPACE_THICKNESS",
    "MarkerItem",
    "MarkerList",
    "MarkerRows",
    "marker_id",
]

HALF_SPACE_EXTENT = 20.0
"""Metres. Edge length of the plate that stands for a half space."""

HALF_SPACE_THICKNESS = 1e-3
"""Metres. Thickness of that plate, whose upper side is the boundary: thin beside all else."""

_MAX_INT32 = 2**31 - 1


class MarkerItem(NamedTuple):
    """A geometry to draw."""

    geometry_id: int
    ns: str
    shape: Shape
    rgba: Rgba | None
    """None: the materials in its mesh file where it has one, else a colour for all."""
    as_hull: bool = False
    """Draw the convex hull of a mesh instead of the mesh."""


def marker_id(geometry_id: int) -> int:
    """Return the marker id of a geometry: its own id, folded into 31 bits."""
    return int(geometry_id) & _MAX_INT32


class MarkerList:
    """Items in the order of their rows, and what follows from them alone; it never changes."""

    def __init__(self, items: Iterable[MarkerItem]) -> None:
        """Raise ValueError where two have the same namespace and id."""
        self.items = list(items)
        self.keys = dict.fromkeys((i.ns, i.geometry_id & _MAX_INT32) for i in self.items)
        if len(self.keys) != len(self.items):
            raise ValueError("two markers have the same namespace and id")
        self._row_of = {item.geometry_id: row for row, item in enumerate(self.items)}
        is_plate = [item.shape.kind == ShapeKind.HALF_SPACE for item in self.items]
        self.plates = np.flatnonzero(np.array(is_plate, dtype=bool))

    def rows_of(self, items: Sequence[MarkerItem]) -> list[int]:
        """Return the row of each item, -1 of those that are not among these, or are others."""
        mine = self.items
        rows = [self._row_of.get(item.geometry_id, -1) for item in items]
        return [
            row if row >= 0 and (mine[row] is item or mine[row] == item) else -1
            for item, row in zip(items, rows, strict=True)
        ]


class MarkerRows:
    """The items of one role, one row each; row i of all poses belongs to item i."""

    def __init__(self) -> None:
        self._list = MarkerList([])
        self._sent = np.empty((0, 4, 4))
        self._stale: dict[tuple[str, int], None] = {}

    @property
    def items(self) -> Sequence[MarkerItem]:
        """The items in the order of their rows."""
        return self._list.items

    @property
    def listed(self) -> MarkerList:
        """The items as they were taken."""
        return self._list

    def set_items(self, items: Iterable[MarkerItem]) -> None:
        """Take over which geometries there are.

        Raises ValueError, and changes nothing, where two have the same namespace and id.
        """
        self.take(MarkerList(items))

    def take(self, new: MarkerList, rows: Callable[[MarkerList], list[int]] | None = None) -> None:
        """Take over which geometries there are; ``rows`` returns their rows in a list before."""
        before, self._list = self._list, new
        self._stale.update(dict.fromkeys(before.keys.keys() - new.keys.keys()))
        for key in self._stale.keys() & new.keys.keys():
            del self._stale[key]
        # Poses that were sent stay known, so that unchanged markers are not sent again.
        never = np.full((1, 4, 4), np.nan)
        known = before.rows_of(new.items) if rows is None else rows(before)
        self._sent = np.concatenate([self._sent, never])[np.array(known, dtype=np.int64)]

    def take_vanished(self) -> list[tuple[str, int]]:
        """Return namespace and id of each marker that vanished since the last call."""
        vanished = list(self._stale)
        self._stale.clear()
        return vanished

    def moved(self, X_WG: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the rows whose pose is another than when it was last taken as sent."""
        self._check(X_WG)
        # Not a number, which stands for "never", differs from everything.
        differs = (self._sent != X_WG).reshape(len(X_WG), 16)
        return np.flatnonzero(differs.any(axis=1))

    def place(self, rows: NDArray[np.int64], X_WG: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of the markers of some rows, ascending, and take them as sent."""
        self._check(X_WG)
        if len(rows) == len(X_WG):
            self._sent, X_WM = X_WG.copy(), X_WG
        else:
            X_WM = X_WG[rows]
            self._sent[rows] = X_WM
        if not len(self._list.plates):
            return X_WM
        # The plate of a half space hangs below its boundary.
        plates = np.isin(rows, self._list.plates)
        X_WM = X_WM.copy()
        X_WM[plates, :3, 3] -= 0.5 * HALF_SPACE_THICKNESS * X_WM[plates, :3, 2]
        return X_WM

    def _check(self, X_WG: NDArray[np.float64]) -> None:
        if X_WG.shape != (len(self._list.items), 4, 4):
            raise ValueError(
                f"{len(self._list.items)} markers take (n, 4, 4) poses, not {X_WG.shape}"
            )
