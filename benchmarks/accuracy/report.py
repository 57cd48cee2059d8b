"""Write the measured rows as a table for programs (CSV) and one for people (Markdown)."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from pathlib import Path

import numpy as np

from benchmarks.accuracy.measure import APART, DEEP, Row

__all__ = ["COUNT", "FLOOR", "SEED", "precision_table", "read", "time_table", "write"]

COUNT = 48
"""Configurations of each task in the published table."""

SEED = 1

FLOOR = 5e-15
"""Metres. Errors below it are rounding: coordinates of up to 2 m are rounded by 2e-16 each, in
the construction's poses as well as in the query."""

_INTRODUCTION = """\
# How exact the answers are, and what a digit costs

The worst error of a signed distance that was seen, in metres, ours beside other engines. Made by
`make accuracy`, which installs the peers (`make peers`), measures for some minutes and writes this
page, `accuracy.csv` and the two plots. `python -m benchmarks.accuracy --help` tells the options.

![Error against time, 2 mm apart](accuracy_apart.png)

![Error against time, 2 mm deep](accuracy_deep.png)
"""

_METHOD = f"""\
## Method

- **Known answers by construction.** Two convex bodies get supporting planes at a random point of a
  random feature each (face, edge, vertex, side, rim, smooth surface), the planes are laid on each
  other, the bodies turned about the common normal and slid along it. Apart, the gap is the
  distance. Overlapping, it is the depth, if no other direction offers a shorter way out; that is
  searched for, and such configurations are thrown away. The search decides which configurations
  count, never what their answer is. See `benchmarks/accuracy/constructions.py`.
- **Sizes** are 14 to 22 cm, poses are generic, features and both orders of the shapes take turns,
  every third pair has parallel or crossed edges and axes. {COUNT} configurations for each pair and
  distance, seed {SEED}; those of 2 mm are what other engines' tables are about.
- **A mesh** stands for its convex hull, as it does between shapes by default. It has a pit, so
  that its triangles differ from its hull. Points are measured against its triangles.
- **Rounding.** Poses have coordinates of up to 2 m, so errors below {FLOOR:.0e} m are those of the
  numbers that go in. `test/numerics/test_accuracy_table.py` holds our columns in both
  directions: larger errors fail, and so do errors more than 12 times smaller than published,
  unless they are below that floor.
- **Engines.** Called from Python, on one thread. `scene_graph_ros`, Drake, Coal, FCL and MuJoCo's
  distances: one call for each pair, poses given before. `scene_graph_ros, batched`: one call for a
  scene of many such pairs, candidates included, divided by their number. Penetrations of
  `scene_graph_ros`, Drake and MuJoCo come from one call for the scene, which is what they offer;
  Coal's and FCL's from one call for each pair. Tolerances are each library's defaults but where
  the name says otherwise. MuJoCo keeps the vertices of meshes in single precision.
- **Times** are the fastest of three rounds, in microseconds for one query; they depend on the
  machine, so compare them only within the table.
- `refused`: the engine raises, or has no such query. `no answer`: it returns NaN, infinity or a
  sentinel. An overlap that an engine doesn't see counts with its full depth.
"""


def read(path: Path) -> list[Row]:
    """Return the rows of a table that ``write`` wrote."""
    with path.open(newline="") as file:
        return [Row.from_text(line) for line in csv.DictReader(file)]


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write accuracy.csv and accuracy.md."""
    with (folder / "accuracy.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row.header())
        writer.writerows(row.texts() for row in rows)
    (folder / "accuracy.md").write_text("\n".join(_pages(rows)))


def _pages(rows: Sequence[Row]) -> list[str]:
    pages = [_INTRODUCTION, "## At a glance\n", _SUMMARY, _summary(rows), _METHOD]
    for query, title in (
        ("distance", "Signed distance"),
        ("penetration", "Penetration"),
        ("point", "Signed distance of a point"),
    ):
        pages.append(f"## {title}: worst error in m\n")
        for d in (*APART, *DEEP):
            if any(row.query == query and row.distance_m == d for row in rows):
                pages += [f"### {_words(d)}\n", precision_table(rows, query, d)]
    for query, d in (("distance", 2e-3), ("distance", -2e-3), ("point", 2e-3)):
        pages += [f"## Time of a query in microseconds: {query}, {_words(d)}\n"]
        pages += [time_table(rows, query, d)]
    return pages


def _words(distance: float) -> str:
    amount = abs(distance)
    text = f"{amount * 1e6:g} um" if amount < 1e-4 else f"{amount * 1e3:g} mm"
    return f"{text} {'deep' if distance < 0.0 else 'apart'}"


def _engines(rows: Sequence[Row]) -> list[str]:
    return list(dict.fromkeys(row.engine for row in rows))


def _error(value: float) -> str:
    if np.isnan(value):
        return "refused"
    if np.isinf(value):
        return "no answer"
    return "0" if value == 0.0 else f"{value:.0e}"


def _time(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2g}" if value < 10.0 else f"{value:.0f}"


def _markdown(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *lines)) + "\n"


def _table(rows: Sequence[Row], query: str, distance: float, column: str) -> str:
    show = _error if column == "worst_error_m" else _time
    chosen = [row for row in rows if (row.query, row.distance_m) == (query, distance)]
    engines = _engines(chosen)
    cells = {(r.shape_1, r.shape_2, r.engine): getattr(r, column) for r in chosen}
    pairs = dict.fromkeys((r.shape_1, r.shape_2) for r in chosen)
    lines = [
        [a if b == "Point" else f"{a}, {b}", *(show(cells[a, b, e]) for e in engines)]
        for a, b in pairs
    ]
    return _markdown(["", *engines], lines)


def precision_table(rows: Sequence[Row], query: str, distance: float) -> str:
    """Return a Markdown table of worst errors: a line for each pair, a column for each engine."""
    return _table(rows, query, distance, "worst_error_m")


def time_table(rows: Sequence[Row], query: str, distance: float) -> str:
    """Return a Markdown table of times: a line for each pair, a column for each engine."""
    return _table(rows, query, distance, "time_us")


_SUMMARY = """\
The worst error over all 35 pairs (two half spaces have no distance), with the number of pairs that
an engine refuses or has no finite answer for in brackets; and the median over the pairs of a
query's time, 2 mm apart.
"""


def _summary(rows: Sequence[Row]) -> str:
    columns = [("distance", d) for d in (*APART, *DEEP)] + [("penetration", d) for d in DEEP]
    header = ["", *(f"{q}, {_words(d)}" for q, d in columns), "time, us"]
    lines = []
    for engine in _engines(rows):
        mine = [row for row in rows if row.engine == engine]
        cells = [_worst([r for r in mine if (r.query, r.distance_m) == c]) for c in columns]
        times = [r.time_us for r in mine if (r.query, r.distance_m) == ("distance", 2e-3)]
        lines.append([engine, *cells, _time(float(np.nanmedian(times)))])
    return _markdown(header, lines)


def _worst(rows: Sequence[Row]) -> str:
    errors = np.array([row.worst_error_m for row in rows])
    finite = errors[np.isfinite(errors)]
    missing = len(errors) - len(finite)
    worst = _error(float(finite.max())) if len(finite) else "refused"
    return f"{worst} ({missing})" if missing else worst
