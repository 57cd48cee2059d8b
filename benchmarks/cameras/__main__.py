"""Measure images of 640 x 480 against other renderers: ``python -m benchmarks.cameras``.

Every frame has new poses, which are part of its time: that of the processor, as all draw by
software. Depths are compared with the truth in 50 digits at pixels drawn at random. Writes
cameras.csv, the summary in cameras_measured.md and a plot, in two minutes of the processor.
Renderers that are not installed, or have no display, are left out, and that is said; ``make
peers`` installs all but embreex.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import os
from pathlib import Path
import time

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before they are loaded: times are of one thread

from tqdm import tqdm  # noqa: E402

from benchmarks.cameras import report  # noqa: E402
from benchmarks.cameras.compare import compare  # noqa: E402
from benchmarks.cameras.measure import Row  # noqa: E402
from benchmarks.cameras.scenes import SCENES  # noqa: E402
from benchmarks.machine import machine  # noqa: E402

__all__ = ["main"]

_DOCS = Path(__file__).parents[2] / "docs"


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cameras", description=__doc__)
    parser.add_argument("--scenes", nargs="+", choices=list(SCENES), default=list(SCENES),
                        metavar="SCENE", help=f"some of {', '.join(SCENES)}")  # fmt: skip
    parser.add_argument("--frames", type=int, default=5, help="of each kind and renderer")
    parser.add_argument("--pixels", type=int, default=300, help="compared with the truth")
    parser.add_argument("--size", nargs=2, type=int, default=(640, 480), metavar=("W", "H"))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    parser.add_argument("--quick", action="store_true", help="one frame each; write nothing")
    parser.add_argument(
        "--plots-only", action="store_true", help="draw the plot from cameras.csv again"
    )
    return parser.parse_args(arguments)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    options = _options(arguments)
    if options.plots_only:
        _draw(report.read(options.out / "cameras.csv"), options.out)
        return
    busy, started = os.getloadavg()[0], time.perf_counter()
    said: dict[str, None] = {}
    rows = compare(
        tqdm(options.scenes, unit="scene", disable=None),
        said.setdefault,
        size=tuple(options.size),
        frames=1 if options.quick else options.frames,
        pixels=options.pixels,
        seed=options.seed,
    )
    print("\n".join(said))
    notes = machine(busy)
    print(f"{notes}\n{report.table(rows)}\n{time.perf_counter() - started:.0f} s in all")
    if options.quick:
        return
    report.write(rows, notes, options.out)
    _draw(rows, options.out)


def _draw(rows: Sequence[Row], folder: Path) -> None:
    from benchmarks.cameras import plots

    plots.write(rows, folder)
    print(f"wrote cameras.csv, cameras_measured.md and {plots.NAME} to {folder}")


if __name__ == "__main__":
    main()
