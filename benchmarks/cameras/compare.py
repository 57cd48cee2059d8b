"""Scenes before all renderers in one run, each renderer in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import os

from benchmarks.cameras.engines import ENGINES
from benchmarks.cameras.measure import load, measure, Row
from benchmarks.cameras.scenes import lens, SCENES
from benchmarks.cameras.seats import Elsewhere

__all__ = ["SHORT", "compare", "compare_shortly"]

SHORT = ("mixed-50", "meshes-1")
"""Scenes of a short run: shapes with closed forms, and triangles."""

_FOR_RENDERERS = {"LP_NUM_THREADS": "1", "MUJOCO_GL": "egl"}
"""One thread of Mesa's, and no display for MuJoCo."""


def compare(
    scenes: Iterable[str],
    say: Callable[[str], object],
    *,
    size: tuple[int, int] = (640, 480),
    frames: int,
    pixels: int,
    seed: int,
) -> list[Row]:
    """Return what all renderers take for scenes by key, and how far their depths are off.

    ``say`` is told which renderer is left out of which scene, and why.
    """
    for name, value in _FOR_RENDERERS.items():
        os.environ.setdefault(name, value)  # their processes inherit it
    rows: list[Row] = []
    seats = [Elsewhere(kind) for kind in ENGINES]
    for key in scenes:
        scene, camera = SCENES[key](seed), lens(*size)
        found = load(seats, scene, camera, say)
        rows += measure(found, scene, camera, frames=frames, pixels=pixels, seed=seed)
    for seat in seats:
        seat.close()
    return rows


def compare_shortly(say: Callable[[str], object], *, seed: int) -> list[Row]:
    """Compare in half a minute: two scenes, two frames, depths at few pixels."""
    return compare(SHORT, say, frames=2, pixels=40, seed=seed)
