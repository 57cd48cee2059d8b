"""What a mesh means by the definition alone: solid angles of its parts, and no code of ours.

Parts are joined along edges of two, oriented from neighbour to neighbour and then by their volume;
the solid is where the closed parts, less the cavities, wind once or more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

__all__ = ["RawParts", "is_inside", "raw_parts", "solid_angles", "without_pairs"]

CHUNK = 50_000
"""Pairs of points and triangles that are computed at a time."""


class RawParts(NamedTuple):
    """The closed parts of a file, as they are written; no part is repaired."""

    vertices: np.ndarray
    triangles: list[np.ndarray]
    """(m, 3) each, oriented outwards."""
    ways: list[int]
    """1 where nine of ten triangles ran outwards in the file, -1 inwards, 0 both ways."""
    is_whole: bool
    """Whether each edge is of two triangles: nothing has to be repaired or guessed."""


def solid_angles(points, vertices, triangles, *, is_absolute=False):
    """Return winding numbers of (n, 3) points by solid angles (van Oosterom, Strackee 1983).

    Or, absolute, by how much the triangles wind around them whichever way each of them runs.
    """
    corners = vertices[triangles]
    result = np.zeros(len(points))
    step = max(1, CHUNK // max(1, len(triangles)))
    for start in range(0, len(points), step):
        a, b, c = (corners[None, :, k] - points[start : start + step, None] for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("nij,nij->ni", x, x)) for x in (a, b, c))
        sine = np.einsum("nij,nij->ni", a, np.cross(b, c))
        cosine = la * lb * lc + lc * np.einsum("nij,nij->ni", a, b)
        cosine += la * np.einsum("nij,nij->ni", b, c) + lb * np.einsum("nij,nij->ni", c, a)
        angles = np.arctan2(sine, cosine)
        angles = np.abs(angles) if is_absolute else angles
        result[start : start + step] = angles.sum(axis=1) / (2.0 * np.pi)
    return result


def raw_parts(vertices, triangles):
    """Return the parts of a file whose every edge is of two triangles."""
    points, inverse = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    rows = inverse.reshape(-1)[triangles]
    rows = rows[(np.sort(rows, axis=1)[:, 1:] != np.sort(rows, axis=1)[:, :-1]).all(axis=1)]
    start, end = rows.reshape(-1), np.roll(rows, -1, axis=1).reshape(-1)
    key = np.minimum(start, end) * len(points) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, first, counts = np.unique(key[order], return_index=True, return_counts=True)
    pair = first[counts == 2]
    one, other = order[pair], order[pair + 1]
    m = len(rows)
    # Two triangles may have more edges than one in common.
    ends, first = np.unique(np.stack([one // 3, other // 3], axis=1), axis=0, return_index=True)
    alike = (start[one] != start[other])[first]
    ways = coo_array((np.where(alike, 1, 2), tuple(ends.T)), shape=(m, m)).tocsr()
    count, label = connected_components(ways, directed=False)
    turned = np.zeros(m, dtype=bool)
    is_alike = {
        pair: same
        for (i, j), same in zip(ends.tolist(), alike.tolist(), strict=True)
        for pair in ((i, j), (j, i))
    }
    for root in np.unique(label, return_index=True)[1].tolist():
        reached, before = breadth_first_order(ways, root, directed=False)
        for t in reached[1:].tolist():
            turned[t] = turned[before[t]] != (not is_alike[int(before[t]), t])
    given, rows = rows, np.where(turned[:, None], rows[:, ::-1], rows)
    parts, outwards = [], []
    for k in range(count):
        part = rows[label == k]
        a, b, c = (points[part[:, j]] - points[part[0, 0]] for j in range(3))
        if np.einsum("ij,ij->", a, np.cross(b, c)) < 0.0:
            part = part[:, ::-1]
        parts.append(part)
        share = (part == given[label == k]).all(axis=1).mean()
        outwards.append(int(share >= 0.9) - int(share <= 0.1))
    return RawParts(points, parts, outwards, bool((counts == 2).all()))


def without_pairs(vertices, triangles):
    """Return the triangles without those with the same corners in pairs, and these.

    They bound nothing, or are a common wall.
    """
    _, inverse = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    rows = np.sort(inverse.reshape(-1)[triangles], axis=1)
    found = np.unique(rows, axis=0, return_index=True, return_counts=True)
    is_kept = np.zeros(len(triangles), dtype=bool)
    is_kept[found[1][found[2] % 2 == 1]] = True
    return triangles[is_kept], triangles[~is_kept]


def is_inside(points, parts, hollow=()):
    """Tell of (n, 3) points whether parts, less cavities by their number, wind around them."""
    total = np.zeros(len(points))
    for k, part in enumerate(parts.triangles):
        number = solid_angles(points, parts.vertices, part)
        total += -number if k in hollow else number
    return total > 0.5
