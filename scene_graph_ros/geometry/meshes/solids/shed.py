"""Set membranes apart: open parts at edges of three, without which the others are closed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts

__all__ = ["without_membranes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDS = 32
"""In each, parts go that share no edge with another one that goes."""


def without_membranes(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Return the triangles (m, 3) without membranes, and those of membranes (k, 3).

    Of the parts at an edge of an odd number of triangles, three or more, that one is a membrane
    without which fewer edges are open; the smallest where several are so.
    """
    apart = [triangles[:0]]
    for _ in range(_ROUNDS):
        if not len(triangles):
            break
        gone = _membranes(vertices, triangles)
        if not gone.any():
            break
        apart.append(triangles[gone])
        triangles = triangles[~gone]
    return triangles, np.concatenate(apart)


def _membranes(vertices: FloatArray, triangles: IntArray) -> NDArray[np.bool_]:
    edges = edges_of(triangles)
    counts, row = edges.counts, edges.rows()
    many = counts[row] > 2
    none = np.zeros(len(triangles), dtype=bool)
    if not (many & (counts[row] % 2 == 1)).any():
        return none
    label, _, _ = walk_parts(mates_of(edges), edges.start)
    total = int(label.max()) + 1
    of = np.repeat(label, 3)
    # How often each part is at each edge of its own that is not of two triangles.
    half = np.flatnonzero(counts[row] != 2)
    keys, times = np.unique(row[half] * total + of[half], return_counts=True)
    edge, part = keys // total, keys % total
    changes = times % 2 == 1  # without the part, such an edge has the other parity
    odd = counts[edge] % 2 == 1
    gain = np.bincount(part, np.where(changes, np.where(odd, 1, -1), 0), total)
    at_odd = np.bincount(part, changes & odd & (counts[edge] > 2), total) > 0
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    area = np.bincount(label, np.linalg.norm(np.cross(b - a, c - a), axis=1), total)
    taken = np.zeros(len(counts), dtype=bool)
    going = np.zeros(total, dtype=bool)
    candidates = np.flatnonzero(at_odd & (gain > 0))
    edges_by_part = {int(p): edge[part == p] for p in candidates}
    for p in candidates[np.argsort(area[candidates], kind="stable")]:
        own = edges_by_part[int(p)]
        if not taken[own].any():
            taken[own] = True
            going[p] = True
    return going[label]
