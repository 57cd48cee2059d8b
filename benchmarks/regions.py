"""Visibility graphs, cliques and regions of configurations: a Panda in its cell, one thread.

And covers of an arm of two joints between a ball and a box, that of
``examples/free_configurations.py``.

``python -m benchmarks.regions`` prints processor time, and what came of it; beside Drake, where it
is installed (``make peers``), whose edges are sampled at 0.05 rad.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import functools
import os
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.robot_engines.drake_engine import DrakeEngine  # noqa: E402
from benchmarks.robot_engines.robot_world import RobotWorld  # noqa: E402
from examples.free_configurations import make_checker  # noqa: E402
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    ConfigurationRegion,
    iris_in_configuration_space,
    iris_in_configuration_space_from_clique_cover,
    iris_zo,
    IrisFromCliqueCoverOptions,
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
_DRAKE_STEP = 0.05
"""rad, between samples of an edge."""
_RADIUS, _ELLIPSOIDS = 0.01, 3
_COVERED, _PER_ROUND = 0.95, 200
"""Share of what is free that a cover has to have, and points of a round."""
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


def _print_drake(
    checker: SceneGraphCollisionChecker, points: np.ndarray, graph_seconds: float, zo: float
) -> None:
    """Print what Drake takes for the same, and how many times ours that is."""
    try:
        drake = DrakeEngine(RobotWorld.of(checker), _DRAKE_STEP)
    except ImportError as error:
        print(f"left out: {error}")
        return
    seconds, graph = _timed(lambda: drake.visibility_graph(points))
    free = int(graph.diagonal().sum())
    print(
        f"Drake's visibility graph, {free} free, {(graph.nnz - free) // 2} edges sampled:"
        f" {seconds:.2f} s, {seconds / graph_seconds:.1f} times ours"
    )
    for way in ("IrisZo", "IrisNp2"):
        ask = functools.partial(drake.region, way, np.array(_SEED), _RADIUS, _ELLIPSOIDS)
        seconds, found = _timed(ask)
        print(
            f"Drake's {way}: {seconds:.2f} s, {len(found.b)} faces, {seconds / zo:.1f} times ours"
        )


def _covers(rounds: int) -> None:
    """Print covers of an arm of two joints, ours and Drake's, from as many generators."""
    checker = make_checker()
    tree = checker.model.tree
    spread = np.random.default_rng(77).uniform(tree.lower, tree.upper, (20_000, 2))
    free = checker.check_configs_collision_free(spread)
    try:
        drake = DrakeEngine(RobotWorld.of(checker), _DRAKE_STEP)
    except ImportError as error:
        print(f"left out: {error}")
        drake = None

    def ours(seed: int, options: IrisNpOptions | IrisZoOptions) -> list[HPolyhedron]:
        asked = IrisFromCliqueCoverOptions(
            iris_options=options,
            coverage_termination_threshold=_COVERED,
            num_points_per_visibility_round=_PER_ROUND,
            parallelism=1,
        )
        generator = np.random.default_rng(seed)
        return iris_in_configuration_space_from_clique_cover(checker, asked, generator)

    def told(whose: str, cover: Callable[[int], list[HPolyhedron]]) -> float:
        timed = []
        for k in range(rounds):
            try:
                timed.append(_timed(functools.partial(cover, k)))
            except RuntimeError as error:  # Drake's, where a clique's centre is not free
                print(f"{whose} fails with generator {k}: {str(error)[:80]}")
        seconds, found = zip(*timed, strict=True)
        shares, colliding = [], []
        for regions in found:
            inside = [region.point_in_set(spread, 0.0) for region in regions]
            shares.append(np.any(inside, axis=0)[free].mean())
            colliding.append(max(1.0 - free[each].mean() for each in inside))
        print(
            f"{whose}: {np.mean(seconds):.2f} s, {np.mean([len(r) for r in found]):.1f} regions,"
            f" covered {np.mean(shares):.3f} (least {np.min(shares):.3f}), of the worst region"
            f" {np.max(colliding):.2%} collides"
        )
        return float(np.mean(seconds))

    ways = {
        "np": IrisNpOptions(iteration_limit=1),
        "zo": IrisZoOptions(max_iterations=1, parallelism=1),
    }
    for way, options in ways.items():
        ours(0, options)  # loads kernels
        mine = told(f"cover by {way}", functools.partial(ours, options=options))
        if drake is not None:
            ask = functools.partial(drake.cover, way=way, share=_COVERED, points=_PER_ROUND)
            theirs = told(f"Drake's cover by {way}", ask)
            print(f"Drake's takes {theirs / mine:.1f} times as long")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--points", type=int, default=200, help="of the visibility graph")
    parser.add_argument("--quick", action="store_true", help="one ellipsoid for each region")
    arguments = parser.parse_args()
    load = os.getloadavg()[0]
    checker = SceneGraphCollisionChecker(load_robot_diagram(_SCENE))
    tree, count = checker.model.tree, arguments.points
    generator = np.random.default_rng(1)
    points = generator.uniform(tree.lower, tree.upper, (count, tree.num_positions))
    # The first calls load kernels.
    visibility_graph(checker, points[:3], 1)
    MaxCliqueSolverViaBranchAndBound().solve_max_clique(np.ones((3, 3)))
    graph_seconds, graph = _timed(lambda: visibility_graph(checker, points, 1))
    free = int(graph.diagonal().sum())
    edges = (graph.nnz - free) // 2
    print(
        f"visibility graph, {count} points, {free} free, {edges} edges proven:"
        f" {graph_seconds:.2f} s"
    )
    for solver in (MaxCliqueSolverViaGreedy(), MaxCliqueSolverViaBranchAndBound()):
        seconds, clique = _timed(lambda s=solver: s.solve_max_clique(graph))  # type: ignore[misc]
        print(f"{type(solver).__name__}: {clique.sum()} points, {1e3 * seconds:.1f} ms")
    domain = HPolyhedron.make_box(tree.lower, tree.upper)
    ball = Hyperellipsoid.make_hypersphere(_RADIUS, _SEED)
    limit = 1 if arguments.quick else _ELLIPSOIDS
    zo = IrisZoOptions(parallelism=1, max_iterations=limit)
    grow: Any = functools.partial(iris_zo, checker, ball, domain, zo, certificate=True)
    grow()  # loads kernels
    zo_seconds, found = _timed(grow)
    print(f"iris_zo: {zo_seconds:.2f} s, {_words(checker, found)}")
    if not arguments.quick:
        _print_drake(checker, points, graph_seconds, zo_seconds)
    np_options = IrisNpOptions(parallelism=1, iteration_limit=min(limit, 2))
    name = "iris_in_configuration_space"
    try:
        asked: Any = (checker, _SEED, np_options)
        ask = functools.partial(iris_in_configuration_space, *asked, certificate=True)
        ask()  # loads kernels
        seconds, found = _timed(ask)
    except RegionNotFoundError as error:
        print(error)
    else:
        print(f"{name}: {seconds:.2f} s, {_words(checker, found)}")
    _covers(1 if arguments.quick else 5)
    print(machine(load), end="")


if __name__ == "__main__":
    main()
