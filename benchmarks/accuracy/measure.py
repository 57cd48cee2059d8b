"""Put known configurations to engines and note the worst error and the time of a query."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
import itertools
from typing import Any
import zlib

import numpy as np

from benchmarks.accuracy.bodies import KINDS
from benchmarks.accuracy.constructions import known_pairs, known_points
from benchmarks.accuracy.engines.engine import Engine, Refused, Reply

__all__ = [
    "APART",
    "DEEP",
    "Row",
    "Task",
    "installed_engines",
    "measure",
    "our_engines",
    "tasks",
]

APART = (1e-6, 2e-3, 0.1)
"""Metres between the shapes."""

DEEP = (-2e-3, -2e-2)
"""Metres of overlap, as signed distances."""

_POINT = "point"


@dataclass(frozen=True)
class Row:
    """One line of the table: an engine's errors (m) on one task; NaN where it refuses."""

    query: str
    shape_1: str
    shape_2: str
    distance_m: float
    engine: str
    count: int
    worst_error_m: float
    median_error_m: float
    time_us: float

    @classmethod
    def header(cls) -> list[str]:
        """Return the names of the columns."""
        return [field.name for field in fields(cls)]

    @classmethod
    def from_text(cls, values: dict[str, str]) -> Row:
        """Read a line of the table."""
        kinds: dict[str, Callable[[str], Any]] = {"str": str, "float": float, "int": int}
        return cls(**{f.name: kinds[str(f.type)](values[f.name]) for f in fields(cls)})

    def texts(self) -> list[str]:
        """Return a line of the table, with two digits for each measurement."""
        return [f"{x:.1e}" if isinstance(x, float) else str(x) for x in astuple(self)]


@dataclass(frozen=True)
class Task:
    """A query about two kinds of shape (or one and a point) at a signed distance (m)."""

    query: str
    shape_1: str
    shape_2: str
    distance: float

    def configurations(self, count: int, seed: int) -> list[Any]:
        """Return known pairs or points. With a smaller ``count``, the same ones, but fewer."""
        # The penetration query gets the configurations of the distance query.
        key = f"{self.shape_1} {self.shape_2} {self.distance!r}"
        rng = np.random.default_rng([seed, zlib.crc32(key.encode())])
        if self.query == _POINT:
            return known_points(self.shape_1, self.distance, count, rng)
        return known_pairs(self.shape_1, self.shape_2, self.distance, count, rng)

    def ask(self, engine: Engine, configurations: Sequence[Any]) -> Reply:
        """Return the engine's reply; raises Refused."""
        ask = {
            "distance": engine.distances,
            "penetration": engine.penetrations,
            _POINT: engine.points,
        }[self.query]
        return ask(configurations)


def tasks() -> list[Task]:
    """Return all tasks: every query, every pair but two half spaces, every distance."""
    pairs = [
        pair
        for pair in itertools.combinations_with_replacement(KINDS, 2)
        if pair != ("HalfSpace", "HalfSpace")
    ]
    every = (*APART, *DEEP)
    return [
        *(Task("distance", a, b, d) for a, b in pairs for d in every),
        *(Task("penetration", a, b, d) for a, b in pairs for d in DEEP),
        *(Task(_POINT, kind, "Point", d) for kind in KINDS for d in every),
    ]


def our_engines() -> list[Engine]:
    """Return this package's engines; tiers of accuracy are further ones."""
    from benchmarks.accuracy.engines.ours import Ours, OursBatched

    return [Ours(), OursBatched()]


def installed_engines(tell: Callable[[str], Any]) -> list[Engine]:
    """Return ours and all peers whose import works; ``tell`` hears of the others."""
    from benchmarks.accuracy.engines.coal import Coal
    from benchmarks.accuracy.engines.drake import Drake
    from benchmarks.accuracy.engines.fcl import Fcl
    from benchmarks.accuracy.engines.mujoco import MuJoCo

    engines = our_engines()
    makers: list[Callable[[], Engine]] = [
        Drake,
        Coal,
        lambda: Coal(1e-12),
        Fcl,
        MuJoCo,
        lambda: MuJoCo(1e-12),
    ]
    for make in makers:
        try:
            engines.append(make())
        except ImportError as error:
            tell(f"left out: {error}")
    return engines


def _row(task: Task, engine: Engine, configurations: Sequence[Any]) -> Row:
    worst = median = time_us = np.nan
    try:
        reply = task.ask(engine, configurations)
    except Refused:
        pass
    else:
        errors = np.abs(reply.distances - task.distance)
        # A peer's NaN or its largest double is an answer, and as wrong as can be.
        errors = np.where(np.isfinite(errors), errors, np.inf)
        worst, median = float(errors.max()), float(np.median(errors))
        time_us = 1e6 * reply.seconds
    return Row(
        task.query,
        task.shape_1,
        task.shape_2,
        task.distance,
        engine.name,
        len(configurations),
        worst,
        median,
        time_us,
    )


def measure(
    engines: Sequence[Engine], work: Iterable[Task], count: int, seed: int
) -> Iterator[Row]:
    """Yield a row for every task and engine."""
    for task in work:
        configurations = task.configurations(count, seed)
        for engine in engines:
            yield _row(task, engine, configurations)
