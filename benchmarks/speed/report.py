"""The measured times as tables for people (Markdown) and for programs (CSV)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import csv
import math
from pathlib import Path

from benchmarks.speed.engines.ours import Ours
from benchmarks.speed.measure import ENGINES, Measurement
from benchmarks.speed.rows import BUILDING, ROWS, SURFACE_ROWS

__all__ = [
    "COMPLIANT",
    "MIXED",
    "first_table",
    "ratio_table",
    "read",
    "summary_table",
    "table",
    "write",
]

MIXED = "mixed"
COMPLIANT = "compliant"
MAIN_SIZE = 1000
"""Bodies of the mixed scenes that the goals are about."""

_ALL = (*ROWS, *SURFACE_ROWS, BUILDING)
_TITLES = {row.key: row.title for row in _ALL}
_GOALS = {row.key: row.goal for row in _ALL}


def read(path: Path) -> list[Measurement]:
    """Return the measurements of a file that ``write`` wrote."""
    numbers = {"size": int, "rounds": int, "turns": int}
    words = ("scene", "row", "engine")
    with path.open(newline="") as file:
        return [
            Measurement(**{k: v if k in words else numbers.get(k, float)(v) for k, v in r.items()})
            for r in csv.DictReader(file)
        ]


def _number(value: float) -> str:
    """Return three digits, without an exponent."""
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}"


def _cell(m: Measurement | None) -> str:
    if m is None:
        return "—"
    spread = f" ({_number(m.low_ms)} to {_number(m.high_ms)})" if m.rounds > 1 else ""
    faces = "" if math.isnan(m.faces) else f", {m.faces:.0f} faces"
    return f"{_number(m.median_ms)}{spread} · {m.found:.0f}{faces}"


def _against(
    rows: Sequence[Measurement], column: str = "median_ms"
) -> tuple[Measurement, Measurement] | None:
    """Return ours and the fastest peer by a column; None where either was not measured."""
    measured = [m for m in rows if not math.isnan(getattr(m, column))]
    ours = [m for m in measured if m.engine == Ours.name]
    peers = [m for m in measured if m.engine != Ours.name]
    if not (ours and peers):
        return None
    return ours[0], min(peers, key=lambda m: getattr(m, column))


def ratio(rows: Sequence[Measurement]) -> float | None:
    """Return how many times as long as ours the fastest peer took; None without peers."""
    pair = _against(rows)
    return pair[1].median_ms / pair[0].median_ms if pair else None


def _groups(rows: Sequence[Measurement]) -> dict[tuple[str, int, str], list[Measurement]]:
    groups: dict[tuple[str, int, str], list[Measurement]] = {}
    for m in rows:
        groups.setdefault((m.scene, m.size, m.row), []).append(m)
    return groups


def table(rows: Sequence[Measurement]) -> str:
    """Return a Markdown table of one scene: a line for each row and size, a column each engine."""
    names = [engine.name for engine in ENGINES if any(m.engine == engine.name for m in rows)]
    lines = [
        f"| asked | N | {' | '.join(names)} | fastest peer / ours |",
        "| --- | ---: |" + " ---: |" * (len(names) + 1),
    ]
    order = {key: k for k, key in enumerate(_TITLES)}
    for (_, size, key), group in sorted(
        _groups(rows).items(), key=lambda g: (order[g[0][2]], g[0][1])
    ):
        by_engine = {m.engine: m for m in group}
        cells = [_cell(by_engine.get(name)) for name in names]
        r = ratio(group)
        last = "—" if r is None else f"**{_number(r)}**"
        lines.append(f"| {_TITLES[key]} | {size} | {' | '.join(cells)} | {last} |")
    return "\n".join(lines) + "\n"


def ratio_table(rows: Sequence[Measurement]) -> str:
    """Return a line for each row of one scene: how many times as long the fastest peer took."""
    sizes = sorted({m.size for m in rows})
    lines = [
        f"| fastest peer / ours, N = | {' | '.join(map(str, sizes))} |",
        "| --- |" + " ---: |" * len(sizes),
    ]
    groups = _groups(rows)
    scene = rows[0].scene
    for key in (key for key in _TITLES if any(m.row == key for m in rows)):
        found = [ratio(groups.get((scene, size, key), [])) for size in sizes]
        cells = ["—" if r is None else f"**{_number(r)}**" for r in found]
        lines.append(f"| {_TITLES[key]} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _main_lines(
    rows: Sequence[Measurement], column: str
) -> Iterator[tuple[str, Measurement, str]]:
    """Yield row, ours and the cells of a line, for each row of 1000 mixed shapes."""
    for (scene, size, key), group in _groups(rows).items():
        pair = _against(group, column)
        if scene in (MIXED, COMPLIANT) and size == MAIN_SIZE and pair is not None:
            ours, best = (getattr(m, column) for m in pair)
            times = f"{_number(ours)} | {pair[1].engine}: {_number(best)}"
            yield key, pair[0], f"| {_TITLES[key]} | {times} | {_number(best / ours)} |"


def summary_table(rows: Sequence[Measurement]) -> str:
    """Return the ratios that were reached with 1000 mixed shapes beside the goals."""
    lines = ["| asked | ours (ms) | fastest peer (ms) | ratio | goal |",
             "| --- | ---: | ---: | ---: | ---: |"]  # fmt: skip
    for key, _, line in _main_lines(rows, "median_ms"):
        lines.append(f"{line} {_GOALS[key]:.0f} |")
    return "\n".join(lines) + "\n"


def first_table(rows: Sequence[Measurement]) -> str:
    """Return the same of the queries that came after other work: the first of each streak."""
    lines = ["| asked | ours (ms) | fastest peer (ms) | ratio | ours, first / rest |",
             "| --- | ---: | ---: | ---: | ---: |"]  # fmt: skip
    for _, ours, line in _main_lines(rows, "first_median_ms"):
        lines.append(f"{line} {_number(ours.first_median_ms / ours.median_ms)} |")
    return "\n".join(lines) + "\n"


def write(rows: Sequence[Measurement], titles: dict[str, str], notes: str, folder: Path) -> None:
    """Write performance.csv, and performance.md with ``notes`` on the machine in it.

    ``titles`` has the title of every scene by its key. What follows the line ``<!-- measured -->``
    is written anew; what stands before and what follows ``<!-- end -->`` are kept. A folder
    without that page gets the measured part alone.
    """
    with (folder / "performance.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Measurement._fields)
        for m in rows:
            writer.writerow([f"{v:.6g}" if isinstance(v, float) else v for v in m])
    parts = [notes, "### 1000 mixed shapes against the goals\n", summary_table(rows)]
    parts += ["### The same, the first query after other work\n", first_table(rows)]
    for key, title in titles.items():
        mine = [m for m in rows if m.scene == key]
        if mine:
            shown = table if len({m.size for m in mine}) == 1 else ratio_table
            parts += [f"### {title[0].upper()}{title[1:]}\n", shown(mine)]
            if key == MIXED:
                parts.append("![Time against the number of shapes](performance.png)\n")
    parts.append("![Time in the other scenes](performance_scenes.png)\n")
    page = folder / "performance.md"
    text = page.read_text() if page.exists() else f"{_START}{_END}\n"
    before, _, rest = text.partition(_START)
    after = rest.partition(_END)[2]
    page.write_text(before + _START + "\n\n" + "\n".join(parts) + "\n" + _END + after)


_START, _END = "<!-- measured -->", "<!-- end -->"
