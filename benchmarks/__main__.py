"""Compare the speed of queries with the peers: ``python -m benchmarks``.

Every pose is new before every query, and its update is part of the time. The engines take turns on
the same scenes, each a streak of queries long. Writes performance.csv, performance.md and two
plots. At the end two scenes are rendered, half a minute: ``python -m benchmarks.cameras`` has more
of them. Peers that are not installed are left out, and that is said; ``make bench`` installs them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
import os
from pathlib import Path
import time

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before numpy is loaded: times are of one thread

from tqdm import tqdm  # noqa: E402

from benchmarks.machine import machine  # noqa: E402
from benchmarks.speed import plots, report  # noqa: E402
from benchmarks.speed.building import measure_building  # noqa: E402
from benchmarks.speed.engines.engine import Engine  # noqa: E402
from benchmarks.speed.make_scenes import (  # noqa: E402
    compliant,
    COMPLIANT_SIZES,
    mixed,
    OTHER_SCENES,
)
from benchmarks.speed.measure import make_engines, measure, Measurement  # noqa: E402
from benchmarks.speed.rows import BUILDING, Row, ROWS, SURFACE_ROWS  # noqa: E402
from benchmarks.speed.scenes import Scene  # noqa: E402

__all__ = ["main"]

_DOCS = Path(__file__).parents[1] / "docs"
_SIZES = (10, 100, 1000, 10_000)
_QUICK_SIZES = (10, 100, 1000)
_CAMERAS = "cameras"
"""The row that is about images."""


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    keys = [*(row.key for row in (*ROWS, *SURFACE_ROWS, BUILDING)), _CAMERAS]
    parser.add_argument("--rows", nargs="+", choices=keys, default=keys, metavar="ROW",
                        help=f"what to ask: {', '.join(keys)}")  # fmt: skip
    parser.add_argument("--sizes", nargs="*", type=int, default=None, metavar="N",
                        help="numbers of mixed shapes")  # fmt: skip
    parser.add_argument("--compliant", nargs="*", type=int, default=COMPLIANT_SIZES, metavar="N",
                        help="numbers of mixed compliant shapes")  # fmt: skip
    parser.add_argument("--scenes", nargs="*", choices=list(OTHER_SCENES), default=None,
                        metavar="SCENE", help=f"one of {', '.join(OTHER_SCENES)}")  # fmt: skip
    parser.add_argument("--seconds", type=float, default=None, help="for each row and scene")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=_DOCS, help="folder to write to")
    parser.add_argument(
        "--quick", action="store_true", help="up to 1000 mixed shapes, shortly; write nothing"
    )
    parser.add_argument(
        "--plots-only", action="store_true", help="draw the plots from performance.csv again"
    )
    options = parser.parse_args(arguments)
    if options.sizes is None:
        options.sizes = _QUICK_SIZES if options.quick else _SIZES
    if options.scenes is None:
        options.scenes = () if options.quick else tuple(OTHER_SCENES)
    if options.seconds is None:
        options.seconds = 0.5 if options.quick else 3.0
    return options


def _jobs(options: argparse.Namespace) -> list[tuple[Callable[[], Scene], list[Row]]]:
    rows = [row for row in ROWS if row.key in options.rows]
    jobs: list[tuple[Callable[[], Scene], list[Row]]] = [
        (partial(mixed, n, options.seed), [row for row in rows if n <= row.max_size])
        for n in options.sizes
    ]
    anywhere = [row for row in rows if not row.only_mixed]
    jobs += [(partial(OTHER_SCENES[name], options.seed), anywhere) for name in options.scenes]
    soft = [row for row in (*SURFACE_ROWS, BUILDING) if row.key in options.rows]
    if soft:
        jobs += [(partial(compliant, n, options.seed), soft) for n in options.compliant]
    return [(make, asked) for make, asked in jobs if asked]


def _measure(
    engines: Sequence[Engine],
    row: Row,
    scene: Scene,
    options: argparse.Namespace,
    say: Callable[[str], None],
) -> list[Measurement]:
    if row is BUILDING:
        return measure_building(engines, partial(compliant, scene.size), options.seed)
    return measure(engines, row, scene, options.seconds, say)


def _images(seed: int) -> str:
    """Return the table of two scenes before all renderers, and who was left out."""
    from benchmarks.cameras.compare import compare_shortly
    from benchmarks.cameras.report import table

    said: dict[str, None] = {}
    rows = compare_shortly(said.setdefault, seed=seed)
    return "\n".join([table(rows), *said, ""])


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line."""
    options = _options(arguments)
    if options.plots_only:
        plots.write(report.read(options.out / "performance.csv"), options.out)
        return
    load, started = os.getloadavg()[0], time.perf_counter()
    jobs = _jobs(options)
    measured: list[Measurement] = []
    titles: dict[str, str] = {}
    with tqdm(total=sum(1 + len(rows) for _, rows in jobs), unit="step", disable=None) as bar:
        for make, rows in jobs:
            bar.set_description("making a scene")
            scene = make()
            titles[scene.key] = scene.title
            engines = make_engines(scene, bar.write)
            bar.update()
            for row in rows:
                bar.set_description(f"{scene.size} bodies: {row.key}")
                measured += _measure(engines, row, scene, options, bar.write)
                bar.update()
    notes = machine(load)
    print(f"{notes}Times in ms: median (first to ninth decile) · pairs, answers, surfaces.\n")
    for key, title in titles.items():
        print(f"{title}\n\n{report.table([m for m in measured if m.scene == key])}")
    print(report.summary_table(measured))
    print(f"The first query after other work:\n\n{report.first_table(measured)}")
    if _CAMERAS in options.rows:
        print(f"Images of 640 x 480, ms of the processor:\n\n{_images(options.seed)}")
    print(f"{time.perf_counter() - started:.0f} s in all")
    if options.quick:
        return
    options.out.mkdir(parents=True, exist_ok=True)
    report.write(measured, titles, notes, options.out)
    plots.write(measured, options.out)
    print(f"wrote performance.csv, performance.md and plots to {options.out}")


if __name__ == "__main__":
    main()
