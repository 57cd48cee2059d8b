"""The edges of a graph, and the remainder of a removal that was interrupted."""

from __future__ import annotations

import itertools
from typing import Generic, TypeVar

from scene_graph_ros.geometry.model.writes import Writes

__all__ = ["EdgeTable"]

Edge = TypeVar("Edge")


class EdgeTable(Generic[Edge]):
    """The edges of a graph by their numbers, in the order in which they were added.

    A removal, of vertices, too, happens once its writes are known. Whoever looks does those first
    that are left. Vertices know this and not their graph, so that one without edges is no cycle.
    ``numbers`` are those that the graph gives out next, to vertices, edges and slack variables.
    """

    __slots__ = ("_edges", "_left", "numbers")

    def __init__(self) -> None:
        self.numbers = itertools.count()
        self._edges: dict[int, Edge] = {}
        self._left: Writes | None = None

    def now(self) -> dict[int, Edge]:
        """Return the edges, to look at and to add some."""
        if self._left is not None:
            self._finish(self._left)
        return self._edges

    def remove(self, writes: Writes) -> None:
        """Have a removal happen, as a whole or not at all."""
        self._left = writes
        self._finish(writes)

    def _finish(self, writes: Writes) -> None:
        writes.write()
        self._left = None

    def those_of(self, some: dict[int, Edge]) -> list[Edge]:
        """Return those of some edges that are here."""
        edges = self.now()
        return [edge for number, edge in some.items() if edges.get(number) is edge]
