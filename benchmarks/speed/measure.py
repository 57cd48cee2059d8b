"""Time the engines row by row, taking turns, so that a slow moment of the machine hits all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
import gc
import time
from typing import Any, NamedTuple

import numpy as np

from benchmarks.speed.engines.coal import Coal
from benchmarks.speed.engines.drake import Drake
from benchmarks.speed.engines.engine import Engine
from benchmarks.speed.engines.fcl import Fcl
from benchmarks.speed.engines.mujoco import MuJoCo
from benchmarks.speed.engines.ours import Ours
from benchmarks.speed.rows import Row
from benchmarks.speed.scenes import Scene

__all__ = ["ENGINES", "Measurement", "make_engines", "measure"]

ENGINES = (Ours, Drake, MuJoCo, Coal, Fcl)

MAX_ROUNDS = 60
MIN_ROUNDS = 3
SLOW = 4.0
"""Seconds. A query that took longer the first time is not asked again."""


class Measurement(NamedTuple):
    """The times of one engine, scene and row."""

    scene: str
    size: int
    row: str
    engine: str
    rounds: int
    median_ms: float
    low_ms: float
    """First decile."""
    high_ms: float
    """Ninth decile."""
    found: float
    """Mean number of pairs, or of answers to points."""
    faces: float = np.nan
    """Mean number of faces of contact surfaces together."""


def make_engines(scene: Scene, say: Callable[[str], None]) -> list[Engine]:
    """Return the installed engines with the scene; those that can't have it are named."""
    engines: list[Engine] = []
    for engine in ENGINES:
        try:
            engines.append(engine(scene))
        except (ImportError, NotImplementedError) as error:
            say(f"{scene.key}: {engine.name} is left out: {error}")
    return engines


def _there_and_back(sets: int) -> Iterator[int]:
    """Yield indices of sets forth and back without end, so that nothing ever jumps."""
    period = max(2 * (sets - 1), 1)
    k = 0
    while True:
        yield min(k % period, period - k % period)
        k += 1


class _Turns:
    """One engine's part of a row."""

    def __init__(self, engine: Engine, row: Row, scene: Scene, X_WFs: np.ndarray) -> None:
        self.engine, self.row = engine, row
        self._arguments = row.arguments(scene)
        self._X_WFs = X_WFs
        self._order = _there_and_back(len(X_WFs))
        self.times: list[float] = []
        self.found: list[int] = []
        self.faces: list[int] = []

    def ready(self) -> None:
        """Bring the poses into the engine's form, and ask once; the time tells if it is slow."""
        self.engine.choose(self._X_WFs, self.row.max_distance)
        next(self._order)
        self.engine.move(0)
        self.once()
        if self.is_slow:  # It may have built what is built once.
            self.times.clear()
            self.once()

    def once(self) -> None:
        """Move and ask, and count what was found after time was taken."""
        ask: Callable[..., Any] = getattr(self.engine, self.row.method)
        k = next(self._order)
        start = time.perf_counter()
        self.engine.move(k)
        result = ask(*self._arguments)
        self.times.append(time.perf_counter() - start)
        self.found.append(self.engine.count(self.row.key, result))
        if self.row.method == "surfaces":
            self.faces.append(self.engine.faces(result))

    @property
    def is_slow(self) -> bool:
        """Whether the first answer took too long to ask again."""
        return self.times[0] > SLOW

    def measurement(self, scene: Scene) -> Measurement:
        """Return the result; the first answer, that warms up, counts only if it stayed alone."""
        times = 1e3 * np.array(self.times[1:] or self.times)
        low, median, high = np.quantile(times, [0.1, 0.5, 0.9])
        name = self.engine.name
        found = float(np.mean(self.found))
        faces = float(np.mean(self.faces)) if self.faces else np.nan
        return Measurement(
            scene.key, scene.size, self.row.key, name, len(times), median, low, high, found, faces
        )


def measure(
    engines: Sequence[Engine],
    row: Row,
    scene: Scene,
    seconds: float,
    say: Callable[[str], None],
) -> list[Measurement]:
    """Ask all engines that have the row, in turns, for about so many seconds together."""
    X_WFs = row.poses(scene)
    if X_WFs is None:
        return []
    turns = []
    for engine in engines:
        if hasattr(engine, row.method):
            turn = _Turns(engine, row, scene, X_WFs)
            try:
                turn.ready()
            except RuntimeError as error:  # Drake refuses some pairs
                say(f"{scene.key}, {row.key}: {engine.name} is left out: {error}")
            else:
                turns.append(turn)
    quick = [turn for turn in turns if not turn.is_slow]
    each = max(sum(turn.times[0] for turn in quick), 1e-6)
    rounds = int(np.clip(seconds / each, MIN_ROUNDS, MAX_ROUNDS))
    gc.collect()
    for k in range(rounds):
        for i in range(len(quick)):
            quick[(i + k) % len(quick)].once()
    return [turn.measurement(scene) for turn in turns]
