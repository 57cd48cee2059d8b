"""The parts of triangles: joined along edges of two, each oriented, closed or a sheet."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.pairing import pair_around
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes

__all__ = ["Parts", "are_flat", "find_parts", "joined_parts", "signed_volumes", "size_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_ROUNDS = 16
"""Of pairing around edges that parts share; each round leaves fewer open ones."""

_ALIKE = 0.9
"""A part in which fewer triangles run alike says nothing of what it means by their way."""

_ROUNDING = 1e-15
"""Relative to the largest coordinate: how thick rounding makes a plate without thickness."""


class Parts(NamedTuple):
    """Triangles, each part oriented outwards, and the parts' properties."""

    triangles: IntArray
    """(m, 3): those of closed parts run counter-clockwise seen from outside of the part."""
    label: IntArray
    """(m,): the part of each triangle, counted from 0."""
    is_closed: NDArray[np.bool_]
    """(n,): whether a part has no open edge, and encloses anything."""
    runs_outwards: IntArray
    """(n,): 1 where a part's triangles ran outwards as given, -1 inwards, 0 both ways."""
    volumes: FloatArray
    """(n,): six times what each closed part encloses; 0 for others."""
    against: IntArray
    """The triangles (rows) that ran the other way than most of their closed part."""
    has_edges_of_two: BoolArray
    """(n,): whether no edge of a part has more triangles: else it may be nested in itself."""


def find_parts(vertices: FloatArray, triangles: IntArray, gap: float = 0.0) -> Parts:
    """Find the parts of (m, 3) triangles over welded (v, 3) vertices.

    Faces of parts that share an edge are in one plane where they are nearer than ``gap``, metres.
    """
    edges = edges_of(triangles)
    mate = mates_of(edges)
    label, turned, is_two_sided = walk_parts(mate, edges.start)
    closed = _closed(edges, label, turned, is_two_sided)
    for _ in range(_ROUNDS):
        if closed.all():
            break
        if not pair_around(vertices, triangles, edges, mate, closed[label], label, turned, gap):
            break
        label, turned, is_two_sided = walk_parts(mate, edges.start)
        closed = _closed(edges, label, turned, is_two_sided)
    return _oriented(vertices, triangles, edges, (label, turned, closed))


def joined_parts(alone: Parts, rest: Parts, shift: int) -> Parts:
    """Return the closed ones of some parts, and other ones, whose vertices begin at ``shift``."""
    kept = alone.is_closed[alone.label]
    number = np.cumsum(alone.is_closed) - 1
    count = int(alone.is_closed.sum())
    at = np.cumsum(kept) - 1
    closed = alone.is_closed
    return Parts(
        np.concatenate([alone.triangles[kept], rest.triangles + shift]),
        np.concatenate([number[alone.label[kept]], rest.label + count]),
        np.concatenate([closed[closed], rest.is_closed]),
        np.concatenate([alone.runs_outwards[closed], rest.runs_outwards]),
        np.concatenate([alone.volumes[closed], rest.volumes]),
        np.concatenate([at[alone.against], rest.against + int(kept.sum())]),
        np.concatenate([alone.has_edges_of_two[closed], rest.has_edges_of_two]),
    )


def size_of(vertices: FloatArray, triangles: IntArray) -> float:
    """Return the largest extent of triangles (m, 3) along an axis."""
    lower, upper = triangle_boxes(vertices, triangles)
    # NumPy takes the smallest of a column much faster than along an axis of three.
    return max(float(upper[:, k].max() - lower[:, k].min()) for k in range(3))


def signed_volumes(
    vertices: FloatArray, triangles: IntArray, label: IntArray, count: int
) -> FloatArray:
    """Return (count,): six times the volume of each part; negative where it faces inwards."""
    first = np.zeros(count, dtype=np.int64)
    first[label[::-1]] = triangles[::-1, 0]
    a, b, c = (vertices[triangles[:, k]] - vertices[first[label]] for k in range(3))
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(np.bincount(label, six, count), dtype=np.float64)


def are_flat(
    vertices: FloatArray, triangles: IntArray, label: IntArray, volumes: FloatArray
) -> BoolArray:
    """Return (n,): whether a part encloses nothing, but for its coordinates' rounding.

    ``volumes`` (n,) are six times those of the parts.
    """
    count, most = (
        np.bincount(label, minlength=len(volumes)),
        float(np.abs(vertices).max(initial=0.0)),
    )
    # No triangle is larger than the box around all: so areas are asked of few parts.
    small = np.abs(volumes) <= 16.0 * _ROUNDING * most * most * most * count
    if not small.any():
        return small
    rows = np.flatnonzero(small[label])
    thickness = _ROUNDING * float(np.abs(vertices[triangles]).max())
    a, b, c = (vertices[triangles[rows, k]] for k in range(3))
    doubled = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    areas = np.bincount(label[rows], doubled, len(volumes))
    # A plate has one and a half times its thickness times its doubled area, both sides counted.
    return np.asarray(small & (np.abs(volumes) <= 1.5 * thickness * areas))


def _directions(edges: Edges, turned: NDArray[np.bool_]) -> IntArray:
    """Return (3 m,): 1 for half edges from the lower vertex to the higher one, else -1."""
    forward = (edges.start < edges.end) != np.repeat(turned, 3)
    return np.where(forward, 1, -1)


def _closed(
    edges: Edges, label: IntArray, turned: BoolArray, is_two_sided: BoolArray
) -> NDArray[np.bool_]:
    """Return a mask of the parts that run through each edge as often one way as the other."""
    count = len(is_two_sided)
    closed = is_two_sided.copy()
    order = edges.order
    odd = np.repeat(edges.counts != 2, edges.counts)
    # Edges of two triangles of one part are balanced, if the part is two-sided.
    half = order[odd]
    if len(half):
        key = edges.rows()[half] * count + label[half // 3]
        keys, group = np.unique(key, return_inverse=True)
        balance = np.bincount(group, _directions(edges, turned)[half], len(keys))
        closed[(keys % count)[balance != 0]] = False
    return closed


def _oriented(
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    walked: tuple[IntArray, BoolArray, BoolArray],
) -> Parts:
    label, turned, closed = walked
    count = len(closed)
    raw = triangles
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    volumes = signed_volumes(vertices, triangles, label, count)
    # A part that lies back to back encloses nothing, however it is closed.
    closed = closed & ~are_flat(vertices, triangles, label, volumes)
    inwards = closed & (volumes < 0.0)
    triangles = np.where(inwards[label][:, None], triangles[:, ::-1], triangles)
    is_kept = (triangles == raw).all(axis=1)
    share = np.bincount(label, is_kept, count) / np.maximum(np.bincount(label, minlength=count), 1)
    runs_outwards = (share >= _ALIKE).astype(np.int64) - (share <= 1.0 - _ALIKE)
    against = np.flatnonzero(closed[label] & (is_kept != (share >= 0.5)[label]))
    many = edges.order[np.repeat(edges.counts != 2, edges.counts)] // 3
    has_edges_of_two = np.ones(count, dtype=bool)
    has_edges_of_two[label[many]] = False
    # What is open stays as it is given.
    triangles = np.where(closed[label][:, None], triangles, raw)
    return Parts(
        np.ascontiguousarray(triangles),
        label,
        closed,
        runs_outwards,
        np.where(closed, np.abs(volumes), 0.0),
        against,
        has_edges_of_two,
    )
