"""How often samples of an edge miss what it collides with, against their step and time.

An edge collides where the proof shows a configuration of it that does: that is a fact, whoever
found it. Samples that are all free on such an edge are a wrong answer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import csv
from dataclasses import asdict, dataclass, fields
import importlib
import math
from pathlib import Path
import tempfile
from typing import Any

import numpy as np

from benchmarks.timing import microseconds
from scene_graph_ros.geometry import Cylinder, GeometryInstance, ProximityProperties
from scene_graph_ros.planning import (
    EdgeStatus,
    load_robot_diagram,
    RobotDiagramBuilder,
    SceneGraphCollisionChecker,
)

__all__ = ["SCENES", "EdgeErrors", "edges_of", "measure_errors", "panda", "read", "write"]

_CELL = "config/scenes/panda_cell.yaml"
_TIMED = 400
"""Edges of which the time is taken."""
_REPEATS = 3
_COARSEST = 0.4
"""Step (rad) between samples that is halved again and again."""
_LENGTH = 1.25
"""Of edges at most, rad and m."""

_ROD = """<robot name="rod"><link name="base"/><link name="cart"/><link name="rod">
  <collision><origin xyz="0.5 0 0"/><geometry><box size="1 0.001 0.001"/></geometry></collision>
  </link><joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
  <axis xyz="1 0 0"/><limit lower="-0.6" upper="0.6" effort="1" velocity="1"/></joint>
  <joint name="hinge" type="revolute"><parent link="cart"/><child link="rod"/>
  <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""


@dataclass(frozen=True)
class EdgeErrors:
    """What one way to answer did with the edges of a scene."""

    scene: str
    step: float
    """rad; 0 for the proof."""
    edges: int
    colliding: int
    """That certainly collide."""
    wrong: int
    """Of these, said to be free."""
    undecided: int
    """That count as not free, and may be."""
    microseconds: float
    """For an edge."""

    @property
    def share(self) -> float:
        """Return how many of all answers are wrong."""
        return self.wrong / self.edges


def panda() -> SceneGraphCollisionChecker:
    """Return a Panda in its cell."""
    return SceneGraphCollisionChecker(load_robot_diagram(_CELL))


def wire() -> SceneGraphCollisionChecker:
    """Return a Panda in its cell, with wires of 2 mm between ceiling and table."""
    builder = RobotDiagramBuilder()
    builder.add_scene(_CELL)
    scene = builder.scene_graph
    source = scene.register_source("wires")
    rng = np.random.default_rng(4)
    for k in range(12):
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(0.35, 0.7)
        X_WG = np.eye(4)
        X_WG[:3, 3] = far * math.cos(angle), far * math.sin(angle), 1.1
        instance = GeometryInstance(X_WG, Cylinder(0.001, 1.2), f"wire_{k}")
        instance.set_proximity_properties(ProximityProperties())
        scene.register_anchored_geometry(source, instance)
    return SceneGraphCollisionChecker(builder.build())


def rod() -> SceneGraphCollisionChecker:
    """Return a rod of 1 m and 1 mm on a cart, among posts of 1 mm."""
    rng = np.random.default_rng(1)
    lines = ["version: 1", "sources: [{name: around}]", "geometries:"]
    for k in range(8):
        angle, far = rng.uniform(-math.pi, math.pi), rng.uniform(0.4, 1.4)
        place = f"{far * math.cos(angle):.6f}, {far * math.sin(angle):.6f}, 0"
        lines.append(
            f"  - {{name: post_{k}, source: around, pose: {{xyz: [{place}]}},"
            " shape: {type: cylinder, radius: 0.0005, length: 0.2}}"
        )
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "rod.urdf").write_text(_ROD)
        lines += ["robots:", "  - {name: rod, urdf: rod.urdf}"]
        scene = Path(folder, "scene.yaml")
        scene.write_text("\n".join(lines))
        return SceneGraphCollisionChecker(load_robot_diagram(str(scene)))


SCENES: dict[str, Callable[[], SceneGraphCollisionChecker]] = {
    "a Panda in its cell": panda,
    "the same with wires of 2 mm": wire,
    "a rod among posts of 1 mm": rod,
}


def edges_of(checker: SceneGraphCollisionChecker, count: int) -> np.ndarray:
    """Return up to so many random edges ``(n, 2, nq)``, which begin where nothing collides."""
    rng, tree = np.random.default_rng(0), checker.model.tree
    lower, upper = np.maximum(tree.lower, -3.0), np.minimum(tree.upper, 3.0)
    q = rng.uniform(lower, upper, (count, tree.num_positions))
    free = q[checker.check_configs_collision_free(q)]
    ways = free[1:] - free[:-1]
    ways *= np.minimum(1.0, _LENGTH / np.linalg.norm(ways, axis=1))[:, np.newaxis]
    return np.stack([free[:-1], free[:-1] + ways], axis=1)


def _samples(edges: np.ndarray, halvings: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the samples of edges in a row ``(k, nq)``, and where those of each begin.

    Steps are at most _COARSEST, halved so often; each halving keeps the samples of before.
    """
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    counts = np.maximum(1, np.ceil(lengths / _COARSEST)).astype(np.int64) * 2**halvings + 1
    begins = np.concatenate([[0], np.cumsum(counts)])
    rows = np.repeat(np.arange(len(edges)), counts)
    t = ((np.arange(begins[-1]) - begins[rows]) / (counts[rows] - 1))[:, np.newaxis]
    return (1.0 - t) * edges[rows, 0] + t * edges[rows, 1], begins[:-1]


def _missed(checker: SceneGraphCollisionChecker, hits: np.ndarray, halvings: int) -> np.ndarray:
    """Return those of edges that collide whose samples are all free."""
    missed = []
    for part in np.array_split(hits, max(1, len(hits) * 2**halvings // 20_000)):
        if len(part):
            q, begins = _samples(part, halvings)
            free = np.logical_and.reduceat(checker.check_configs_collision_free(q), begins)
            missed.append(part[free])
    return np.concatenate(missed) if missed else hits[:0]


def measure_errors(
    scene: str, checker: SceneGraphCollisionChecker, count: int, halvings: int
) -> list[EdgeErrors]:
    """Return what the proof, and samples at steps halved so often, say of random edges."""
    edges = edges_of(checker, count)
    statuses = np.array([measure.status for measure in checker.measure_edges(edges)])
    hits = edges[statuses == EdgeStatus.COLLIDES]
    undecided = int((statuses == EdgeStatus.UNDECIDED).sum())
    timed = edges[:_TIMED]
    each = microseconds(lambda: checker.check_edges_collision_free(timed), len(timed), _REPEATS)
    rows = [EdgeErrors(scene, 0.0, len(edges), len(hits), 0, undecided, each)]
    missed = hits
    for k in range(halvings + 1):
        missed = _missed(checker, missed, k)
        some = timed[: max(20, _TIMED >> max(0, k - 4))]
        q, _ = _samples(some, k)
        each = microseconds(
            lambda q=q: checker.check_configs_collision_free(q),  # type: ignore[misc]
            len(some),
            _REPEATS,
        )
        step = _COARSEST / 2**k
        rows.append(EdgeErrors(scene, step, len(edges), len(hits), len(missed), 0, each))
    return rows


def read(file: Path) -> list[EdgeErrors]:
    """Return what was written."""
    kinds = {"scene": str, "step": float, "microseconds": float}
    with file.open(newline="") as lines:
        return [
            EdgeErrors(**{name: kinds.get(name, int)(value) for name, value in row.items()})
            for row in csv.DictReader(lines)
        ]


def write(rows: Sequence[EdgeErrors], folder: Path) -> None:
    """Write edges.csv and edges.png. Raises ImportError without matplotlib."""
    with (folder / "edges.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(EdgeErrors)])
        writer.writeheader()
        for row in rows:
            values = asdict(row) | {"step": f"{row.step:g}"}
            writer.writerow(values | {"microseconds": f"{row.microseconds:.4g}"})
    importlib.import_module("matplotlib").use("Agg")
    # What the file says, so that whoever draws it again gets the same.
    _picture(read(folder / "edges.csv")).savefig(folder / "edges.png", dpi=130)


_LOOKS = (("#0b5394", "o"), ("#1b7837", "^"), ("#d55e00", "s"))


def _picture(rows: Sequence[EdgeErrors]) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, (by_step, by_time) = pyplot.subplots(1, 2, figsize=(12.0, 5.4), sharey=True)
    scenes = list(dict.fromkeys(row.scene for row in rows))
    positive = [row.share for row in rows if row.wrong]
    none = 10.0 ** math.floor(math.log10(min(positive, default=1e-3)) - 0.5)
    for scene, (colour, marker) in zip(scenes, _LOOKS, strict=False):
        mine = [row for row in rows if row.scene == scene]
        (proof,), samples = ([r for r in mine if r.step == 0.0], [r for r in mine if r.step])
        shares = [row.share or none for row in samples]
        style = {"color": colour, "linewidth": 1.6, "marker": marker, "markersize": 6}
        label = f"{scene}: {proof.colliding} of {proof.edges} edges collide"
        for axis, places in (
            (by_step, [row.step for row in samples]),
            (by_time, [row.microseconds for row in samples]),
        ):
            axis.plot(places, shares, label=label, **style)
            lucky = [k for k, row in enumerate(samples) if not row.wrong]
            axis.plot(
                [places[k] for k in lucky],
                [none] * len(lucky),
                linestyle="none",
                marker=marker,
                markersize=6,
                markerfacecolor="white",
                color=colour,
                zorder=3,
            )
        by_time.plot(
            proof.microseconds, none, marker="*", markersize=19, color=colour, zorder=4,
            markeredgecolor="black", markeredgewidth=0.8, linestyle="none",
        )  # fmt: skip
    for axis, words in (
        (by_step, "step between samples (rad)"),
        (by_time, "time for an edge (µs), one thread"),
    ):
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_xlabel(words)
        axis.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
        axis.axhspan(none / 2.0, none * 2.0, color="#eeeeee", zorder=0)
    by_step.invert_xaxis()
    by_step.set_ylim(none / 2.0, 1.0)
    ticks = [10.0**k for k in range(round(math.log10(none)) + 1, 1)]
    by_step.set_yticks([none, *ticks], ["none", *(f"{100 * t:g} %" for t in ticks)])
    by_step.set_ylabel("edges said to be free that collide")
    by_time.text(
        0.02, 0.14, "★ the proof: none wrong,\n    and none can be", transform=by_time.transAxes,
        fontsize=10, fontweight="bold",
    )  # fmt: skip
    by_step.text(
        0.02, 0.025, "open marks: no edge happened\nto be missed, others may be",
        transform=by_step.transAxes, fontsize=8.5, color="#555555",
    )  # fmt: skip
    handles, labels = by_step.get_legend_handles_labels()
    figure.suptitle("Is this motion free? Samples along it, and a proof", fontsize=13)
    figure.legend(
        handles, labels, loc="lower center", ncols=len(scenes), frameon=False, fontsize=9
    )
    figure.tight_layout(rect=(0.0, 0.05, 1.0, 1.0))
    return figure
