"""What every engine of the comparison offers."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from benchmarks.speed.scenes import Scene

__all__ = ["Engine"]


class Engine(Protocol):
    """One engine with one scene.

    What a query returns is given to ``count`` outside the measured time. A row of the table that
    an engine has no query for is a method that it lacks: ``candidates``, ``penetrations``,
    ``distances(max_distance)``, ``collides``, ``points(p_WQs)``, ``surfaces(representation)``.
    """

    name: str

    def __init__(self, scene: Scene) -> None: ...

    def choose(self, X_WFs: np.ndarray, max_distance: float) -> None:
        """Bring sets of poses (m, f, 4, 4) into the engine's own form, before time is taken.

        ``max_distance`` (m) is how far the next queries look: 0 unless they ask for distances.
        """

    def move(self, k: int) -> None:
        """Give every frame its pose of the k-th set, in bulk where the engine has that."""

    def count(self, row: str, result: Any) -> int:
        """Return how many pairs, or answers to points, the result of a row has."""

    def faces(self, result: Any) -> int:
        """Return how many faces contact surfaces have together; only where there are any."""
