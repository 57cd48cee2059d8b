"""Lists of items to draw, and their changes since a reader last saw them.

A `DrawList` says which geometries are drawn and never changes; `Shown` remembers the items that
one reader has seen, and so tells which have moved, appeared and vanished.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.perception_properties import Picture
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import Shape

__all__ = ["Changes", "DrawItem", "DrawList", "ItemKey", "Shown"]

ItemKey = tuple[str, int]
"""Group and geometry id: what an item is known by while its geometry lives."""


class DrawItem(NamedTuple):
    """A geometry to draw."""

    geometry_id: int
    group: str
    """What it is part of, ``<role>/<source>/<frame>``."""
    shape: Shape
    rgba: Rgba | None
    """None: the materials in its mesh file where it has one, else a colour for all."""
    as_hull: bool = False
    """Draw the convex hull of a mesh instead of the mesh."""
    path: tuple[str, ...] = ()
    """Role, source, frame and name, each of which may contain slashes."""
    picture: Picture | None = None
    """What it is covered with, for viewers that can; ``rgba`` multiplies it."""

    @property
    def is_as_given(self) -> bool:
        """Whether a mesh is drawn by its own triangles, and not by convex hulls."""
        in_pieces = isinstance(self.shape, MeshShape) and self.shape.pieces is not None
        return not (self.as_hull or in_pieces or self.shape.kind == ShapeKind.CONVEX)


class DrawList:
    """Items in the order of their rows, and tables that follow from them; it never changes."""

    def __init__(self, items: Iterable[DrawItem]) -> None:
        """Raise ValueError where two have the same group and geometry."""
        self.items = list(items)
        self.rows = {(item.group, item.geometry_id): row for row, item in enumerate(self.items)}
        """Of each item by its key."""
        if len(self.rows) != len(self.items):
            raise ValueError("two items to draw have the same group and geometry id")
        are_half_spaces = [item.shape.kind == ShapeKind.HALF_SPACE for item in self.items]
        self.half_spaces = np.flatnonzero(np.array(are_half_spaces, dtype=bool))
        """Rows of what has no end."""

    def rows_of(self, items: Sequence[DrawItem]) -> list[int]:
        """Return the row of each item, -1 of those that are not among these, or are others."""
        mine = self.items
        rows = [self.rows.get((item.group, item.geometry_id), -1) for item in items]
        return [
            row if row >= 0 and (mine[row] is item or mine[row] == item) else -1
            for item, row in zip(items, rows, strict=True)
        ]


class Changes(NamedTuple):
    """The changes after which a reader sees a list of items at their poses."""

    appeared: NDArray[np.int64]
    """(a,) rows of items that are new, or look different than before."""
    vanished: list[ItemKey]
    moved: NDArray[np.int64]
    """(m,) rows whose pose is another, ascending; those of new items are among them."""


class Shown:
    """The items that one reader sees, one row each; row i of all poses belongs to item i."""

    def __init__(self) -> None:
        self._list = DrawList([])
        self._poses = np.empty((0, 4, 4))
        self._stale: dict[ItemKey, None] = {}

    @property
    def items(self) -> Sequence[DrawItem]:
        """The items in the order of their rows."""
        return self._list.items

    @property
    def listed(self) -> DrawList:
        """The items as they were taken."""
        return self._list

    def set_items(self, items: Iterable[DrawItem]) -> None:
        """Take over which geometries there are.

        Raises ValueError, and changes nothing, where two have the same group and geometry.
        """
        self.take(DrawList(items))

    def take(self, new: DrawList, rows: Callable[[DrawList], list[int]] | None = None) -> None:
        """Take over which geometries there are; ``rows`` returns their rows in a list before."""
        known = self._list.rows_of(new.items) if rows is None else rows(self._list)
        self._take(new, np.array(known, dtype=np.int64))

    def _take(self, new: DrawList, known: NDArray[np.int64]) -> None:
        before, self._list = self._list, new
        self._stale.update(dict.fromkeys(before.rows.keys() - new.rows.keys()))
        for key in self._stale.keys() & new.rows.keys():
            del self._stale[key]
        # Poses that were shown stay known, so that unchanged items are not shown again.
        never = np.full((1, 4, 4), np.nan)
        self._poses = np.concatenate([self._poses, never])[known]

    def take_vanished(self) -> list[ItemKey]:
        """Return the items that vanished since the last call."""
        vanished = list(self._stale)
        self._stale.clear()
        return vanished

    def moved(self, X_WG: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the rows whose pose ``(n, 4, 4)`` is another than when it was last shown."""
        self._check(X_WG)
        # Not a number, which stands for "never", differs from everything.
        differs = (self._poses != X_WG).reshape(len(X_WG), 16)
        return np.flatnonzero(differs.any(axis=1))

    def place(self, rows: NDArray[np.int64], X_WG: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of some rows, ascending, and take them as shown."""
        self._check(X_WG)
        if len(rows) == len(X_WG):
            self._poses = X_WG.copy()
            return X_WG
        X_WM: NDArray[np.float64] = X_WG[rows]
        self._poses[rows] = X_WM
        return X_WM

    def follow(self, listed: DrawList, X_WG: NDArray[np.float64]) -> Changes:
        """Show a list of items at poses ``(n, 4, 4)``; return the changes."""
        appeared = np.empty(0, dtype=np.int64)
        if listed is not self._list:
            known = np.array(self._list.rows_of(listed.items), dtype=np.int64)
            appeared = np.flatnonzero(known < 0)
            self._take(listed, known)
        moved = self.moved(X_WG)
        self.place(moved, X_WG)
        return Changes(appeared, self.take_vanished(), moved)

    def _check(self, X_WG: NDArray[np.float64]) -> None:
        if X_WG.shape != (len(self._list.items), 4, 4):
            raise ValueError(
                f"{len(self._list.items)} items take (n, 4, 4) poses, not {X_WG.shape}"
            )
