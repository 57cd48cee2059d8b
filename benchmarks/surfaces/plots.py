"""Error against time per surface, log-log: a panel for each pair of shapes.

A line joins an engine's resolutions, from the coarsest mesh to the finest: the worst error and
the median time over what may be rigid. Small marks behind are triangles, lines are polygons.
"""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.surfaces.cases import DEEPEST
from benchmarks.surfaces.measure import Row

__all__ = ["NAMES", "Quantity", "worst", "write"]


class Quantity(NamedTuple):
    """What a figure shows."""

    column: str
    scale: float
    label: str
    title: str
    ticks: tuple[float, ...]
    unit: str


NAMES = {
    "surfaces.png": Quantity(
        "force_error", 100.0, "error of the force", "Force", (0.1, 1.0, 10.0, 100.0), " %"
    ),
    "surfaces_area.png": Quantity(
        "area_error", 100.0, "error of the area", "Area", (0.1, 1.0, 10.0, 100.0), " %"
    ),
    "surfaces_centre.png": Quantity(
        "centre_error_m", 1e3, "error of the pressure centre", "Pressure centre",
        (1e-3, 1e-2, 0.1, 1.0), " mm",
    ),
}  # fmt: skip
"""The plots' files, and what they show."""

_LOOKS = {"scene_graph_ros": ("#0b5394", "o"), "Drake": ("#d55e00", "s")}
_SIDES = {"one compliant": "-", "both compliant": "--"}
_TIME_TICKS = (5.0, 10.0, 100.0, 1000.0, 10_000.0)


def worst(rows: Sequence[Row], column: str) -> tuple[float, float]:
    """Return the median time (us) and the worst value of a column; NaN without an answer."""
    values = np.array([getattr(row, column) for row in rows], dtype=float)
    times = np.array([row.time_us for row in rows], dtype=float)
    known = np.isfinite(values) & np.isfinite(times)
    if not known.any():
        return np.nan, np.nan
    return float(np.median(times[known])), float(values[known].max())


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write the plots; raises ImportError without matplotlib."""
    matplotlib = importlib.import_module("matplotlib")
    matplotlib.use("Agg")
    with_hint = [row for row in rows if np.isfinite(row.hint_m)]
    for name, quantity in NAMES.items():
        _figure(with_hint, quantity).savefig(folder / name, dpi=110)


def _figure(rows: Sequence[Row], quantity: Quantity) -> Any:
    pyplot = importlib.import_module("matplotlib.pyplot")
    figure, axes = pyplot.subplots(2, 3, figsize=(12.5, 8.4), sharex=True, sharey=True)
    panels = list(dict.fromkeys(row.shapes for row in rows))
    for shapes, axis in zip(panels, axes.flat, strict=True):
        inside = [row for row in rows if row.shapes == shapes]
        axis.set_title(shapes, fontsize=11)
        _draw(axis, inside, quantity)
    for axis in axes[1]:
        axis.set_xlabel("time for one surface, poses included (µs)")
    for axis in axes[:, 0]:
        axis.set_ylabel(quantity.label)
    found: dict[str, Any] = {}
    for axis in axes.flat:
        handles, labels = axis.get_legend_handles_labels()
        found.update(zip(labels, handles, strict=True))
    figure.suptitle(
        f"{quantity.title}: what a finer mesh buys. Bodies of radius {1e3 * DEEPEST:g} mm, 10 to"
        " 30 mm deep.\nAt the marks: resolution_hint in mm. Lines: polygons; faint: triangles."
        " Down and to the left is better",
        fontsize=11,
    )
    order = sorted(found, key=lambda label: (label.split(",")[0] == "Drake", label))
    order.sort(key=lambda label: label.startswith("Drake"))
    figure.legend(
        [found[label] for label in order], order, loc="lower center", ncols=4, frameon=False
    )
    figure.tight_layout(rect=(0.0, 0.045, 1.0, 1.0))
    return figure


def _draw(axis: Any, rows: Sequence[Row], quantity: Quantity) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_yticks(quantity.ticks, [f"{tick:g}{quantity.unit}" for tick in quantity.ticks])
    axis.set_xticks(_TIME_TICKS, [f"{tick:g}" for tick in _TIME_TICKS])
    axis.grid(visible=True, which="major", color="#e4e4e4", linewidth=0.6)
    for engine in _LOOKS:
        for sides in _SIDES:
            mine = [row for row in rows if (row.engine, row.sides) == (engine, sides)]
            if mine:
                _draw_line(axis, mine, quantity)


def _draw_line(axis: Any, rows: Sequence[Row], quantity: Quantity) -> None:
    engine, sides = rows[0].engine, rows[0].sides
    colour, marker = _LOOKS[engine]
    points: dict[str, list[tuple[float, float, float]]] = {"triangle": [], "polygon": []}
    for hint in sorted({row.hint_m for row in rows}, reverse=True):
        for representation, line in points.items():
            here = [r for r in rows if (r.hint_m, r.representation) == (hint, representation)]
            x, y = worst(here, quantity.column)
            if np.isfinite(y):
                line.append((x, quantity.scale * y, hint))
    if not points["polygon"]:
        return
    if points["triangle"]:
        x, y, _ = zip(*points["triangle"], strict=True)
        axis.scatter(x, y, s=14, color=colour, marker=marker, alpha=0.3, linewidths=0, zorder=2)
    x, y, hints = zip(*points["polygon"], strict=True)
    is_one = sides == "one compliant"
    axis.plot(
        x, y, color=colour, marker=marker, linestyle=_SIDES[sides], markersize=7, linewidth=1.5,
        markerfacecolor=colour if is_one else "white",
        markeredgecolor="white" if is_one else colour, label=f"{engine}, {sides}", zorder=4,
    )  # fmt: skip
    if engine == "scene_graph_ros" and is_one:
        for a, b, hint in zip(x, y, hints, strict=True):
            axis.annotate(
                f"{1e3 * hint:.3g}", (a, b), xytext=(-7, -4), textcoords="offset points",
                ha="right", va="top", fontsize=8.5, color=colour, weight="bold", zorder=5,
            )  # fmt: skip
