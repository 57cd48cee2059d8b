"""What each knob of convex sets costs: ``python -m benchmarks.sets_knobs``.

Error against processor time for the settings of what is not exact: volumes by sampling, samples
themselves, regions among obstacles, simpler polyhedra, paths through graphs. Truths follow from
how the sets were made. One thread, the least of some times. Writes ``sets_knobs.csv`` and
``sets_knobs.png``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import csv
from dataclasses import dataclass
import functools
import itertools
import math
import os
from pathlib import Path
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.mazes import doors_of, our_graph  # noqa: E402
from scene_graph_ros.geometry.optimization import (  # noqa: E402
    GraphOfConvexSetsOptions,
    HPolyhedron,
    iris,
    IrisOptions,
    VPolytope,
)

__all__ = ["KNOBS", "Knob", "Row", "main", "measure"]

_DOCS = Path(__file__).parents[1] / "docs"
_REPEATS = 3


@dataclass(frozen=True)
class Row:
    """What one setting of a knob cost: its error, and seconds."""

    knob: str
    setting: float
    error: float
    seconds: float


@dataclass(frozen=True)
class Knob:
    """An option of a question, the settings that are tried, and what is taken for the error.

    ``ask`` takes a setting and the number of a try, and returns an answer; ``error`` takes the
    answers of all tries.
    """

    question: str
    option: str
    error_is: str
    settings: tuple[float, ...]
    tries: int
    ask: Callable[[float, int], Any]
    error: Callable[[list[Any]], float]


@functools.cache
def _box(n: int) -> tuple[HPolyhedron, np.ndarray, np.ndarray]:
    """Return a turned box, its axes as rows and half its widths, from 1 down to 0.1."""
    Q, _ = np.linalg.qr(np.random.default_rng(n).normal(size=(n, n)))
    half = np.linspace(1.0, 0.1, n)
    return HPolyhedron(np.concatenate([Q, -Q]), np.tile(half, 2)), Q, half


def _middle(truth: float, values: list[float]) -> float:
    """Return the middle relative error."""
    return float(np.median([abs(value / truth - 1.0) for value in values]))


def _volume(n: int) -> float:
    return float(np.prod(2.0 * _box(n)[2]))


def _apart(samples: list[np.ndarray]) -> float:
    """Return how far the share of samples below a height is from the truth, at most.

    Along each axis of the box, in which they are uniform (Kolmogorov's distance); the middle of
    all tries.
    """
    _, Q, half = _box(7)
    found = []
    for points in samples:
        heights = np.sort((points @ Q.T / half + 1.0) / 2.0, axis=0)
        shares = (np.arange(len(points)) + 0.5)[:, None] / len(points)
        found.append(float(np.abs(heights - shares).max()))
    return float(np.median(found))


@functools.cache
def _obstacles() -> tuple[HPolyhedron, list[VPolytope]]:
    """Return a room and a hundred hulls in it, none at its middle."""
    rng = np.random.default_rng(3)
    centers = rng.uniform(-4.5, 4.5, (400, 3))
    centers = centers[np.linalg.norm(centers, axis=1) > 1.2][:100]
    hulls = [VPolytope(c + 0.4 * rng.normal(size=(8, 3)) / 2.0) for c in centers]
    return HPolyhedron.make_box([-5.0] * 3, [5.0] * 3), hulls


def _region(threshold: float, _: int) -> float:
    """Return the volume of the ellipsoid in a region that is grown up to a threshold."""
    room, hulls = _obstacles()
    options = IrisOptions(termination_threshold=-1.0, relative_termination_threshold=threshold)
    region = iris(hulls, np.zeros(3), room, options)
    return region.maximum_volume_inscribed_ellipsoid().calc_volume()


@functools.cache
def _largest_region() -> float:
    return _region(0.0, 0)


@functools.cache
def _cut_ball() -> HPolyhedron:
    """Return what 60 half spaces around a ball leave, in three dimensions."""
    rows = np.random.default_rng(5).normal(size=(60, 3))
    return HPolyhedron(rows, np.linalg.norm(rows, axis=1)).reduce_inequalities()


def _simplified(ratio: float, _: int) -> HPolyhedron:
    return _cut_ball().simplify_by_incremental_face_translation(ratio)


@functools.cache
def _maze() -> tuple[Any, ...]:
    """Return a maze in which many ways cost nearly the same."""
    return our_graph(doors_of(np.random.default_rng(1), 14, 0.5), 14)


def _path(gap: float, _: int) -> float:
    graph, start, goal = _maze()
    result = graph.solve_shortest_path(start, goal, GraphOfConvexSetsOptions(gap_tolerance=gap))
    return float(result.gap / result.cost)


KNOBS = (
    Knob(
        "volume by sampling, 4D",
        "desired_rel_accuracy",
        "middle error of nine",
        (0.1, 0.03, 0.01, 0.003, 0.001),
        9,
        lambda a, k: (
            _box(4)[0]
            .calc_volume_via_sampling(np.random.default_rng(k), a, max_num_samples=100_000_000)
            .volume
        ),
        lambda found: _middle(_volume(4), found),
    ),
    Knob(
        "interval of a volume, 7D",
        "desired_rel_accuracy",
        "half the interval's width",
        (0.2, 0.1, 0.05, 0.02, 0.01),
        3,
        lambda a, k: _box(7)[0].calc_volume_interval(
            np.random.default_rng(k), a, max_num_samples=100_000_000
        ),
        lambda found: (
            float(np.median([each.upper - each.lower for each in found])) / 2.0 / _volume(7)
        ),
    ),
    Knob(
        "1000 samples, 7D",
        "mixing_steps",
        "largest error of a share",
        (1, 2, 4, 8, 16, 28, 64),
        9,
        lambda steps, k: (
            _box(7)[0]
            .uniform_samples(np.random.default_rng(k), 1000, mixing_steps=int(steps))
            .points
        ),
        _apart,
    ),
    Knob(
        "region among 100 hulls, 3D",
        "relative_termination_threshold",
        "volume that is missing",
        (1.0, 0.3, 0.03, 0.01, 1e-3),
        1,
        _region,
        lambda found: max(1.0 - found[0] / _largest_region(), 0.0),
    ),
    Knob(
        "fewer faces of 60, 3D",
        "min_volume_ratio",
        "volume that is missing",
        (0.1, 0.3, 0.5, 0.7, 0.9, 0.97),
        1,
        _simplified,
        lambda found: 1.0 - found[0].calc_volume() / _cut_ball().calc_volume(),
    ),
    Knob(
        "path through 196 sets",
        "gap_tolerance",
        "proven gap",
        (0.03, 0.01, 3e-3, 1e-3, 1e-4, 1e-6),
        1,
        _path,
        lambda found: found[0],
    ),
)


def measure(
    knobs: tuple[Knob, ...] = KNOBS, repeats: int = _REPEATS, settings: int | None = None
) -> Iterator[Row]:
    """Ask with each of a knob's settings, or so many of them."""
    for knob in knobs:
        knob.ask(knob.settings[0], 0)
        for setting in knob.settings[:settings]:
            answers, seconds = [], []
            for k in range(knob.tries):
                times = []
                for _ in range(repeats):
                    begin = time.process_time()
                    answer = knob.ask(setting, k)
                    times.append(time.process_time() - begin)
                answers.append(answer)
                seconds.append(min(times))
            error = knob.error(answers)
            yield Row(knob.question, setting, error, float(np.median(seconds)))


def _picture(rows: list[Row], path: Path) -> None:
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter

    figure = Figure(figsize=(11.0, 6.6), layout="constrained")
    for axis, knob in zip(figure.subplots(2, 3).flat, KNOBS, strict=True):
        of = [row for row in rows if row.knob == knob.question]
        times = [1e3 * row.seconds for row in of]
        errors = [max(row.error, 1e-10) for row in of]
        axis.plot(times, errors, "o-", color="C0")
        for row, x, y in zip(of, times, errors, strict=True):
            axis.annotate(
                f"{row.setting:g}", (x, y), xytext=(4, 4), textcoords="offset points", fontsize=8
            )
        axis.set(xscale="log", yscale="log", xlabel="CPU time (ms)", ylabel=knob.error_is)
        axis.set_title(f"{knob.question}\n{knob.option}", fontsize=10)
        axis.margins(x=0.15, y=0.1)
        for scale, values in ((axis.xaxis, times), (axis.yaxis, errors)):
            is_short = max(values) < 30.0 * min(values)
            scale.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if is_short else (1.0,)))
            scale.set_major_formatter(lambda value, _: f"{value:g}")
            scale.set_minor_formatter(NullFormatter())
        axis.grid(alpha=0.3, which="both")
    figure.savefig(path, dpi=100)


def main(arguments: list[str] | None = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sets_knobs", description=__doc__)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    parser.add_argument("--settings", type=int, default=None, help="of each knob, at most")
    options = parser.parse_args(arguments)
    load = os.getloadavg()[0]
    rows = list(measure(settings=options.settings))
    with (options.out / "sets_knobs.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(("question", "setting", "error", "seconds"))
        writer.writerows((r.knob, repr(r.setting), repr(r.error), repr(r.seconds)) for r in rows)
    print(f"{'question':28} {'setting':>8} {'error':>9} {'CPU (ms)':>10}")
    for _, of in itertools.groupby(rows, key=lambda row: row.knob):
        for row in of:
            said = "none" if math.isclose(row.error, 0.0) else f"{row.error:.1e}"
            print(f"{row.knob:28} {row.setting:8g} {said:>9} {1e3 * row.seconds:10.2f}")
    _picture(rows, options.out / "sets_knobs.png")
    print(machine(load), end="")


if __name__ == "__main__":
    main()
