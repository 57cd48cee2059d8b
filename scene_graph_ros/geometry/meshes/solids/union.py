"""Unite closed parts that overlap, touch or are nested, by ``manifold3d``.

The solid is the set of points around which the parts wind, cavities counted as -1. With U_k the
points in k or more of the others and V_k those in k or more cavities, it is the union of all
U_k - V_k. The result is held to winding numbers at random points, which are counted apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.solids.overlaps import groups_of_boxes
from scene_graph_ros.geometry.meshes.solids.parts import Parts
from scene_graph_ros.geometry.meshes.solids.press import pressed_together
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["United", "unite"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_PART = 1e-12
"""Relative to the whole: a part of this size, in length, is dropped."""

_WITHIN = 1e-9
"""Relative to its own volume: as much of a part may be outside of one that it is wholly inside."""

_SAMPLES = 256
"""Random points at which the union's winding numbers are those of the parts."""


class United(NamedTuple):
    """The boundary of a solid."""

    vertices: FloatArray
    """(v, 3)."""
    triangles: IntArray
    """(m, 3), counter-clockwise seen from outside of the solid."""
    cavities: int
    """How many of the parts are cavities."""
    dropped: IntArray
    """Parts that are too small beside the whole."""
    doubt: str
    """Why some parts were left as they are, or nothing."""


class _Part(NamedTuple):
    triangles: IntArray
    runs_outwards: bool
    volume: float
    lower: FloatArray
    upper: FloatArray


class _NotUnitedError(Exception):
    """The library refuses a part, or its result is not what the parts wind around."""


def unite(vertices: FloatArray, parts: Parts) -> United:
    """Return the boundary of the solid of all closed parts; ``vertices`` (v, 3) are theirs."""
    found = _split(vertices, parts)
    if not found:
        return United(*_together([]), 0, np.zeros(0, dtype=np.int64), "")
    size = float(np.ptp(vertices[parts.triangles].reshape(-1, 3), axis=0).max())
    extents = np.array([(part.upper - part.lower).max() for part in found])
    is_kept = extents > LEAST_PART * size
    dropped = np.flatnonzero(parts.is_closed)[~is_kept]
    found = [part for part, kept in zip(found, is_kept, strict=True) if kept]
    pieces: list[tuple[FloatArray, IntArray]] = []
    cavities, doubt = 0, ""
    lower = np.array([part.lower for part in found]).reshape(-1, 3)
    upper = np.array([part.upper for part in found]).reshape(-1, 3)
    alone = []
    for group in groups_of_boxes(lower, upper):
        members = [found[i] for i in group]
        if len(members) == 1:
            alone.append(members[0].triangles)
            continue
        try:
            piece, hollow = _united_group(vertices, members)
            pieces.append(piece)
            cavities += hollow
        except _NotUnitedError as error:
            alone.extend(member.triangles for member in members)
            doubt = str(error)
    if alone:
        pieces.insert(0, _used(vertices, np.concatenate(alone)))
    return United(*_together(pieces), cavities, dropped, doubt)


def _split(vertices: FloatArray, parts: Parts) -> list[_Part]:
    """Return the closed parts one by one."""
    order = np.argsort(parts.label, kind="stable")
    ends = np.cumsum(np.bincount(parts.label, minlength=len(parts.is_closed)))
    result = []
    for k in np.flatnonzero(parts.is_closed):
        triangles = parts.triangles[order[(ends[k - 1] if k else 0) : ends[k]]]
        corners = vertices[triangles].reshape(-1, 3)
        result.append(
            _Part(
                triangles,
                bool(parts.runs_outwards[k]),
                float(parts.volumes[k]) / 6.0,
                corners.min(axis=0),
                corners.max(axis=0),
            )
        )
    return result


def _used(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    used, triangles = used_indices(triangles, len(vertices))
    return vertices[used], triangles


def _together(pieces: Sequence[tuple[FloatArray, IntArray]]) -> tuple[FloatArray, IntArray]:
    if not pieces:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    starts = np.cumsum([0, *(len(v) for v, _ in pieces)])
    triangles = [t + s for (_, t), s in zip(pieces, starts, strict=False)]
    return np.concatenate([v for v, _ in pieces]), np.concatenate(triangles)


def _united_group(
    vertices: FloatArray, members: list[_Part]
) -> tuple[tuple[FloatArray, IntArray], int]:
    """Return the boundary of the solid of parts whose boxes overlap, and how many are cavities."""
    import manifold3d

    label = np.repeat(np.arange(len(members)), [len(part.triangles) for part in members])
    triangles = np.concatenate([part.triangles for part in members])
    # Parts may share vertices, which go different ways.
    own = distinct_rows(np.stack([np.repeat(label, 3), triangles.reshape(-1)], axis=1))
    points = vertices[own.rows[:, 1]]
    triangles = own.inverse.reshape(-1, 3)
    points = pressed_together(points, triangles, label)
    bodies = [
        _body(manifold3d, *_used(points, triangles[label == k])) for k in range(len(members))
    ]
    hollow = _cavities(vertices, members, bodies)
    solids = [body for body, is_hollow in zip(bodies, hollow, strict=True) if not is_hollow]
    hollows = [body for body, is_hollow in zip(bodies, hollow, strict=True) if is_hollow]
    if hollows:
        out = _levels(manifold3d, hollows, len(hollows))
        inside = _levels(manifold3d, solids, len(out) + 1)
        out.append(manifold3d.Manifold())
        whole = manifold3d.Manifold.batch_boolean(
            [u - v for u, v in zip(inside, out, strict=False)], manifold3d.OpType.Add
        )
    else:
        whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    mesh = whole.to_mesh64()
    points = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    triangles = np.array(mesh.tri_verts, dtype=np.int64)
    triangles = _welded(points, triangles)
    oriented = [
        part.triangles[:, ::-1] if is_hollow else part.triangles
        for part, is_hollow in zip(members, hollow, strict=True)
    ]
    _hold_to_winding(vertices, np.concatenate(oriented), points, triangles)
    return _used(points, triangles), int(np.sum(hollow))


def _body(manifold3d: Any, vertices: FloatArray, triangles: IntArray) -> Any:
    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(vertices),
        tri_verts=np.ascontiguousarray(triangles, dtype=np.uint64),
    )
    body = manifold3d.Manifold(mesh)
    if body.status() != manifold3d.Error.NoError:
        raise _NotUnitedError(f"manifold3d refuses a part: {body.status().name}")
    return body


def _levels(manifold3d: Any, bodies: Sequence[Any], most: int) -> list[Any]:
    """Return, for k from 1 to at most ``most``, the points that are in k or more of the bodies."""
    levels: list[Any] = []
    for body in bodies:
        above = [level ^ body for level in levels]
        if not levels:
            levels = [body]
            continue
        if len(levels) < most and not above[-1].is_empty():
            levels.append(above[-1])
        for k in range(len(above) - 1, 0, -1):
            levels[k] = levels[k] + above[k - 1]
        levels[0] = levels[0] + body
    return levels


def _cavities(vertices: FloatArray, members: list[_Part], bodies: Sequence[Any]) -> list[bool]:
    """Tell which parts are inside of an odd number of others and run against the smallest."""
    if len({part.runs_outwards for part in members}) == 1:
        return [False] * len(members)
    around: list[list[int]] = [[] for _ in members]
    lower = np.array([part.lower for part in members])
    upper = np.array([part.upper for part in members])
    middles = np.array([vertices[part.triangles[0]].mean(axis=0) for part in members])
    volumes = np.array([part.volume for part in members])
    for k, other in enumerate(members):
        is_candidate = (lower >= other.lower).all(axis=1) & (upper <= other.upper).all(axis=1)
        inner = np.flatnonzero(is_candidate & (volumes < other.volume))
        if len(inner):
            inner = inner[winding_numbers(middles[inner], vertices, other.triangles) > 0]
        for i in inner.tolist():
            around[i].append(k)
    result = []
    for i, part in enumerate(members):
        against = any(members[k].runs_outwards != part.runs_outwards for k in around[i])
        # Where nothing runs against it, there is nothing to find out.
        wholly = [
            k
            for k in around[i]
            if against and (bodies[i] - bodies[k]).volume() <= _WITHIN * part.volume
        ]
        smallest = min(wholly, key=lambda k: members[k].volume, default=i)
        is_against = members[smallest].runs_outwards != part.runs_outwards
        result.append(is_against and len(wholly) % 2 == 1)
    return result


def _welded(points: FloatArray, triangles: IntArray) -> IntArray:
    """Return triangles that use the first of equal points, without those that collapse."""
    distinct = distinct_rows(points)
    triangles = distinct.first[distinct.inverse][triangles]
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)]


def _hold_to_winding(
    vertices: FloatArray, oriented: IntArray, points: FloatArray, triangles: IntArray
) -> None:
    """Compare the union with its parts at random points, in the box and beside vertices."""
    rng = np.random.default_rng(2)
    corners = vertices[np.unique(oriented)]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    spread = rng.uniform(lower, upper, (_SAMPLES, 3))
    beside = corners[rng.integers(len(corners), size=_SAMPLES)]
    beside = beside + rng.normal(scale=1e-3 * float((upper - lower).max()), size=beside.shape)
    samples = np.concatenate([spread, beside])
    wanted = winding_numbers(samples, vertices, oriented) >= 1
    found = np.zeros(len(samples), dtype=np.int64)
    if len(triangles):
        found = winding_numbers(samples, points, triangles)
    wrong = np.flatnonzero(wanted != (found >= 1))
    if len(wrong):
        place = ", ".join(f"{x:.6g}" for x in samples[wrong[0]])
        raise _NotUnitedError(f"parts can't be united, one crosses itself near ({place})")
