"""Triangles to draw, where a viewer has no form of its own for a shape."""

from __future__ import annotations

from collections.abc import Iterator
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.hull import triangles_of_hull
from scene_graph_ros.geometry.meshes.sources import hulls_of, load_surface
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["Triangles", "capsule_triangles", "hull_triangles", "surface_triangles"]

_SEGMENTS = 16
"""Sides of a drawn capsule: enough to look round at a glance, few enough to send when it moves."""
_RINGS = 4
"""Rows of triangles in each cap of a drawn capsule."""


class Triangles(NamedTuple):
    """A triangle mesh in the frame G of its shape."""

    vertices: NDArray[np.float64]
    """``(n, 3)`` metres."""
    triangles: NDArray[np.int64]
    """``(t, 3)`` indices, counter-clockwise seen from outside."""


def capsule_triangles(capsule: Capsule) -> Triangles:
    """Return triangles whose corners lie on the capsule."""
    half_length = 0.5 * capsule.length
    vertices = [(0.0, 0.0, half_length + capsule.radius)]
    # Rings from the upper pole to the lower one; the two equators bound the cylindrical part.
    for cap, center in ((1.0, half_length), (-1.0, -half_length)):
        for k in range(_RINGS) if cap > 0 else reversed(range(_RINGS)):
            latitude = cap * 0.5 * math.pi * (_RINGS - 1 - k) / _RINGS
            ring_radius = capsule.radius * math.cos(latitude)
            z = center + capsule.radius * math.sin(latitude)
            for segment in range(_SEGMENTS):
                angle = 2.0 * math.pi * segment / _SEGMENTS
                vertices.append((ring_radius * math.cos(angle), ring_radius * math.sin(angle), z))
    vertices.append((0.0, 0.0, -half_length - capsule.radius))
    rings = 2 * _RINGS
    return Triangles(np.array(vertices), np.array(list(_ring_triangles(rings)), dtype=np.int64))


def _ring_triangles(rings: int) -> Iterator[tuple[int, int, int]]:
    """Join a pole (vertex 0), rings of _SEGMENTS vertices from top to bottom, and a pole."""
    last = 1 + rings * _SEGMENTS
    for segment in range(_SEGMENTS):
        after = (segment + 1) % _SEGMENTS
        yield 0, 1 + segment, 1 + after
        for ring in range(rings - 1):
            upper, lower = 1 + ring * _SEGMENTS, 1 + (ring + 1) * _SEGMENTS
            yield upper + segment, lower + segment, lower + after
            yield upper + segment, lower + after, upper + after
        bottom = last - _SEGMENTS
        yield bottom + segment, last, bottom + after


def surface_triangles(shape: MeshShape) -> Triangles:
    """Return the triangles of a mesh in G, its scale applied; raises MeshError if unreadable."""
    return Triangles(*load_surface(shape))


def hull_triangles(shape: MeshShape) -> Triangles:
    """Return the triangles of the convex hull of a mesh or of points, in G, the scale applied.

    Of a mesh in pieces they are those of all hulls. A flat hull has two sides; one without area
    has no triangles. Raises MeshError if the mesh is unreadable.
    """
    hulls = hulls_of(shape)
    starts = np.cumsum([0, *(len(hull.vertices) for hull in hulls)]).tolist()
    triangles = [triangles_of_hull(hull) + k for hull, k in zip(hulls, starts, strict=False)]
    return Triangles(np.concatenate([h.vertices for h in hulls]), np.concatenate(triangles))
