"""What more things around a robot cost: ``python -m benchmarks.many_obstacles``.

A Panda among random boxes that fill the same share of space, whatever their number. Each is asked
about twice in turns: with the tree of what does not move, and pair by pair. Times are of the
processor, the least of some calls.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from unittest import mock

import numpy as np

from benchmarks.edge_errors import edges_of
from benchmarks.machine import machine
from benchmarks.plans import panda
from benchmarks.timing import microseconds
from scene_graph_ros.geometry import Box, GeometryInstance, ProximityProperties, SceneGraph
from scene_graph_ros.planning import RobotDiagram, SceneGraphCollisionChecker
from scene_graph_ros.scene_files import register_robot

__all__ = ["main"]

_COUNTS = (30, 100, 300, 1000, 3000)
_LOWER, _UPPER = (-1.5, -1.5, -0.2), (1.5, 1.5, 1.8)
_FREE = 0.35
"""Metres around the robot's axis in which no box has its centre."""
_SIZES = (0.03, 0.15)
"""Metres, of the edges of 30 boxes."""
_FEWEST = "scene_graph_ros.planning.pairs.static_tree.FEWEST"
_INFLUENCE = 0.1
_REPEATS = 3


def _cell(count: int, seed: int = 0) -> RobotDiagram:
    """Return the Panda among so many boxes."""
    model, semantics = panda()
    scene_graph, rng = SceneGraph(), np.random.default_rng(seed)
    source = scene_graph.register_source("panda")
    frames = register_robot(model, scene_graph, source, semantics=semantics, visual=False)
    placed = 0
    while placed < count:
        X_WB = np.eye(4)
        X_WB[:3, 3] = rng.uniform(_LOWER, _UPPER)
        if np.hypot(*X_WB[:2, 3]) < _FREE:
            continue
        Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        X_WB[:3, :3] = Q * np.sign(np.linalg.det(Q))
        size = rng.uniform(*_SIZES, 3) * (_COUNTS[0] / count) ** (1.0 / 3.0)
        box = GeometryInstance(X_WB, Box(*size), f"box_{placed}")
        box.set_proximity_properties(ProximityProperties())
        scene_graph.register_anchored_geometry(source, box)
        placed += 1
    tree = model.kinematic_tree(semantics)
    return RobotDiagram(scene_graph, scene_graph.create_default_context(), tree, frames)


def _measured(checker: SceneGraphCollisionChecker, count: int) -> tuple[float, float, float]:
    """Return microseconds of a configuration, an edge, and clearances of a configuration."""
    tree, rng = checker.model.tree, np.random.default_rng(1)
    q = rng.uniform(tree.lower, tree.upper, (count, tree.num_positions))
    edges = edges_of(checker, count // 3)
    some = q[: max(count // 10, 1)]
    return (
        microseconds(lambda: checker.check_configs_collision_free(q), len(q), _REPEATS),
        microseconds(lambda: checker.check_edges_collision_free(edges), len(edges), _REPEATS),
        microseconds(
            lambda: [checker.calc_robot_clearance(each, _INFLUENCE) for each in some],
            len(some),
            _REPEATS,
        ),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--boxes", nargs="+", type=int, default=_COUNTS, help="how many")
    parser.add_argument("--count", type=int, default=1000, help="configurations")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    print(f"{'boxes':>6} {'':10} {'configuration, us':>18} {'edge, us':>10} {'clearance, us':>14}")
    for boxes in options.boxes:
        robots = _cell(boxes)
        for name, fewest in (("by tree", 0), ("all pairs", 10**9)):
            with mock.patch(_FEWEST, fewest):
                checker = SceneGraphCollisionChecker(robots)
            each, edge, near = _measured(checker, options.count)
            print(f"{boxes:6} {name:10} {each:18.2f} {edge:10.1f} {near:14.1f}")
    print(machine(load), end="")


if __name__ == "__main__":
    main()
