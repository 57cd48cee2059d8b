"""Worst errors as colours: a row for each pair of shapes, a column for each engine."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import importlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.accuracy.measure import Row
from benchmarks.accuracy.words import ONE_BY_ONE, WITH_FCL

__all__ = ["NAME", "worst_errors", "write"]

NAME = "accuracy_map.png"

_PANELS = {"apart": "1 µm to 100 mm apart", "deep": "2 to 20 mm deep"}
_LEAST, _MOST = -16.0, -2.0
"""Powers of ten of a metre at the ends of the colours."""

_NO_ANSWER = "#d0d0d0"


def worst_errors(rows: Sequence[Row], *, is_deep: bool) -> dict[tuple[str, str], dict[str, float]]:
    """Return the worst error (m) of each pair by engine, over all distances on one side.

    NaN where an engine refuses a pair or has no finite answer for it. Points are pairs, too.
    """
    found: dict[tuple[str, str], dict[str, float]] = {}
    for row in rows:
        is_shown = row.query in ("distance", "point") and (row.distance_m < 0.0) == is_deep
        if is_shown and row.engine not in (ONE_BY_ONE, WITH_FCL):
            errors = found.setdefault((row.shape_1, row.shape_2), {})
            error = row.worst_error_m if np.isfinite(row.worst_error_m) else np.nan
            # A NaN stays: what is refused once is refused.
            errors[row.engine] = float(np.maximum(errors.get(row.engine, 0.0), error))
    return found


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write the map; raises ImportError without matplotlib."""
    importlib.import_module("matplotlib").use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    panels = [worst_errors(rows, is_deep=is_deep) for is_deep in (False, True)]
    pairs = sorted(panels[0], key=lambda pair: "Point" in pair)
    engines = list(dict.fromkeys(name for errors in panels[0].values() for name in errors))
    figure, axes = pyplot.subplots(1, 2, figsize=(11.0, 12.0), sharey=True)
    for axis, errors, title in zip(axes, panels, _PANELS.values(), strict=True):
        numbers = np.array(
            [[errors.get(pair, {}).get(engine, np.nan) for engine in engines] for pair in pairs]
        )
        image = _draw(axis, numbers, engines)
        axis.set_title(title, fontsize=11)
    axes[0].set_yticks(range(len(pairs)), [_named(pair) for pair in pairs], fontsize=8)
    figure.suptitle(
        "Worst error of the signed distance of 20 cm shapes: powers of ten of a metre; "
        "grey where there is no answer",
        fontsize=12,
    )
    figure.tight_layout(rect=(0.0, 0.04, 1.0, 0.985))
    bar = figure.add_axes((0.3, 0.025, 0.4, 0.012))
    figure.colorbar(image, cax=bar, orientation="horizontal")
    figure.savefig(folder / NAME, dpi=110)


def _named(pair: Iterable[str]) -> str:
    return ", ".join(pair)


def _draw(axis: Any, numbers: NDArray[np.float64], engines: Sequence[str]) -> Any:
    powers = np.log10(np.maximum(numbers, 10.0**_LEAST))
    axis.set_facecolor(_NO_ANSWER)
    image = axis.imshow(powers, cmap="viridis_r", vmin=_LEAST, vmax=_MOST, aspect="auto")
    for i, j in np.argwhere(np.isfinite(powers)):
        is_dark = powers[i, j] > 0.5 * (_LEAST + _MOST)
        axis.text(
            j,
            i,
            f"{powers[i, j]:.0f}",
            ha="center",
            va="center",
            fontsize=7,
            color="white" if is_dark else "black",
        )
    axis.set_xticks(range(len(engines)), engines, rotation=60, ha="right", fontsize=8)
    return image
