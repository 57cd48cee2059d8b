"""Trajectories through mazes of regions, beside Drake: ``python -m benchmarks.gcs_trajectories``.

One thread. Cells and the doors between them are given as half-spaces, so that everybody has to
find out which of them meet; with ``--turn`` they are turned, so that nothing is along the axes.
Order 1 costs the length of the path; order 3 costs time and a tenth of the length, with bounds of
velocity and a direction that goes on. Both solve the relaxation with Clarabel and round it five
times; costs are compared before times. Without pydrake only ours is measured, and that is said;
``make peers`` installs it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
import itertools
import os
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.mazes import doors_of  # noqa: E402
from scene_graph_ros.geometry.optimization import (  # noqa: E402
    GraphOfConvexSetsOptions,
    HPolyhedron,
    Point,
)
from scene_graph_ros.planning import GcsTrajectoryOptimization  # noqa: E402

__all__ = ["Row", "main", "maze_of", "measure", "trajectories_through"]

_ORDERS = (1, 3)
_SAME = 1e-4
"""Relative difference up to which costs count as equal: both round the same relaxation, and draw
paths of nearly the same flows with numbers of their own."""

_SPEED = 1.0
_PATHS = 5
_MOST_PROGRAMS = 300
"""Of the search; what is then left is its gap."""


@dataclass(frozen=True)
class Row:
    """One maze; CPU seconds to add regions and edges, and to solve; NaN where nobody was asked."""

    size: int
    order: int
    num_regions: int
    num_edges: int
    adding: tuple[float, float]
    solving: tuple[float, float]
    costs: tuple[float, float]
    bounds: tuple[float, float]
    """Ours is proven; Drake's is what its relaxation costs."""
    searched: tuple[float, float, float]
    """Ours alone, a search with 300 programs at most: seconds, cost and gap."""

    @property
    def agree(self) -> str:
        """Whether costs are the same, or whose is lower."""
        ours, theirs = self.costs
        if np.isnan(theirs):
            return "-"
        if abs(ours - theirs) <= _SAME * abs(theirs):
            return "same"
        return f"ours {100.0 * (ours / theirs - 1.0):+.2f} %"


Maze = tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]
"""Rows and sides of regions, and start and goal ``(2, 2)``."""


def maze_of(size: int, degrees: float, seed: int = 0) -> Maze:
    """Return the cells of a maze and the doors between them, turned, and two of its corners."""
    doors = doors_of(np.random.default_rng(seed), size)
    cells = [
        (np.array(cell) - 0.4, np.array(cell) + 0.4)
        for cell in itertools.product(range(size), repeat=2)
    ]
    passages = []
    for first, second in doors:
        ends = np.array([first, second], dtype=float)
        way = (ends[1] - ends[0]).astype(bool)
        half = np.where(way, 0.2, 0.1)
        passages.append((ends.mean(axis=0) - half, ends.mean(axis=0) + half))
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turned = np.array([[c, -s], [s, c]])
    rows = np.concatenate([turned.T, -turned.T])
    regions = [(rows, np.append(high, -low)) for low, high in cells + passages]
    return regions, np.array([[0.0, 0.0], [size - 1.0, size - 1.0]]) @ turned.T


def _timed(ask: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.process_time()
    found = ask()
    return time.process_time() - begin, found


def trajectories_through(maze: Maze, order: int) -> tuple[GcsTrajectoryOptimization, Any, Any]:
    """Return our trajectories through a maze, and the regions that they begin and end in."""
    graph = GcsTrajectoryOptimization(2)
    regions = graph.add_regions([HPolyhedron(*region) for region in maze[0]], order)
    ends = [
        graph.add_regions([Point(at)], 0, name=name)
        for name, at in zip(("start", "goal"), maze[1], strict=True)
    ]
    graph.add_edges(ends[0], regions)
    graph.add_edges(regions, ends[1])
    if order == 1:
        graph.add_path_length_cost()
        return graph, *ends
    graph.add_time_cost()
    graph.add_path_length_cost(0.1)
    graph.add_velocity_bounds([-_SPEED] * 2, [_SPEED] * 2)
    graph.add_path_continuity_constraints(1)
    return graph, *ends


def _drakes(maze: Maze, order: int) -> tuple[Any, Any, Any]:
    from pydrake.geometry import optimization as drake
    from pydrake.planning import GcsTrajectoryOptimization as Theirs

    graph = Theirs(2)
    polyhedra = [drake.HPolyhedron(*region) for region in maze[0]]
    regions = graph.AddRegions(polyhedra, order, 1e-6, 20.0, "regions")
    ends = [
        graph.AddRegions([drake.Point(at)], 0, 1e-6, 20.0, name)
        for name, at in zip(("start", "goal"), maze[1], strict=True)
    ]
    graph.AddEdges(ends[0], regions)
    graph.AddEdges(regions, ends[1])
    if order == 1:
        graph.AddPathLengthCost()
        return graph, *ends
    graph.AddTimeCost()
    graph.AddPathLengthCost(0.1)
    graph.AddVelocityBounds(np.full(2, -_SPEED), np.full(2, _SPEED))
    graph.AddPathContinuityConstraints(1)
    return graph, *ends


def _defaults(maze: Maze, order: int) -> tuple[tuple[float, float], ...]:
    """Return seconds to add and solve, cost and bound, as both are set by default: ours, Drake's.

    Drake's has its preprocessing then, a linear program for each edge.
    """
    first, (graph, *ends) = _timed(lambda: trajectories_through(maze, order))
    second, (_, result) = _timed(lambda: graph.solve_path(*ends))
    theirs = (np.nan, np.nan, np.nan)
    if _has_drake():
        third, (peer, *places) = _timed(lambda: _drakes(maze, order))
        fourth, (_, found) = _timed(lambda: peer.SolvePath(*places))
        least = peer.SolvePath(*places, _drakes_options(0))[1].get_optimal_cost()
        theirs = third + fourth, found.get_optimal_cost(), least
    return (first + second, theirs[0]), (result.cost, theirs[1]), (result.lower_bound, theirs[2])


def _drakes_options(paths: int) -> Any:
    from pydrake.geometry.optimization import GraphOfConvexSetsOptions as Theirs
    from pydrake.solvers import ClarabelSolver

    options = Theirs()
    options.convex_relaxation = True
    options.preprocessing = False  # one linear program for each edge: many times the solve
    options.max_rounded_paths = paths
    options.solver = ClarabelSolver()
    return options


def _has_drake() -> bool:
    try:
        import pydrake.planning  # noqa: F401
    except ImportError:
        return False
    return True


def measure(sizes: Sequence[int], degrees: float = 0.0) -> Iterator[Row]:
    """Solve mazes of some cells along a side, with both orders."""
    for size, order in itertools.product(sizes, _ORDERS):
        maze = maze_of(size, degrees)
        adding, (graph, *ends) = _timed(lambda m=maze, o=order: trajectories_through(m, o))
        relaxed = GraphOfConvexSetsOptions(convex_relaxation=True, max_rounded_paths=_PATHS)
        solving, (_, result) = _timed(lambda g=graph, e=ends, r=relaxed: g.solve_path(*e, r))
        searching, (_, best) = _timed(
            lambda g=graph, e=ends: g.solve_path(
                *e,
                GraphOfConvexSetsOptions(
                    convex_relaxation=False, max_search_programs=_MOST_PROGRAMS
                ),
            )
        )
        times, cost, least = (np.nan, np.nan), np.nan, np.nan
        if _has_drake():
            first, (theirs, *places) = _timed(lambda m=maze, o=order: _drakes(m, o))
            options = _drakes_options(_PATHS)
            second, (_, found) = _timed(lambda t=theirs, p=places, o=options: t.SolvePath(*p, o))
            times = (first, second)
            cost = found.get_optimal_cost() if found.is_success() else np.inf
            least = theirs.SolvePath(*places, _drakes_options(0))[1].get_optimal_cost()
        yield Row(
            size,
            order,
            len(maze[0]),
            graph.graph_of_convex_sets.num_edges,
            (adding, times[0]),
            (solving, times[1]),
            (result.cost, cost),
            (result.lower_bound, least),
            (searching, best.cost, best.gap),
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[5, 10, 20])
    parser.add_argument("--turn", type=float, default=0.0, help="degrees")
    parser.add_argument(
        "--defaults", action="store_true", help="both as they are set by default, nothing else"
    )
    options = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    if not _has_drake():
        print("pydrake is not installed: only ours was measured")
    list(measure([2]))  # imports and kernels
    if options.defaults:
        print(f"{'maze':7} {'order':>5} {'s':>8} {'Drake':>8} {'cost':>10} {'Drake':>10}"
              f" {'bound':>10} {'Drake':>10}")  # fmt: skip
        for size, order in itertools.product(options.sizes, _ORDERS):
            seconds, costs, bounds = _defaults(maze_of(size, options.turn), order)
            print(
                f"{size:3}x{size:<3} {order:5} {seconds[0]:8.3f} {seconds[1]:8.3f}"
                f" {costs[0]:10.6f} {costs[1]:10.6f} {bounds[0]:10.6f} {bounds[1]:10.6f}",
                flush=True,
            )
        return
    print(
        f"{'maze':7} {'order':>5} {'regions':>7} {'edges':>6} {'adding':>7} {'Drake':>7}"
        f" {'solving':>8} {'Drake':>8} {'cost':>10} {'Drake':>10} {'bound':>10}"
        f" {'Drake':>10} {'costs':>14}"
        f" {'search':>9} {'cost':>10} {'gap':>8}"
    )
    for row in measure(options.sizes, options.turn):
        print(
            f"{row.size:3}x{row.size:<3} {row.order:5} {row.num_regions:7} {row.num_edges:6}"
            f" {row.adding[0]:7.3f} {row.adding[1]:7.3f} {row.solving[0]:8.3f}"
            f" {row.solving[1]:8.3f} {row.costs[0]:10.6f} {row.costs[1]:10.6f}"
            f" {row.bounds[0]:10.6f} {row.bounds[1]:10.6f}"
            f" {row.agree:>14} {row.searched[0]:9.3f} {row.searched[1]:10.6f}"
            f" {row.searched[2]:8.1e}",
            flush=True,
        )


if __name__ == "__main__":
    main()
