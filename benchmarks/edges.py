"""What a proof that an edge is free costs beside samples of it: a Panda in its cell, one thread.

``python -m benchmarks.edges`` prints microseconds, and what became of the edges.
"""

from __future__ import annotations

from collections.abc import Callable
import time

import numpy as np

from scene_graph_ros.planning import (
    EdgeStatus,
    load_robot_diagram,
    RobotDiagram,
    SceneGraphCollisionChecker,
)

__all__ = ["main"]

_SCENE = "config/scenes/panda_cell.yaml"
_COUNT = 1000
_LENGTH = 1.25
_STEP = 0.05
_REPEATS = 5


def _microseconds(function: Callable[[], object], count: int) -> float:
    """Return the least processor time of a call, per unit of work."""
    function()
    times = []
    for _ in range(_REPEATS):
        begin = time.process_time()
        function()
        times.append(time.process_time() - begin)
    return min(times) / count * 1e6


def _one_by_one(robots: RobotDiagram, q: np.ndarray) -> Callable[[], None]:
    """Return what asks the scene itself about each configuration."""
    inspector = robots.context.snapshot.inspector
    names = {int(frame): name for name, frame in robots.frames.items()}
    source = inspector.get_owning_source_id(next(iter(robots.frames.values())))
    links = [names[int(frame)] for frame in sorted(inspector.frames_for_source(source))]

    def ask() -> None:
        for each in q:
            robots.context.set_frame_poses(source, robots.tree.link_poses(each, links))
            robots.scene_graph.query_object(robots.context).has_collisions()

    return ask


def main() -> None:
    """Print the table."""
    robots = load_robot_diagram(_SCENE)
    checker, tree = SceneGraphCollisionChecker(robots), robots.tree
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    q = rng.uniform(lower, upper, (_COUNT, tree.num_positions))
    free = q[checker.check_configs_collision_free(q)]
    ways = free[1:] - free[:-1]
    ways *= np.minimum(1.0, _LENGTH / np.linalg.norm(ways, axis=1))[:, np.newaxis]
    edges = np.stack([free[:-1], free[:-1] + ways], axis=1)

    def sample() -> None:
        for start, way in zip(free, ways, strict=False):
            steps = max(2, int(np.ceil(np.linalg.norm(way) / _STEP)) + 1)
            checker.check_configs_collision_free(
                start + np.linspace(0.0, 1.0, steps)[:, np.newaxis] * way
            )

    rows = {
        "a configuration, in a batch": _microseconds(
            lambda: checker.check_configs_collision_free(q), len(q)
        ),
        "the same by set_frame_poses and has_collisions": _microseconds(
            _one_by_one(robots, q[:200]), 200
        ),
        "an edge, proven or found to collide": _microseconds(
            lambda: checker.check_edges_collision_free(edges), len(edges)
        ),
        f"the same edge, sampled at steps of {_STEP}": _microseconds(sample, len(edges)),
        "clearances up to 0.1 m": _microseconds(
            lambda: [checker.calc_robot_clearance(each, 0.1) for each in q[:50]], 50
        ),
    }
    for what, microseconds in rows.items():
        print(f"{what:50} {microseconds:9.1f} us")
    statuses = [measure.status for measure in checker.measure_edges(edges)]
    counts = {status.name: statuses.count(status) for status in EdgeStatus}
    print(f"{len(edges)} edges, {checker.num_pairs} pairs: {counts}")


if __name__ == "__main__":
    main()
