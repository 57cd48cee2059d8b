"""A set's volume by the share of its box that is inside."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_generator, as_nonnegative
from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["SampledVolume", "sample_volume"]

_BATCH = 1000
"""Points that are asked at once."""


@one_line()
class SampledVolume(NamedTuple):
    """An estimate, its relative standard error, NaN without a point inside, and the points."""

    volume: float
    rel_accuracy: float
    num_samples: int


def sample_volume(
    asked: Any, generator: np.random.Generator, desired_rel_accuracy: float, max_num_samples: int
) -> SampledVolume:
    """Estimate a volume as `ConvexSet.calc_volume_via_sampling` says."""
    label = f"{type(asked).__name__}.calc_volume_via_sampling"
    as_generator(generator, f"{label}: generator")
    desired = as_nonnegative(desired_rel_accuracy, f"{label}: desired_rel_accuracy")
    if desired > 1.0:
        raise ConvexSetError(f"{label}: desired_rel_accuracy must be at most 1, not {desired!r}")
    most = int(as_nonnegative(max_num_samples, f"{label}: max_num_samples"))
    if most < 1:
        raise ConvexSetError(
            f"{label}: max_num_samples must be at least 1, not {quoted(max_num_samples)}"
        )
    n = asked.ambient_dimension
    if n == 0:
        raise ConvexSetError(f"{label}: there is no volume in 0 dimensions")
    if asked.is_empty():
        return SampledVolume(0.0, math.nan, 0)
    bounds = bounds_of(asked)
    if bounds is None:
        raise ConvexSetError(f"{label}: the set is unbounded; intersect it with a box")
    lb, ub = bounds
    widths, hits, count, error = ub - lb, 0, 0, math.nan
    while count < most:
        batch = min(_BATCH, most - count)
        points = lb + generator.random((batch, n)) * widths
        hits += int(asked._holds(points).sum())
        count += batch
        if hits:
            error = math.sqrt((1.0 - hits / count) / hits)
            if error <= desired:
                break
    return SampledVolume(float(np.prod(widths)) * hits / count, error, count)
