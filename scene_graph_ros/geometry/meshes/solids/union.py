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

from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.cavities import cavities_among, may_have_cavities, Part
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.folds import unfolded
from scene_graph_ros.geometry.meshes.solids.half_edges import edges_of
from scene_graph_ros.geometry.meshes.solids.overlaps import groups_of_boxes
from scene_graph_ros.geometry.meshes.solids.pairing import is_nested_in_itself, with_pairs_apart
from scene_graph_ros.geometry.meshes.solids.parts import Parts, signed_volumes, size_of
from scene_graph_ros.geometry.meshes.solids.piercing import TooManyError
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
    slits: int
    """Pairs of triangles of different parts that were pressed together."""
    slit: FloatArray | None
    """A point (3,) at one of them."""
    doubt: str
    """Why some parts were left as they are, or nothing."""


class _Piece(NamedTuple):
    """The same of a group of parts whose boxes overlap."""

    vertices: FloatArray
    triangles: IntArray
    cavities: int
    crossing: FloatArray | None
    slits: int = 0
    slit: FloatArray | None = None


class _NotUnitedError(Exception):
    """The library refuses a part, or its result is not the parts' union by winding numbers."""


def unite(vertices: FloatArray, parts: Parts, tolerance: float, *, resolve: bool) -> United:
    """Return the boundary of the solid of all closed parts.

    Args:
        vertices: (v, 3).
        parts: over these vertices; its sheets are left out.
        tolerance: metres; slits between parts that are not wider are closed.
        resolve: whether parts are searched for places where they cross themselves.

    """
    found = _split(vertices, parts)
    if not found:
        return United(*_together([]), 0, np.zeros(0, dtype=np.int64), (), 0, None, "")
    size = size_of(vertices, parts.triangles)
    extents = np.array([(part.upper - part.lower).max() for part in found])
    is_kept = extents > LEAST_PART * size
    dropped = np.flatnonzero(parts.is_closed)[~is_kept]
    found = [part for part, kept in zip(found, is_kept, strict=True) if kept]
    pieces: list[tuple[FloatArray, IntArray]] = []
    united = United(*_together([]), 0, dropped, (), 0, None, "")
    lower = np.array([part.lower for part in found]).reshape(-1, 3)
    upper = np.array([part.upper for part in found]).reshape(-1, 3)
    alone = []
    for group in groups_of_boxes(lower - tolerance, upper):
        members = [found[i] for i in group]
        if len(members) == 1 and not resolve and _has_edges_of_two(members[0].triangles):
            alone.append(members[0].triangles)
            continue
        middle = _middle(members)
        try:
            piece = _united_group(vertices, members, middle, tolerance, resolve)
            pieces.append((piece.vertices + middle, piece.triangles))
            united = _counted(united, piece, middle)
        except _NotUnitedError as error:
            alone.extend(member.triangles for member in members)
            united = united._replace(doubt=str(error))
    if alone:
        pieces.insert(0, _used(vertices, np.concatenate(alone)))
    whole, triangles = _together(pieces)
    return united._replace(vertices=whole, triangles=triangles)


def _has_edges_of_two(triangles: IntArray) -> bool:
    """Tell of a closed part whether no edge is of four: else it may be nested in itself."""
    return bool((edges_of(triangles).counts == 2).all())


def _counted(united: United, piece: _Piece, middle: FloatArray) -> United:
    """Add the report on one group of parts, whose middle is the origin there."""
    crossings, slit = united.crossings, united.slit
    if piece.crossing is not None:
        crossings = (*crossings, piece.crossing + middle)
    if slit is None and piece.slit is not None and piece.slits:
        slit = piece.slit + middle
    return united._replace(
        cavities=united.cavities + piece.cavities,
        crossings=crossings,
        slits=united.slits + piece.slits,
        slit=slit,
    )


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
    vertices: FloatArray, members: list[Part], middle: FloatArray, tolerance: float, resolve: bool
) -> _Piece:
    """Return the boundary of the solid of parts whose boxes overlap, with the middle as origin."""
    points, members = _about(middle, vertices, members)
    nested = [is_nested_in_itself(points, part.triangles) for part in members]
    if len(members) > 1 and not resolve:  # else all are cut together
        points, members, nested = _without_nesting(points, members, nested)
    label = np.repeat(np.arange(len(members)), [len(part.triangles) for part in members])
    triangles = np.concatenate([part.triangles for part in members])
    if len(members) == 1:
        crossing = first_crossing(points, triangles)
        if crossing is None:
            try:
                _hold_to_winding((points, triangles), (points, triangles))
            except _NotUnitedError:
                return _Piece(*_resolved_group(points, triangles), 0, None)
            return _Piece(points, triangles, 0, None)
        return _Piece(*_resolved_group(points, triangles), 0, crossing)
    hollow = [False] * len(members)
    if may_have_cavities(members):
        hollow = cavities_among(points, members, _bodies(points, members, nested))
    oriented = np.where(np.array(hollow)[label][:, None], triangles[:, ::-1], triangles)
    pressed = pressed_together(points, oriented, label, tolerance)
    points = pressed.vertices
    crossing = None
    try:
        united = _by_library(_bodies(points, members, nested), hollow)
        _hold_to_winding((points, oriented), united)
        crossing = first_crossing(*united) if resolve else None
        is_resolved = crossing is not None
    except _NotUnitedError:
        crossing, is_resolved = first_crossing(points, triangles), True
    if is_resolved:
        united = _resolved_group(points, oriented)
    return _Piece(*united, int(np.sum(hollow)), crossing, pressed.slits, pressed.point)


def _without_nesting(
    points: FloatArray, members: list[Part], nested: list[bool]
) -> tuple[FloatArray, list[Part], list[bool]]:
    """Return vertices and parts, those nested in themselves as they are without walls inside.

    The library would leave the walls. Also returns which could not be cut.
    """
    at, result, left, count = [points], [], list(nested), len(points)
    for k, part in enumerate(members):
        if nested[k]:
            try:
                own, triangles = _resolved_group(*_used(points, part.triangles))
            except _NotUnitedError:
                result.append(part)
                continue
            one = np.zeros(len(triangles), dtype=np.int64)
            volume = float(signed_volumes(own, triangles, one, 1)[0]) / 6.0
            part = part._replace(triangles=triangles + count, volume=volume)
            at.append(own)
            left[k], count = False, count + len(own)
        result.append(part)
    return np.concatenate(at), result, left


def _about(
    middle: FloatArray, vertices: FloatArray, members: list[Part]
) -> tuple[FloatArray, list[Part]]:
    """Return vertices (k, 3) about a point, and parts each of which has its own of them."""
    points: list[FloatArray] = []
    result, count = [], 0
    for part in members:
        used, triangles = used_indices(part.triangles, len(vertices))
        points.append(vertices[used] - middle)
        lower, upper = part.lower - middle, part.upper - middle
        result.append(part._replace(triangles=triangles + count, lower=lower, upper=upper))
        count += len(used)
    return np.concatenate(points), result


def _resolved_group(points: FloatArray, oriented: IntArray) -> tuple[FloatArray, IntArray]:
    """Return the boundary of the space triangles wind around, by cutting their crossings."""
    try:
        found = resolved(unfolded(points, oriented), oriented)
    except TooManyError as error:
        raise _NotUnitedError(f"parts can't be united: {error}") from error
    if found is None:
        raise _NotUnitedError("parts can't be united: where they cross, they do not close")
    united = found[0], without_short_edges(*found)
    _hold_to_winding((points, oriented), united)
    return _used(*united)


def _by_library(bodies: Sequence[Any], hollow: list[bool]) -> tuple[FloatArray, IntArray]:
    """Return the boundary of the solid of manifolds, some of which are cavities."""
    import manifold3d

    if any(body is None for body in bodies):
        raise _NotUnitedError("manifold3d refuses a part")
    solids = [body for body, is_hollow in zip(bodies, hollow, strict=True) if not is_hollow]
    hollows = [body for body, is_hollow in zip(bodies, hollow, strict=True) if is_hollow]
    whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add)
    if hollows:
        out = _levels(hollows, len(hollows))
        # Where there is no cavity, it is enough to be in one of the others.
        inside = [whole, *_levels(_beside(solids, hollows), len(out) + 1)[1:]]
        out.append(manifold3d.Manifold())
        whole = manifold3d.Manifold.batch_boolean(
            [u - v for u, v in zip(inside, out, strict=False)], manifold3d.OpType.Add
        )
    mesh = whole.to_mesh64()
    points = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    triangles = np.array(mesh.tri_verts, dtype=np.int64).reshape(-1, 3)
    return _used(points, without_short_edges(points, triangles))


def _bodies(vertices: FloatArray, members: list[Part], nested: list[bool]) -> list[Any]:
    """Return parts for the library, with None for those that it refuses or that are nested."""
    return [
        None if is_nested else _body(*_used(vertices, part.triangles))
        for part, is_nested in zip(members, nested, strict=True)
    ]


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


def _beside(bodies: Sequence[Any], others: Sequence[Any]) -> list[Any]:
    """Return the bodies whose boxes meet the box of any other one."""
    own = np.array([body.bounding_box() for body in bodies])
    boxes = np.array([body.bounding_box() for body in others])
    is_below = (own[:, None, :3] <= boxes[None, :, 3:]).all(axis=2)
    is_above = (own[:, None, 3:] >= boxes[None, :, :3]).all(axis=2)
    rows = np.unique(np.nonzero(is_below & is_above)[0])
    return [bodies[k] for k in rows.tolist()]


def _levels(bodies: Sequence[Any], most: int) -> list[Any]:
    """Return, for k from 1 to at most ``most``, the points that are in k or more of the bodies.

    Halves of the bodies are counted first: points in k of all are in i of the one half, and in
    k - i of the other. So most intersections are of few triangles.
    """
    levels = [[body] for body in bodies]
    while len(levels) > 1:
        left = levels[-1:] if len(levels) % 2 else []
        pairs = zip(levels[::2], levels[1::2], strict=False)
        levels = [_levels_of_both(one, other, most) for one, other in pairs] + left
    return levels[0] if levels else []


def _levels_of_both(one: list[Any], other: list[Any], most: int) -> list[Any]:
    """Return, for k up to ``most``, the points that are in k or more of two halves together."""
    import manifold3d

    result: list[Any] = []
    for k in range(1, min(most, len(one) + len(other)) + 1):
        terms = [one[k - 1]] if k <= len(one) else []
        terms += [other[k - 1]] if k <= len(other) else []
        terms += [
            one[i - 1] ^ other[k - i - 1]
            for i in range(max(1, k - len(other)), min(len(one), k - 1) + 1)
        ]
        level = manifold3d.Manifold.batch_boolean(terms, manifold3d.OpType.Add)
        if level.is_empty():
            break
        result.append(level)
    return result


def _hold_to_winding(
    given: tuple[FloatArray, IntArray], united: tuple[FloatArray, IntArray]
) -> None:
    """Compare the union with its parts at random points, in the box and beside vertices.

    It winds once around the points around which they wind once or more.
    """
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
    # A part that is nested in itself, along edges of four, would leave walls inside of the solid.
    wrong = np.flatnonzero(found != wanted)
    if len(wrong):
        place = ", ".join(f"{x:.6g}" for x in samples[wrong[0]])
        raise _NotUnitedError(f"parts can't be united near ({place})")
