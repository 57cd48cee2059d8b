"""Mazes as graphs of convex sets, for us and for Drake."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    HPolyhedron,
    norm,
    Point,
    Vertex,
)

__all__ = ["doors_of", "drakes_graph", "our_graph"]

Cell = tuple[int, int]

_HALF = 0.4
"""Half the width of what is free of a cell of width 1."""

_MORE = 0.1
"""Of the walls that are left in a maze without circles, the share that gets a door, too."""


def doors_of(rng: np.random.Generator, size: int) -> list[tuple[Cell, Cell]]:
    """Return the pairs of cells with a door between them, of a square maze."""
    pairs = [
        ((i, j), (i + a, j + b))
        for i, j in itertools.product(range(size), repeat=2)
        for a, b in ((1, 0), (0, 1))
        if i + a < size and j + b < size
    ]
    above = {cell: cell for cell in itertools.product(range(size), repeat=2)}

    def root(cell: Cell) -> Cell:
        while above[cell] != cell:
            cell = above[cell]
        return cell

    doors, walls = [], []
    for k in rng.permutation(len(pairs)):
        first, second = (root(cell) for cell in pairs[k])
        (walls if first == second else doors).append(pairs[k])
        above[first] = second
    return [*doors, *walls[: round(_MORE * len(walls))]]


def _box(cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    return np.array(cell) - _HALF, np.array(cell) + _HALF


def our_graph(
    doors: list[tuple[Cell, Cell]], size: int
) -> tuple[GraphOfConvexSets, Vertex, Vertex]:
    """Return the graph of the cells, and its points in two corners; edges cost their lengths."""
    graph = GraphOfConvexSets()
    cells = {
        cell: graph.add_vertex(HPolyhedron.make_box(*_box(cell)))
        for cell in itertools.product(range(size), repeat=2)
    }
    start, goal = (graph.add_vertex(Point([at, at])) for at in (0.0, size - 1.0))
    ends = [(start, cells[0, 0]), (cells[size - 1, size - 1], goal)]
    for u, v in [*ends, *((cells[a], cells[b]) for d in doors for a, b in (d, d[::-1]))]:
        edge = graph.add_edge(u, v)
        edge.add_cost(norm(edge.xv - edge.xu))
    return graph, start, goal


def drakes_graph(doors: list[tuple[Cell, Cell]], size: int, drake: Any) -> tuple[Any, Any, Any]:
    """Return the same as Drake's."""
    from pydrake.solvers import Binding, Cost, L2NormCost

    graph = drake.GraphOfConvexSets()
    cells = {
        cell: graph.AddVertex(drake.HPolyhedron.MakeBox(*_box(cell)))
        for cell in itertools.product(range(size), repeat=2)
    }
    start, goal = (graph.AddVertex(drake.Point([at, at])) for at in (0.0, size - 1.0))
    way = np.concatenate([-np.eye(2), np.eye(2)], axis=1)
    ends = [(start, cells[0, 0]), (cells[size - 1, size - 1], goal)]
    for u, v in [*ends, *((cells[a], cells[b]) for d in doors for a, b in (d, d[::-1]))]:
        edge = graph.AddEdge(u, v)
        length = L2NormCost(way, np.zeros(2))
        edge.AddCost(Binding[Cost](length, np.concatenate([edge.xu(), edge.xv()])))
    return graph, start, goal
