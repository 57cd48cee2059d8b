"""Volumes between two bounds, from independent points or rays alone: no walk has to have mixed.

About the centre of an ellipsoid inside, a set reaches ``rho(u)`` along a way u, and its volume is
that of the ellipsoid times the mean of ``rho^n`` over ways that are uniform on the unit sphere. Of
rows that is a division for each. The mean of numbers between known bounds lies in the interval of
Maurer and Pontil, "Empirical Bernstein bounds and sample variance penalization", 2009, theorem 4.
Sets of other kinds count points of their box; the interval is that of Clopper and Pearson, 1934.
Each round of more samples may err with a share of the probability, so that it doesn't matter when
the rounds end.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_generator, as_nonnegative
from scene_graph_ros.convex.questions.axes import unit_ball_volume
from scene_graph_ros.convex.questions.ellipsoids import inscribed
from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.convex.solve.ellipsoids.inscribed import largest_inscribed
from scene_graph_ros.geometry.one_line import one_line

__all__ = ["VolumeInterval", "bernstein_interval", "clopper_pearson_interval", "volume_interval"]

_FIRST_ROUND = 4000
"""Samples of the first round; each further one has twice as many."""

_BATCH = 4000
"""Rays or points that are asked at once."""

_NO_WEIGHT = 1e-6
"""Of the largest: rows with less don't take part."""

_ROUNDING = 1e-9
"""Relative: what distances and their means are rounded by at most."""

_EXACT = 1e-12
"""Relative: what exact volumes are rounded by."""


@one_line()
class VolumeInterval(NamedTuple):
    """A volume is between ``lower`` and ``upper`` with the probability ``confidence`` or more.

    ``volume`` is the estimate, ``num_samples`` how many independent rays or points it is from; 0
    and a confidence of 1 where no chance was in it.
    """

    lower: float
    volume: float
    upper: float
    confidence: float
    num_samples: int


def volume_interval(
    asked: Any,
    generator: np.random.Generator,
    desired_rel_accuracy: float,
    confidence: float,
    max_num_samples: int,
) -> VolumeInterval:
    """Return an interval as `ConvexSet.calc_volume_interval` says."""
    label = f"{type(asked).__name__}.calc_volume_interval"
    as_generator(generator, f"{label}: generator")
    desired = as_nonnegative(desired_rel_accuracy, f"{label}: desired_rel_accuracy")
    sure = as_nonnegative(confidence, f"{label}: confidence")
    if not 0.0 < sure < 1.0:
        raise ConvexSetError(f"{label}: confidence must be between 0 and 1, not {sure!r}")
    most = int(as_nonnegative(max_num_samples, f"{label}: max_num_samples"))
    if most < 1:
        raise ConvexSetError(f"{label}: max_num_samples must be at least 1, not {most!r}")
    if asked.ambient_dimension == 0:
        raise ConvexSetError(f"{label}: there is no volume in 0 dimensions")
    if asked.is_empty():
        return VolumeInterval(0.0, 0.0, 0.0, 1.0, 0)
    if asked.has_exact_volume:
        volume = asked.calc_volume()
        return VolumeInterval(volume * (1 - _EXACT), volume, volume * (1 + _EXACT), 1.0, 0)
    bounds = bounds_of(asked)
    if bounds is None:
        raise ConvexSetError(f"{label}: the set is unbounded; intersect it with a box")
    rows = asked._linear_rows()
    if rows is None:
        return _rounds(_Points(asked, bounds), generator, desired, sure, most)
    return _rounds(_Rays(asked, rows[0], rows[1], bounds), generator, desired, sure, most)


def _rounds(
    source: _Points | _Rays,
    generator: np.random.Generator,
    desired: float,
    confidence: float,
    most: int,
) -> VolumeInterval:
    """Take more samples until the interval is as narrow as desired."""
    best, round_, goal = VolumeInterval(0.0, math.nan, math.inf, confidence, 0), 0, _FIRST_ROUND
    while True:
        goal = min(goal, most)
        while source.count < goal:
            source.take(generator, min(_BATCH, goal - source.count))
        round_ += 1
        error = (1.0 - confidence) * 6.0 / (math.pi * round_) ** 2
        low, middle, high = source.interval(error)
        lower, upper = max(best.lower, low), min(best.upper, high)
        best = VolumeInterval(lower, middle, upper, confidence, source.count)
        if upper - lower <= 2.0 * desired * middle or goal == most:
            return best
        goal *= 2


class _Points:
    """Points of a set's box, of which some are inside."""

    def __init__(self, asked: Any, bounds: tuple[np.ndarray, np.ndarray]) -> None:
        self.asked, (self.lb, self.ub) = asked, bounds
        self.count, self.hits = 0, 0

    def take(self, generator: np.random.Generator, size: int) -> None:
        """Draw some more."""
        points = self.lb + generator.random((size, len(self.lb))) * (self.ub - self.lb)
        self.hits += int(self.asked._holds(points).sum())
        self.count += size

    def interval(self, error: float) -> tuple[float, float, float]:
        """Return (lower, estimate, upper); the bounds hold but for a probability."""
        box = float(np.prod(self.ub - self.lb))
        low, high = clopper_pearson_interval(self.hits, self.count, error)
        return box * low, box * self.hits / self.count, box * high


class _Rays:
    """How far a polyhedron reaches along rays from the centre of the largest ellipsoid inside."""

    def __init__(
        self, asked: Any, A: np.ndarray, b: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]
    ) -> None:
        found = inscribed(asked)
        slack = b - A @ found.center
        named = np.linalg.norm(A, axis=1) > 0.0
        self.rows = (A[named] @ found.B) / slack[named, None]
        n = A.shape[1]
        self.unit = unit_ball_volume(n) * math.exp(np.linalg.slogdet(found.B)[1])
        self.most = _furthest(type(asked)(self.rows, np.ones(len(self.rows)))) ** n
        low, high = bounds
        self.box = float(np.prod(high - low)) / self.unit
        self.count, self.total, self.squares = 0, 0.0, 0.0

    def take(self, generator: np.random.Generator, size: int) -> None:
        """Draw some more."""
        n = self.rows.shape[1]
        ways = generator.normal(size=(size, n))
        ways /= np.linalg.norm(ways, axis=1)[:, None]
        powers = (ways @ self.rows.T).max(axis=1) ** -float(n)
        self.total += float(powers.sum())
        self.squares += float((powers**2).sum())
        self.count += size

    def interval(self, error: float) -> tuple[float, float, float]:
        """Return (lower, estimate, upper); the bounds hold but for a probability."""
        mean = self.total / self.count
        variance = max(0.0, self.squares / self.count - mean**2) * self.count
        variance /= max(self.count - 1, 1)
        half = bernstein_interval(variance, self.most - 1.0, self.count, error)
        rounding = _ROUNDING * mean
        low, high = max(1.0, mean - half - rounding), min(self.box, mean + half + rounding)
        return self.unit * low, self.unit * mean, self.unit * high


def _furthest(rounded: Any) -> float:
    """Return a bound of a polyhedron's radius ``a . y <= 1`` about the origin.

    With weights w of rows and ``-a . y <= h`` for all of them, ``sum w (1 - a.y) (h + a.y) >= 0``
    bounds ``sum w (a.y)^2``. With the largest ellipsoid's weights the squares add up to ``|y|^2``
    and the rows to nothing (John 1948); their residuals are in the bound.
    """
    A = rounded.A
    _, _, y = largest_inscribed(A)
    lengths = np.linalg.norm(A, axis=1)
    weights = np.where(y > _NO_WEIGHT * y.max(), y / lengths, 0.0)
    named = np.flatnonzero(weights)
    weights, rows = weights[named], A[named]
    reached = [rounded.support(-row) for row in rows]
    h = max(each.value + each.gap for each in reached)
    least = float(np.linalg.eigvalsh(rows.T @ (weights[:, None] * rows))[0])
    tilt = abs(1.0 - h) * float(np.linalg.norm(weights @ rows))
    # least r^2 <= h sum w + tilt r
    root = tilt + math.sqrt(tilt**2 + 4.0 * least * h * float(weights.sum()))
    return root / (2.0 * least) * (1.0 + _ROUNDING)


def bernstein_interval(variance: float, width: float, count: int, error: float) -> float:
    """Return a bound of a mean's distance from that of ``count`` samples in an interval.

    But for a probability ``error``, of both sides together; ``variance`` is that of the samples.
    """
    if count < 2:
        return width
    log = math.log(4.0 / error)
    return math.sqrt(2.0 * variance * log / count) + 7.0 * width * log / (3.0 * (count - 1))


def clopper_pearson_interval(hits: int, count: int, error: float) -> tuple[float, float]:
    """Return bounds of a share of which so many hits were found, but for a probability."""
    from scipy.special import betaincinv

    low = float(betaincinv(hits, count - hits + 1, 0.5 * error)) if hits else 0.0
    high = float(betaincinv(hits + 1, count - hits, 1.0 - 0.5 * error)) if hits < count else 1.0
    return low, high
