"""Regions around random configurations of an arm of seven joints, beside Drake's: time and size.

``python -m benchmarks.region_seeds`` grows them among a table, a post, a beam and a ball by
`iris_zo` and `iris_in_configuration_space`, and by Drake's IrisZo and IrisNp2 with the same
options where it is installed (``make peers``); processor time, one thread.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.robot_engines.drake_engine import DrakeEngine  # noqa: E402
from benchmarks.robot_engines.robot_world import RobotWorld  # noqa: E402
from scene_graph_ros.geometry import SceneGraph  # noqa: E402
from scene_graph_ros.geometry.optimization import HPolyhedron, Hyperellipsoid  # noqa: E402
from scene_graph_ros.planning import (  # noqa: E402
    iris_in_configuration_space,
    iris_zo,
    IrisNpOptions,
    IrisZoOptions,
    RobotDiagram,
    SceneGraphCollisionChecker,
)
from scene_graph_ros.scene_files import load_scene_text  # noqa: E402

__all__ = ["main"]

_ARM = "package://example-robot-data/robots/xarm_description"
_SCENE = f"""version: 1
sources: [{{name: around}}]
robots:
  - {{name: arm, urdf: "{_ARM}/urdf/xarm7.urdf", srdf: "{_ARM}/srdf/xarm7.srdf"}}
geometries:
  - name: table
    source: around
    pose: {{xyz: [0.45, 0, -0.06]}}
    shape: {{type: box, size: [0.6, 1.2, 0.1]}}
  - name: post
    source: around
    pose: {{xyz: [0.35, 0.35, 0.25]}}
    shape: {{type: cylinder, radius: 0.05, length: 0.5}}
  - name: beam
    source: around
    pose: {{xyz: [0.45, 0, 0.7]}}
    shape: {{type: box, size: [0.08, 0.8, 0.08]}}
  - name: ball
    source: around
    pose: {{xyz: [0.4, -0.35, 0.2]}}
    shape: {{type: sphere, radius: 0.1}}
"""

_TURN = 2.9
"""rad: seeds are no farther from 0 than that, where joints turn farther."""

_CLEAR = 0.05
"""Metres that seeds are clear of everything."""

_ELLIPSOIDS, _RADIUS, _ASKED = 3, 0.01, 3000


def _seeds(checker: SceneGraphCollisionChecker, count: int) -> list[np.ndarray]:
    tree, generator, found = checker.model.tree, np.random.default_rng(3), []
    low, high = np.maximum(tree.lower, -_TURN), np.minimum(tree.upper, _TURN)
    while len(found) < count:
        q = generator.uniform(low, high)
        is_free = checker.check_configs_collision_free(q[np.newaxis])[0]
        if is_free and not len(checker.calc_robot_clearance(q, _CLEAR).distances):
            found.append(q)
    return found


def _measure(
    checker: SceneGraphCollisionChecker,
    seeds: list[np.ndarray],
    grow: Callable[[np.ndarray], HPolyhedron],
) -> np.ndarray:
    """Return seconds, log volume of the ellipsoid, faces, share that collides, ``(n, 4)``."""
    rows = []
    for q in seeds:
        begin = time.process_time()
        region = grow(q)
        seconds = time.process_time() - begin
        inside = region.maximum_volume_inscribed_ellipsoid()
        points = region.uniform_samples(np.random.default_rng(9), _ASKED, mixing_steps=30).points
        share = 1.0 - checker.check_configs_collision_free(points).mean()
        rows.append((seconds, -np.linalg.slogdet(inside.A)[1], len(region.b), share))
    return np.array(rows)


def _ways(
    checker: SceneGraphCollisionChecker,
) -> dict[str, Callable[[np.ndarray], HPolyhedron]]:
    tree = checker.model.tree
    domain = HPolyhedron.make_box(tree.lower, tree.upper)
    zo = IrisZoOptions(parallelism=1, max_iterations=_ELLIPSOIDS)
    by_gradients = IrisNpOptions(parallelism=1, iteration_limit=_ELLIPSOIDS)

    def ball(q: np.ndarray) -> Hyperellipsoid:
        return Hyperellipsoid.make_hypersphere(_RADIUS, q)

    ways: dict[str, Callable[[np.ndarray], HPolyhedron]] = {
        "iris_zo": lambda q: iris_zo(checker, ball(q), domain, zo),
        "iris_in_configuration_space": lambda q: iris_in_configuration_space(
            checker, q, by_gradients
        ),
    }
    try:
        drake: Any = DrakeEngine(RobotWorld.of(checker), 0.05)
    except ImportError as error:
        print(f"left out: {error}")
        return ways
    for name in ("IrisZo", "IrisNp2"):
        ways[f"Drake's {name}"] = lambda q, n=name: drake.region(n, q, _RADIUS, _ELLIPSOIDS)  # type: ignore[misc]
    return ways


def main() -> None:
    """Print medians of all seeds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="configurations to grow regions at")
    count, load = parser.parse_args().seeds, os.getloadavg()[0]
    scene_graph = SceneGraph()
    scene = load_scene_text(_SCENE).apply(scene_graph)
    checker = SceneGraphCollisionChecker(RobotDiagram.of_scene(scene_graph, scene))
    seeds = _seeds(checker, count)
    print("way: seconds, log volume of the ellipsoid, faces, share that collides; medians")
    for name, grow in _ways(checker).items():
        grow(seeds[0])  # loads kernels
        s, volume, faces, share = np.median(_measure(checker, seeds, grow), axis=0)
        print(f"{name}: {s:.2f} s, {volume:.2f}, {faces:.0f}, {share:.2%}", flush=True)
    print(machine(load), end="")


if __name__ == "__main__":
    main()
