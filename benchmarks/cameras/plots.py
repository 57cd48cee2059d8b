"""Error of depth against time for a frame, log-log: a panel for each scene."""

from __future__ import annotations

from collections.abc import Sequence
import importlib
from pathlib import Path

import numpy as np

from benchmarks.cameras.measure import Row, UNROUNDED

__all__ = ["NAME", "write"]

NAME = "cameras_accuracy.png"

_LOOKS = {
    "scene_graph_ros": ("#0b5394", "o"),
    UNROUNDED: ("#0b5394", "*"),
    "Drake, VTK": ("#d55e00", "s"),
    "Drake, GL": ("#e69f00", "D"),
    "MuJoCo": ("#009e73", "^"),
    "Embree, float32": ("#7f7f7f", "v"),
}


def write(rows: Sequence[Row], folder: Path) -> None:
    """Write the plot; raises ImportError without matplotlib."""
    matplotlib = importlib.import_module("matplotlib")
    matplotlib.use("Agg")
    pyplot = importlib.import_module("matplotlib.pyplot")
    scenes = list(dict.fromkeys(row.scene for row in rows))
    size = (2.75 * len(scenes) + 0.6, 4.6)
    figure, axes = pyplot.subplots(1, len(scenes), figsize=size, sharex=True, sharey=True)
    handles = {}
    for scene, axis in zip(scenes, np.atleast_1d(axes), strict=True):
        inside = [row for row in rows if row.scene == scene and np.isfinite(row.median_m)]
        axis.set_title(inside[0].title.replace(", ", ",\n"), fontsize=10)
        for row in inside:
            color, mark = _LOOKS[row.engine]
            axis.plot([row.depth_ms] * 2, [row.median_m, row.high_m], color=color, linewidth=1)
            (handles[row.engine],) = axis.plot(
                row.depth_ms, row.median_m, mark, color=color, markersize=9
            )
        axis.set(xscale="log", yscale="log")
        axis.grid(visible=True, color="#dddddd")
        axis.set_axisbelow(True)
    middle = np.atleast_1d(axes)[len(scenes) // 2]
    middle.set_xlabel("processor time for a depth image of 640 x 480, new poses included (ms)")
    np.atleast_1d(axes)[0].set_ylabel("error of depth (m): median, line to 99 %")
    figure.legend(handles.values(), handles, loc="lower center", ncols=len(handles), fontsize=9)
    figure.tight_layout(rect=(0.0, 0.07, 1.0, 1.0))
    figure.savefig(folder / NAME, dpi=110)
    pyplot.close(figure)
