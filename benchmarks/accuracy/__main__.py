"""Measure the accuracy of distances, ours and the peers': ``python -m benchmarks.accuracy``.

Writes accuracy.csv, accuracy.md and two plots. Peers that are not installed are left out, and that
is said; ``make accuracy`` installs them.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

from tqdm import tqdm  # noqa: E402

from benchmarks.accuracy import report  # noqa: E402
from benchmarks.accuracy.measure import (  # noqa: E402
    installed_engines,
    measure,
    our_engines,
    OUR_TIERS,
    Row,
    tasks,
)
from benchmarks.accuracy.scene import measure_scene  # noqa: E402

__all__ = ["main"]

_DOCS = Path(__file__).parents[2] / "docs"
_QUICK_COUNT = 4


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.accuracy", description=__doc__)
    parser.add_argument("--count", type=int, default=report.COUNT, help="configurations of a task")
    parser.add_argument("--seed", type=int, default=report.SEED)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    parser.add_argument(
        "--ours", action="store_true", help="measure our tiers; of the peers keep what is there"
    )
    parser.add_argument(
        "--plots-only", action="store_true", help="write text and plots from accuracy.csv again"
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="a few configurations of ours at 2 mm; print the table, write nothing",
    )
    return parser.parse_args()


def _kept(table: Path) -> list[Row]:
    """Return the rows of others than our tiers in a table that may exist."""
    if not table.exists():
        return []
    return [row for row in report.read(table) if row.engine not in OUR_TIERS]


def main() -> None:
    """Run the command line."""
    options = _options()
    work = tasks()
    count = options.count
    if options.quick:
        work, count = [task for task in work if abs(task.distance) == 2e-3], _QUICK_COUNT
    if options.plots_only:
        rows = report.read(options.out / "accuracy.csv")
    else:
        engines = our_engines() if options.ours or options.quick else installed_engines(print)
        progress = tqdm(work, unit="task", disable=None)
        rows = list(measure(engines, progress, count, options.seed))
        if not options.quick:
            rows += measure_scene(options.seed)
        if options.ours:
            rows += _kept(options.out / "accuracy.csv")
    if options.quick:
        print(report.precision_table(rows, "distance", 2e-3))
        print(report.precision_table(rows, "distance", -2e-3))
        return
    options.out.mkdir(parents=True, exist_ok=True)
    report.write(rows, options.out)
    from benchmarks.accuracy import heat_map, plots

    plots.write(rows, options.out)
    heat_map.write(rows, options.out)
    names = ", ".join([*plots.NAMES, heat_map.NAME])
    print(f"wrote {options.out}/accuracy.csv, accuracy.md, {names}")


if __name__ == "__main__":
    main()
