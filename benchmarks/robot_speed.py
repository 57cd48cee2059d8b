"""Configurations and edges per second of a Panda in two scenes, beside the peers in one run.

``python -m benchmarks.robot_speed`` prints the table. All are called from Python with one thread,
about the same geometries and pairs. Ours proves edges; the others sample them at steps of 0.05 rad
and stop at the first collision. To them a mesh is its convex hull: where a finger is in the bowl,
they differ. Clearances with derivatives are tables of their own: a call for each configuration,
and ours all at once, too. Drake has no distances from a mesh's triangles, nor of hulls from half
spaces, so in the cell it answers an easier question. The second table asks both the same; in the
third there are boxes and hulls only. Peers that are not installed are left out, and that is said;
``make peers`` installs them.

Sphere models stand for planners that cover the robot with spheres and check these: as fast, and
wrong where a sphere is outside of its link. ``alarms`` is how many of the free configurations
collide to an engine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
import contextlib
from functools import partial
import os
from pathlib import Path
from typing import NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

from benchmarks.edge_errors import edges_of  # noqa: E402
from benchmarks.machine import machine  # noqa: E402
from benchmarks.robot_engines.clearance_scenes import (  # noqa: E402
    boxes_and_grasp,
    cell,
    cell_of_hulls,
)
from benchmarks.robot_engines.drake_engine import DrakeEngine  # noqa: E402
from benchmarks.robot_engines.mujoco_engine import MuJoCoEngine  # noqa: E402
from benchmarks.robot_engines.our_engine import OurBatches, OurEngine  # noqa: E402
from benchmarks.robot_engines.pinocchio_engine import PinocchioEngine  # noqa: E402
from benchmarks.robot_engines.robot_world import (  # noqa: E402
    ClearanceEngine,
    RobotEngine,
    RobotWorld,
)
from benchmarks.robot_engines.sphere_engine import SphereEngine  # noqa: E402
from benchmarks.timing import least_time  # noqa: E402
from scene_graph_ros.planning import SceneGraphCollisionChecker  # noqa: E402

__all__ = ["main"]

_STEP = 0.05
_REPEATS = 4
_SPHERES = (60, 240, 960)
"""In all around what moves: sphere models."""
_INFLUENCES = (0.05, 0.1, 0.5)
"""Metres, up to which clearances are told."""
_SCENES = {"the cell": cell, "a box in the hand among 29 boxes": boxes_and_grasp}
"""Configurations and edges are checked in these; the picture is of the first."""

_CLEARANCE_SCENES = {
    "the cell": cell,
    "the cell as Drake has it (meshes are hulls, no floor)": cell_of_hulls,
    "a box in the hand among 29 boxes": boxes_and_grasp,
}


class _Row(NamedTuple):
    name: str
    configurations: float
    """Microseconds each."""
    edges: float
    """Microseconds each."""
    apart: int
    """Configurations of which it says otherwise than ours."""
    alarms: float
    """Of the configurations that are free to ours: the share that collides to it."""
    colliding: int
    """Edges."""


def _engines(checker: SceneGraphCollisionChecker) -> list[RobotEngine]:
    """Return ours first, and the peers that are installed."""
    world, found = RobotWorld.of(checker), [OurEngine(checker)]
    peers: tuple[Callable[[], RobotEngine], ...] = (
        lambda: DrakeEngine(world, _STEP),
        lambda: MuJoCoEngine(world),
        lambda: PinocchioEngine(world),
        *(partial(SphereEngine, world, count) for count in _SPHERES),
    )
    engines: list[RobotEngine] = [*found]
    for make in peers:
        try:
            engines.append(make())
        except ImportError as error:
            print(f"left out: {error}")
    return engines


def _measured(engines: Sequence[RobotEngine], q: np.ndarray, edges: np.ndarray) -> list[_Row]:
    rows: list[_Row] = []
    truth = engines[0].collide(q)
    for engine in engines:
        each, hits = least_time(lambda e=engine: e.collide(q), _REPEATS)  # type: ignore[misc]
        edge, colliding = least_time(
            lambda e=engine: e.edges_collide(edges, _STEP),  # type: ignore[misc]
            _REPEATS,
        )
        each, edge = 1e6 * each / len(q), 1e6 * edge / len(edges)
        apart = int((hits != truth).sum())
        alarms = float(hits[~truth].mean())
        rows.append(_Row(engine.name, each, edge, apart, alarms, int(colliding.sum())))
    return rows


def _clearances(
    engines: Sequence[ClearanceEngine], q: np.ndarray, influence: float
) -> list[tuple[float, float]]:
    """Return microseconds and rows of each configuration, by engine; they take turns."""
    best, rows = [np.inf] * len(engines), [0.0] * len(engines)
    for _ in range(_REPEATS):
        for k, engine in enumerate(engines):
            each, counts = least_time(lambda e=engine: e.clearances(q, influence), 1)  # type: ignore[misc]
            best[k], rows[k] = min(best[k], 1e6 * each / len(q)), float(counts.mean())
    return list(zip(best, rows, strict=True))


def _print_clearances(scene: str, checker: SceneGraphCollisionChecker, count: int) -> None:
    """Print what clearances cost in a scene, by our checker and by Drake's, if it is there."""
    tree, rng = checker.model.tree, np.random.default_rng(0)
    q = rng.uniform(tree.lower, tree.upper, (count, tree.num_positions))
    engines: list[ClearanceEngine] = [OurEngine(checker), OurBatches(checker)]
    with contextlib.suppress(ImportError):
        engines.append(DrakeEngine(RobotWorld.of(checker), _STEP))
    names = [engine.name for engine in engines]
    print(f"{scene}, {checker.num_pairs} pairs")
    print(f"{'clearance within':26} {'microseconds':>13} {'rows':>7} {'Drake takes':>12}")
    for influence in _INFLUENCES:
        found = _clearances(engines, q, influence)
        theirs = found[2][0] if len(found) > 2 else np.nan
        for name, (each, rows) in zip(names, found, strict=True):
            print(f"{influence:4} m, {name:18} {each:13.1f} {rows:7.2f} {theirs / each:11.1f}x")


def _print_rates(scene: str, checker: SceneGraphCollisionChecker, count: int) -> list[_Row]:
    """Print how many configurations and edges of a scene each engine checks in a second."""
    tree, rng = checker.model.tree, np.random.default_rng(0)
    q = rng.uniform(tree.lower, tree.upper, (count, tree.num_positions))
    edges = edges_of(checker, count)
    rows = _measured(_engines(checker), q, edges)
    ours = rows[0]
    print(
        f"{scene}: {len(q)} configurations, {len(edges)} edges, {checker.num_pairs} pairs checked"
    )
    print(
        f"{'':18} {'configurations/s':>17} {'ours is':>9} {'edges/s':>9} {'ours is':>9}"
        f" {'differ':>7} {'alarms':>7} {'collide':>8}"
    )
    for row in rows:
        print(
            f"{row.name:18} {1e6 / row.configurations:17.0f}"
            f" {row.configurations / ours.configurations:8.1f}x {1e6 / row.edges:9.0f}"
            f" {row.edges / ours.edges:8.1f}x {row.apart:7} {row.alarms:7.1%} {row.colliding:8}"
        )
    return rows


def _draw(rows: Sequence[_Row], output: Path) -> None:
    """Write bars of what each engine does in a second, and how often it is wrong."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.2), sharey=True, layout="constrained")
    names = [row.name for row in rows]
    colours = ["tab:orange" if "spheres" in name else "0.6" for name in names]
    colours[0] = "tab:green"
    done = ([row.configurations for row in rows], [row.edges for row in rows])
    sampled = "edges a second: ours proven, others sampled"
    for axis, times, title in zip(
        axes[:2], done, ("configurations a second", sampled), strict=True
    ):
        rates = [1e6 / each for each in times]
        bars = axis.barh(names, rates, color=colours)
        axis.bar_label(bars, [f"{rate:,.0f}".replace(",", " ") for rate in rates], padding=4)
        axis.set_xlim(0.0, 1.2 * max(rates))
        axis.set_title(title, fontsize="medium")
        axis.spines[["top", "right", "bottom"]].set_visible(False)
        axis.set_xticks([])
    alarms = [100.0 * row.alarms for row in rows]
    bars = axes[2].barh(names, alarms, color=colours)
    axes[2].bar_label(bars, [f"{each:.1f} %" for each in alarms], padding=4)
    axes[2].set_xlim(0.0, 1.2 * max(1.0, *alarms))
    axes[2].set_title("free ones said to collide", fontsize="medium")
    axes[2].spines[["top", "right", "bottom"]].set_visible(False)
    axes[2].set_xticks([])
    axes[0].invert_yaxis()
    figure.savefig(output, dpi=110)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--picture", type=Path, help="a file for bars of the rates")
    parser.add_argument("--count", type=int, default=1000, help="configurations, and edges")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    drawn = None
    for scene, made in _SCENES.items():
        rows = _print_rates(scene, made(), options.count)
        drawn = rows if drawn is None else drawn
    if options.picture is not None and drawn is not None:
        _draw(drawn, options.picture)
    for scene, made in _CLEARANCE_SCENES.items():
        _print_clearances(scene, made(), options.count)
    print(machine(load), end="")


if __name__ == "__main__":
    main()
