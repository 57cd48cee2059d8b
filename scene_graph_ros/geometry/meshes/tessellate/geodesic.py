"""The unit sphere and half of it as geodesic polyhedra, and stars of tetrahedra."""

from __future__ import annotations

from functools import lru_cache
import itertools
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.spatial.elementary import arc_tangents, sines_and_cosines
from scene_graph_ros.geometry.spatial.sums import determinant, product

__all__ = [
    "LONGEST_DOME_EDGE",
    "LONGEST_SPHERE_EDGE",
    "geodesic_dome",
    "geodesic_sphere",
    "star",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))
_ICOSAHEDRON_ANGLE = 1.1071487177940904  # The arc of the tangent 2.
_OCTAHEDRON_ANGLE = 0.5 * math.pi

LONGEST_SPHERE_EDGE = 1.304
"""Times 1 / f: no edge of ``geodesic_sphere(f)`` is longer."""

LONGEST_DOME_EDGE = 2.32
"""Times 1 / f: no edge of ``geodesic_dome(f)`` is longer."""


@lru_cache(maxsize=1)
def _icosahedron() -> tuple[FloatArray, IntArray]:
    """Return (12, 3) unit vertices and (20, 3) triangles, counter-clockwise from outside."""
    signs = np.array(list(itertools.product((1.0, -1.0), (_GOLDEN, -_GOLDEN))))
    flat = np.column_stack([np.zeros(4), signs])
    vertices = np.concatenate([np.roll(flat, k, axis=1) for k in range(3)])
    vertices /= math.sqrt(1.0 + _GOLDEN**2)
    gram = product(vertices, vertices.T)
    near = (gram > 0.0) & (gram < 0.9)
    triangles = []
    for a, b, c in itertools.combinations(range(12), 3):
        if near[a, b] and near[b, c] and near[c, a]:
            outward = determinant(vertices[[a, b, c]]) > 0.0
            triangles.append((a, b, c) if outward else (a, c, b))
    return vertices, np.array(triangles, dtype=np.int64)


def _numbering(triangles: IntArray, f: int) -> tuple[list[IntArray], int]:
    """Give numbers to the lattice points of all faces, to shared ones once; corners keep theirs.

    Returns:
        Per face (f+1, f+1) with entry (j, k) the number of the point with weights (f-j-k, j, k),
        and how many numbers there are.

    """
    edges: dict[tuple[int, int], int] = {}
    count = int(triangles.max()) + 1
    inside = np.arange(1, f)
    tables = []
    for a, b, c in triangles.tolist():
        table = np.full((f + 1, f + 1), -1, dtype=np.int64)
        table[0, 0], table[f, 0], table[0, f] = a, b, c
        sides = (
            (a, b, inside, 0 * inside),
            (b, c, f - inside, inside),
            (a, c, 0 * inside, inside),
        )
        for start, end, j, k in sides:
            key = (min(start, end), max(start, end))
            if key not in edges:
                edges[key] = count
                count += f - 1
            along = inside - 1 if start < end else f - 1 - inside
            table[j, k] = edges[key] + along
        j, k = np.nonzero(np.add.outer(inside, inside) < f)
        table[j + 1, k + 1] = count + np.arange(len(j))
        count += len(j)
        tables.append(table)
    return tables, count


def _divided(
    corners: FloatArray, triangles: IntArray, angle: float, f: int
) -> tuple[FloatArray, IntArray]:
    """Cut each side of spherical triangles into f parts; ``angle`` is that of all their sides.

    The weights of a point are sines of equal angles, which on a side are equal parts of the great
    circle, and inside come near to it.
    """
    tables, count = _numbering(triangles, f)
    vertices = np.empty((count, 3))
    lattice = np.add.outer(np.arange(f + 1), np.arange(f + 1))
    j, k = np.nonzero(lattice <= f)
    turns = np.stack([f - j - k, j, k], axis=1) * (angle / f)
    weights = sines_and_cosines(turns.ravel())[0].reshape(turns.shape)
    up_j, up_k = np.nonzero(lattice < f)
    down_j, down_k = np.nonzero(lattice < f - 1)
    faces = []
    for corner_rows, table in zip(triangles, tables, strict=True):
        points = product(weights, corners[corner_rows])
        vertices[table[j, k]] = points / np.linalg.norm(points, axis=1)[:, None]
        up = (table[up_j, up_k], table[up_j + 1, up_k], table[up_j, up_k + 1])
        down = (
            table[down_j + 1, down_k],
            table[down_j + 1, down_k + 1],
            table[down_j, down_k + 1],
        )
        faces += [np.stack(up, axis=1), np.stack(down, axis=1)]
    return vertices, np.concatenate(faces)


@lru_cache(maxsize=32)
def geodesic_sphere(f: int) -> tuple[FloatArray, IntArray]:
    """Return the unit sphere as an icosahedron with each side cut into f parts.

    Returns:
        (10 f^2 + 2, 3) vertices and (20 f^2, 3) triangles, counter-clockwise from outside; both
        read-only, and the same for the same f.

    """
    vertices, faces = _divided(*_icosahedron(), _ICOSAHEDRON_ANGLE, f)
    vertices.flags.writeable = faces.flags.writeable = False
    return vertices, faces


@lru_cache(maxsize=32)
def geodesic_dome(f: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the half z >= 0 of the unit sphere as half an octahedron, sides cut into f parts.

    Returns:
        (2 f^2 + 2 f + 1, 3) vertices, (4 f^2, 3) triangles, counter-clockwise from outside, and
        the (4 f,) vertices of the rim, where z is 0, in equal steps counter-clockwise about z
        from (1, 0, 0); all read-only.

    """
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    corners = np.concatenate([turn, [[0.0, 0.0, 1.0]]])
    triangles = np.array([[k, (k + 1) % 4, 4] for k in range(4)])
    vertices, faces = _divided(corners, triangles, _OCTAHEDRON_ANGLE, f)
    on_rim = np.flatnonzero(vertices[:, 2] == 0.0)
    angles = arc_tangents(vertices[on_rim, 1], vertices[on_rim, 0])
    turned = np.where(angles < 0.0, angles + 2.0 * math.pi, angles)
    rim = on_rim[np.argsort(turned, kind="stable")]
    for array in (vertices, faces, rim):
        array.flags.writeable = False
    return vertices, faces, rim


def star(triangles: IntArray, apex: int) -> IntArray:
    """Join triangles, counter-clockwise from outside, with an inner vertex: (t, 4)."""
    result = np.empty((len(triangles), 4), dtype=np.int64)
    result[:, 0] = apex
    result[:, 1:] = triangles
    return result
