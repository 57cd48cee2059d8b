"""Error against time, log-log: a panel for each family of pairs, a colour for each engine."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.accuracy.measure import Row

__all__ = ["NAMES", "family", "write"]

NAMES = {"accuracy_apart.png": (2e-3, "2 mm apart"), "accuracy_deep.png": (-2e-3, "2 mm deep")}
"""The plots' files, and what they show."""

FAMILIES = (
    "spheres, capsules, half space among themselves",
    "spheres, capsules against boxes and hulls",
    "boxes, hulls, half space among themselves",
    "cylinders and ellipsoids against all",
)

_LOOKS = {
    "scene_graph_ros": ("#0b5394", "o"),
    "scene_graph_ros, batched": ("#3d9be9", "D"),
    "Drake": ("#d55e00", "s"),
    "Coal": ("#1b7837", "^"),
    "Coal, tolerance 1e-12": ("#7fbf7b", "v"),
    "FCL": ("#8c6bb1", "P"),
    "MuJoCo": ("#b8860b", "<"),
    "MuJoCo, tolerance 1e-12": ("#e6c35c", ">"),
}
_LEAST = 1e-17
_PROMISE = 2e-13
"""Metres: 1e-12 of the shapes' 20 cm."""


def family(shape_1: str, shape_2: str) -> str:
    """Return the panel that a pair belongs to."""
    pair = {shape_1, shape_2}
    if pair & {"Cylinder", "Ellipsoid"}:
        return FAMILIES[3]
    if pair <= {"Sphere", "Capsule", "HalfSpace"}:
        return FAMILIES[0]
    return FAMILIES[1] if pair & {"Sphere", "Capsule"} else FAMILIES[2]


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write the plots; raises ImportError without matplotlib."""
    matplotlib = importlib.import_module("matplotlib")
    matplotlib.use("Agg")
    for name, (distance, words) in NAMES.items():
        chosen = [r for r in rows if (r.query, r.distance_m) == ("distance", distance)]
        figure = _figure(chosen, words)
        figure.savefig(folder / name, dpi=130)


def _figure(rows: Sequence[Row], words: str) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, axes = pyplot.subplots(2, 2, figsize=(11.0, 8.4), sharex=True, sharey=True)
    for panel, axis in zip(FAMILIES, axes.flat, strict=True):
        inside = [row for row in rows if family(row.shape_1, row.shape_2) == panel]
        _draw(axis, inside, panel)
    for axis in axes[1]:
        axis.set_xlabel("time of one query from Python (µs)")
    for axis in axes[:, 0]:
        axis.set_ylabel("worst error (m)")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.suptitle(
        f"Signed distance of 20 cm shapes {words}: one mark for each pair, lower left is better",
        fontsize=13,
    )
    figure.legend(handles, labels, loc="lower center", ncols=4, frameon=False, fontsize=10)
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    return figure


def _draw(axis: Any, rows: Sequence[Row], title: str) -> None:
    refused = []
    for engine in dict.fromkeys(row.engine for row in rows):
        colour, marker = _LOOKS[engine]
        mine = [row for row in rows if row.engine == engine]
        errors = np.array([row.worst_error_m for row in mine])
        times = np.array([row.time_us for row in mine])
        answered = np.isfinite(errors)
        if not answered.all():
            refused.append(f"{engine}: {np.count_nonzero(~answered)}")
        axis.scatter(
            times[answered],
            np.maximum(errors[answered], _LEAST),
            s=34,
            color=colour,
            marker=marker,
            edgecolors="white",
            linewidths=0.5,
            label=engine,
            zorder=3,
        )
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.axhline(_PROMISE, color="#555555", linestyle="--", linewidth=1.0)
    axis.annotate(
        "promised: 1e-12 of the size",
        (0.99, _PROMISE),
        xycoords=("axes fraction", "data"),
        ha="right",
        va="bottom",
        fontsize=9,
        color="#555555",
    )
    axis.set_title(title, fontsize=11)
    axis.grid(visible=True, which="major", color="#dddddd", linewidth=0.6)
    if refused:
        text = "no answer (pairs): " + ", ".join(refused)
        axis.text(0.01, 0.99, text, transform=axis.transAxes, va="top", fontsize=8)
