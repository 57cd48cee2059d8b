"""Measure contact surfaces against closed forms: ``python -m benchmarks.surfaces``.

Writes surfaces.csv, the tables of surfaces.md and three plots, ours beside Drake's. Without
pydrake only ours are measured, and that is said; ``make accuracy`` installs it.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import time

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

from tqdm import tqdm  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.surfaces import report  # noqa: E402
from benchmarks.surfaces.kinds import kinds_table, measure_kinds  # noqa: E402
from benchmarks.surfaces.measure import installed, measure, PAIRS, Row, tasks  # noqa: E402

__all__ = ["main"]

_DOCS = Path(__file__).parents[2] / "docs"
_QUICK_HINT = 0.02


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.surfaces", description=__doc__)
    parser.add_argument("--pairs", type=int, default=PAIRS, help="configurations of a case")
    parser.add_argument("--seconds", type=float, default=0.4, help="for each case and resolution")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    parser.add_argument(
        "--quick", action="store_true", help="coarse meshes, shortly; print, write nothing"
    )
    parser.add_argument(
        "--plots-only", action="store_true", help="draw the plots from surfaces.csv again"
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    options = _options(arguments)
    if options.plots_only:
        _draw(report.read(options.out / "surfaces.csv"), options.out)
        return
    load, started = os.getloadavg()[0], time.perf_counter()
    work = tasks()
    if options.quick:
        work = [task for task in work if not task.hint < _QUICK_HINT]
        options.seconds = 0.02
    engines = installed(print)
    rows: list[Row] = []
    for task in tqdm(work, unit="task", disable=None):
        rows += measure(engines, task, options.pairs, options.seconds, options.seed)
    kinds = kinds_table(list(measure_kinds()))
    print(kinds)
    print(report.shapes_table(rows) if options.quick else report.hint_table(rows))
    print(f"{time.perf_counter() - started:.0f} s in all")
    if options.quick:
        return
    options.out.mkdir(parents=True, exist_ok=True)
    report.write(rows, kinds, machine(load), options.out)
    _draw(rows, options.out)


def _draw(rows: Sequence[Row], folder: Path) -> None:
    from benchmarks.surfaces import plots

    plots.write(rows, folder)
    print(f"wrote surfaces.csv, surfaces.md, {', '.join(plots.NAMES)} to {folder}")


if __name__ == "__main__":
    main()
