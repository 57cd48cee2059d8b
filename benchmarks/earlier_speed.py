"""Compare the speed of queries with an earlier version of this package, in turns.

    python -m benchmarks.earlier_speed --before 8a3c575 [--turns 5] [--sizes 100 1000 --scenes ...]

Both run the scenes and rows of ``python -m benchmarks``, whose other options are taken, too, one
after the other, and in the other order the next time. A row's time is the least first decile of
all turns, as other work on the machine only makes times longer. The earlier version's kernels are
compiled first, which takes minutes.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile

from tqdm import tqdm

from benchmarks.earlier_sources import ROOT, sources_of
from benchmarks.machine import machine
from benchmarks.speed import report
from benchmarks.speed.measure import Measurement
from benchmarks.speed.rows import BUILDING, ROWS, SURFACE_ROWS

__all__ = ["main"]

_KEYS = [row.key for row in (*ROWS, *SURFACE_ROWS, BUILDING)]

Key = tuple[str, int, str]
"""A scene, its number of bodies, and a row."""

Times = dict[Key, float]
"""Milliseconds."""


def _measured(sources: Path, arguments: list[str]) -> Times:
    """Return the times of ours over the package in a folder, which has our benchmarks."""
    with tempfile.TemporaryDirectory() as out:
        command = ["-m", "benchmarks", "--rows", *_KEYS, *arguments, "--out", out]
        subprocess.run(
            [sys.executable, *command],
            cwd=sources,
            env={**os.environ, "PYTHONPATH": str(sources)},
            check=True,
            stdout=subprocess.DEVNULL,
        )
        found = report.read(Path(out) / "performance.csv")
    return {(m.scene, m.size, m.row): _least(m) for m in found if m.engine == report.Ours.name}


def _least(m: Measurement) -> float:
    """Return the first decile; of building, which is a difference of two times, the median."""
    return m.median_ms if m.row == BUILDING.key else m.low_ms


def table(now: Times, before: Times) -> str:
    """Return a line for each row, the one that became slowest first."""
    ratios = {key: now[key] / before[key] for key in now.keys() & before.keys()}
    lines = ["| scene | N | row | before, ms | now, ms | ratio |", "|" + " --- |" * 6]
    for key in sorted(ratios, key=ratios.__getitem__, reverse=True):
        scene, size, row = key
        lines.append(
            f"| {scene} | {size} | {row} | {before[key]:.4g} | {now[key]:.4g} "
            f"| {ratios[key]:.3f} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.earlier_speed",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--before", required=True, metavar="COMMIT", help="an earlier version")
    parser.add_argument("--turns", type=int, default=5)
    options, others = parser.parse_known_args()
    load = os.getloadavg()[0]
    with sources_of(options.before) as earlier, tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "scene_graph_ros", Path(folder, "scene_graph_ros"))
        sources = [Path(folder), earlier]
        least: list[Times] = [{}, {}]
        for each in sources:
            shutil.copytree(ROOT / "benchmarks", each / "benchmarks")
        for turn in tqdm(range(options.turns + 1), unit="turn", disable=None):
            # The first turn compiles and loads: it does not count.
            arguments = others if turn else [*others, "--seconds", "0.01"]
            for k in range(2)[:: 1 if turn % 2 else -1]:
                for key, ms in _measured(sources[k], arguments).items():
                    if turn:
                        least[k][key] = min(ms, least[k].get(key, ms))
    print(f"{machine(load)}\n{table(*least)}")


if __name__ == "__main__":
    main()
