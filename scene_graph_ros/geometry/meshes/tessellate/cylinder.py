"""Cylinders: prisms over regular polygons, cut along the medial axis.

The medial axis of a long cylinder is a segment, of a flat one a disk, of one as long as wide a
point, and a cone from each rim to it. The extent is 1 on segment, disk or point and falls linearly
to 0 on the surface, as the distance does. Along the axis and across the caps nothing is gained by
smaller elements, so only the circumference is divided.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.tessellate.counts import (
    checked_count,
    divisions,
    required_hint,
)
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.spatial.elementary import sines_and_cosines
from scene_graph_ros.geometry.tolerances import MEDIAL_AXIS

__all__ = ["surface_cylinder", "volume_cylinder"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_FEWEST_SIDES = 6
_POINT, _SEGMENT, _DISK = range(3)
_TETRAHEDRA_PER_SIDE = {_POINT: 4, _SEGMENT: 5, _DISK: 9}


def surface_cylinder(
    shape: Cylinder, resolution_hint: float | None
) -> tuple[FloatArray, IntArray]:
    """Return vertices (v, 3), m, on the surface and triangles (t, 3).

    No edge along a rim is longer than the hint. Raises PropertyError without a hint, MeshError
    for too many triangles.
    """
    return volume_cylinder(shape, resolution_hint).surface()


def volume_cylinder(shape: Cylinder, resolution_hint: float | None, margin: float = 0.0) -> Solid:
    """Return the solid; ``margin`` (m) moves side and caps out. Raises as ``surface_cylinder``."""
    hint = required_hint(shape, resolution_hint)
    radius, half = shape.radius, 0.5 * shape.length
    n = divisions(2.0 * math.pi * radius, hint, at_least=_FEWEST_SIDES)
    medial_radius, medial_half = max(radius - half, 0.0), max(half - radius, 0.0)
    medial = _POINT
    if medial_half > MEDIAL_AXIS * half:
        medial = _SEGMENT
    elif medial_radius > MEDIAL_AXIS * radius:
        medial = _DISK
    checked_count(shape, hint, radius, _TETRAHEDRA_PER_SIDE[medial] * n)
    circle, tetrahedra, triangles = _topology(n, medial)
    rims, inner = 2 * n + 2, {_POINT: 1, _SEGMENT: 2, _DISK: n + 1}[medial]
    vertices = np.zeros((rims + inner, 3))
    vertices[: 2 * n, :2] = (radius + margin) * circle
    vertices[:rims, 2] = half + margin
    vertices[:n, 2] *= -1.0
    vertices[2 * n, 2] *= -1.0
    if medial == _SEGMENT:
        vertices[rims:, 2] = -medial_half, medial_half
    elif medial == _DISK:
        vertices[rims + 1 :, :2] = medial_radius * circle[:n]
    extent = np.ones(len(vertices))
    extent[:rims] = -margin / min(radius, half) if margin else 0.0
    return Solid(vertices, tetrahedra, triangles, extent)


@lru_cache(maxsize=64)
def _topology(n: int, medial: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the unit circle twice (2 n, 2), tetrahedra and triangles for n sides; read-only.

    Vertices are the lower rim, the upper rim, the centres of the lower and of the upper cap, then
    the medial axis: its point; its lower and its upper end; or its centre and its rim.
    """
    k = np.arange(n)
    angles = k * (2.0 * math.pi / n)
    circle = np.tile(np.column_stack(sines_and_cosines(angles)[::-1]), (2, 1))
    low, low_next = k, np.roll(k, -1)
    high, high_next = low + n, low_next + n
    bottom, top = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    first = np.full(n, 2 * n + 2)
    outside = [
        (bottom, low_next, low),
        (top, high, high_next),
        (low, low_next, high_next),
        (low, high_next, high),
    ]
    if medial == _DISK:
        inner, inner_next = first + 1 + k, first + 1 + low_next
        inside = [
            *_star(outside[:2], first),
            *_star(outside[2:], inner_next),
            (low, inner, high, inner_next),
            (high, high_next, inner_next, first),
            (high, inner_next, inner, first),
            (low, inner_next, low_next, first),
            (low, inner, inner_next, first),
        ]
    elif medial == _SEGMENT:
        end = first + 1
        inside = [
            *_star(outside[:1], first),
            *_star(outside[1:], end),
            (first, low, low_next, end),
        ]
    else:
        inside = _star(outside, first)
    triangles = np.concatenate([np.stack(rows, axis=1) for rows in outside])
    tetrahedra = np.concatenate([np.stack(rows, axis=1) for rows in inside])
    for array in (circle, tetrahedra, triangles):
        array.flags.writeable = False
    return circle, tetrahedra, triangles


def _star(outside: Sequence[tuple[IntArray, ...]], apex: IntArray) -> list[tuple[IntArray, ...]]:
    """Join outward triangles with an inner vertex."""
    return [(apex, *triangle) for triangle in outside]
