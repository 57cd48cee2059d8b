"""Where answers about convex sets are right, beside Drake's: ``python -m benchmarks.emptiness``.

Two pictures in one. On the left for each size of a polytope and each gap between two of its
faces, the share of right answers to whether it is empty: turned boxes whose facing rows are the
same numbers with opposite signs, so that the truth is exact; half of them overlap by as much
instead. On the right the error of the largest ellipsoid inside a turned box of known widths
against the time it takes.
Writes ``sets_accuracy.csv`` and ``sets_accuracy.png``; without pydrake only ours, which it says.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
import csv
import os
from pathlib import Path
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from scene_graph_ros.geometry.optimization import HPolyhedron  # noqa: E402

__all__ = ["main", "measure_ellipsoids", "measure_emptiness"]

_DOCS = Path(__file__).parents[1] / "docs"
SIZES = 10.0 ** np.arange(-9, 10, 2)
"""Metres."""
GAPS = 10.0 ** -np.arange(1.0, 16.0)
"""Of the size."""
WIDTHS = 10.0 ** -np.arange(0.0, 7.0)
"""The least width of a box beside the others, of which turning leaves 1e-16 known."""
_TURNS = 4
_REPEATS = 3

Asked = Callable[[np.ndarray, np.ndarray], Any]


def _engines() -> dict[str, tuple[Asked, Asked]]:
    """Name who is asked whether rows have no point, and of the log volume of the ellipsoid."""

    def volume(A: np.ndarray, b: np.ndarray) -> float:
        ellipsoid = HPolyhedron(A, b).maximum_volume_inscribed_ellipsoid()
        return -float(np.linalg.slogdet(ellipsoid.A)[1])

    found: dict[str, tuple[Asked, Asked]] = {
        "ours": (lambda A, b: HPolyhedron(A, b).is_empty(), volume)
    }
    try:
        import pydrake.geometry.optimization as drake
    except ImportError:
        print("pydrake is not installed, so only ours is measured; make peers installs it")
        return found

    def their_volume(A: np.ndarray, b: np.ndarray) -> float:
        ellipsoid = drake.HPolyhedron(A, b).MaximumVolumeInscribedEllipsoid()
        return -float(np.linalg.slogdet(ellipsoid.A())[1])

    found["Drake"] = (lambda A, b: drake.HPolyhedron(A, b).IsEmpty(), their_volume)
    return found


def _turned_box(rng: np.random.Generator, half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.concatenate([turn, -turn]), np.tile(half, 2)


def measure_emptiness(ask: Asked) -> Iterator[tuple[float, float, float]]:
    """Return the share of right answers for each size and gap."""
    for size in SIZES:
        for gap in GAPS:
            rng, right = np.random.default_rng(1), 0
            for _ in range(_TURNS):
                A, b = _turned_box(rng, np.full(3, size))
                for is_empty in (True, False):
                    # Rows 0 and 3 are each other's negatives: they add up to 0 <= b0 + b3.
                    b[0], b[3] = 0.0, -gap * size if is_empty else gap * size
                    right += bool(ask(A, b)) == is_empty
            yield float(size), float(gap), right / (2 * _TURNS)


def measure_ellipsoids(ask: Asked) -> Iterator[tuple[float, float, float, float]]:
    """Return the error of the log volume and the least time (s) for each size and width."""
    for size in SIZES[::2]:
        for width in WIDTHS:
            half = size * np.array([1.0, 1.0, width])
            A, b = _turned_box(np.random.default_rng(2), half)
            best, error = np.inf, np.nan
            for _ in range(_REPEATS):
                begin = time.process_time()
                try:
                    error = abs(ask(A, b) - float(np.log(half).sum()))
                except RuntimeError:
                    break
                best = min(best, time.process_time() - begin)
            yield float(size), float(width), error, best


def _picture(emptiness: dict[str, Any], ellipsoids: dict[str, Any], path: Path) -> None:
    from matplotlib.figure import Figure

    count = len(emptiness)
    figure = Figure(figsize=(4.2 * (count + 1) + 1.0, 4.4), layout="constrained")
    axes = figure.subplots(1, count + 1)
    for axis, (name, rows) in zip(axes, emptiness.items(), strict=False):
        share = np.array([row[2] for row in rows]).reshape(len(SIZES), len(GAPS))
        drawn = axis.pcolormesh(GAPS, SIZES, 100.0 * share, cmap="RdYlBu", vmin=0.0, vmax=100.0)
        axis.set(xscale="log", yscale="log", title=f"{name}: right answers to is_empty")
        axis.set(xlabel="gap or overlap, of the size", ylabel="size (m)")
    figure.colorbar(drawn, ax=axes[count - 1], label="%")
    last = axes[-1]
    for (name, rows), mark in zip(ellipsoids.items(), "os", strict=False):
        table = np.array(rows)
        is_found = np.isfinite(table[:, 3])
        failed = int((~is_found).sum())
        label = f"{name}, of {len(table)} boxes {failed} failed" if failed else name
        last.plot(
            1e3 * table[is_found, 3], np.maximum(table[is_found, 2], 1e-16), mark, label=label
        )
    last.set(xscale="log", yscale="log", title="largest ellipsoid inside a thin box")
    last.set(xlabel="CPU time (ms)", ylabel="error of the logarithm of the volume")
    last.grid(alpha=0.3)
    last.legend()
    figure.savefig(path, dpi=110)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.emptiness", description=__doc__)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    options = parser.parse_args()
    emptiness, ellipsoids = {}, {}
    for name, (is_empty, volume) in _engines().items():
        emptiness[name] = list(measure_emptiness(is_empty))
        ellipsoids[name] = list(measure_ellipsoids(volume))
        wrong = sum(share < 1.0 for _, _, share in emptiness[name])
        print(f"{name}: {wrong} of {len(emptiness[name])} fields with wrong answers")
    with (options.out / "sets_accuracy.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(
            ("engine", "question", "size", "gap or width", "share or error", "seconds")
        )
        for name, rows in emptiness.items():
            writer.writerows((name, "is_empty", *map(repr, row), "") for row in rows)
        for name, table in ellipsoids.items():
            writer.writerows((name, "inscribed", *map(repr, row)) for row in table)
    _picture(emptiness, ellipsoids, options.out / "sets_accuracy.png")


if __name__ == "__main__":
    main()
