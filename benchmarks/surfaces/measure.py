"""Put pairs with a known contact surface to the engines; note errors, faces and time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass, fields
import gc
import time
from typing import Any
import zlib

import numpy as np

from benchmarks.surfaces.cases import Case, CASES, Configuration, draw, HINTS
from benchmarks.surfaces.engines import Engine, ENGINES, Found, Refused

__all__ = [
    "PAIRS",
    "REPRESENTATIONS",
    "Row",
    "Task",
    "installed",
    "measure",
    "tasks",
    "worst_errors",
]

PAIRS = 12
"""Configurations of a case, all in one scene."""
REPRESENTATIONS = ("triangle", "polygon")
MIN_ROUNDS = 6
MAX_ROUNDS = 60


@dataclass(frozen=True)
class Row:
    """One engine's worst errors on a case at one resolution; NaN where it refuses.

    ``hint_m`` is NaN where no mesh depends on it.
    """

    shapes: str
    sides: str
    detail: str
    hint_m: float
    engine: str
    representation: str
    pairs: int
    found: int
    faces: float
    """Mean number of faces of a surface."""
    force_error: float
    """Of the force's vector, as a part of the force."""
    area_error: float
    """As a part of the area."""
    centre_error_m: float
    """How far the force's line of action passes by the true point."""
    time_us: float
    """For one surface, in a query about all pairs, poses included."""

    @classmethod
    def header(cls) -> list[str]:
        """Return the names of the columns."""
        return [field.name for field in fields(cls)]

    @classmethod
    def from_text(cls, values: dict[str, str]) -> Row:
        """Read a line of the table."""
        kinds: dict[str, Any] = {"str": str, "float": float, "int": int}
        return cls(**{f.name: kinds[str(f.type)](values[f.name]) for f in fields(cls)})

    def texts(self) -> list[str]:
        """Return a line of the table, with three digits for each measurement."""
        return [f"{x:.3g}" if isinstance(x, float) else str(x) for x in astuple(self)]


@dataclass(frozen=True)
class Task:
    """A case at one resolution (m); NaN where it has none."""

    case: Case
    hint: float


def tasks() -> list[Task]:
    """Return every case at every resolution that makes a difference."""
    return [Task(case, h) for case in CASES for h in (HINTS if case.has_hint else (np.nan,))]


def installed(tell: Any) -> list[type[Engine]]:
    """Return the engines whose import works; ``tell`` hears of the others."""
    try:
        import pydrake.geometry  # noqa: F401
    except ImportError as error:
        tell(f"left out: {error}")
        return [ENGINES[0]]
    return list(ENGINES)


class _Turns:
    """One engine and representation of a task."""

    def __init__(self, engine: Engine, representation: str) -> None:
        self.engine, self.representation = engine, representation
        self.found: list[Found] = []
        self.times: list[float] = []
        self.is_refused = False

    def begin(self) -> None:
        """Ask once, at the poses whose truth is known; warms up."""
        self.engine.move(1)
        self.engine.move(0)
        try:
            self.found = self.engine.integrals(self.engine.ask(self.representation))
        except Refused:
            self.is_refused = True
        else:
            self.once(1)

    def once(self, k: int) -> None:
        """Move everything to its k-th poses, and ask."""
        start = time.perf_counter()
        self.engine.move(k % 2)
        self.engine.ask(self.representation)
        self.times.append(time.perf_counter() - start)


def worst_errors(
    pairs: Sequence[Configuration], found: Sequence[Found]
) -> tuple[float, float, float]:
    """Return the worst errors of force, area and line of action; what is missing has no force."""
    force, area, centre = np.ones(len(pairs)), np.ones(len(pairs)), np.full(len(pairs), np.nan)
    for one in found:
        truth = pairs[one.pair]
        strength = float(np.linalg.norm(truth.force_W))
        force[one.pair] = np.linalg.norm(one.force_W - truth.force_W) / strength
        area[one.pair] = abs(one.area - truth.area) / truth.area
        centre[one.pair] = np.linalg.norm(one.moment_W) / strength
    worst = float(np.nanmax(centre)) if len(found) else np.nan
    return float(force.max()), float(area.max()), worst


def _row(task: Task, turn: _Turns, pairs: Sequence[Configuration]) -> Row:
    case, found = task.case, turn.found
    errors, faces, time_us = (np.nan,) * 3, np.nan, np.nan
    if not turn.is_refused:
        errors = worst_errors(pairs, found)
        faces = float(np.mean([one.faces for one in found])) if found else 0.0
        time_us = 1e6 * float(np.min(turn.times)) / max(len(found), 1)
    return Row(
        case.shapes, case.sides, case.detail, task.hint, turn.engine.name, turn.representation,
        len(pairs), len(found), faces, *errors, time_us,
    )  # fmt: skip


def measure(
    engines: Sequence[type[Engine]], task: Task, pairs: int, seconds: float, seed: int
) -> Iterator[Row]:
    """Yield a row for every engine and representation; they take turns, for so many seconds.

    The time is that of the fastest round. Every resolution of a case has the same pairs.
    """
    rng = np.random.default_rng([seed, zlib.crc32(task.case.name.encode())])
    configurations = draw(task.case, pairs, rng)
    hint = HINTS[0] if np.isnan(task.hint) else task.hint
    turns = []
    for make in engines:
        engine = make(configurations, hint)
        turns += [_Turns(engine, representation) for representation in REPRESENTATIONS]
    for turn in turns:
        turn.begin()
    asked = [turn for turn in turns if not turn.is_refused]
    each = sum(turn.times[0] for turn in asked)
    rounds = int(np.clip(seconds / max(each, 1e-9), MIN_ROUNDS, MAX_ROUNDS))
    gc.collect()
    for k in range(rounds):
        for i in range(len(asked)):
            asked[(i + k) % len(asked)].once(k)
    for turn in turns:
        yield _row(task, turn, configurations)
