"""Points where planes of triangles meet, in whole numbers, so that no sign is a guess."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
import itertools
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Edge", "ExactPoints", "ascending"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Edge = tuple[int, int]
Whole = tuple[int, int, int]
Homogeneous = tuple[int, int, int, int]
Key = tuple[Edge, int] | tuple[int, int, int]

_CERTAIN = 1e-13
"""Relative to the largest coordinate: what floating point says of larger lengths is certain."""


def ascending(a: int, b: int) -> Edge:
    """Return two numbers in order."""
    return (a, b) if a < b else (b, a)


def _cross(a: Whole, b: Whole) -> Whole:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _dot(a: Sequence[int], b: Sequence[int]) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


class ExactPoints:
    """The points of an arrangement: vertices first, then those where planes meet.

    A point is known by the triangles in whose planes it is. Coordinates of vertices are whole
    numbers, stored as floats. ``used`` are the triangles (k,) whose edges are known.
    """

    def __init__(self, vertices: FloatArray, triangles: IntArray, used: IntArray) -> None:
        self.rows: list[list[int]] = triangles.tolist()
        corners = vertices[triangles]
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        normals = np.cross(*sides)
        length = np.linalg.norm(normals, axis=1)
        normals /= np.where(length > 0.0, length, 1.0)[:, None]
        self.slack = _CERTAIN * float(np.abs(corners).max())
        """In the unit of coordinates: what floating point says of larger lengths is certain."""
        # The normal of a needle is as uncertain as its sides are longer than its height.
        product = np.linalg.norm(sides[0], axis=1) * np.linalg.norm(sides[1], axis=1)
        slack = np.full(len(length), np.inf)
        np.divide(self.slack * product, length, out=slack, where=length > 0.0)
        self._slack: list[float] = slack.tolist()
        # Single numbers are faster in lists than in arrays.
        self._normals: list[list[float]] = normals.tolist()
        self._origins: list[list[float]] = corners[:, 0].tolist()
        self.at: list[list[float]] = vertices.tolist()
        self._planes: list[frozenset[int]] = [frozenset()] * len(vertices)
        self._exact: dict[int, Homogeneous] = {}
        self._plane: dict[int, tuple[Whole, int]] = {}
        self._row: dict[Key, int] = {}
        self.on_edge: dict[Edge, list[int]] = defaultdict(list)
        """The corners of polygons that are inside of an edge."""
        self.on_line: dict[Edge, list[int]] = defaultdict(list)
        """The corners of polygons that are in the planes of two triangles."""
        self._edge_of: dict[int, Edge] = {}
        self._corners: set[int] = set()
        self.owners: dict[Edge, list[int]] = defaultdict(list)
        """The triangles at an edge."""
        for t in used.tolist():
            row = self.rows[t]
            for k in range(3):
                self.owners[ascending(row[k], row[(k + 1) % 3])].append(t)

    def height(self, point: int, t: int) -> float:
        """Return a point's height above a triangle's plane: of the right sign, or exactly 0."""
        if t in self._planes[point] or point in self.rows[t]:
            return 0.0
        (nx, ny, nz), (ox, oy, oz), (x, y, z) = self._normals[t], self._origins[t], self.at[point]
        value = nx * (x - ox) + ny * (y - oy) + nz * (z - oz)
        if abs(value) > self._slack[t]:
            return value
        normal, offset = self._plane_of(t)
        *at, weight = self._exact_of(point)
        return (_dot(normal, at) - offset * weight) / (weight * math.isqrt(_dot(normal, normal)))

    def on_edge_and_plane(self, edge: Edge, t: int) -> int:
        """Return the point where an edge's line meets a triangle's plane."""
        return self._get((edge, t), frozenset([t, *self.owners[edge]]))

    def on_planes(self, one: int, two: int, three: int) -> int:
        """Return the point in three planes."""
        for a, b, c in ((one, two, three), (two, three, one), (three, one, two)):
            common = sorted(set(self.rows[a]) & set(self.rows[b]))
            if len(common) == 2:
                return self.on_edge_and_plane((common[0], common[1]), c)
        a, b, c = sorted((one, two, three))
        return self._get((a, b, c), frozenset((a, b, c)))

    def make_corner(self, point: int) -> None:
        """Have polygons end at a point; others that meet them have it on their sides."""
        if point in self._corners:
            return
        self._corners.add(point)
        if point in self._edge_of:
            self.on_edge[self._edge_of[point]].append(point)
        for a, b in itertools.combinations(sorted(self._planes[point]), 2):
            self.on_line[a, b].append(point)

    def positions(self, points: Sequence[int]) -> list[Any]:
        """Return numbers that are in the order of different points along their common line."""
        columns = list(zip(*(self.at[point] for point in points), strict=True))
        extents = [max(column) - min(column) for column in columns]
        axis = extents.index(max(extents))
        in_order = sorted(columns[axis])
        if min(b - a for a, b in itertools.pairwise(in_order)) > self.slack:
            return list(columns[axis])
        exact = [self._exact_of(point) for point in points]
        for k in (axis, (axis + 1) % 3, (axis + 2) % 3):
            found = [Fraction(e[k], e[3]) for e in exact]
            if len(set(found)) == len(found):
                return found
        return found

    def _get(self, key: Key, planes: frozenset[int]) -> int:
        row = self._row.get(key)
        if row is None:
            row = self._row[key] = len(self.at)
            exact = self._exact[row] = self._meeting(key)
            self.at.append([exact[k] / exact[3] for k in range(3)])
            self._planes.append(planes)
            if len(key) == 2:
                self._edge_of[row] = key[0]
        return row

    def _meeting(self, key: Key) -> Homogeneous:
        """Return the point of an edge and a plane, or three planes: (w x, w y, w z, w > 0)."""
        if len(key) == 2:
            (u, v), t = key
            normal, offset = self._plane_of(t)
            start, end = self._exact_of(u), self._exact_of(v)
            before, after = _dot(normal, start) - offset, _dot(normal, end) - offset
            at = [after * start[k] - before * end[k] for k in range(3)]
            weight = after - before
        else:
            (a, p), (b, q), (c, r) = (self._plane_of(t) for t in key)
            weights = _cross(b, c), _cross(c, a), _cross(a, b)
            at = [p * weights[0][k] + q * weights[1][k] + r * weights[2][k] for k in range(3)]
            weight = _dot(a, weights[0])
        if weight < 0:
            return -at[0], -at[1], -at[2], -weight
        return at[0], at[1], at[2], weight

    def _plane_of(self, t: int) -> tuple[Whole, int]:
        """Return (n, d) of the plane n . x = d of a triangle."""
        found = self._plane.get(t)
        if found is None:
            a, b, c = (self._exact_of(v) for v in self.rows[t])
            one = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
            other = (c[0] - a[0], c[1] - a[1], c[2] - a[2])
            normal = _cross(one, other)
            found = self._plane[t] = normal, _dot(normal, a)
        return found

    def _exact_of(self, point: int) -> Homogeneous:
        found = self._exact.get(point)
        if found is None:
            x, y, z = (int(c) for c in self.at[point])
            found = self._exact[point] = (x, y, z, 1)
        return found
