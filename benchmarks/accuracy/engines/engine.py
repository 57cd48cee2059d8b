"""What the measurement asks of an engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import time
from typing import Any, NamedTuple, Protocol

import numpy as np

from benchmarks.accuracy.constructions import KnownPair, KnownPoint

__all__ = ["ROUNDS", "Engine", "Refused", "Reply", "one_by_one", "spread", "timed"]

ROUNDS = 5
"""Each measurement of time is repeated so often, and the fastest counts: the others were
disturbed."""

_SPACING = 1.0


class Refused(Exception):  # noqa: N818 - an answer, not an error
    """The engine says that it has no answer for this query or pair."""


class Reply(NamedTuple):
    """Signed distances (k,) in metres, and the time of one query in seconds."""

    distances: np.ndarray
    seconds: float


class Engine(Protocol):
    """Answers known pairs and points; raises Refused where it has no answer."""

    name: str

    def distances(self, pairs: Sequence[KnownPair]) -> Reply:
        """Return the signed distance of each pair."""

    def penetrations(self, pairs: Sequence[KnownPair]) -> Reply:
        """Return minus the depth of each overlapping pair, 0 where the overlap was not seen."""

    def points(self, points: Sequence[KnownPoint]) -> Reply:
        """Return the signed distance of each point."""


def timed(work: Callable[[], Any], prepare: Callable[[], Any] | None = None) -> tuple[Any, float]:
    """Return the result of ``work`` and its least time in seconds, ``prepare`` not counted."""
    least = np.inf
    for _ in range(1 + ROUNDS):  # the first warms up
        if prepare is not None:
            prepare()
        start = time.perf_counter()
        result = work()
        least = min(least, time.perf_counter() - start)
    return result, least


def one_by_one(ask: Callable[..., float], arguments: Sequence[tuple[Any, ...]]) -> Reply:
    """Ask once for every tuple of arguments, as a loop in Python does."""
    values, seconds = timed(lambda: [ask(*a) for a in arguments])
    return Reply(np.array(values), seconds / len(arguments))


def spread(pairs: Sequence[KnownPair]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (X_WA, X_WB) of the pairs, each moved to a place of its own in a cube."""
    side = int(np.ceil(len(pairs) ** (1.0 / 3.0)))
    placed = []
    for k, pair in enumerate(pairs):
        place = np.array([k % side, k // side % side, k // side**2]) - 0.5 * (side - 1)
        shift = np.eye(4)
        shift[:3, 3] = _SPACING * place
        placed.append((shift @ pair.X_WA, shift @ pair.X_WB))
    return placed
