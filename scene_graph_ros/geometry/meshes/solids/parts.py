"""The parts of triangles: joined along edges of two, each oriented, closed or a sheet.

Where more than two triangles of a part, or of several that are open, meet at an edge, they are
paired around it: those beside each other that bound one wedge of the solid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts

__all__ = ["Parts", "find_parts", "joined_parts", "signed_volumes"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_ROUNDS = 16
"""Of pairing around edges that parts share; each round leaves fewer open ones."""


class Parts(NamedTuple):
    """Triangles, each part oriented outwards, and what is known of the parts."""

    triangles: IntArray
    """(m, 3): those of closed parts run counter-clockwise seen from outside of the part."""
    label: IntArray
    """(m,): the part of each triangle, counted from 0."""
    is_closed: NDArray[np.bool_]
    """(n,): whether a part has no open edge, and encloses anything."""
    runs_outwards: NDArray[np.bool_]
    """(n,): whether most of a part's triangles ran outwards as they were given."""
    volumes: FloatArray
    """(n,): six times what each closed part encloses; 0 for others."""
    against: IntArray
    """The triangles (rows) that ran the other way than most of their closed part."""


def find_parts(vertices: FloatArray, triangles: IntArray) -> Parts:
    """Find the parts of (m, 3) triangles over welded (v, 3) vertices."""
    edges = edges_of(triangles)
    mate = mates_of(edges)
    label, turned, is_two_sided = walk_parts(mate, edges.start)
    closed = _closed(edges, label, turned, is_two_sided)
    for _ in range(_ROUNDS):
        if closed.all() or not _pair_around(vertices, triangles, edges, mate, closed[label]):
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
    )


def signed_volumes(
    vertices: FloatArray, triangles: IntArray, label: IntArray, count: int
) -> FloatArray:
    """Return (count,): six times the volume of each part; negative where it faces inwards."""
    first = np.zeros(count, dtype=np.int64)
    first[label[::-1]] = triangles[::-1, 0]
    a, b, c = (vertices[triangles[:, k]] - vertices[first[label]] for k in range(3))
    six = np.einsum("ij,ij->i", a, np.cross(b, c))
    return np.asarray(np.bincount(label, six, count), dtype=np.float64)


def _directions(edges: Edges, turned: NDArray[np.bool_]) -> IntArray:
    """Return (3 m,): 1 for half edges from the lower vertex to the higher one, else -1."""
    forward = (edges.start < edges.end) != np.repeat(turned, 3)
    return np.where(forward, 1, -1)


def _closed(
    edges: Edges, label: IntArray, turned: BoolArray, is_two_sided: BoolArray
) -> NDArray[np.bool_]:
    """Tell which parts run through each of their edges as often one way as the other."""
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


def _pair_around(
    vertices: FloatArray, triangles: IntArray, edges: Edges, mate: IntArray, is_closed: BoolArray
) -> bool:
    """Pair half edges of open parts around edges that have an even number of them; tell if any."""
    counts = edges.counts
    changed = False
    for e in np.flatnonzero(counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half = half[(mate[half] < 0) & ~is_closed[half // 3]]
        if len(half) < 2 or len(half) % 2:
            continue
        half = half[np.argsort(_angles(vertices, triangles, edges, half), kind="stable")]
        low = edges.start[half] < edges.end[half]
        if (low[::2] != low[1::2]).all():
            # Counter-clockwise around the edge, a half edge along it is where its solid ends.
            shift = 0 if not low[0] else 1
        else:
            shift = _tighter(_angles(vertices, triangles, edges, half))
        half = np.roll(half, -shift)
        mate[half[::2]], mate[half[1::2]] = half[1::2], half[::2]
        changed = True
    return changed


def _angles(vertices: FloatArray, triangles: IntArray, edges: Edges, half: IntArray) -> FloatArray:
    """Return the angles (k,) of triangles around their common edge, from the lower vertex."""
    low = np.minimum(edges.start[half[0]], edges.end[half[0]])
    high = np.maximum(edges.start[half[0]], edges.end[half[0]])
    axis = vertices[high] - vertices[low]
    axis /= np.linalg.norm(axis)
    across = np.eye(3)[np.abs(axis).argmin()]
    u = np.cross(axis, across)
    u /= np.linalg.norm(u)
    corner = triangles[half // 3, (half % 3 + 2) % 3]
    arms = vertices[corner] - vertices[low]
    return np.arctan2(arms @ np.cross(axis, u), arms @ u)


def _tighter(angles: FloatArray) -> int:
    """Return 0 or 1: from which on pairs of sorted angles are nearer to each other."""
    gaps = np.diff(np.append(angles, angles[0] + 2.0 * np.pi))
    return 0 if gaps[::2].sum() <= gaps[1::2].sum() else 1


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
    # A part of two triangles back to back encloses nothing, however it is closed.
    closed = closed & (volumes != 0.0)
    inwards = closed & (volumes < 0.0)
    triangles = np.where(inwards[label][:, None], triangles[:, ::-1], triangles)
    is_kept = (triangles == raw).all(axis=1)
    runs_outwards = 2 * np.bincount(label, is_kept, count) >= np.bincount(label, minlength=count)
    against = np.flatnonzero(closed[label] & (is_kept != runs_outwards[label]))
    # What is open stays as it is given.
    triangles = np.where(closed[label][:, None], triangles, raw)
    return Parts(
        np.ascontiguousarray(triangles),
        label,
        closed,
        runs_outwards,
        np.where(closed, np.abs(volumes), 0.0),
        against,
    )
