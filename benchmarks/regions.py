"""Visibility graphs, cliques and regions of configurations: a Panda in its cell, one thread.

``python -m benchmarks.regions`` prints processor time, and what came of it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import time
from typing import Any

import numpy as np

from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid
from scene_graph_ros.planning import (
    ConfigurationRegion,
    iris_in_configuration_space,
    iris_zo,
    IrisNpOptions,
    IrisZoOptions,
    load_robot_diagram,
    MaxCliqueSolverViaBranchAndBound,
    MaxCliqueSolverViaGreedy,
    RegionNotFoundError,
    SceneGraphCollisionChecker,
    visibility_graph,
)

__all__ = ["main"]

_SCENE = "config/scenes/panda_cell.yaml"
_SEED = (0.0, -0.4, 0.0, -2.0, 0.0, 1.6, 0.8, 0.02)


def _timed(function: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time of a call in seconds, and what it returned."""
    begin = time.process_time()
    result = function()
    return time.process_time() - begin, result


def _words(checker: SceneGraphCollisionChecker, found: ConfigurationRegion) -> str:
    """Return a region in numbers, with what share of another sampler's points collides."""
    generator, q, points = np.random.default_rng(99), np.array(_SEED), []
    for _ in range(5000):
        q = found.region.uniform_sample(generator, q, 20)
        points.append(q)
    share = 1.0 - checker.check_configs_collision_free(points).mean()
    return (
        f"{len(found.region.b)} faces, log volume of the ellipsoid"
        f" {np.log(found.volumes[-1]):.2f}, {100 * share:.2f} % of 5000 points collide"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=200, help="of the visibility graph")
    parser.add_argument("--quick", action="store_true", help="one ellipsoid for each region")
    arguments = parser.parse_args()
    checker = SceneGraphCollisionChecker(load_robot_diagram(_SCENE))
    tree, count = checker.model.tree, arguments.points
    generator = np.random.default_rng(1)
    points = generator.uniform(tree.lower, tree.upper, (count, tree.num_positions))
    # The first calls load kernels.
    visibility_graph(checker, points[:3], 1)
    MaxCliqueSolverViaBranchAndBound().solve_max_clique(np.ones((3, 3)))
    seconds, graph = _timed(lambda: visibility_graph(checker, points, 1))
    free = int(graph.diagonal().sum())
    edges = (graph.nnz - free) // 2
    print(f"visibility graph, {count} points, {free} free, {edges} edges proven: {seconds:.2f} s")
    for solver in (MaxCliqueSolverViaGreedy(), MaxCliqueSolverViaBranchAndBound()):
        seconds, clique = _timed(lambda s=solver: s.solve_max_clique(graph))  # type: ignore[misc]
        print(f"{type(solver).__name__}: {clique.sum()} points, {1e3 * seconds:.1f} ms")
    domain = HPolyhedron.make_box(tree.lower, tree.upper)
    ball = Hyperellipsoid.make_hypersphere(0.01, _SEED)
    limit = 1 if arguments.quick else 3
    zo = IrisZoOptions(parallelism=1, max_iterations=limit)
    seconds, found = _timed(lambda: iris_zo(checker, ball, domain, zo, certificate=True))
    print(f"iris_zo: {seconds:.2f} s, {_words(checker, found)}")
    np_options = IrisNpOptions(parallelism=1, iteration_limit=min(limit, 2))
    name = "iris_in_configuration_space"
    try:
        seconds, found = _timed(
            lambda: iris_in_configuration_space(checker, _SEED, np_options, certificate=True)
        )
    except RegionNotFoundError as error:
        print(error)
    else:
        print(f"{name}: {seconds:.2f} s, {_words(checker, found)}")


if __name__ == "__main__":
    main()
