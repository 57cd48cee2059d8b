"""The measured rows as a table for programs (CSV) and tables for people in docs/surfaces.md."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from pathlib import Path

import numpy as np

from benchmarks.surfaces.cases import DEEPEST, HINTS
from benchmarks.surfaces.engines import Drake, Ours
from benchmarks.surfaces.measure import Row
from benchmarks.surfaces.plots import worst

__all__ = ["hint_table", "read", "shapes_table", "write"]

EXACT = 1e-10
"""Part of a force or area: what is smaller is rounding of coordinates of metres."""
EXACT_POSITION = 1e-12
"""Metres, likewise."""

_START, _END = "<!-- measured: {} -->", "<!-- end -->"
_LINE = "polygon"
_HEADER = ["", "force", "area", "pressure centre (mm)", "faces", "time (µs)", "order"]


def read(path: Path) -> list[Row]:
    """Return the rows of a table that ``write`` wrote."""
    with path.open(newline="") as file:
        return [Row.from_text(line) for line in csv.DictReader(file)]


def write(rows: Sequence[Row], kinds: str, notes: str, folder: Path) -> None:
    """Write surfaces.csv, and the measured parts of surfaces.md, with ``notes`` on the machine.

    ``kinds`` is the table of the ways to compute contact. Each part stands between two comments in
    the page; everything else is kept.
    """
    with (folder / "surfaces.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Row.header())
        writer.writerows(row.texts() for row in rows)
    parts = {"kinds": kinds, "machine": notes, "hints": hint_table(rows)}
    parts["shapes"] = shapes_table(rows)
    page = folder / "surfaces.md"
    text = page.read_text() if page.exists() else "".join(map(_empty, parts))
    for name, part in parts.items():
        before, start, rest = text.partition(_START.format(name))
        _, end, after = rest.partition(_END)
        if not end:
            raise ValueError(f"{page} has no part {name!r} to write to")
        text = f"{before}{start}\n\n{part}\n{end}{after}"
    page.write_text(text)


def _empty(name: str) -> str:
    return f"{_START.format(name)}\n{_END}\n"


def _markdown(header: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(line) + " |" for line in (header, rule, *lines)) + "\n"


def _percent(value: float) -> str:
    if np.isnan(value):
        return "refused"
    if value < EXACT:
        return "exact"
    return f"{100.0 * value:.0f} %" if value >= 0.1 else f"{100.0 * value:.2g} %"


def _millimetres(value: float) -> str:
    if np.isnan(value):
        return ""
    return "exact" if value < EXACT_POSITION else f"{1e3 * value:.1g}"


def _time(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.2g}" if value < 100.0 else f"{value:.0f}"


def hint_table(rows: Sequence[Row]) -> str:
    """Return a line for each resolution: the range over curved pairs of shapes, both engines."""
    chosen = [row for row in rows if np.isfinite(row.hint_m) and row.representation == _LINE]
    header = ["`resolution_hint`"]
    for engine in (Ours.name, Drake.name):
        header += [f"{engine}: force", "area", "pressure centre (mm)", "time (µs)"]
    lines = []
    for hint in HINTS:
        line = [f"1/{DEEPEST / hint:.0f} of the radius" if hint < DEEPEST else "the radius"]
        for engine in (Ours.name, Drake.name):
            mine = [row for row in chosen if (row.hint_m, row.engine) == (hint, engine)]
            answered = [row for row in mine if np.isfinite(row.time_us)]
            if not answered:
                line += [""] * 4
                continue
            line += [
                _span([_percent(row.force_error) for row in _ordered(answered, "force_error")]),
                _span([_percent(row.area_error) for row in _ordered(answered, "area_error")]),
                _span([_millimetres(r.centre_error_m) for r in
                       _ordered(answered, "centre_error_m")]),
                _span([_time(row.time_us) for row in _ordered(answered, "time_us")]),
            ]  # fmt: skip
        lines.append(line)
    return _markdown(header, lines)


def _ordered(rows: Sequence[Row], column: str) -> list[Row]:
    return sorted(rows, key=lambda row: getattr(row, column))


def _span(texts: Sequence[str]) -> str:
    first, last = texts[0].removesuffix(" %"), texts[-1]
    return last if texts[0] == last else f"{first} to {last}"


def shapes_table(rows: Sequence[Row]) -> str:
    """Return a line for each case at the middle resolution: ours, and after it Drake's."""
    lines = []
    for shapes, detail in dict.fromkeys((row.shapes, row.detail) for row in rows):
        cells = [
            _cells([row for row in rows
                    if (row.shapes, row.detail, row.engine, row.representation)
                    == (shapes, detail, engine, _LINE)])
            for engine in (Ours.name, Drake.name)
        ]  # fmt: skip
        both = [", ".join(filter(None, pair)) for pair in zip(*cells, strict=True)]
        lines.append([f"{shapes}, {detail}", *both])
    return _markdown(_HEADER, lines)


def _cells(mine: Sequence[Row]) -> list[str]:
    """Return the cells of one engine's rows of a case, one row for each resolution."""
    if not mine:
        return [""] * (len(_HEADER) - 1)
    hint = np.nan if np.isnan(mine[0].hint_m) else HINTS[2]
    row = next(r for r in mine if r.hint_m == hint or np.isnan(hint))
    return [
        _percent(row.force_error),
        "" if np.isnan(row.area_error) else _percent(row.area_error),
        _millimetres(row.centre_error_m),
        "" if np.isnan(row.faces) else f"{row.faces:.0f}",
        _time(worst([row], "force_error")[0]),
        _order(mine),
    ]


def _order(rows: Sequence[Row]) -> str:
    """Return by which power of the hint the force's error falls, from R/4 to the finest."""
    errors = {row.hint_m: row.force_error for row in rows}
    if HINTS[2] not in errors or np.isnan(errors[HINTS[2]]) or HINTS[-1] not in errors:
        return ""
    power = np.log(errors[HINTS[2]] / errors[HINTS[-1]]) / np.log(HINTS[2] / HINTS[-1])
    return f"{power:.1f}"
