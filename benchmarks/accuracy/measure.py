"""Put known configurations to engines and note the worst error and the time of a query."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
import functools
import itertools
from typing import Any
import zlib

import numpy as np

from benchmarks.accuracy.bodies import KINDS
from benchmarks.accuracy.constructions import known_pairs, known_points
from benchmarks.accuracy.engines.engine import Engine, Refused, Reply
from scene_graph_ros.geometry.accuracy import Accuracy

__all__ = [
    "APART",
    "DEEP",
    "LEAST_STATED",
    "OUR_TIERS",
    "Row",
    "Task",
    "installed_engines",
    "measure",
    "our_engines",
    "stated",
    "tasks",
]

APART = (1e-6, 2e-3, 0.1)
"""Metres between the shapes."""

DEEP = (-2e-3, -2e-2)
"""Metres of overlap, as signed distances."""

LEAST_STATED = 1e-14
"""Metres. What is stated where errors are rounding: coordinates of up to 5 m are rounded by up to
4e-16 each, in the construction's poses as well as in the query."""

_SENTINEL = 1e6
"""Metres. A peer's answer that is further off stands for none."""

_POINT = "point"

DEEP_QUERIES = ("distance", "penetration")
"""What is asked about overlapping shapes, one after the other, so that they share the pairs."""

OUR_TIERS = tuple(tier.value for tier in Accuracy)
"""The names of the engines that stand for the tiers."""


@dataclass(frozen=True)
class Row:
    """One line of the table: an engine's errors (m) on one task; NaN where it refuses.

    ``stated_m`` is what the table says of one of our tiers, and a test holds it to.
    """

    query: str
    shape_1: str
    shape_2: str
    distance_m: float
    engine: str
    count: int
    worst_error_m: float
    median_error_m: float
    stated_m: float
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
        kind_2 = None if self.query == _POINT else self.shape_2
        return _configurations(self.shape_1, kind_2, self.distance, count, seed)

    def ask(self, engine: Engine, configurations: Sequence[Any]) -> Reply:
        """Return the engine's reply; raises Refused."""
        ask = {
            "distance": engine.distances,
            "penetration": engine.penetrations,
            _POINT: engine.points,
        }[self.query]
        return ask(configurations)


@functools.lru_cache(maxsize=128)
def _configurations(
    kind_1: str, kind_2: str | None, distance: float, count: int, seed: int
) -> list[Any]:
    """Return known pairs, or points where there is no second kind; the same for every query."""
    key = f"{kind_1} {kind_2} {distance!r}"
    rng = np.random.default_rng([seed, zlib.crc32(key.encode())])
    if kind_2 is None:
        return known_points(kind_1, distance, count, rng)
    return known_pairs(kind_1, kind_2, distance, count, rng)


def tasks() -> list[Task]:
    """Return all tasks: every query, every pair but two half spaces, every distance."""
    pairs = [
        pair
        for pair in itertools.combinations_with_replacement(KINDS, 2)
        if pair != ("HalfSpace", "HalfSpace")
    ]
    every = (*APART, *DEEP)
    queries = (*(("distance", d) for d in APART), *((q, d) for d in DEEP for q in DEEP_QUERIES))
    return [
        *(Task(query, a, b, d) for a, b in pairs for query, d in queries),
        *(Task(_POINT, kind, "Point", d) for kind in KINDS for d in every),
    ]


def our_engines() -> list[Engine]:
    """Return this package at every tier, asked about many pairs at once."""
    from benchmarks.accuracy.engines.ours import OursBatched

    return [OursBatched(tier) for tier in Accuracy]


def installed_engines(tell: Callable[[str], Any]) -> list[Engine]:
    """Return ours and all peers whose import works; ``tell`` hears of the others."""
    from benchmarks.accuracy.engines.coal import Coal
    from benchmarks.accuracy.engines.drake import Drake
    from benchmarks.accuracy.engines.fcl import Fcl
    from benchmarks.accuracy.engines.mujoco import MuJoCo
    from benchmarks.accuracy.engines.ours import Ours, OursWithFcl

    engines = our_engines()
    makers: list[Callable[[], Engine]] = [
        lambda: Ours(Accuracy.EXACT),
        OursWithFcl,
        Drake,
        lambda: Coal(1e-3),
        Coal,
        lambda: Coal(1e-12),
        Fcl,
        lambda: MuJoCo(1e-3),
        MuJoCo,
        lambda: MuJoCo(1e-12),
    ]
    for make in makers:
        try:
            engines.append(make())
        except ImportError as error:
            tell(f"left out: {error}")
    return engines


def stated(worst_error: float) -> float:
    """Return the power of ten (m) that the table states for a measured error.

    It is 4 to 40 times the error: another processor rounds in another way.
    """
    return float(10.0 ** np.ceil(np.log10(4.0 * max(worst_error, LEAST_STATED / 40.0))))


def _row(task: Task, engine: Engine, configurations: Sequence[Any]) -> Row:
    worst = median = time_us = np.nan
    try:
        reply = task.ask(engine, configurations)
    except Refused:
        pass
    else:
        errors = np.abs(reply.distances - task.distance)
        # A peer's NaN or its largest double is an answer, and as wrong as can be.
        errors = np.where(errors < _SENTINEL, errors, np.inf)
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
        stated(worst) if engine.name in OUR_TIERS else np.nan,
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
