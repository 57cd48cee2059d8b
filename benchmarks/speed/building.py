"""How long it takes to build the compliant bodies of a scene: meshes, fields, trees.

Ours are built when they are first asked for, Drake's when they are registered. What is timed is
everything from nothing to the first contact surfaces, less everything from nothing to the first
collision candidates of the same scene without compliance. Each round has shapes of its own, so
that no engine has them already.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import time
from typing import Any

import numpy as np

from benchmarks.speed.engines.engine import Engine
from benchmarks.speed.measure import Measurement, SLOW
from benchmarks.speed.rows import BUILDING
from benchmarks.speed.scenes import Scene

__all__ = ["measure_building"]

_ROUNDS = 3


def _seconds(engine: type[Engine], scene: Scene, ask: Callable[[Any], Any]) -> float:
    """Return the time from nothing to an answer."""
    start = time.perf_counter()
    one = engine(scene)
    one.move(0)
    ask(one)
    return time.perf_counter() - start


def measure_building(
    engines: Sequence[Engine], make: Callable[[int], Scene], seed: int
) -> list[Measurement]:
    """Build scenes of the seeds after ``seed`` with every engine that has contact surfaces."""
    kinds = [type(engine) for engine in engines if hasattr(engine, "surfaces")]
    times: dict[type[Engine], list[float]] = {kind: [] for kind in kinds}
    for k in range(_ROUNDS):
        scene = make(seed + 1 + k)
        for kind, taken in times.items():
            if taken and max(taken) > SLOW:
                continue
            without = _seconds(kind, replace(scene, compliance=None), lambda one: one.candidates())
            taken.append(_seconds(kind, scene, lambda one: one.surfaces("triangle")) - without)
    return [_measurement(scene, kind.name, taken) for kind, taken in times.items()]


def _measurement(scene: Scene, engine: str, seconds: list[float]) -> Measurement:
    low, median, high = 1e3 * np.quantile(seconds, [0.1, 0.5, 0.9])
    rounds, n = len(seconds), scene.size
    return Measurement(scene.key, n, BUILDING.key, engine, rounds, median, low, high, n)
