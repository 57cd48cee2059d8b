"""Ellipsoids, spheres among them: a geodesic sphere under an affine map, a star from the centre.

The extent is 1 at the centre and falls linearly to 0 on the surface along every ray, which a star
of tetrahedra represents without error. It is the affine image of the sphere's, so off the axes of
symmetry it is not the distance to the surface.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.tessellate.counts import (
    checked_count,
    divisions,
    required_hint,
)
from scene_graph_ros.geometry.meshes.tessellate.geodesic import (
    geodesic_sphere,
    LONGEST_SPHERE_EDGE,
    star,
)
from scene_graph_ros.geometry.meshes.tessellate.solid import Solid
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.sphere import Sphere

__all__ = ["surface_ellipsoid", "volume_ellipsoid"]


def _semi_axes(shape: Sphere | Ellipsoid) -> tuple[float, float, float]:
    if isinstance(shape, Ellipsoid):
        return (shape.a, shape.b, shape.c)
    if shape.radius == 0.0:
        raise MeshError(f"{shape!r} is a point: it has no surface and no volume")
    return (shape.radius, shape.radius, shape.radius)


def _frequency(shape: Sphere | Ellipsoid, hint: float, axes: tuple[float, float, float]) -> int:
    """Return the frequency at which no edge is longer than the hint."""
    largest = max(axes)
    f = divisions(LONGEST_SPHERE_EDGE * largest, hint, at_least=1)
    checked_count(shape, hint, largest, 20 * f * f)
    return f


def surface_ellipsoid(
    shape: Sphere | Ellipsoid, resolution_hint: float | None
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return vertices on the surface (v, 3), m, and triangles (t, 3); no edge exceeds the hint.

    Raises PropertyError without a hint, MeshError for a point or too many triangles.
    """
    axes = _semi_axes(shape)
    hint = required_hint(shape, resolution_hint)
    sphere, triangles = geodesic_sphere(_frequency(shape, hint, axes))
    return sphere * axes, triangles


def volume_ellipsoid(
    shape: Sphere | Ellipsoid, resolution_hint: float | None, margin: float = 0.0
) -> Solid:
    """Return the solid; ``margin`` (m) moves each vertex out along its ray.

    A vertex moves so far that its tangent plane moves by the margin. Raises as
    ``surface_ellipsoid`` does.
    """
    axes = _semi_axes(shape)
    hint = required_hint(shape, resolution_hint)
    sphere, triangles = geodesic_sphere(_frequency(shape, hint, axes))
    count = len(sphere)
    # The support function of the ellipsoid at the normal of A u is 1 / |A^-1 u|.
    beyond = margin * np.linalg.norm(sphere / axes, axis=1) if margin else np.zeros(count)
    vertices = np.zeros((count + 1, 3))
    vertices[:-1] = sphere * axes * (1.0 + beyond)[:, None]
    extent = np.ones(count + 1)
    extent[:-1] = -beyond
    return Solid(vertices, star(triangles, count), triangles, extent)
