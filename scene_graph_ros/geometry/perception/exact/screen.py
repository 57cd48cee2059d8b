"""The pixels that can see a body, and the nearest body of each so far."""

import math
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    any_of,
    load_lanes,
    select,
    store_lanes,
)
from scene_graph_ros.geometry.perception.exact.bodies import element

__all__ = ["Screen", "Sensor", "clear_screen", "keep_nearest", "pixels", "sphere_box"]

TIE = 1.0 - 2.0**-42
"""Where a body is not nearer than this share of another's depth, they are at the same place, and
the one with the smaller id is seen. It is more than rounding, and less than what is promised."""

_WIDER = 1.0 + 1e-9
"""Bounding balls are grown by this, far more than rounding, and cost no pixel."""


class Sensor(NamedTuple):
    """A camera S in the world, and its pixels."""

    R_WS: tuple[float, ...]
    """The rotation, row by row."""
    p_WS: tuple[float, float, float]
    """Metres."""
    focal: tuple[float, float]
    """fx and fy, in pixels."""
    center: tuple[float, float]
    """cx and cy, in pixels."""
    size: tuple[int, int]
    """Width and height, in pixels."""
    clipping: tuple[float, float]
    """The least and the greatest depth, in m."""
    margin: float
    """Pixels: more than what rounding moves a projected point by."""
    x: np.ndarray
    """(width + LANES,) tangents of the columns: the ray of pixel (u, v) is (x[u], y[v], 1)."""
    y: np.ndarray
    """(height,) tangents of the rows."""


class Screen(NamedTuple):
    """Each pixel's nearest body. Rows are longer than the image, so lanes may run over."""

    depth: np.ndarray
    """(height, width + LANES) metres; inf where nothing is."""
    seen: np.ndarray
    """(height, width + LANES) what is there, as ``element`` numbers it; -1 where nothing is."""


@lean_kernel
def clear_screen(screen):
    """Make every pixel see nothing."""
    for place in range(screen.depth.size):
        screen.depth.flat[place] = np.inf
        screen.seen.flat[place] = -1.0


@inlined_kernel
def keep_nearest(screen, place, is_hit, depth, row, number):
    """Let eight pixels see an element of a body where it is nearer than theirs.

    Bodies come in the order of their rows. Where two are as near to rounding, as coplanar faces
    are, the first stays; of one body, the nearest is seen.
    """
    known, seen = load_lanes(screen.depth, place), load_lanes(screen.seen, place)
    is_nearer = is_hit & (depth < select(seen < element(row, 0), TIE * known, known))
    if any_of(is_nearer):
        store_lanes(screen.depth, place, select(is_nearer, depth, known))
        store_lanes(screen.seen, place, select(is_nearer, number, seen))


@inlined_kernel
def pixels(sensor, axis, lowest, highest):
    """Return (first, last) pixel of an axis between two coordinates; first > last if none is."""
    first = max(0.0, math.ceil(lowest - sensor.margin))
    last = min(sensor.size[axis] - 1.0, math.floor(highest + sensor.margin))
    if not first <= last:
        return 1, 0
    return int(first), int(last)


@inlined_kernel
def _slopes(across, ahead, radius, near):
    """Return the least and the greatest tangent at which a ball is seen.

    Exact where all of it is ahead, by the two tangents to its circle; else bounds of the part
    beyond the near plane.
    """
    if ahead - radius > near and ahead > _WIDER * _WIDER * radius:
        square = (ahead - radius) * (ahead + radius)
        half = radius * math.sqrt(across * across + square)
        return (across * ahead - half) / square, (across * ahead + half) / square
    farthest = ahead + radius
    low, high = across - radius, across + radius
    return (
        low / (near if low < 0.0 else farthest),
        high / (near if high > 0.0 else farthest),
    )


@lean_kernel
def sphere_box(sensor, p_SB, radius):
    """Return (u0, u1, v0, v1), the pixels that can see a ball; u0 > u1 or v0 > v1 if none can."""
    near, far = sensor.clipping
    radius = _WIDER * radius
    if not (p_SB[2] + radius >= near and p_SB[2] - radius <= far):
        return 1, 0, 1, 0
    low, high = _slopes(p_SB[0], p_SB[2], radius, near)
    fx, fy = sensor.focal
    cx, cy = sensor.center
    u0, u1 = pixels(sensor, 0, fx * low + cx, fx * high + cx)
    low, high = _slopes(p_SB[1], p_SB[2], radius, near)
    v0, v1 = pixels(sensor, 1, fy * low + cy, fy * high + cy)
    return u0, u1, v0, v1
