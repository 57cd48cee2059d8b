"""What the tiers cost in a scene: 1000 mixed shapes, every pose new before every query."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import time
from typing import Any

import numpy as np

from benchmarks.accuracy.measure import Row
from benchmarks.accuracy.words import SCENE_DISTANCE, SCENE_PENETRATION
from benchmarks.speed.engines.ours import Ours
from benchmarks.speed.make_scenes import mixed, SETS
from scene_graph_ros.geometry.accuracy import Accuracy

__all__ = ["measure_scene"]

_SHAPES = 1000
_ROUNDS = 5
_MAX_DISTANCE = 0.1

_ASK: dict[str, Callable[..., Any]] = {
    SCENE_PENETRATION: lambda query, **how: query.compute_point_pair_penetration(**how),
    SCENE_DISTANCE: lambda query, **how: query.compute_signed_distance_pairwise_closest_points(
        _MAX_DISTANCE, **how
    ),
}


def measure_scene(seed: int) -> Iterator[Row]:
    """Yield a row for every query and tier: the time of a whole query, poses included.

    It is the median over the sets of poses of the fastest of some rounds.
    Nothing is known of the scene's true distances, so the errors are NaN.
    """
    ours = Ours(mixed(_SHAPES, seed))
    for name, ask in _ASK.items():
        times = {tier: np.full(SETS, np.inf) for tier in Accuracy}
        pairs = 0
        for _ in range(_ROUNDS):
            for tier, least in times.items():
                for k in [*range(SETS), *range(SETS - 2, 0, -1)]:  # there and back
                    start = time.perf_counter()
                    ours.move(k)
                    pairs = max(pairs, len(ask(ours.query, accuracy=tier)))
                    least[k] = min(least[k], time.perf_counter() - start)
        for tier, least in times.items():
            microseconds = 1e6 * float(np.median(least))
            missing = (np.nan,) * 3
            yield Row(name, "mixed", "mixed", np.nan, tier.value, pairs, *missing, microseconds)
