"""Cut triangles along the curves where they cross each other, into convex polygons that conform.

Each point is known by the planes and the edge that it is on, never by its coordinates: two
polygons that meet have the same points in common, also where triangles cross in slivers.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.exact_points import ascending, Edge, ExactPoints
from scene_graph_ros.geometry.meshes.solids.piercing import (
    DegenerateError,
    Piercings,
    piercings,
    TooManyError,
)

__all__ = ["Arrangement", "arrangement"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
MOST_PIECES = 200_000
"""Pieces into which triangles are cut; five times as many as in the worst of 777 robots' meshes.
It takes some 20 s and 0.6 GB."""

Label = int | Edge
"""What a side of a polygon is on: another triangle, or an edge of its own."""


class _Piece(NamedTuple):
    """A convex part of a triangle."""

    sides: list[tuple[int, Label]]
    """Points in order, each with the label of the side that begins there."""
    is_front: dict[int, bool]
    """Of the triangles that its sides are on: whether it is on their front side."""


class Arrangement(NamedTuple):
    """Convex polygons that cover triangles, and cross each other nowhere."""

    points: FloatArray
    """(k, 3): the vertices, and points where triangles cross."""
    polygons: list[list[int]]
    """Points in order; some are on straight sides."""
    source: IntArray
    """(n,): the triangle that each polygon is of."""
    is_front: list[dict[int, bool]]
    """Of triangles that its sides are on: whether the polygon is on their front side."""


def arrangement(vertices: FloatArray, triangles: IntArray) -> Arrangement:
    """Return the polygons of triangles that cross others, or that points are on the edges of.

    Args:
        vertices: (v, 3) whole numbers, in general position.
        triangles: (m, 3).

    Raises:
        DegenerateError: the position is not general.
        TooManyError: there would be more than MOST_PIECES.

    """
    found = piercings(vertices, triangles)
    is_end = np.zeros(len(vertices), dtype=bool)
    is_end[triangles[found.through]] = is_end[triangles[found.owner]] = True
    # What has an edge in common with those that cross.
    points = ExactPoints(vertices, triangles, np.flatnonzero(is_end[triangles].sum(axis=1) > 1))
    # A segment has two ends, in two triangles, each of which it cuts once or more.
    if len(found.owner) > MOST_PIECES:
        raise TooManyError(f"triangles would be cut into more than {MOST_PIECES} pieces")
    crossing = _segments(points, found)
    pieces: dict[int, list[_Piece]] = {}
    room = MOST_PIECES
    for t, others in crossing.items():
        pieces[t] = _cut(points, t, others, room)
        room -= len(pieces[t])
    for edge in list(points.on_edge):
        for t in points.owners[edge]:
            pieces.setdefault(t, [_whole(points.rows[t])])
    polygons, source, is_front = [], [], []
    lines = _Lines(points)
    for t, parts in pieces.items():
        for part in parts:
            polygons.append(_with_all_points(lines, t, part))
            source.append(t)
            is_front.append(part.is_front)
    return Arrangement(np.array(points.at), polygons, np.array(source, dtype=np.int64), is_front)


def _segments(points: ExactPoints, found: Piercings) -> dict[int, dict[int, tuple[int, int]]]:
    """Return for each triangle that others cross, from where to where each of them does."""
    ends: dict[Edge, set[int]] = defaultdict(set)
    for (u, v), t, owner in zip(*(a.tolist() for a in found), strict=True):
        ends[ascending(t, owner)].add(points.on_edge_and_plane((u, v), t))
    result: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    for (one, other), between in ends.items():
        between |= set(points.rows[one]) & set(points.rows[other])
        if len(between) != 2:
            raise DegenerateError
        start, end = between
        result[one][other] = result[other][one] = start, end
    return result


def _whole(row: list[int]) -> _Piece:
    return _Piece([(row[k], ascending(row[k], row[(k + 1) % 3])) for k in range(3)], {})


def _cut(
    points: ExactPoints, t: int, others: dict[int, tuple[int, int]], room: int
) -> list[_Piece]:
    """Return a triangle cut along others, each as far as it reaches, into room pieces at most."""
    pieces = [_whole(points.rows[t])]
    boxes = _Boxes(points)
    boxes.append(pieces[0])
    for other, ends in others.items():
        for k in boxes.meeting(ends):
            halves = _halves(points, t, pieces[k], other, ends)
            if len(halves) == 2:
                pieces[k] = halves[0]
                boxes.put(k, halves[0])
                pieces.append(halves[1])
                boxes.append(halves[1])
        if len(pieces) > room:
            raise TooManyError(f"triangles would be cut into more than {MOST_PIECES} pieces")
    return pieces


class _Boxes:
    """The boxes around the pieces of a triangle, so that few are looked at for each segment."""

    def __init__(self, points: ExactPoints) -> None:
        self._points = points
        self._bounds = np.empty((16, 6))
        self._count = 0

    def append(self, piece: _Piece) -> None:
        if self._count == len(self._bounds):
            self._bounds = np.concatenate([self._bounds, np.empty_like(self._bounds)])
        self._count += 1
        self.put(self._count - 1, piece)

    def put(self, k: int, piece: _Piece) -> None:
        """Set the piece k."""
        self._bounds[k] = self._bounds_of([point for point, _ in piece.sides])

    def meeting(self, rows: Sequence[int]) -> list[int]:
        """Return the pieces whose boxes come within rounding of the box around some points."""
        if self._count == 1:
            return [0]
        a, b, c, d, e, f = self._bounds_of(rows)
        slack = self._points.slack
        # The negated upper corners are behind the lower ones.
        most = (slack - d, slack - e, slack - f, slack - a, slack - b, slack - c)
        meets = (self._bounds[: self._count] <= most).all(axis=1)
        return np.flatnonzero(meets).tolist()

    def _bounds_of(self, rows: Sequence[int]) -> tuple[float, ...]:
        x, y, z = zip(*[self._points.at[row] for row in rows], strict=True)
        return min(x), min(y), min(z), -max(x), -max(y), -max(z)


def _halves(
    points: ExactPoints, t: int, piece: _Piece, other: int, ends: tuple[int, int]
) -> list[_Piece]:
    """Return a piece cut along a segment's line, or as it is where the segment is beside it."""
    sides = piece.sides
    heights = [points.height(point, other) for point, _ in sides]
    if min(heights) >= 0.0 or max(heights) <= 0.0:
        return [piece]
    chord: list[tuple[int, int]] = []  # the side or corner, and the point there
    for k, (point, label) in enumerate(sides):
        if heights[k] == 0.0:
            chord.append((k, point))
        elif heights[k] * heights[(k + 1) % len(sides)] < 0.0:
            if isinstance(label, tuple):
                chord.append((k, points.on_edge_and_plane(label, other)))
            else:
                chord.append((k, points.on_planes(t, label, other)))
    if len(chord) != 2 or chord[0][1] == chord[1][1]:
        raise DegenerateError
    if not _overlap(points, (chord[0][1], chord[1][1]), ends):
        return [piece]
    result = []
    for _, point in chord:
        points.make_corner(point)
    for start, end in (chord, chord[::-1]):
        corner = (start[0] + 1) % len(sides)
        rest = _between(sides, heights, start, end, other)
        labels = {label for _, label in rest}
        is_front = {t: front for t, front in piece.is_front.items() if t in labels}
        is_front[other] = heights[corner] > 0.0
        result.append(_Piece(rest, is_front))
    return result


def _overlap(points: ExactPoints, chord: tuple[int, int], ends: tuple[int, int]) -> bool:
    """Tell whether two segments of one line have more than an end in common."""
    rows = list({*chord, *ends})
    if len(rows) == 2:
        return True
    at = dict(zip(rows, points.positions(rows), strict=True))
    low, high = sorted(at[k] for k in chord)
    start, end = sorted(at[k] for k in ends)
    return bool(max(low, start) < min(high, end))


def _between(
    sides: list[tuple[int, Label]],
    heights: list[float],
    start: tuple[int, int],
    end: tuple[int, int],
    other: int,
) -> list[tuple[int, Label]]:
    """Return the sides of a piece from one end of a chord around to the other, and the chord."""
    (i, first), (j, last) = start, end
    result = [(first, sides[i][1])]
    k = (i + 1) % len(sides)
    while k != j:
        result.append(sides[k])
        k = (k + 1) % len(sides)
    if heights[j] != 0.0:
        result.append(sides[j])
    result.append((last, other))
    return result


class _Lines:
    """The corners of polygons on the line of a side, in order, once no more are made."""

    def __init__(self, points: ExactPoints) -> None:
        self._points = points
        self._found: dict[tuple[bool, Edge], tuple[list[int], dict[int, int]]] = {}

    def between(self, t: int, label: Label, start: int, end: int) -> list[int]:
        """Return the points inside of a side of a piece of triangle t, from its start on."""
        is_edge = isinstance(label, tuple)
        line = label if isinstance(label, tuple) else ascending(t, label)
        if (is_edge, line) not in self._found:
            self._found[is_edge, line] = self._in_order(line, is_edge=is_edge)
        order, place = self._found[is_edge, line]
        first, last = place[start], place[end]
        return order[first + 1 : last] if first < last else order[last + 1 : first][::-1]

    def _in_order(self, line: Edge, *, is_edge: bool) -> tuple[list[int], dict[int, int]]:
        points = self._points
        if is_edge:
            rows = [*line, *points.on_edge.get(line, [])]
        else:
            shared = set(points.rows[line[0]]) & set(points.rows[line[1]])
            rows = [*shared, *points.on_line.get(line, [])]
        at = points.positions(rows)
        order = [row for _, row in sorted(zip(at, rows, strict=True))]
        return order, {row: k for k, row in enumerate(order)}


def _with_all_points(lines: _Lines, t: int, piece: _Piece) -> list[int]:
    """Return the points of a piece, and those of others on its sides."""
    result: list[int] = []
    for k, (point, label) in enumerate(piece.sides):
        result.append(point)
        result += lines.between(t, label, point, piece.sides[(k + 1) % len(piece.sides)][0])
    return result
