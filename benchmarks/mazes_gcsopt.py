"""Paths through mazes, beside gcsopt: ``python -m benchmarks.mazes_gcsopt 10 20``.

gcsopt models in CVXPY; its relaxation is solved by Clarabel, as ours is. Graphs are made anew each
time, which counts: processor time of one thread. ``pip install gcsopt`` adds it to an environment;
it is not among the peers of ``make peers``, as it brings a modelling layer and its solvers.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import itertools
import os
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy starts its threads

import numpy as np

from benchmarks.machine import machine
from benchmarks.mazes import box_of, Cell, doors_of, our_graph
from benchmarks.timing import least_time
from scene_graph_ros.geometry.optimization import GraphOfConvexSetsOptions

__all__ = ["main"]

_RUNS = 3


def _theirs(doors: list[tuple[Cell, Cell]], size: int) -> float:
    """Return the bound of gcsopt's relaxation."""
    import cvxpy
    import gcsopt

    graph = gcsopt.GraphOfConvexSets(True)
    at: dict[Any, Any] = {}
    for cell in itertools.product(range(size), repeat=2):
        at[cell] = graph.add_vertex(cell)
        x, (low, high) = at[cell].add_variable(2), box_of(cell)
        at[cell].add_constraint(x >= low)
        at[cell].add_constraint(x <= high)
    for name, corner in (("start", 0.0), ("goal", size - 1.0)):
        at[name] = graph.add_vertex(name)
        at[name].add_constraint(at[name].add_variable(2) == np.full(2, corner))
    ends: list[Any] = [("start", (0, 0)), ((size - 1, size - 1), "goal")]
    for u, v in [*ends, *(each for d in doors for each in (d, d[::-1]))]:
        way = at[v].variables[0] - at[u].variables[0]
        graph.add_edge(at[u], at[v]).add_cost(cvxpy.norm2(way))
    graph.solve_shortest_path(at["start"], at["goal"], binary=False, solver="CLARABEL")
    return float(graph.value)


def _ours(doors: list[tuple[Cell, Cell]], size: int, *, is_proven: bool) -> float:
    """Return the bound of our relaxation, or the cost of the path that is proven to be best."""
    graph, start, goal = our_graph(doors, size)
    if is_proven:
        return graph.solve_shortest_path(start, goal).cost
    options = GraphOfConvexSetsOptions(convex_relaxation=True, max_rounded_paths=0)
    return graph.solve_shortest_path(start, goal, options).lower_bound


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mazes_gcsopt", description=__doc__)
    parser.add_argument("sizes", type=int, nargs="+", help="cells along a side")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    try:
        import gcsopt  # noqa: F401

        has_peer = True
    except ImportError:
        has_peer = False
        print("gcsopt is not installed, so only ours is measured; pip install gcsopt adds it")
    print(
        "cells  relaxation: ours (s)  gcsopt (s)  ratio  bound: ours  gcsopt  best path (s)  cost"
    )
    for size in options.sizes:
        doors = doors_of(np.random.default_rng(1), size)
        ours, bound = least_time(lambda d=doors, n=size: _ours(d, n, is_proven=False), _RUNS)  # type: ignore[misc]
        exact, cost = least_time(lambda d=doors, n=size: _ours(d, n, is_proven=True), _RUNS)  # type: ignore[misc]
        theirs, other = (
            least_time(lambda d=doors, n=size: _theirs(d, n), 1)  # type: ignore[misc]
            if has_peer
            else (np.nan, np.nan)
        )
        print(
            f"{size:5}  {ours:20.3f}  {theirs:10.2f}  {theirs / ours:5.0f}  {bound:11.5f}"
            f"  {other:.5f}  {exact:10.3f}  {cost:.5f}"
        )
    print(machine(load), end="")


if __name__ == "__main__":
    main()
