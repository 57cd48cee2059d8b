"""Shapes as balls of one radius about the points of a hull, which a plane separates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.sources import hull_of
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.capsule import Capsule
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.shapes.cylinder import Cylinder
from scene_graph_ros.geometry.shapes.ellipsoid import Ellipsoid
from scene_graph_ros.geometry.shapes.half_space import HalfSpace
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.sphere import Sphere
from scene_graph_ros.planning.certified.errors import CertificateError

__all__ = ["RoundedHull", "rounded_hull"]

_SIDES = 8
"""Of the prism around a cylinder: its edges are farther from the axis by 8 %."""

_OUTWARDS = 1.0 + 1e-12
"""Times the prism's radius: far more than rounding takes off it."""


class RoundedHull(NamedTuple):
    """All points that are no farther than a radius (m) from the hull of points ``(k, 3)`` in G."""

    points: NDArray[np.float64]
    radius: float


def rounded_hull(shape: Shape, name: str) -> RoundedHull:
    """Return a shape, or an outer bound: of a cylinder a prism, of an ellipsoid its box.

    Of a mesh it is the hull. A half space has no points. Raises CertificateError, which says the
    geometry's ``name``, for other shapes.
    """
    if isinstance(shape, Sphere):
        return RoundedHull(np.zeros((1, 3)), shape.radius)
    if isinstance(shape, Capsule):
        half = 0.5 * shape.length
        return RoundedHull(np.array([[0.0, 0.0, half], [0.0, 0.0, -half]]), shape.radius)
    if isinstance(shape, (Box, Ellipsoid)):
        signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij")).reshape(3, -1).T
        size = (
            shape.size if isinstance(shape, Box) else 2.0 * np.array([shape.a, shape.b, shape.c])
        )
        return RoundedHull(signs * size, 0.0)
    if isinstance(shape, HalfSpace):
        return RoundedHull(np.zeros((0, 3)), 0.0)
    if isinstance(shape, Cylinder):
        angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
        radius = shape.radius / np.cos(np.pi / _SIDES) * _OUTWARDS
        ring = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        ends = [np.column_stack([ring, np.full(_SIDES, h * shape.length)]) for h in (-0.5, 0.5)]
        return RoundedHull(np.concatenate(ends), 0.0)
    if isinstance(shape, (Convex, Mesh)):
        return RoundedHull(np.asarray(hull_of(shape).vertices, dtype=np.float64), 0.0)
    raise CertificateError(
        f"geometry {name!r}: a {type(shape).__name__} has no separating planes here; ignore its"
        " pairs, or put a box around it"
    )
