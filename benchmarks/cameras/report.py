"""The measured rows as a file for programs, a table to print, and one of cameras_measured.md."""

from __future__ import annotations

from collections.abc import Sequence
import csv
from dataclasses import fields
from pathlib import Path

import numpy as np

from benchmarks.cameras.engines import Ours
from benchmarks.cameras.measure import Row, UNROUNDED

__all__ = ["read", "summary", "table", "write"]

_START, _END = "<!-- measured -->", "<!-- end -->"
_HEADER = ("", "depth", "label", "colour", "all three", "error of depth (m)", "elsewhere")
_COLUMNS = [field.name for field in fields(Row)]


def read(path: Path) -> list[Row]:
    """Return the rows of a table that ``write`` wrote."""
    with path.open(newline="") as file:
        return [Row.from_text(line) for line in csv.DictReader(file)]


def write(rows: Sequence[Row], notes: str, folder: Path) -> None:
    """Write cameras.csv, and the summary in cameras_measured.md below ``notes`` on the machine.

    Raises ValueError where the page has no place for it, between two comments.
    """
    with (folder / "cameras.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        writer.writerows([_text(getattr(row, name)) for name in _COLUMNS] for row in rows)
    page = folder / "cameras_measured.md"
    before, start, rest = page.read_text().partition(_START)
    _, end, after = rest.partition(_END)
    if not start or not end:
        raise ValueError(f"{page} has no part between {_START} and {_END} to write to")
    page.write_text(f"{before}{start}\n\n{notes}\n{summary(rows)}\n{end}{after}")


def _text(value: str | float) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _time(value: float, ours: float, *, is_ours: bool) -> str:
    """Return milliseconds, and for others how many times ours."""
    if np.isnan(value):
        return ""
    milliseconds = f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"
    ratio = value / ours
    times = f"{ratio:.0f}" if ratio >= 10.0 else f"{ratio:.1f}"
    return milliseconds if is_ours else f"{milliseconds} ({times} x)"


def _error(row: Row) -> str:
    return f"{row.median_m:.1e}, 99 %: {row.high_m:.1e}"


def table(rows: Sequence[Row]) -> str:
    """Return a line for each scene and renderer: times in ms with their ratios to ours, errors."""
    lines = [_HEADER, ("---", *["---:"] * (len(_HEADER) - 1))]
    for scene in dict.fromkeys(row.scene for row in rows):
        inside = [row for row in rows if row.scene == scene]
        ours = next((row for row in inside if row.engine == Ours.name), inside[0])
        lines.append((f"**{inside[0].title}**", *[""] * (len(_HEADER) - 1)))
        for row in inside:
            is_ours = row.engine == Ours.name
            names = ("depth_ms", "label_ms", "color_ms", "all_ms")
            times = [
                _time(getattr(row, name), getattr(ours, name), is_ours=is_ours) for name in names
            ]
            if row.engine == UNROUNDED:
                times = [""] * len(names)
            lines.append((row.engine, *times, _error(row), f"{row.elsewhere} of {row.pixels}"))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def summary(rows: Sequence[Row]) -> str:
    """Return a line for each scene: milliseconds of depth, label and colour, by renderer.

    A renderer of depths alone stands with these, beside our depths.
    """
    engines = [name for name in dict.fromkeys(row.engine for row in rows) if name != UNROUNDED]
    lines = [("", *engines), ("---", *["---:"] * len(engines))]
    for scene in dict.fromkeys(row.scene for row in rows):
        inside = {row.engine: row for row in rows if row.scene == scene}
        lines.append(
            (next(iter(inside.values())).title, *(_all(inside, name) for name in engines))
        )
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def _all(inside: dict[str, Row], engine: str) -> str:
    row, ours = inside.get(engine), inside[Ours.name]
    if row is None:
        return ""
    if np.isnan(row.all_ms):
        depth = _time(row.depth_ms, ours.depth_ms, is_ours=False)
        return f"depth: {depth}" if depth else ""
    return _time(row.all_ms, ours.all_ms, is_ours=engine == Ours.name)
