"""What a smaller gap costs: ``python -m benchmarks.gcs_gaps`` measures, prints and draws.

Trajectories through a maze of regions, as in `benchmarks.gcs_trajectories`, in processor seconds
of one thread, adding regions aside. The gap is what the path costs above the proven bound,
relative to its cost. It is measured for the relaxation with more and more of its paths compared,
without and with the constraints that no flow goes there and back; for the search by branch and
bound with more and more programs; and for edges that no path takes left in.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import csv
import itertools
import os
from pathlib import Path
import time
from typing import Any, NamedTuple

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

import numpy as np  # noqa: E402

from benchmarks.gcs_trajectories import maze_of, trajectories_through  # noqa: E402
from benchmarks.machine import machine  # noqa: E402
from scene_graph_ros.geometry.optimization import GraphOfConvexSetsOptions  # noqa: E402

__all__ = ["Gap", "draw", "main", "measure"]

_PICTURE = Path(__file__).parents[1] / "docs" / "gcs_gaps.png"
_PATHS = (1, 2, 5, 10, 20)
_PROGRAMS = (10, 30, 100, 300, 1000, 3000)
_CLOSED = 1e-6
"""Relative: the default of ``gap_tolerance``, at which a search ends."""
_LEAST = 1e-9
"""Drawn of gaps that are smaller."""
_WAYS = {
    "without preprocessing": ("#8d6e63", "v", False),
    "loose relaxation": ("#70757a", "s", True),
    "relaxation": ("#1f6fb4", "o", True),
    "branch and bound": ("#d1495b", "D", False),
}
"""Colour, mark, and whether numbers are below, of the first and the last alone."""


class Gap(NamedTuple):
    """One way to solve."""

    size: int
    order: int
    way: str
    count: int
    """Rounded paths, or programs of the search at most."""
    seconds: float
    cost: float
    bound: float

    @property
    def gap(self) -> float:
        """Relative to the cost."""
        return max(0.0, self.cost - self.bound) / self.cost


def _asked(paths: Sequence[int], programs: Sequence[int]) -> list[tuple[str, int, Any]]:
    """Return the ways, their counts and options."""
    relaxed: dict[str, Any] = {"convex_relaxation": True}
    result: list[tuple[str, int, Any]] = [
        ("without preprocessing", 5, {**relaxed, "preprocessing": False})
    ]
    for count in paths:
        loose = {**relaxed, "max_rounded_paths": count, "max_tightenings": 0}
        result.append(("loose relaxation", count, loose))
    result += [("relaxation", n, {**relaxed, "max_rounded_paths": n}) for n in paths]
    for count in programs:
        searched = {"convex_relaxation": False, "max_search_programs": count}
        result.append(("branch and bound", count, searched))
    return result


def measure(
    size: int, order: int, paths: Sequence[int] = _PATHS, programs: Sequence[int] = _PROGRAMS
) -> list[Gap]:
    """Return the gaps of a maze; a search that closes its gap is the last."""
    graph, *ends = trajectories_through(maze_of(size, 0.0), order)
    found: list[Gap] = []
    for way, count, options in _asked(paths, programs):
        begin = time.process_time()
        _, result = graph.solve_path(*ends, GraphOfConvexSetsOptions(**options))
        seconds = time.process_time() - begin
        found.append(Gap(size, order, way, count, seconds, result.cost, result.lower_bound))
        if way == "branch and bound" and found[-1].gap <= 2.0 * _CLOSED:
            break
    return found


def draw(mazes: Sequence[Sequence[Gap]], path: Path) -> None:
    """Draw gap against time, a panel for each maze and order."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter

    columns = (len(mazes) + 1) // 2
    figure, axes = plt.subplots(
        2, columns, figsize=(4.6 * columns, 7.8), layout="constrained", squeeze=False
    )
    for axis, found in zip(axes.flat, mazes, strict=False):
        for way, (color, mark, below) in _WAYS.items():
            rows = [each for each in found if each.way == way]
            seconds = [each.seconds for each in rows]
            gaps = np.maximum([each.gap for each in rows], _LEAST)
            axis.loglog(seconds, gaps, f"{mark}-", color=color, label=way, lw=1.2, ms=5)
            # Of many that are beside each other the first and the last.
            marked = {0, len(rows) - 1} if below else range(len(rows))
            for k in marked:
                axis.annotate(
                    str(rows[k].count),
                    (seconds[k], gaps[k]),
                    (0, -12 if below else 6),
                    textcoords="offset points",
                    ha="center",
                    fontsize=8,
                    color=color,
                )
        least, most = min(each.gap for each in found), max(each.gap for each in found)
        axis.set_ylim(0.3 * max(least, _LEAST), 3.0 * most)
        if least < _CLOSED:
            axis.axhline(_CLOSED, color="0.5", lw=0.8, ls=":")
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.xaxis.set_major_formatter("{x:g}")
        axis.xaxis.set_minor_formatter(NullFormatter())
        size = f"{found[0].size}x{found[0].size}"
        axis.set_title(f"{size} cells, order {found[0].order}", fontsize=10)
        axis.set(xlabel="processor time, s", ylabel="gap, of the cost")
        axis.grid(alpha=0.25)
    for axis in list(axes.flat)[len(mazes) :]:
        axis.set_visible(False)
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower left")
    figure.savefig(path, dpi=100)
    plt.close(figure)


def _write(mazes: Sequence[Sequence[Gap]], path: Path) -> None:
    """Write all rows as a table for other programs."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow((*Gap._fields, "gap"))
        for each in itertools.chain(*mazes):
            numbers = f"{each.seconds:.3f}", f"{each.cost:.6f}", f"{each.bound:.6f}"
            writer.writerow((*each[:4], *numbers, f"{each.gap:.1e}"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print and draw."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[10, 20])
    parser.add_argument("--orders", type=int, nargs="+", default=[1, 3, 5])
    parser.add_argument("--most-programs", type=int, default=_PROGRAMS[-1])
    parser.add_argument(
        "--output", type=Path, default=_PICTURE, help="the picture; its table is beside it"
    )
    options = parser.parse_args(arguments)
    print(machine(os.getloadavg()[0]))
    measure(2, 1, (1,), (10,))  # imports and kernels
    programs = [count for count in _PROGRAMS if count <= options.most_programs]
    print(f"{'maze':7} {'order':>5} {'way':22} {'count':>5} {'s':>8} {'cost':>10} {'bound':>10}"
          f" {'gap':>8}")  # fmt: skip
    mazes = []
    for size in options.sizes:
        for order in options.orders:
            mazes.append(measure(size, order, programs=programs))
            for each in mazes[-1]:
                print(
                    f"{size:3}x{size:<3} {order:5} {each.way:22} {each.count:5}"
                    f" {each.seconds:8.3f} {each.cost:10.6f} {each.bound:10.6f} {each.gap:8.1e}",
                    flush=True,
                )
    draw(mazes, options.output)
    _write(mazes, options.output.with_suffix(".csv"))
    print(f"Picture and table: {options.output}, {options.output.with_suffix('.csv').name}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
