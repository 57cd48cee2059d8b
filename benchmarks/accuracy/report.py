"""Write the measured rows as a table for programs (CSV) and one for people (Markdown)."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from pathlib import Path

import numpy as np

from benchmarks.accuracy.measure import APART, DEEP, OUR_TIERS, Row
from benchmarks.accuracy.words import (
    EACH_PAIR,
    INTRODUCTION,
    METHOD,
    SCENE_DISTANCE,
    SCENE_PENETRATION,
    SUMMARY,
)
from scene_graph_ros.geometry.accuracy import Accuracy

__all__ = ["COUNT", "SEED", "page", "precision_table", "read", "write"]

COUNT = 36
"""Configurations of each task in the published table."""

SEED = 1

_SCENES = (SCENE_PENETRATION, SCENE_DISTANCE)


def read(path: Path) -> list[Row]:
    """Return the rows of a table that ``write`` wrote."""
    with path.open(newline="") as file:
        return [Row.from_text(line) for line in csv.DictReader(file)]


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write accuracy.csv and accuracy.md, the latter from what stands in the former."""
    with (folder / "accuracy.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row.header())
        writer.writerows(row.texts() for row in rows)
    (folder / "accuracy.md").write_text(page(read(folder / "accuracy.csv")))


def page(rows: Sequence[Row]) -> str:
    """Return the text of accuracy.md."""
    method = METHOD.format(count=COUNT, seed=SEED)
    return "\n".join([INTRODUCTION, _tiers(rows), SUMMARY, _summary(rows), EACH_PAIR, method])


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


def precision_table(rows: Sequence[Row], query: str, distance: float) -> str:
    """Return a Markdown table of worst errors: a line for each pair, a column for each engine."""
    chosen = [row for row in rows if (row.query, row.distance_m) == (query, distance)]
    engines = _engines(chosen)
    cells = {(r.shape_1, r.shape_2, r.engine): _stated(r) for r in chosen}
    pairs = dict.fromkeys((r.shape_1, r.shape_2) for r in chosen)
    lines = [[f"{a}, {b}", *(cells[a, b, e] for e in engines)] for a, b in pairs]
    return _markdown(["", *engines], lines)


def _stated(row: Row) -> str:
    """Return what the table states: a bound for our tiers, what was measured for the others."""
    return _error(row.worst_error_m if np.isnan(row.stated_m) else row.stated_m)


def _finite_worst(rows: Sequence[Row]) -> float:
    errors = [row.worst_error_m for row in rows if np.isfinite(row.worst_error_m)]
    return max(errors, default=np.nan)


def _tiers(rows: Sequence[Row]) -> str:
    """Return the table to choose a tier from: promise, worst error, time of a pair, of scenes."""
    header = ["tier", "promised", "on 20 cm shapes", "worst error seen", "one pair (us)"]
    header += [f"{name} (ms)" for name in _SCENES]
    lines = []
    for tier in Accuracy:
        mine = [row for row in rows if row.engine == tier.value]
        pairs = [row for row in mine if row.query in ("distance", "penetration")]
        times = [row.time_us for row in pairs if row.distance_m == 2e-3]
        scenes = {row.query: 1e-3 * row.time_us for row in mine if row.query in _SCENES}
        lines.append(
            [
                f"`{tier.value}`",
                f"{tier.bound:.0e} of the size",
                f"{0.2 * tier.bound:.0e} m",
                f"{_error(_finite_worst(pairs))} m",
                _time(float(np.median(times))) if times else "",
                *(_time(scenes.get(name, np.nan)) for name in _SCENES),
            ]
        )
    return _markdown(header, lines)


def _summary(rows: Sequence[Row]) -> str:
    columns = [("distance", d) for d in (*APART, *DEEP)] + [("penetration", d) for d in DEEP]
    header = ["", *(f"{q}, {_words(d)}" for q, d in columns), "time, us"]
    lines = []
    for engine in _engines([row for row in rows if row.query == "distance"]):
        mine = [row for row in rows if row.engine == engine]
        cells = [_worst([r for r in mine if (r.query, r.distance_m) == c]) for c in columns]
        times = [r.time_us for r in mine if (r.query, r.distance_m) == ("distance", 2e-3)]
        name = f"**{engine}**" if engine in OUR_TIERS else engine
        lines.append([name, *cells, _time(float(np.nanmedian(times)))])
    return _markdown(header, lines)


def _worst(rows: Sequence[Row]) -> str:
    errors = np.array([row.worst_error_m for row in rows])
    missing = np.count_nonzero(~np.isfinite(errors))
    worst = "refused" if missing == len(errors) else _error(_finite_worst(rows))
    return f"{worst} ({missing})" if 0 < missing < len(errors) else worst
