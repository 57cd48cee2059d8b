"""Error against time of questions about convex sets: ``python -m benchmarks.sets_errors``.

Each question is asked of turned and shifted boxes in several dimensions, of several sizes, and of
several widths along one of their axes; the truth follows from their construction. What is decided
is asked without and with a certificate, which is checked in the same time. One thread, the least
processor time of some calls, each with the making of its sets. Writes ``sets_errors.csv`` and
``sets_errors.png``; without pydrake only ours, which it says.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
import csv
from dataclasses import dataclass
import itertools
import math
import os
from pathlib import Path
import time
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.known_boxes import (  # noqa: E402
    Box,
    box_of,
    DECISIONS,
    DIMENSIONS_OF,
    error_of,
    QUESTIONS,
)
from benchmarks.machine import machine  # noqa: E402
from benchmarks.sets_engines import Ask, DRAKE, engines, OURS, PROVEN  # noqa: E402

__all__ = ["Row", "main", "measure"]

_DOCS = Path(__file__).parents[1] / "docs"
DIMENSIONS = (2, 3, 7, 14)
SIZES = (1e-6, 1e-3, 1.0, 1e3, 1e6)
"""Metres."""
WIDTHS = (1.0, 1e-2, 1e-4)
"""Of the box along one axis, beside the others."""
_REPEATS = 3
_FLOOR = 1e-17
"""Smaller errors are drawn there."""

_MARKS = {2: "o", 3: "s", 7: "^", 14: "D"}
_COLORS = {OURS: "C0", PROVEN: "C2", DRAKE: "C1"}


@dataclass(frozen=True)
class Row:
    """What one engine said of one box: relative error, NaN where it failed, and seconds."""

    engine: str
    question: str
    dimension: int
    size: float
    width: float
    error: float
    seconds: float


def measure(
    sizes: tuple[float, ...] = SIZES,
    widths: tuple[float, ...] = WIDTHS,
    dimensions: tuple[int, ...] = DIMENSIONS,
    repeats: int = _REPEATS,
) -> Iterator[Row]:
    """Ask each engine each question of each box."""
    asked = engines()
    for question, n in itertools.product(QUESTIONS, dimensions):
        if n not in DIMENSIONS_OF.get(question, dimensions):
            continue
        for size, width in itertools.product(sizes, widths):
            box = box_of(size, width, n)
            for name, (ask, of) in asked.items():
                if of is None or question in of:
                    error, seconds = _ask(ask, question, box, repeats)
                    yield Row(name, question, n, size, width, error, seconds)


def _ask(ask: Ask, question: str, box: Box, repeats: int) -> tuple[float, float]:
    """Return the error of the answer and the least time of a call, of a decision among many."""
    _make(box)
    count = len(box.cases[question]) if question in DECISIONS else 1
    best, error = math.inf, math.nan
    for _ in range(repeats):
        begin = time.process_time()
        try:
            answer: Any = ask(question, box)
        # Drake ends the process in some of its failures.
        except (RuntimeError, SystemExit, ValueError, TypeError):
            break
        best = min(best, (time.process_time() - begin) / count)
        error = error_of(question, box, answer)
    return error, best


def _make(box: Box) -> None:
    """Compute what is asked with, which is kept, before the time begins."""
    _ = box.cases, box.walls, box.stations, box.hull_points


def _picture(rows: list[Row], path: Path) -> None:
    """Draw error against time, a panel for each question."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    figure = Figure(figsize=(14.0, 8.6), layout="constrained")
    axes = figure.subplots(3, 5, sharex=True, sharey=True)
    for axis, question in zip(axes.flat, QUESTIONS, strict=False):
        of = [row for row in rows if row.question == question]
        for engine, n in itertools.product(_COLORS, _MARKS):
            found = [r for r in of if (r.engine, r.dimension) == (engine, n)]
            found = [r for r in found if math.isfinite(r.error)]
            axis.plot(
                [1e3 * row.seconds for row in found],
                [max(row.error, _FLOOR) for row in found],
                _MARKS[n],
                color=_COLORS[engine],
                alpha=0.6,
                markersize=5,
            )
        failed = sum(row.engine == DRAKE and not math.isfinite(row.error) for row in of)
        axis.set(xscale="log", yscale="log", title=question)
        if failed:
            note = f"and {failed} without an answer"
            axis.text(
                0.97,
                0.95,
                note,
                color=_COLORS[DRAKE],
                ha="right",
                va="top",
                fontsize=8,
                transform=axis.transAxes,
            )
        axis.grid(alpha=0.3)
    last = axes.flat[-1]
    last.axis("off")
    present = {row.engine for row in rows}
    handles = [
        Line2D([], [], marker="o", linestyle="", color=color, label=name)
        for name, color in _COLORS.items()
        if name in present
    ]
    handles += [
        Line2D([], [], marker=mark, linestyle="", color="0.4", label=f"{n} dimensions")
        for n, mark in _MARKS.items()
    ]
    last.legend(handles=handles, loc="center", frameon=False)
    axes[-2, -1].tick_params(labelbottom=True)
    for axis in axes[-1, :-1]:
        axis.set_xlabel("CPU time (ms)")
    for axis in axes[:, 0]:
        axis.set_ylabel("relative error")
    figure.savefig(path, dpi=100)


def _table(rows: list[Row]) -> Iterator[str]:
    """Say the worst error and the median time of each question, engine and dimension."""
    for question, engine, n in itertools.product(QUESTIONS, _COLORS, _MARKS):
        of = [r for r in rows if (r.question, r.engine, r.dimension) == (question, engine, n)]
        found = [r for r in of if math.isfinite(r.error)]
        if of:
            worst = max((r.error for r in found), default=math.nan)
            middle = 1e3 * float(np.median([r.seconds for r in found])) if found else math.nan
            yield (
                f"{question:24} {engine:22} {n:2}D worst {worst:.1e}, median {middle:.3f} ms,"
                f" failed {len(of) - len(found)} of {len(of)}"
            )


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sets_errors", description=__doc__)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    options = parser.parse_args()
    load = os.getloadavg()[0]
    if DRAKE not in engines():
        print("pydrake is not installed, so only ours is measured; make peers installs it")
    rows = list(measure())
    with (options.out / "sets_errors.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(
            ("engine", "question", "dimension", "size", "width", "relative error", "seconds")
        )
        writer.writerows(
            (
                *(r.engine, r.question, r.dimension),
                *(f"{v:.4g}" for v in (r.size, r.width, r.error, r.seconds)),
            )
            for r in rows
        )
    for line in _table(rows):
        print(line)
    _picture(rows, options.out / "sets_errors.png")
    print(machine(load), end="")


if __name__ == "__main__":
    main()
