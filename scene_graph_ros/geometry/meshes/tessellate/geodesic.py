"""The unit sphere as a geodesic polyhedron, and stars of tetrahedra over closed surfaces."""

from __future__ import annotations

from functools import lru_cache
import itertools
import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["LONGEST_EDGE", "geodesic_sphere", "star"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))
_EDGE_ANGLE = math.acos(1.0 / math.sqrt(5.0))

LONGEST_EDGE = 1.304
"""Times 1 / f: no edge of the polyhedron of frequency f is longer, on the unit sphere."""


@lru_cache(maxsize=1)
def _icosahedron() -> tuple[FloatArray, IntArray]:
    """Return (12, 3) unit vertices and (20, 3) triangles, counter-clockwise from outside."""
    signs = np.array(list(itertools.product((1.0, -1.0), (_GOLDEN, -_GOLDEN))))
    flat = np.column_stack([np.zeros(4), signs])
    vertices = np.concatenate([np.roll(flat, k, axis=1) for k in range(3)])
    vertices /= math.sqrt(1.0 + _GOLDEN**2)
    gram = vertices @ vertices.T
    near = (gram > 0.0) & (gram < 0.9)
    triangles = []
    for a, b, c in itertools.combinations(range(12), 3):
        if near[a, b] and near[b, c] and near[c, a]:
            outward = np.linalg.det(vertices[[a, b, c]]) > 0.0
            triangles.append((a, b, c) if outward else (a, c, b))
    return vertices, np.array(triangles, dtype=np.int64)


def _numbering(triangles: IntArray, f: int) -> tuple[list[IntArray], int]:
    """Number the lattice points of all faces, shared ones once.

    Returns:
        Per face (f+1, f+1) with entry (j, k) the number of the point with weights (f-j-k, j, k),
        and how many numbers there are.

    """
    edges: dict[tuple[int, int], int] = {}
    count = 12
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


@lru_cache(maxsize=32)
def geodesic_sphere(f: int) -> tuple[FloatArray, IntArray]:
    """Cut each side of an icosahedron into f parts and push the points out to the unit sphere.

    The weights of a point are sines of equal angles, which on a side of the icosahedron are equal
    parts of the great circle, and inside come near to it.

    Returns:
        (10 f^2 + 2, 3) vertices and (20 f^2, 3) triangles, counter-clockwise from outside; both
        read-only, and the same for the same f.

    """
    corners, triangles = _icosahedron()
    tables, count = _numbering(triangles, f)
    vertices = np.empty((count, 3))
    j, k = np.nonzero(np.add.outer(np.arange(f + 1), np.arange(f + 1)) <= f)
    weights = np.sin(np.stack([f - j - k, j, k], axis=1) * (_EDGE_ANGLE / f))
    up_j, up_k = np.nonzero(np.add.outer(np.arange(f), np.arange(f)) < f)
    down_j, down_k = np.nonzero(np.add.outer(np.arange(f), np.arange(f)) < f - 1)
    result = []
    for corner_rows, table in zip(triangles, tables, strict=True):
        points = weights @ corners[corner_rows]
        vertices[table[j, k]] = points / np.linalg.norm(points, axis=1)[:, None]
        up = (table[up_j, up_k], table[up_j + 1, up_k], table[up_j, up_k + 1])
        down = (
            table[down_j + 1, down_k],
            table[down_j + 1, down_k + 1],
            table[down_j, down_k + 1],
        )
        result += [np.stack(up, axis=1), np.stack(down, axis=1)]
    faces = np.concatenate(result)
    vertices.flags.writeable = faces.flags.writeable = False
    return vertices, faces


def star(triangles: IntArray, apex: int) -> IntArray:
    """Join triangles, counter-clockwise from outside, with an inner vertex: (t, 4)."""
    result = np.empty((len(triangles), 4), dtype=np.int64)
    result[:, 0] = apex
    result[:, 1:] = triangles
    return result
