"""Time the engines row by row, taking turns, so that a slow moment of the machine hits all.

A turn is a streak of queries, as in a loop that asks one engine again and again. The first of a
streak finds the processor's caches full of another engine's data; it is kept apart.
"""

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

STREAK = 9
"""Queries of a turn: the first, which comes after other work, and eight more."""
MAX_TURNS = 12
MIN_TURNS = 3
"""Turns that streaks are shortened for, down to two queries, where a query is slow."""
SETTLING = (150, 0.5)
"""Queries, and seconds, at most, before time is taken: trees of boxes get better by and by."""
SLOW = 4.0
"""Seconds. A query that took longer the first time is not asked again."""


class Measurement(NamedTuple):
    """The times of one engine, scene and row."""

    scene: str
    size: int
    row: str
    engine: str
    rounds: int
    """Queries whose times the next three are of."""
    median_ms: float
    low_ms: float
    """First decile."""
    high_ms: float
    """Ninth decile."""
    found: float
    """Mean number of pairs, or of answers to points."""
    faces: float = np.nan
    """Mean number of faces of contact surfaces together."""
    turns: int = 0
    """Queries that came after another engine's, whose times the next three are of."""
    first_median_ms: float = np.nan
    first_low_ms: float = np.nan
    first_high_ms: float = np.nan


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
        self.last_answer = 0.0
        self.times: list[float] = []
        self.firsts: list[float] = []
        self.found: list[int] = []
        self.faces: list[int] = []

    def ready(self) -> None:
        """Bring the poses into the engine's form, and ask until the engine has settled.

        The time of the last answer tells if it is slow.
        """
        self.engine.choose(self._X_WFs, self.row.max_distance)
        next(self._order)
        self.engine.move(0)
        self.last_answer = self._once()
        if self.is_slow:  # It may have built what is built once.
            self.last_answer = self._once()
        if self.is_slow:
            self.times.append(self.last_answer)
            return
        count, seconds = SETTLING
        end = time.perf_counter() + seconds
        for _ in range(count):
            self.last_answer = self._once()
            if time.perf_counter() >= end:
                return

    def take(self, streak: int, *, is_first_apart: bool) -> None:
        """Ask so many times in a row, with new poses each time."""
        times = [self._once() for _ in range(streak)]
        if is_first_apart:
            self.firsts.append(times.pop(0))
        self.times += times

    def _once(self) -> float:
        """Move and ask; return the seconds. What was found is counted after time was taken."""
        ask: Callable[..., Any] = getattr(self.engine, self.row.method)
        k = next(self._order)
        start = time.perf_counter()
        self.engine.move(k)
        result = ask(*self._arguments)
        elapsed = time.perf_counter() - start
        self.found.append(self.engine.count(self.row.key, result))
        if self.row.method == "surfaces":
            self.faces.append(self.engine.faces(result))
        return elapsed

    @property
    def is_slow(self) -> bool:
        """Whether an answer took too long to ask again."""
        return self.last_answer > SLOW

    def measurement(self, scene: Scene) -> Measurement:
        """Return the result; the answer that warmed up counts only if it stayed alone."""
        return Measurement(
            scene=scene.key,
            size=scene.size,
            row=self.row.key,
            engine=self.engine.name,
            rounds=len(self.times),
            found=float(np.mean(self.found)),
            faces=float(np.mean(self.faces)) if self.faces else np.nan,
            turns=len(self.firsts),
            **_milliseconds("", self.times),
            **_milliseconds("first_", self.firsts),
        )


def _milliseconds(prefix: str, seconds: Sequence[float]) -> dict[str, float]:
    """Return median, first and ninth decile by the names of their columns; nan of nothing."""
    figures = np.full(3, np.nan)
    if seconds:
        figures = 1e3 * np.quantile(seconds, [0.5, 0.1, 0.9])
    names = [f"{prefix}{name}_ms" for name in ("median", "low", "high")]
    return dict(zip(names, figures.tolist(), strict=True))


def _plan(queries: float) -> tuple[int, int]:
    """Return turns and the length of their streaks, for so many queries of each engine."""
    streak = int(np.clip(queries // MIN_TURNS, 2, STREAK))
    return int(np.clip(queries // streak, 2, MAX_TURNS)), streak


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
    each = max(sum(turn.last_answer for turn in quick), 1e-6)
    count, streak = _plan(seconds / each)
    gc.collect()
    for _ in range(count):
        for turn in quick:
            turn.take(streak, is_first_apart=len(quick) > 1)
    return [turn.measurement(scene) for turn in turns]
