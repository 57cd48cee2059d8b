"""What a proof that an edge is free costs beside samples of it, and how often these are wrong.

``python -m benchmarks.edges`` prints microseconds of one thread for a Panda in its cell, and what
became of the edges. Then it writes docs/edges.csv and docs/edges.png: how many edges samples take
for free that collide, by their step and time, in three scenes. ``--quick`` writes nothing.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import os
from pathlib import Path

import numpy as np

from benchmarks.edge_errors import (
    EdgeErrors,
    edges_of,
    measure_errors,
    read,
    SCENES,
    write,
)
from benchmarks.machine import machine
from benchmarks.timing import microseconds
from scene_graph_ros.planning import (
    EdgeStatus,
    load_robot_diagram,
    RobotDiagram,
    SceneGraphCollisionChecker,
)

__all__ = ["main"]

_SCENE = "config/scenes/panda_cell.yaml"
_COUNT = 1000
_STEP = 0.05
_REPEATS = 5
_HALVINGS = 10
"""Of the step between samples."""
_DOCS = Path(__file__).parents[1] / "docs"


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


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="print the first table only")
    parser.add_argument("--picture-only", action="store_true", help="draw edges.csv again")
    parser.add_argument("--count", type=int, default=40_000, help="random edges of each scene")
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    options = parser.parse_args(arguments)
    if options.picture_only:
        write(read(options.out / "edges.csv"), options.out)
        return
    load = os.getloadavg()[0]
    _print_times()
    if not options.quick:
        rows = []
        for scene, make in SCENES.items():
            rows += measure_errors(scene, make(), options.count, _HALVINGS)
        print(_table(rows))
        write(rows, options.out)
    print(machine(load), end="")


def _table(rows: Sequence[EdgeErrors]) -> str:
    lines = [f"{'':30} {'step, rad':>10} {'us':>9} {'wrong':>7} {'of':>7}"]
    for row in rows:
        step = f"{row.step:.2g}" if row.step else "proof"
        us = f"{row.microseconds:.1f}"
        lines.append(f"{row.scene:30} {step:>10} {us:>9} {row.wrong:7} {row.edges:7}")
    return "\n".join(lines)


def _print_times() -> None:
    """Print the first table."""
    robots = load_robot_diagram(_SCENE)
    checker, tree = SceneGraphCollisionChecker(robots), robots.tree
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    q = rng.uniform(lower, upper, (_COUNT, tree.num_positions))
    edges = edges_of(checker, _COUNT)

    def sample() -> None:
        for start, end in edges:
            steps = max(2, int(np.ceil(np.linalg.norm(end - start) / _STEP)) + 1)
            checker.check_configs_collision_free(
                start + np.linspace(0.0, 1.0, steps)[:, np.newaxis] * (end - start)
            )

    rows = {
        "a configuration, in a batch": microseconds(
            lambda: checker.check_configs_collision_free(q), len(q), _REPEATS
        ),
        "the same by set_frame_poses and has_collisions": microseconds(
            _one_by_one(robots, q[:200]), 200, _REPEATS
        ),
        "an edge, proven or found to collide": microseconds(
            lambda: checker.check_edges_collision_free(edges), len(edges), _REPEATS
        ),
        f"the same edge, sampled at steps of {_STEP}": microseconds(sample, len(edges), _REPEATS),
        "clearances up to 0.1 m": microseconds(
            lambda: [checker.calc_robot_clearance(each, 0.1) for each in q[:50]], 50, _REPEATS
        ),
    }
    for what, each in rows.items():
        print(f"{what:50} {each:9.1f} us")
    statuses = [measure.status for measure in checker.measure_edges(edges)]
    counts = {status.name: statuses.count(status) for status in EdgeStatus}
    print(f"{len(edges)} edges, {checker.num_pairs} pairs: {counts}")


if __name__ == "__main__":
    main()
