"""The rows of the table: what is asked, how it is compared, what has to be reached."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks.speed.scenes import Scene

__all__ = ["BUILDING", "MAX_DISTANCE", "ROWS", "SURFACE_ROWS", "Row"]

MAX_DISTANCE = 0.1
"""Metres: how far signed distances are asked for."""


class Row(NamedTuple):
    """One question to a scene; the poses are new each time and their update is included."""

    key: str
    title: str
    method: str
    """The method of an engine that answers it."""
    arguments: Callable[[Scene], tuple[Any, ...]]
    goal: float
    """How many times as fast as the fastest peer we want to be with 1000 mixed shapes."""
    is_apart: bool = False
    """Whether the poses are those in which nothing collides."""
    max_distance: float = 0.0
    max_size: int = 1_000_000
    """Bodies. Larger scenes are not asked: the answers alone would take gigabytes."""
    only_mixed: bool = False
    """Whether the row is asked of the mixed shapes only."""

    def poses(self, scene: Scene) -> np.ndarray | None:
        """Return the sets of poses, None where the scene has none for this row."""
        return scene.apart_X_WF if self.is_apart else scene.X_WF


def _nothing(scene: Scene) -> tuple[Any, ...]:
    del scene
    return ()


ROWS = (
    Row("candidates", "pose update and collision candidates", "candidates", _nothing, 3.0),
    Row("penetration", "penetration of the whole scene", "penetrations", _nothing, 3.0),
    Row(
        "distance",
        "signed distance up to 0.1 m, exact tier",
        "distances",
        lambda scene: (MAX_DISTANCE,),
        5.0,
        max_distance=MAX_DISTANCE,
    ),
    Row("collides", "is anything colliding? nothing is", "collides", _nothing, 3.0, is_apart=True),
    Row(
        "point",
        "distance of 1 point to all",
        "points",
        lambda s: (s.p_WQs[:1],),
        20.0,
        only_mixed=True,
    ),
    Row(
        "points",
        "distance of 1000 points to all",
        "points",
        lambda s: (s.p_WQs,),
        200.0,
        max_size=1000,
        only_mixed=True,
    ),
)
"""What is asked of all scenes but those of compliant shapes."""

SURFACE_ROWS = (
    Row("triangles", "contact surfaces, triangles", "surfaces", lambda s: ("triangle",), 3.0),
    Row("polygons", "contact surfaces, polygons", "surfaces", lambda s: ("polygon",), 3.0),
)
"""What is asked of compliant shapes."""

BUILDING = Row("building", "building the compliant bodies, once", "", _nothing, 3.0)
"""See ``building.py``: it is measured in its own way."""
