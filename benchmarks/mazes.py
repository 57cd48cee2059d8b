"""Mazes as graphs of convex sets, for us and for Drake; large ones are for us alone.

``python -m benchmarks.mazes 50 100`` makes mazes of so many cells along a side, and finds the
path through each: the best of some that the relaxation suggests, then the search's, with its
proven gap. ``--more-doors`` opens walls; processor time of this process, one thread.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
import itertools
import os
import resource
import sys
import time
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy starts its threads

import numpy as np

from benchmarks.machine import machine
from scene_graph_ros.convex.graphs.search.path_problem import network_of
from scene_graph_ros.geometry.optimization import (
    GraphOfConvexSets,
    GraphOfConvexSetsOptions,
    HPolyhedron,
    norm,
    Point,
    Vertex,
)

__all__ = ["Cell", "Row", "box_of", "doors_of", "drakes_graph", "main", "measure", "our_graph"]

Cell = tuple[int, int]

_HALF = 0.4
"""Half the width of what is free of a cell of width 1."""

_MORE = 0.1
"""Of the walls that are left in a maze without circles, the share that gets a door, too."""


def doors_of(rng: np.random.Generator, size: int, more: float = _MORE) -> list[tuple[Cell, Cell]]:
    """Return the pairs of cells with a door between them, of a square maze.

    ``more`` is the share of the walls left in a maze without circles that gets a door, too.
    """
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
    return [*doors, *walls[: round(more * len(walls))]]


def box_of(cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(2,)`` of what is free of a cell."""
    return np.array(cell) - _HALF, np.array(cell) + _HALF


def our_graph(
    doors: list[tuple[Cell, Cell]], size: int
) -> tuple[GraphOfConvexSets, Vertex, Vertex]:
    """Return the graph of the cells, and its points in two corners; edges cost their lengths."""
    graph = GraphOfConvexSets()
    cells = {
        cell: graph.add_vertex(HPolyhedron.make_box(*box_of(cell)))
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
        cell: graph.AddVertex(drake.HPolyhedron.MakeBox(*box_of(cell)))
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


@dataclass(frozen=True)
class Row:
    """What a maze took, in seconds of processor time, and what was found."""

    cells: int
    edges: int
    kept: int
    preprocessing: float
    rounded: float
    rounded_gap: float
    proven: float
    gap: float
    programs: int


def measure(size: int, more: float = _MORE, seed: int = 1, most_programs: int = 10_000) -> Row:
    """Find the path through a maze, rounded and proven; gaps are relative to the cost."""
    graph, start, goal = our_graph(doors_of(np.random.default_rng(seed), size, more), size)
    seconds, begin = [], time.process_time()
    kept = network_of(graph.vertices, graph.edges, start, goal).on_simple_paths()
    found = []
    for options in (
        GraphOfConvexSetsOptions(convex_relaxation=True),
        GraphOfConvexSetsOptions(max_search_programs=most_programs),
    ):
        seconds.append(time.process_time() - begin)
        begin = time.process_time()
        found.append(graph.solve_shortest_path(start, goal, options))
    seconds.append(time.process_time() - begin)
    rounded, proven = found
    return Row(
        graph.num_vertices - 2,
        graph.num_edges,
        len(kept),
        seconds[0],
        seconds[1],
        rounded.gap / rounded.cost,
        seconds[2],
        proven.gap / proven.cost,
        proven.num_search_programs,
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mazes", description=__doc__)
    parser.add_argument("sizes", type=int, nargs="+", help="cells along a side")
    parser.add_argument("--more-doors", type=float, default=_MORE, help="share of walls opened")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most-programs", type=int, default=10_000, help="of the search")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    print("cells edges kept preprocessing(s) rounded(s) gap proven(s) gap programs memory(GB)")
    for size in options.sizes:
        row = measure(size, options.more_doors, options.seed, options.most_programs)
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        print(
            f"{row.cells} {row.edges} {row.kept} {row.preprocessing:.3f} {row.rounded:.2f}"
            f" {row.rounded_gap:.1e} {row.proven:.2f} {row.gap:.1e} {row.programs} {memory:.2f}",
            flush=True,
        )
    print(machine(load), end="")


if __name__ == "__main__":
    main(sys.argv[1:])
