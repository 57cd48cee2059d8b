"""Convex hulls whose faces are moved out.

The vertices are where the moved planes meet: they are the facets of the hull of the planes' polar
points ``n / (offset - n . c)`` about a point c inside (Preparata and Muller 1979).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.deepest_point import deepest_point
from scene_graph_ros.geometry.meshes.hull import convex_hull, Hull, triangles_of_hull
from scene_graph_ros.geometry.meshes.sources import hull_of
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.tolerances import DEEPEST_POINT

__all__ = ["make_convex_hull"]


def make_convex_hull(shape: MeshShape, margin: float = 0.0) -> Convex:
    """Return the convex hull of a Convex or Mesh with each of its faces moved out.

    The faces move by ``margin`` (m), so that corners move farther, and points within the margin of
    the hull are inside. It is a shape as any other: in contact surfaces it presses from its own
    faces on, where the property ``("hydroelastic", "margin")`` leaves the pressure as it is and
    adds a layer without force.

    Raises MeshError for another shape, a margin that is negative or not finite, and a hull that is
    flat, as a plane alone does not say where its edge goes.
    """
    if not isinstance(shape, MeshShape):
        raise MeshError(f"make_convex_hull: shape must be a Convex or Mesh, not {quoted(shape)}")
    distance = as_float(margin)
    if distance is None or not 0.0 <= distance < math.inf:
        raise MeshError(
            f"make_convex_hull: margin must be finite and at least 0, not {quoted(margin)}"
        )
    hull = hull_of(shape)
    if len(hull.faces) < 4:
        raise MeshError(f"make_convex_hull: {shape!r} is flat: it has no volume")
    return Convex(vertices=hull.vertices if distance == 0.0 else _moved(hull, distance, shape))


def _moved(hull: Hull, margin: float, shape: Any) -> NDArray[np.float64]:
    """Return the corners ``(v, 3)`` of the planes of a hull, each moved out by a distance."""
    centre, depth = deepest_point(
        hull.normals, hull.offsets, hull.vertices.mean(axis=0), DEEPEST_POINT
    )
    reach = hull.offsets + margin - (hull.normals * centre).sum(axis=1)
    if not depth > 0.0:
        raise MeshError(f"make_convex_hull: {shape!r} is too thin: no point is deep inside")
    # Of a length of about 1, whatever the size.
    size = depth + margin
    polar = convex_hull(hull.normals * (size / reach)[:, np.newaxis])
    facets = triangles_of_hull(polar)
    normals = polar.vertices[facets]
    corners = _solved(normals, np.ones((len(facets), 3)))
    # A step of refinement makes up for the rounding of Cramer's rule.
    corners += _solved(normals, 1.0 - (normals * corners[:, np.newaxis]).sum(axis=2))
    return np.asarray(convex_hull(centre + size * corners).vertices)


def _solved(rows: NDArray[np.float64], sides: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return x ``(m, 3)`` with ``rows @ x = sides``, of ``(m, 3, 3)`` and ``(m, 3)``."""
    others = np.cross(rows[:, [1, 2, 0]], rows[:, [2, 0, 1]])
    determinants = (rows[:, 0] * others[:, 0]).sum(axis=1)
    x: NDArray[np.float64] = (sides[:, :, np.newaxis] * others).sum(axis=1)
    return x / determinants[:, np.newaxis]
