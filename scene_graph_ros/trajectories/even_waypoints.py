"""Points that are dense along a curve, replaced by fewer ones evenly along it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

__all__ = ["even_points"]

Array = NDArray[np.float64]

_SOFT = 0.5
"""rad: a point at which a path turns by more is a corner."""

_BULGE = 2e-3
"""Of a path's extent: how far a curve through points may be from the edges between them."""

_FEWEST = 5
"""Edges in turn that may be those of a curve."""

_TURN = 0.3
"""rad: by how much the path turns at most at each of the points that replace others."""

_FIRST, _MORE = 4, 1.4
"""Edges that are tried first, and times how many next."""

_EVEN = 1.15
"""Times the mean edge: the longest one, of points that are even already."""


def even_points(
    points: Array, units: Array, always: NDArray[np.bool_], deviation: Array | None = None
) -> tuple[Array, NDArray[np.bool_]]:
    """Return points ``(m, k)`` of which those that are dense along a curve are evenly apart.

    Between corners, where at least five edges turn a little each, so that the cubic spline through
    their points is nowhere farther than 0.2 % of the path's extent from them, the points are
    replaced by points of the spline: so many, that the path turns by at most 0.3 rad at each. The
    curve does not depend on how many points there were, then, nor on how uneven they are. Those
    that are ``always`` there remain; they are marked in the second array.
    """
    if len(points) <= _FEWEST:
        return points, always
    scaled = points / units
    tolerance = _BULGE * float(np.ptp(scaled, axis=0).max())
    if deviation is not None:
        tolerance = min(tolerance, float((deviation / units).min()))
    lengths = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
    if not (lengths > 0.0).all():
        return points, always
    turns = _turns(scaled)
    soft = (turns < _SOFT) & ~always[1:-1]
    around = np.concatenate([[0.0], turns]) + np.concatenate([turns, [0.0]])
    # The spline's distance from an edge is about an eighth of its length times its turn.
    gentle = lengths * around / 16.0 <= tolerance
    corners = np.concatenate([[True], ~(soft & gentle[:-1] & gentle[1:]), [True]])
    parts, marks = [points[:1]], [always[:1]]
    for low, high in pairwise(np.flatnonzero(corners)):
        part = points[low + 1 : high + 1]
        if high - low >= _FEWEST:
            part = _evened(points[low : high + 1], units, tolerance)
        mark = np.zeros(len(part), dtype=np.bool_)
        mark[-1] = always[high]
        parts.append(part)
        marks.append(mark)
    return np.concatenate(parts), np.concatenate(marks)


def _evened(points: Array, units: Array, tolerance: float) -> Array:
    """Return even points of the spline through points, without the first."""
    scaled = points / units
    lengths = np.linalg.norm(np.diff(scaled, axis=0), axis=1)
    at = np.concatenate([[0.0], lengths.cumsum()])
    spline, last = CubicSpline(at, scaled), float(at[-1])
    count = float(_FIRST)
    while count <= len(lengths):
        places = np.linspace(0.0, last, int(count) + 1)
        found = spline(places)
        found[[0, -1]] = scaled[[0, -1]]
        chords = np.stack([np.interp(at, places, row) for row in found.T], axis=1)
        if _turns(found).max() <= _TURN and np.abs(chords - scaled).max() <= 2.0 * tolerance:
            return np.concatenate([found[1:-1] * units, points[-1:]])
        count *= _MORE
    if lengths.max() <= _EVEN * lengths.mean():
        return points[1:]
    places = np.linspace(0.0, last, len(lengths) + 1)
    return np.concatenate([spline(places[1:-1]) * units, points[-1:]])


def _turns(points: Array) -> Array:
    """Return by which angle a path turns at each point between its ends, rad."""
    ways = np.diff(points, axis=0)
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    apart: Array = np.linalg.norm(np.diff(ways, axis=0), axis=1)
    return 2.0 * np.arcsin(np.minimum(0.5 * apart, 1.0))
