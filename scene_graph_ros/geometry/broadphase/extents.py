"""How far shapes reach along a direction: one formula for all kinds, and so without a branch.

Along the unit vector u, with components x in G, a shape reaches from its centre c as far as

    |(a_0 x_0, a_1 x_1, a_2 x_2)| + b_0 |x_0| + b_1 |x_1| + b_2 |x_2| + r

both ways: an ellipsoid has semi-axes a, a box half extents b, a ball the radius r, a capsule r and
one b, a cylinder two a and one b. A hull is in its box in G, and also in a ball around its centre.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = [
    "BALL",
    "BOX_PART",
    "NUMBERS",
    "OFFSET",
    "RADIUS",
    "ROUND_PART",
    "centres_of",
    "extents_of",
    "half_extent",
]

FloatArray = NDArray[np.float64]

NUMBERS = 8
"""Of a row of extents."""
ROUND_PART, RADIUS, BOX_PART, OFFSET = 0, 3, 4, 7
"""Where it has a, r, b and the sum of the sizes of c's coordinates."""
BALL = 3
"""Where a row of centres has the radius of the ball around c: infinite if it tells no more."""


_PLACES: dict[ShapeKind, tuple[tuple[int, int], ...]] = every_kind(
    "extents",
    {
        ShapeKind.SPHERE: ((RADIUS, 0),),
        ShapeKind.CAPSULE: ((RADIUS, 0), (BOX_PART + 2, 1)),
        ShapeKind.BOX: tuple((BOX_PART + axis, axis) for axis in range(3)),
        ShapeKind.CYLINDER: ((ROUND_PART, 0), (ROUND_PART + 1, 0), (BOX_PART + 2, 1)),
        ShapeKind.ELLIPSOID: tuple((ROUND_PART + axis, axis) for axis in range(3)),
        # Half spaces have no numbers, hulls those of their boxes.
        ShapeKind.HALF_SPACE: (),
        ShapeKind.CONVEX: (),
        ShapeKind.MESH: (),
    },
)
"""Where a row has the numbers of a shape: places, and columns of its size."""


def extents_of(table: ShapeTable) -> FloatArray:
    """Return the (n, NUMBERS) rows for ``half_extent``; a half space reaches infinitely far."""
    kind, size = table.kind, table.size
    rows = np.zeros((len(kind), NUMBERS))
    for wanted, places in _PLACES.items():
        for place, column in places:
            rows[kind == wanted, place] = size[kind == wanted, column]
    rows[kind == ShapeKind.HALF_SPACE, RADIUS] = math.inf
    is_hull = table.hull >= 0
    rows[is_hull, BOX_PART : BOX_PART + 3] = 0.5 * (table.upper - table.lower)[is_hull]
    offsets = 0.5 * np.abs(table.lower[is_hull] + table.upper[is_hull])
    rows[is_hull, OFFSET] = offsets.sum(axis=1)
    return rows


def centres_of(table: ShapeTable) -> FloatArray:
    """Return (n, 4): the centre in G, and the radius of a ball around it that holds the row."""
    rows = np.zeros((len(table.kind), 4))
    rows[:, BALL] = math.inf
    is_hull = table.hull >= 0
    if not is_hull.any():
        return rows
    rows[is_hull, :3] = 0.5 * (table.lower[is_hull] + table.upper[is_hull])
    # Rows share hulls: each hull's ball is found once.
    start = table.hulls.vertex_start
    centres = np.zeros((len(start) - 1, 3))
    centres[table.hull[is_hull]] = rows[is_hull, :3]
    away = table.hulls.vertices - np.repeat(centres, np.diff(start), axis=0)
    radii = np.maximum.reduceat(np.linalg.norm(away, axis=1), start[:-1])
    rows[is_hull, BALL] = radii[table.hull[is_hull]]
    return rows


@inlined_kernel
def half_extent(extents, i, x, y, z):
    """Return the support of row i, less its radius, along (x, y, z) in G, times the length."""
    a, b, c = extents[i, 0] * x, extents[i, 1] * y, extents[i, 2] * z
    flat = extents[i, 4] * abs(x) + extents[i, 5] * abs(y) + extents[i, 6] * abs(z)
    return math.sqrt(a * a + b * b + c * c) + flat
