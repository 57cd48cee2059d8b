"""Capsules: two domes and a prism, joined with the ends of the segment that is their medial axis.

The extent is 1 on the segment and falls linearly to 0 on the surface, as the distance does.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.tessellate.counts import (
    checked_count,
    divisions,
    required_hint,
)
from scene_graph_ros.geometry.meshes.tessellate.geodesic import (
    geodesic_dome,
    LONGEST_DOME_EDGE,
    star,
)
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.shapes.capsule import Capsule

__all__ = ["surface_capsule", "volume_capsule"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def surface_capsule(shape: Capsule, resolution_hint: float | None) -> tuple[FloatArray, IntArray]:
    """Return vertices on the surface (v, 3), m, and triangles (t, 3).

    No edge is longer than the hint, but those along the axis, where the surface is straight.
    Raises PropertyError without a hint, MeshError for too many triangles.
    """
    return volume_capsule(shape, resolution_hint).surface()


def volume_capsule(shape: Capsule, resolution_hint: float | None, margin: float = 0.0) -> Solid:
    """Return the solid; ``margin`` (m) adds to the radius. Raises as ``surface_capsule``."""
    hint = required_hint(shape, resolution_hint)
    f = divisions(LONGEST_DOME_EDGE * shape.radius, hint, at_least=1)
    checked_count(shape, hint, shape.radius, 8 * f * f + 12 * f)
    dome, tetrahedra, triangles = _topology(f)
    half = 0.5 * shape.length
    n = len(dome)
    vertices = np.zeros((2 * n + 2, 3))
    vertices[:n] = (shape.radius + margin) * dome
    vertices[n:-2] = vertices[:n]
    vertices[n:-2, 2] *= -1.0
    vertices[:n, 2] += half
    vertices[n:-2, 2] -= half
    vertices[-2:, 2] = half, -half
    extent = np.ones(len(vertices))
    extent[:-2] = -margin / shape.radius if margin else 0.0
    return Solid(vertices, tetrahedra, triangles, extent)


@lru_cache(maxsize=32)
def _topology(f: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the upper dome's vertices, all tetrahedra and all triangles; read-only.

    Vertices are those of the upper dome, of the lower one, the upper and the lower end of the
    segment.
    """
    dome, upper, rim = geodesic_dome(f)
    n = len(dome)
    lower = (upper + n)[:, ::-1]
    c, d = np.roll(rim, -1), rim
    a, b = d + n, c + n
    end, start = np.full(len(rim), 2 * n), np.full(len(rim), 2 * n + 1)
    prism = [(start, a, b, end), (a, c, b, end), (a, d, c, end)]
    side = [(a, b, c), (a, c, d)]
    inside = [np.stack(rows, axis=1) for rows in prism]
    tetrahedra = np.concatenate([star(upper, 2 * n), star(lower, 2 * n + 1), *inside])
    outside = [np.stack(rows, axis=1) for rows in side]
    triangles = np.ascontiguousarray(np.concatenate([upper, lower, *outside]))
    for array in (tetrahedra, triangles):
        array.flags.writeable = False
    return dome, tetrahedra, triangles
