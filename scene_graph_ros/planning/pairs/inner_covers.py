"""Balls and boxes that are inside bodies: where these overlap, so do the bodies."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    every,
    LANES,
    larger,
    load_lanes,
    magnitude,
    root,
)
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = ["INNER", "farthest_apart", "inner_covers"]

INNER = 5
"""Numbers of a body: the radius of a ball, half the edges of a box, and the radius of a ball that
is moved through this box. All have the centre of the ball around the body; all is in it."""

_ROUNDING = 1.0 - 1e-12
"""Times lengths: far more than rounding adds to them."""

_UNKNOWN = (-np.inf, 0.0, 0.0, 0.0, -np.inf)


def inner_covers(
    table: ShapeTable, rows: NDArray[np.int64], centers: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return balls inside of the bodies of these rows ``(b, INNER)``, around centres in G.

    Nothing is known of half spaces, nor of meshes that are measured by their triangles.
    """
    result = np.empty((len(rows), INNER))
    for b, row in enumerate(rows):
        result[b] = _inner(table, int(row), centers[b])
    return result


_RADII: dict[ShapeKind, Callable[[float, float, float], float] | None] = every_kind(
    "balls inside of shapes",
    {
        ShapeKind.SPHERE: lambda x, y, z: x,
        ShapeKind.CAPSULE: lambda x, y, z: x,
        ShapeKind.BOX: min,
        ShapeKind.CYLINDER: lambda x, y, z: min(x, y),
        ShapeKind.ELLIPSOID: min,
        ShapeKind.HALF_SPACE: lambda x, y, z: 0.0,
        # By their faces.
        ShapeKind.CONVEX: None,
        ShapeKind.MESH: None,
    },
)


def _inner(table: ShapeTable, row: int, center: NDArray[np.float64]) -> tuple[float, ...]:
    x, y, z = table.size[row]
    kind = ShapeKind(table.kind[row])
    if kind is ShapeKind.BOX:
        return _ROUNDING * min(x, y, z), x, y, z, 0.0
    of_size = _RADII[kind]
    if of_size is not None:
        radius = of_size(x, y, z)
    else:
        hull, hulls = table.hull[row], table.hulls
        faces = slice(hulls.face_start[hull], hulls.face_start[hull + 1])
        beyond = hulls.face_offsets[faces] - product(hulls.face_normals[faces], center)
        radius = beyond.min(initial=np.inf) if not table.exact[row] else 0.0
    if not 0.0 < radius < np.inf:
        return _UNKNOWN
    return _ROUNDING * radius, 0.0, 0.0, 0.0, _ROUNDING * radius


@inlined_kernel
def farthest_apart(bodies, a, b, places):
    """Return upper bounds of two bodies' distances, in lanes; infinite where nothing is known."""
    X, center, other = places.X_WG[b], places.centers[a], places.centers[b]
    x = load_lanes(center, 0) - load_lanes(other, 0)
    y = load_lanes(center, LANES) - load_lanes(other, LANES)
    z = load_lanes(center, 2 * LANES) - load_lanes(other, 2 * LANES)
    square = every(0.0)
    for i in range(3):
        along = load_lanes(X, i * LANES) * x + load_lanes(X, (4 + i) * LANES) * y
        along = along + load_lanes(X, (8 + i) * LANES) * z
        beyond = larger(magnitude(along) - bodies.inner[b, 1 + i], 0.0)
        square = square + beyond * beyond
    return root(square) - (bodies.inner[a, 0] + bodies.inner[b, 4])
