"""Nearest points of two segments, also parallel, crossing or without length."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, scale, unit
from scene_graph_ros.geometry.tolerances import PARALLEL

__all__ = ["nearest_on_segments"]

SETTLING = 2
"""Rounds of projecting either point on the other's segment: each keeps the distance or lessens it,
and one of the points is an end, which the first round finds."""


@kernel
def _clamp_to_unit(value):
    return min(max(value, -1.0), 1.0)


@kernel
def _closer(best, s, t, d, h, k):
    """Return the better of ``best`` and the points (s, t), as (square, s, t)."""
    offset = axpy(s, h, axpy(-t, k, scale(-1.0, d)))
    square = dot(offset, offset)
    return (square, s, t) if square < best[0] else best


@kernel
def _middle_of_overlap(d, h, hh, k, kk):
    """Return (is_overlapping, s, t) of parallel segments: opposite points, half way."""
    # Along h, in units of |h|, the first segment is [-1, 1] and the second [m - w, m + w].
    m, along = dot(d, h) / hh, dot(h, k)
    w = abs(along) / hh
    low, high = max(-1.0, m - w), min(1.0, m + w)
    s = 0.5 * (low + high)
    return low <= high, s, _clamp_to_unit((s - m) * hh / along) if along != 0.0 else 0.0


@kernel
def nearest_on_segments(d, h, k):
    """Return (s, t, normal): the nearest points s h and d + t k, with s and t in [-1, 1].

    The first segment reaches from -h to h, the second from d - k to d + k. Where both points are
    inside their segments, ``normal`` is their common unit normal; else it is zero. Where parallel
    segments overlap, the points are those half way along the overlap.
    """
    none = (0.0, 0.0, 0.0)
    hh, kk = dot(h, h), dot(k, k)
    n = cross(h, k)
    nn = dot(n, n)
    best = (math.inf, 0.0, 0.0)
    if nn <= PARALLEL * PARALLEL * hh * kk:
        if hh > 0.0 and kk > 0.0:
            is_overlapping, s, t = _middle_of_overlap(d, h, hh, k, kk)
            if is_overlapping:
                return s, t, none
    else:
        t = dot(cross(d, h), n) / nn
        # Projecting the second point keeps the pair opposite when nearly parallel lines leave
        # their place along each other undetermined.
        s = dot(axpy(t, k, d), h) / hh
        if abs(s) <= 1.0 and abs(t) <= 1.0:
            return s, t, unit(n, none)
    # The nearest points include an end of a segment.
    for end in (-1.0, 1.0):
        t = _clamp_to_unit((end * dot(h, k) - dot(d, k)) / kk) if kk > 0.0 else 0.0
        best = _closer(best, end, t, d, h, k)
        s = _clamp_to_unit((end * dot(h, k) + dot(d, h)) / hh) if hh > 0.0 else 0.0
        best = _closer(best, s, end, d, h, k)
    # Squares hide steps below the root of rounding along a segment; projecting does not.
    s, t = best[1], best[2]
    for _ in range(SETTLING):
        s = _clamp_to_unit((t * dot(h, k) + dot(d, h)) / hh) if hh > 0.0 else 0.0
        t = _clamp_to_unit((s * dot(h, k) - dot(d, k)) / kk) if kk > 0.0 else 0.0
    return s, t, none
