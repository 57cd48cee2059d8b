"""Time against the number of shapes, log-log, and time in each of the other scenes."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.speed.measure import ENGINES, Measurement
from benchmarks.speed.report import COMPLIANT, MIXED
from benchmarks.speed.rows import ROWS

__all__ = ["write"]

_LOOKS = {
    "scene_graph_ros": ("#0b5394", "o"),
    "Drake": ("#d55e00", "s"),
    "MuJoCo": ("#b8860b", "<"),
    "Coal": ("#1b7837", "^"),
    "FCL": ("#8c6bb1", "P"),
}


def write(rows: Sequence[Measurement], folder: Path) -> None:
    """Write performance.png and performance_scenes.png, of what was measured.

    Raises ImportError without matplotlib.
    """
    matplotlib = importlib.import_module("matplotlib")
    matplotlib.use("Agg")
    mixed = [m for m in rows if m.scene == MIXED]
    if mixed:
        _against_size(mixed).savefig(folder / "performance.png", dpi=130)
    others = [m for m in rows if m.scene not in (MIXED, COMPLIANT)]
    if len({m.scene for m in others}) > 1:
        _other_scenes(others).savefig(folder / "performance_scenes.png", dpi=130)


def _against_size(rows: Sequence[Measurement]) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, axes = pyplot.subplots(2, 3, figsize=(12.0, 7.6), sharex=True)
    for row, axis in zip(ROWS, axes.flat, strict=True):
        for name, (colour, marker) in _LOOKS.items():
            mine = sorted(
                (m for m in rows if (m.row, m.engine) == (row.key, name)), key=lambda m: m.size
            )
            if not mine:
                continue
            sizes = np.array([m.size for m in mine])
            bounds = [[m.low_ms for m in mine], [m.high_ms for m in mine]]
            style = {"color": colour, "marker": marker, "markersize": 6, "label": name}
            axis.plot(sizes, [m.median_ms for m in mine], linewidth=1.6, **style)
            axis.fill_between(sizes, *bounds, color=colour, alpha=0.15, linewidth=0.0)
        axis.set_xscale("log")
        axis.set_yscale("log")
        axis.set_title(row.title, fontsize=10)
        axis.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
    for axis in axes[1]:
        axis.set_xlabel("number of shapes")
    for axis in axes[:, 0]:
        axis.set_ylabel("time from Python (ms)")
    handles, labels = axes.flat[1].get_legend_handles_labels()
    figure.suptitle(
        "Mixed shapes at 5 % fill, every pose new before every query: lower is better", fontsize=12
    )
    figure.legend(handles, labels, loc="lower center", ncols=5, frameon=False)
    figure.tight_layout(rect=(0.0, 0.05, 1.0, 1.0))
    return figure


def _other_scenes(rows: Sequence[Measurement]) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    scenes = list(dict.fromkeys(m.scene for m in rows))
    asked = [row for row in ROWS if len({m.scene for m in rows if m.row == row.key}) > 1]
    figure, axes = pyplot.subplots(1, len(asked), figsize=(4.0 * len(asked), 5.2), sharey=True)
    height = 0.8 / len(ENGINES)
    for row, axis in zip(asked, np.atleast_1d(axes), strict=True):
        for k, (name, (colour, _)) in enumerate(_LOOKS.items()):
            times = {
                scenes.index(m.scene): m.median_ms
                for m in rows
                if (m.row, m.engine) == (row.key, name)
            }
            places = np.array(list(times)) + (k - 2) * height
            axis.barh(places, list(times.values()), height, color=colour, label=name, zorder=3)
        axis.set_xscale("log")
        axis.set_title(row.title, fontsize=9, wrap=True)
        axis.set_xlabel("time (ms)")
        axis.grid(visible=True, axis="x", which="major", color="#dddddd", linewidth=0.6)
    first = np.atleast_1d(axes)[0]
    first.set_yticks(range(len(scenes)), scenes)
    first.invert_yaxis()
    patch = importlib.import_module("matplotlib.patches").Patch
    handles = [patch(color=colour, label=name) for name, (colour, _) in _LOOKS.items()]
    figure.legend(handles=handles, loc="lower center", ncols=5, frameon=False)
    figure.tight_layout(rect=(0.0, 0.06, 1.0, 1.0))
    return figure
