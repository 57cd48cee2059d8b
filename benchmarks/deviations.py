"""What a smaller deviation from a path costs in time: draws ``docs/deviation_and_duration.png``.

``python -m benchmarks.deviations`` times the paths that `plan_path` finds for 21 problems of
MotionBenchMaker (a Panda, 15 rad/s^2, 500 rad/s^3), with and without limits of jerk, with several
values of ``deviation``, each against the duration without one. It prints the medians, and writes
them with the first and ninth tenth to a CSV file beside the picture.
"""

from __future__ import annotations

import csv
from pathlib import Path

from matplotlib import pyplot
import numpy as np

from benchmarks.plans import moveit_problems
from scene_graph_ros.planning import plan_path, time_path
from scene_graph_ros.planning.trajectories import MotionLimits

__all__ = ["main"]

_PROBLEMS = Path("test/benchmarks/motion_bench_maker_panda.tar.bz2")
_PER_SET = 3
_DEVIATIONS = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
"""rad."""
_LIMITS = ("accelerations", None), ("accelerations and jerks", 500.0)
_PICTURE = Path("docs/deviation_and_duration.png")


def main() -> None:
    """Print the table, and draw it."""
    names = tuple(f"panda_joint{i}" for i in range(1, 8))
    problems = list(moveit_problems(_PROBLEMS, _PER_SET))
    paths = [
        plan_path(each.checker, each.start, each.goal, group="arm", timeout=60).configurations
        for each in problems
    ]
    table: list[tuple[str, ...]] = [("limits", "deviation_rad", "median", "tenth", "ninth_tenth")]
    figure, axes = pyplot.subplots(figsize=(6.4, 3.6), layout="constrained")
    for label, jerk in _LIMITS:
        jerks = None if jerk is None else [jerk] * 7
        limits = MotionLimits([2.175] * 4 + [2.61] * 3, [15.0] * 7, names, jerks)
        rows = []
        for problem, path in zip(problems, paths, strict=True):
            found = [
                time_path(problem.checker, path, limits, deviation=each)
                for each in (None, *_DEVIATIONS)
            ]
            rows.append([timed.duration for timed in found])
        shares = np.array(rows)[:, 1:] / np.array(rows)[:, :1]
        middle = np.median(shares, axis=0)
        print(
            label, *(f"{d:g}: {share:.3f}" for d, share in zip(_DEVIATIONS, middle, strict=True))
        )
        low, high = np.quantile(shares, [0.1, 0.9], axis=0)
        shown = zip(_DEVIATIONS, middle, low, high, strict=True)
        table += [(label, *(f"{value:.4g}" for value in row)) for row in shown]
        places = [3e-4, *_DEVIATIONS[1:]]
        (drawn,) = axes.semilogx(places, middle, "o-", label=f"limits of {label}")
        axes.fill_between(places, low, high, alpha=0.2, color=drawn.get_color(), linewidth=0)
    axes.set_xticks([3e-4, 1e-3, 1e-2, 1e-1], ["0: rests", "0.001", "0.01", "0.1"])
    axes.set_xlabel("deviation of each joint from the path, rad")
    axes.set_ylabel("duration, of that without one")
    axes.grid(visible=True, alpha=0.3)
    axes.legend()
    figure.savefig(_PICTURE, dpi=130)
    with _PICTURE.with_suffix(".csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table)


if __name__ == "__main__":
    main()
