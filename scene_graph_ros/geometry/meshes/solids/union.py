"""Unite closed parts that overlap, touch or are nested, by ``manifold3d``.

The solid is the set of points around which the parts wind, cavities counted as -1. With U_k the
points in k or more of the others and V_k those in k or more cavities, it is the union of all
U_k - V_k. The result is held to winding numbers at random points, which are counted apart. Parts
that the library refuses, or that cross themselves, are cut where they cross (``resolve``).
"""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.solids.cavities import cavities_among, Part
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.overlaps import groups_of_boxes
from scene_graph_ros.geometry.meshes.solids.pairing import with_pairs_apart
from scene_graph_ros.geometry.meshes.solids.parts import Parts
from scene_graph_ros.geometry.meshes.solids.press import pressed_together
from scene_graph_ros.geometry.meshes.solids.resolve import resolved
from scene_graph_ros.geometry.meshes.solids.slivers import without_short_edges
from scene_graph_ros.geometry.meshes.solids.winding import winding_numbers

__all__ = ["United", "unite"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_PART = 1e-12
"""Relative to the whole: a part of this size, in length, is dropped."""

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
    crossings: tuple[FloatArray, ...]
    """Points (3,) where parts crossed each other or themselves, and were cut there."""
    doubt: str
    """Why some parts were left as they are, or nothing."""


class _NotUnitedError(Exception):
    """The library refuses a part, or its result is not what the parts wind around."""


def unite(vertices: FloatArray, parts: Parts, *, resolve: bool) -> United:
    """Return the boundary of the solid of all closed parts; ``vertices`` (v, 3) are theirs.

    With ``resolve`` parts are searched for places where they cross themselves.
    """
    found = _split(vertices, parts)
    if not found:
        return United(*_together([]), 0, np.zeros(0, dtype=np.int64), (), "")
    size = float(np.ptp(vertices[parts.triangles].reshape(-1, 3), axis=0).max())
    extents = np.array([(part.upper - part.lower).max() for part in found])
    is_kept = extents > LEAST_PART * size
    dropped = np.flatnonzero(parts.is_closed)[~is_kept]
    found = [part for part, kept in zip(found, is_kept, strict=True) if kept]
    pieces: list[tuple[FloatArray, IntArray]] = []
    cavities, doubt = 0, ""
    crossings: list[FloatArray] = []
    lower = np.array([part.lower for part in found]).reshape(-1, 3)
    upper = np.array([part.upper for part in found]).reshape(-1, 3)
    alone = []
    for group in groups_of_boxes(lower, upper):
        members = [found[i] for i in group]
        if len(members) == 1 and not resolve:
            alone.append(members[0].triangles)
            continue
        middle = _middle(members)
        try:
            piece, hollow, crossing = _united_group(vertices - middle, members, resolve)
            pieces.append((piece[0] + middle, piece[1]))
            crossing = None if crossing is None else crossing + middle
            cavities += hollow
            crossings += [] if crossing is None else [crossing]
        except _NotUnitedError as error:
            alone.extend(member.triangles for member in members)
            doubt = str(error)
    if alone:
        pieces.insert(0, _used(vertices, np.concatenate(alone)))
    return United(*_together(pieces), cavities, dropped, tuple(crossings), doubt)


def _split(vertices: FloatArray, parts: Parts) -> list[Part]:
    """Return the closed parts one by one."""
    order = np.argsort(parts.label, kind="stable")
    ends = np.cumsum(np.bincount(parts.label, minlength=len(parts.is_closed)))
    result = []
    for k in np.flatnonzero(parts.is_closed):
        triangles = parts.triangles[order[(ends[k - 1] if k else 0) : ends[k]]]
        corners = vertices[triangles].reshape(-1, 3)
        result.append(
            Part(
                triangles,
                int(parts.runs_outwards[k]),
                float(parts.volumes[k]) / 6.0,
                corners.min(axis=0),
                corners.max(axis=0),
            )
        )
    return result


def _middle(members: list[Part]) -> FloatArray:
    """Return a point amid parts: there the library, which rounds by coordinates, is most exact.

    It has few digits, so that hardly any coordinate is rounded when it is subtracted.
    """
    lower = np.min([part.lower for part in members], axis=0)
    upper = np.max([part.upper for part in members], axis=0)
    step = math.ldexp(1.0, math.frexp((upper - lower).max())[1] - 5)
    return np.asarray(np.round(0.5 * (lower + upper) / step) * step)


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
    vertices: FloatArray, members: list[Part], resolve: bool
) -> tuple[tuple[FloatArray, IntArray], int, FloatArray | None]:
    """Return the boundary of the solid of parts whose boxes overlap, and how many are cavities.

    The last is a point where parts cross themselves, if they were resolved.
    """
    label = np.repeat(np.arange(len(members)), [len(part.triangles) for part in members])
    triangles = np.concatenate([part.triangles for part in members])
    # Parts may share vertices, which go different ways.
    own = distinct_rows(np.stack([np.repeat(label, 3), triangles.reshape(-1)], axis=1))
    points, triangles = vertices[own.rows[:, 1]], own.inverse.reshape(-1, 3)
    if len(members) == 1:
        return _resolved_group(points, triangles, first_crossing(points, triangles), [False])
    points = pressed_together(points, triangles, label)
    bodies = [_body(*_used(points, triangles[label == k])) for k in range(len(members))]
    hollow = cavities_among(vertices, members, bodies)
    given = np.concatenate([part.triangles for part in members])
    is_hollow = np.array(hollow)[label][:, None]
    given = np.where(is_hollow, given[:, ::-1], given)
    try:
        united = _by_library(bodies, hollow)
        _hold_to_winding((vertices, given), united)
        crossing = first_crossing(*united) if resolve else None
        if crossing is None:
            return united, int(np.sum(hollow)), None
    except _NotUnitedError:
        crossing = first_crossing(points, triangles)
    oriented = np.where(is_hollow, triangles[:, ::-1], triangles)
    return _resolved_group(points, oriented, crossing, hollow)


def _resolved_group(
    points: FloatArray, oriented: IntArray, crossing: FloatArray | None, hollow: list[bool]
) -> tuple[tuple[FloatArray, IntArray], int, FloatArray | None]:
    """Return as ``_united_group`` does, by cutting all triangles where they cross."""
    if crossing is None and len(hollow) == 1:
        return _used(points, oriented), 0, None
    found = resolved(points, oriented)
    if found is None:
        raise _NotUnitedError("parts can't be united: where they cross, they do not close")
    united = found[0], without_short_edges(*found)
    _hold_to_winding((points, oriented), united)
    return _used(*united), int(np.sum(hollow)), crossing


def _by_library(bodies: Sequence[Any], hollow: list[bool]) -> tuple[FloatArray, IntArray]:
    """Return the boundary of the solid of manifolds, some of which are cavities."""
    import manifold3d

    if any(body is None for body in bodies):
        raise _NotUnitedError("manifold3d refuses a part")
    solids = [body for body, is_hollow in zip(bodies, hollow, strict=True) if not is_hollow]
    hollows = [body for body, is_hollow in zip(bodies, hollow, strict=True) if is_hollow]
    if hollows:
        out = _levels(hollows, len(hollows))
        inside = _levels(solids, len(out) + 1)
        out.append(manifold3d.Manifold())
        whole = manifold3d.Manifold.batch_boolean(
            [u - v for u, v in zip(inside, out, strict=False)], manifold3d.OpType.Add
        )
    else:
        whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    mesh = whole.to_mesh64()
    points = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    triangles = np.array(mesh.tri_verts, dtype=np.int64).reshape(-1, 3)
    return _used(points, without_short_edges(points, triangles))


def _body(vertices: FloatArray, triangles: IntArray) -> Any:
    """Return a part for the library, or None if it refuses it."""
    import manifold3d

    points, faces = with_pairs_apart(vertices, triangles)
    mesh = manifold3d.Mesh64(
        vert_properties=np.ascontiguousarray(points),
        tri_verts=np.ascontiguousarray(faces, dtype=np.uint64),
    )
    body = manifold3d.Manifold(mesh)
    return body if body.status() == manifold3d.Error.NoError else None


def _levels(bodies: Sequence[Any], most: int) -> list[Any]:
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


def _hold_to_winding(
    given: tuple[FloatArray, IntArray], united: tuple[FloatArray, IntArray]
) -> None:
    """Compare the union with its parts at random points, in the box and beside vertices."""
    rng = np.random.default_rng(2)
    vertices, oriented = given
    corners = vertices[np.unique(oriented)]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    spread = rng.uniform(lower, upper, (_SAMPLES, 3))
    beside = corners[rng.integers(len(corners), size=_SAMPLES)]
    beside = beside + rng.normal(scale=1e-3 * float((upper - lower).max()), size=beside.shape)
    samples = np.concatenate([spread, beside])
    wanted = winding_numbers(samples, vertices, oriented) >= 1
    found = np.zeros(len(samples), dtype=np.int64)
    if len(united[1]):
        found = winding_numbers(samples, *united)
    wrong = np.flatnonzero(wanted != (found >= 1))
    if len(wrong):
        place = ", ".join(f"{x:.6g}" for x in samples[wrong[0]])
        raise _NotUnitedError(f"parts can't be united near ({place})")
