"""Error against time, log-log: a panel for each family of pairs, a line for each engine.

A line joins the settings of one engine, from its loosest to its tightest: the median pair's time
and the worst error of the family. Faint marks behind are the single pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.accuracy.measure import OUR_TIERS, Row
from scene_graph_ros.geometry.accuracy import Accuracy

__all__ = ["NAMES", "family", "write"]

NAMES = {
    "accuracy.png": (2e-3, "2 mm apart"),
    "accuracy_deep.png": (-2e-3, "2 mm deep"),
}
"""The plots' files, and what they show."""

FAMILIES = (
    "spheres, capsules, half space among themselves",
    "spheres, capsules against boxes and hulls",
    "boxes, hulls, half space among themselves",
    "cylinders and ellipsoids against all",
)


class _Series(NamedTuple):
    """An engine: its settings from loose to tight, and how it looks."""

    label: str
    engines: tuple[str, ...]
    colour: str
    marker: str


SERIES = (
    _Series("Drake", ("Drake",), "#d55e00", "s"),
    _Series("FCL", ("FCL",), "#7b5ea7", "P"),
    _Series(
        "Coal: tolerance 1e-3, 1e-6 (default), 1e-12",
        ("Coal, tolerance 1e-03", "Coal", "Coal, tolerance 1e-12"),
        "#1b7837",
        "^",
    ),
    _Series(
        "MuJoCo: tolerance 1e-3, 1e-6 (default), 1e-12",
        ("MuJoCo, tolerance 1e-03", "MuJoCo", "MuJoCo, tolerance 1e-12"),
        "#b8860b",
        "v",
    ),
    _Series("scene_graph_ros: quick, standard, exact (default)", OUR_TIERS, "#0b5394", "o"),
)

_TICKS = (0.5, 1.0, 2.0, 5.0, 10.0)
_LEAST = 3e-17
_SAME_SPOT = 1.0
"""Powers of ten of the error: points closer than this have one text."""

_SIZE = 0.2
"""Metres: of the shapes, for the promises' lines."""


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
        figure.savefig(folder / name, dpi=110)


def _figure(rows: Sequence[Row], words: str) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, axes = pyplot.subplots(2, 2, figsize=(11.0, 8.6), sharex=True, sharey=True)
    for panel, axis in zip(FAMILIES, axes.flat, strict=True):
        inside = [row for row in rows if family(row.shape_1, row.shape_2) == panel]
        pairs = len({(row.shape_1, row.shape_2) for row in inside})
        axis.set_title(f"{panel} ({pairs} pairs)", fontsize=11)
        _draw(axis, inside)
    for axis in axes[1]:
        axis.set_xlabel("time of one query from Python (µs)")
        axis.set_xticks(_TICKS, [f"{tick:g}" for tick in _TICKS])
    for axis in axes[:, 0]:
        axis.set_ylabel("error of the distance (m)")
    found = {}
    for axis in axes.flat:
        handles, labels = axis.get_legend_handles_labels()
        found.update(zip(labels, handles, strict=True))
    order = [series.label for series in reversed(SERIES) if series.label in found]
    figure.suptitle(
        f"Signed distance of 20 cm shapes {words}. "
        "Large: median time, worst error of the family; small: one pair each",
        fontsize=12,
    )
    handles = [found[label] for label in order]
    figure.legend(handles, order, loc="lower center", ncols=3, frameon=False, fontsize=10)
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    return figure


def _draw(axis: Any, rows: Sequence[Row]) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_ylim(_LEAST / 3.0, 1.0)
    for tier in Accuracy:
        _promise(axis, tier)
    refused = [text for series in SERIES if (text := _draw_series(axis, rows, series))]
    axis.grid(visible=True, which="major", color="#e4e4e4", linewidth=0.6)
    if refused:
        axis.text(
            0.99,
            0.985,
            "no answer: " + ", ".join(refused),
            transform=axis.transAxes,
            ha="right",
            va="top",
            fontsize=8,
            color="#555555",
        )


def _promise(axis: Any, tier: Accuracy) -> None:
    bound = _SIZE * tier.bound
    axis.axhline(bound, color="#0b5394", linestyle=":", linewidth=1.0, zorder=1)
    axis.annotate(
        f"{tier.value} promises {bound:.0e} m",
        (0.99, bound),
        xycoords=("axes fraction", "data"),
        ha="right",
        va="bottom",
        fontsize=8,
        color="#0b5394",
    )


def _draw_series(axis: Any, rows: Sequence[Row], series: _Series) -> str:
    """Draw one engine; return for how many pairs it had no answer, if any."""
    line, missing = [], 0
    for engine in series.engines:
        mine = [row for row in rows if row.engine == engine]
        answered = [row for row in mine if np.isfinite(row.worst_error_m)]
        missing = max(missing, len(mine) - len(answered))
        if not answered:
            continue
        times = [row.time_us for row in answered]
        errors = np.maximum([row.worst_error_m for row in answered], _LEAST)
        axis.scatter(
            times,
            errors,
            s=12,
            color=series.colour,
            marker=series.marker,
            alpha=0.3,
            linewidths=0,
            zorder=2,
        )
        line.append((float(np.median(times)), float(errors.max())))
    if line:
        x, y = zip(*line, strict=True)
        style = {"color": series.colour, "marker": series.marker, "label": series.label}
        axis.plot(x, y, **style, markersize=9, markeredgecolor="white", linewidth=1.4, zorder=4)
        if series.engines == OUR_TIERS:
            _name_tiers(axis, line, series.colour)
    name = series.label.split(":")[0]
    return f"{name} {missing}" if missing else ""


def _name_tiers(axis: Any, points: Sequence[tuple[float, float]], colour: str) -> None:
    """Write the tiers' names beside their points; those on one spot share a text."""
    texts: dict[tuple[float, float], list[str]] = {}
    for tier, (x, y) in zip(OUR_TIERS, points, strict=True):
        near = [spot for spot in texts if abs(np.log10(y / spot[1])) < _SAME_SPOT]
        names = texts.pop(near[0]) if near else []
        texts[(min(x, near[0][0]) if near else x, y)] = [*names, tier]
    for (x, y), tiers in texts.items():
        axis.annotate(
            "all tiers" if len(tiers) == len(OUR_TIERS) else " = ".join(tiers),
            (x, y),
            xytext=(-9, 0),
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize=9,
            color=colour,
            weight="bold",
            zorder=5,
            bbox={"boxstyle": "round,pad=0.15", "facecolor": "white", "alpha": 0.75, "lw": 0},
        )
