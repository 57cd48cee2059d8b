"""The tables of rates, latencies and answers in a page, and a plot."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np

from benchmarks.machine import machine
from benchmarks.messages.processes import ROOT
from benchmarks.messages.sustained import Measured

__all__ = [
    "Answers",
    "Cell",
    "Edited",
    "Holes",
    "Row",
    "answers_table",
    "cells_table",
    "edits_table",
    "holes_table",
    "table",
    "write",
    "write_answers",
    "write_cells",
    "write_edits",
    "write_holes",
]

PAGE = ROOT / "docs" / "messages.md"
PLOT = ROOT / "docs" / "messages.png"
_LOOKS = {"ordinary": ("#d55e00", "s"), "ours": ("#0b5394", "o")}


class Row(NamedTuple):
    """The highest sustained rate of one way, and the same at the fixed rate."""

    frames: int
    way: str
    best: Measured
    fixed: Measured


class Answers(NamedTuple):
    """How long one service took under a load, or all of them."""

    load: str
    service: str
    milliseconds: np.ndarray
    """From each request to its answer, at the client."""
    updates: float
    """Of the world, per second."""


class Holes(NamedTuple):
    """What one transport did."""

    transport: str
    seconds: float
    visits: int
    crashes: int
    """Of processes whose participants came and went."""
    messages: int
    gaps: list[float]
    """Seconds of each hole."""
    median: float
    high: float
    """Median and 99th percentile of the latency, seconds."""
    share: float
    """Of a core, that the node had."""


class Cell(NamedTuple):
    """How long the contacts of a robot's cell took while two sources sent so far apart."""

    name: str
    apart: str
    milliseconds: np.ndarray
    """From the stamp of each message that got contacts of its own to their receipt."""
    updates: float
    """With contacts of their own, per second."""
    share: float
    """Of a core, of the node."""


class Edited(NamedTuple):
    """How long changes of the scene of one kind took, and held contacts up."""

    change: str
    answers: np.ndarray
    """Milliseconds from each request to its answer."""
    held_up: np.ndarray
    """Milliseconds by which the longest gap between contacts was longer than that of poses."""


def _latency(measured: Measured) -> str:
    if not len(measured.latencies):
        return "no contacts came | - | -"
    median, high = np.percentile(measured.latencies, (50, 99)) * 1e3
    return f"{median:.2f} | {high:.2f} | {measured.latencies.max() * 1e3:.2f}"


def table(rows: Sequence[Row]) -> str:
    """Return the table in Markdown; latencies in ms."""
    rate = rows[0].fixed.rate
    lines = [
        "| frames | way | highest rate (Hz) | contacts, markers/s then"
        f" | share of a core then | own contacts at {rate:g} Hz"
        " | median (ms) | 99 % (ms) | worst (ms) | share of a core |",
        "| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for frames, way, best, fixed in rows:
        reached = f"{best.rate:.0f}" if best.is_sustained else f"below {best.rate:.0f}"
        lines.append(
            f"| {frames} | {way} | {reached}"
            f" | {best.contacts}, {best.markers / best.seconds:.0f} | {best.share:.2f}"
            f" | {100.0 * fixed.answered / max(fixed.sent, 1):.0f} %"
            f" | {_latency(fixed)} | {fixed.share:.2f} |"
        )
    return "\n".join(lines) + "\n"


def answers_table(rows: Sequence[Answers]) -> str:
    """Return the times of answers in Markdown, a line for each load."""
    services = list(dict.fromkeys(row.service for row in rows))
    lines = [
        f"| load | updates/s | {' | '.join(f'`{s}`' if '_' in s else s for s in services)} |",
        f"| --- | ---: |{' ---: |' * len(services)}",
    ]
    for load in dict.fromkeys(row.load for row in rows):
        mine = {row.service: row for row in rows if row.load == load}
        cells = []
        for service in services:
            median, high = np.percentile(mine[service].milliseconds, (50, 99))
            cells.append(f"{median:.1f}, **{high:.1f}**")
        lines.append(f"| {load} | {mine[services[0]].updates:.0f} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def cells_table(rows: Sequence[Cell]) -> str:
    """Return the latencies of cells in Markdown, a line for each time between the sources."""
    lines = [
        "| cell | sent apart by | median (ms) | 99 % (ms) | worst (ms) | updates/s"
        " | share of a core |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, apart, milliseconds, updates, share in rows:
        median, high, worst = np.percentile(milliseconds, (50, 99, 100))
        lines.append(
            f"| {name} | {apart} | {median:.2f} | {high:.2f} | {worst:.2f} | {updates:.0f}"
            f" | {share:.2f} |"
        )
    return "\n".join(lines) + "\n"


def edits_table(rows: Sequence[Edited]) -> str:
    """Return how long contacts were held up in Markdown, a line for each kind of change."""
    lines = [
        "| change | times | answer, median (ms) | held up, median (ms) | 99 % (ms) | worst (ms) |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for change, answers, held_up in rows:
        median, high, worst = np.percentile(held_up, (50, 99, 100))
        lines.append(
            f"| {change} | {len(held_up)} | {np.median(answers):.0f} | {median:.1f} | {high:.1f}"
            f" | {worst:.1f} |"
        )
    return "\n".join(lines) + "\n"


def write(rows: Sequence[Row], load: float) -> None:
    """Put the table of rates into docs/messages.md, between its marks, and the plot beside it."""
    _put("measured", table(rows), load)
    _plot(rows, PLOT)


def write_answers(rows: Sequence[Answers], load: float) -> None:
    """Put the times of answers into docs/messages.md, between their marks."""
    _put("answers", answers_table(rows), load)


def write_cells(rows: Sequence[Cell], load: float) -> None:
    """Put the latencies of the demo into docs/messages.md, between their marks."""
    _put("panda", cells_table(rows), load)


def write_edits(rows: Sequence[Edited], load: float) -> None:
    """Put how long contacts were held up into docs/messages.md, between its marks."""
    _put("edits", edits_table(rows), load)


def holes_table(rows: Sequence[Holes]) -> str:
    """Return how often contacts stayed away, as a table of the page."""
    head = (
        "| transport | seconds | visits | crashes of visitors | holes | longest (ms) "
        "| median (ms) | 99 % (ms) | share of a core |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n"
    )
    return head + "".join(
        f"| {row.transport} | {row.seconds:.0f} | {row.visits} | {row.crashes} | {len(row.gaps)} "
        f"| {1e3 * max(row.gaps, default=0.0):.0f} | {1e3 * row.median:.2f} "
        f"| {1e3 * row.high:.2f} | {row.share:.2f} |\n"
        for row in rows
    )


def write_holes(rows: Sequence[Holes], load: float) -> None:
    """Put how often contacts stayed away into docs/messages.md, between its marks."""
    _put("holes", holes_table(rows), load)


def _put(mark: str, table: str, load: float) -> None:
    begin, end = f"<!-- {mark}: begin -->", f"<!-- {mark}: end -->"
    block = f"{begin}\n{machine(load)}\n{table}{end}"
    new, count = re.subn(f"{begin}.*{end}", lambda _: block, PAGE.read_text(), flags=re.DOTALL)
    if count != 1:
        raise ValueError(f"{PAGE} has no place for the table")
    PAGE.write_text(new)


def _plot(rows: Sequence[Row], path: Path) -> None:
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.6, 3.8))
    for way, (colour, marker) in _LOOKS.items():
        mine = [row for row in rows if row.way == way]
        frames = [row.frames for row in mine]
        style = {"color": colour, "marker": marker, "label": way}
        left.plot(frames, [row.best.rate for row in mine], **style)
        heard = [row for row in mine if len(row.fixed.latencies)]
        percentiles = np.array(
            [np.percentile(row.fixed.latencies, (50, 99)) * 1e3 for row in heard]
        ).reshape(-1, 2)
        at = [row.frames for row in heard]
        right.plot(at, percentiles[:, 0], **style)
        right.fill_between(at, percentiles[:, 0], percentiles[:, 1], color=colour, alpha=0.15)
    left.set_title("highest rate of poses with contacts of their own (Hz)", fontsize=10)
    right.set_title(
        f"poses sent to contacts received at {rows[0].fixed.rate:g} Hz (ms), median to 99 %",
        fontsize=10,
    )
    for axis in (left, right):
        axis.set(xscale="log", yscale="log", xlabel="frames in each message")
        axis.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
        axis.legend(frameon=False)
    figure.tight_layout()
    figure.savefig(path, dpi=130)
