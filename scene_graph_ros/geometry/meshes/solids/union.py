"""Unite closed parts that overlap, touch or are nested, by ``manifold3d``.

The solid is the set of points around which the parts wind, cavities counted as -1. The result is
held to winding numbers at random points, which are counted apart. Parts that the library refuses,
or that cross themselves, are cut where they cross (``resolve``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.cavities import Part
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.folds import unfolded
from scene_graph_ros.geometry.meshes.solids.manifolds import bodies_of, boundary_of
from scene_graph_ros.geometry.meshes.solids.mesh_report import merged, Repair
from scene_graph_ros.geometry.meshes.solids.overlaps import groups_of_boxes
from scene_graph_ros.geometry.meshes.solids.pairing import is_nested_in_itself
from scene_graph_ros.geometry.meshes.solids.parts import Parts, signed_volumes, size_of
from scene_graph_ros.geometry.meshes.solids.piercing import TooManyError
from scene_graph_ros.geometry.meshes.solids.pressed_parts import (
    folds_at,
    pressed_parts,
    PressedParts,
)
from scene_graph_ros.geometry.meshes.solids.resolve import resolved
from scene_graph_ros.geometry.meshes.solids.slivers import (
    Corners,
    SHORT,
    without_short_edges,
)
from scene_graph_ros.geometry.meshes.solids.winding import Tree, winding_numbers
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes

__all__ = ["United", "unite"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Shell = tuple[FloatArray, IntArray]
"""Points (v, 3), and triangles (m, 3) over them."""

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
    repairs: list[Repair]
    """Parts and features that were too small, slits pressed together, crossings that were cut."""
    doubt: str
    """Why some parts were left as they are, or nothing."""


class _Piece(NamedTuple):
    """The same of a group of parts whose boxes overlap."""

    vertices: FloatArray
    triangles: IntArray
    repairs: list[Repair]
    cavities: int = 0


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
        return United(*_together([]), 0, [], "")
    size = size_of(vertices, parts.triangles)
    extents = np.array([(part.upper - part.lower).max() for part in found])
    is_kept = extents > LEAST_PART * size
    repairs: list[Repair] = []
    dropped = np.flatnonzero(~is_kept)
    if len(dropped):
        point, largest = found[dropped[0]].lower, float(extents[dropped].max())
        kind = "parts smaller than 1e-12 of the whole dropped"
        repairs.append(_repair(kind, len(dropped), point, largest))
    found = [part for part, kept in zip(found, is_kept, strict=True) if kept]
    pieces: list[Shell] = []
    cavities, doubt = 0, ""
    lower = np.array([part.lower for part in found]).reshape(-1, 3)
    upper = np.array([part.upper for part in found]).reshape(-1, 3)
    alone = []
    for group in groups_of_boxes(lower - tolerance, upper):
        members = [found[i] for i in group]
        if len(members) == 1 and not resolve and members[0].has_edges_of_two:
            alone.append(members[0].triangles)
            continue
        middle = _middle(members)
        try:
            piece = _united_group(vertices, members, middle, tolerance, resolve)
            pieces.append((piece.vertices + middle, piece.triangles))
            cavities += piece.cavities
            repairs += [_repair(r.kind, r.count, r.point + middle, r.size) for r in piece.repairs]
        except _NotUnitedError as error:
            alone.extend(member.triangles for member in members)
            doubt = str(error)
    if alone:
        pieces.insert(0, _used(vertices, np.concatenate(alone)))
    return United(*_together(pieces), cavities, merged(repairs), doubt)


def _repair(kind: str, count: int, point: FloatArray, size: float | None = None) -> Repair:
    x, y, z = (float(c) for c in point)
    return Repair(kind, count, (x, y, z), size)


def _split(vertices: FloatArray, parts: Parts) -> list[Part]:
    """Return the closed parts one by one."""
    if not len(parts.triangles):
        return []
    triangles = parts.triangles[np.argsort(parts.label, kind="stable")]
    ends = np.cumsum(np.bincount(parts.label))
    starts = np.concatenate([[0], ends[:-1]])
    lower, upper = triangle_boxes(vertices, triangles)
    lower = np.minimum.reduceat(lower, starts)
    upper = np.maximum.reduceat(upper, starts)
    return [
        Part(
            triangles[starts[k] : ends[k]],
            int(parts.runs_outwards[k]),
            float(parts.volumes[k]) / 6.0,
            lower[k],
            upper[k],
            bool(parts.has_edges_of_two[k]),
        )
        for k in np.flatnonzero(parts.is_closed)
    ]


def _middle(members: list[Part]) -> FloatArray:
    """Return a point amid parts: there the library, which rounds by coordinates, is most exact.

    It has few digits, so that hardly any coordinate is rounded when it is subtracted.
    """
    lower = np.min([part.lower for part in members], axis=0)
    upper = np.max([part.upper for part in members], axis=0)
    step = math.ldexp(1.0, math.frexp((upper - lower).max())[1] - 5)
    return np.asarray(np.round(0.5 * (lower + upper) / step) * step)


def _used(vertices: FloatArray, triangles: IntArray) -> Shell:
    used, triangles = used_indices(triangles, len(vertices))
    return vertices[used], triangles


def _together(pieces: Sequence[Shell]) -> Shell:
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
    if len(members) == 1:
        triangles, of = members[0].triangles, np.zeros(len(points), dtype=np.int64)
        crossing = first_crossing(points, triangles)
        if crossing is None:
            try:
                _hold_to_winding((points, triangles), (points, triangles))
            except _NotUnitedError:
                return _resolved_group(points, triangles, of)
            return _Piece(points, triangles, [])
        return _resolved_group(points, triangles, of, crossing)
    members = [
        part._replace(
            is_nested=not part.has_edges_of_two and is_nested_in_itself(points, part.triangles)
        )
        for part in members
    ]
    repairs: list[Repair] = []
    if not resolve:  # else all are cut together
        nested = {k: None for k, part in enumerate(members) if part.is_nested}
        points, members, repairs = _cut_alone(points, members, nested)
    found = pressed_parts(points, members, tolerance)
    folded = folds_at(points, members, found)
    if folded:
        points, members, more = _cut_alone(points, members, folded)
        repairs += more
        if not members:
            return _Piece(*_together([]), repairs)
        found = pressed_parts(points, members, tolerance)
    return _united_parts(found, members, repairs, resolve=resolve)


def _united_parts(
    found: PressedParts, members: list[Part], repairs: list[Repair], *, resolve: bool
) -> _Piece:
    """Return the boundary of the solid of parts that are pressed together; repairs are added."""
    points, oriented = given = found.pressed.vertices, found.oriented
    if found.reaching:
        at = points[members[found.reaching[0]].triangles].mean(axis=(0, 1))
        kind = "cavities that reach out of their part cut off"
        repairs.append(_repair(kind, len(found.reaching), at))
    if found.pressed.slits:
        kind, widest = "slits pressed together", found.pressed.widest
        repairs.append(_repair(kind, found.pressed.slits, found.pressed.point, widest))
    crossing, tree = None, found.pressed.tree
    try:
        united = _by_library(found, members)
        _hold_to_winding(given, united[:2], tree)
        crossing = first_crossing(*united[:2]) if resolve else None
        is_resolved = crossing is not None
    except _NotUnitedError:
        crossing, is_resolved = first_crossing(points, found.triangles), True
    if is_resolved:
        united = _resolved_group(points, oriented, found.of, crossing)
    repairs += united.repairs + _vanished(members, given, united[:2], tree)
    return _Piece(*united[:2], repairs, int(np.sum(np.array(found.cavity_of) >= 0)))


def _vanished(members: list[Part], given: Shell, united: Shell, tree: Tree | None) -> list[Repair]:
    """Return a repair for parts of which the union has nothing, since they are too thin."""
    points, oriented = given
    size = size_of(points, oriented)
    extents = np.array([(part.upper - part.lower).max() for part in members])
    thickness = np.array([part.volume for part in members]) / extents**2
    rows = np.flatnonzero(thickness <= SHORT * size)
    if not len(rows) or not len(united[1]):
        return []
    middles = np.array([points[members[k].triangles].mean(axis=(0, 1)) for k in rows])
    wanted = winding_numbers(middles, points, oriented, tree=tree) >= 1
    lost = np.flatnonzero((winding_numbers(middles, *united) >= 1) != wanted)
    if not len(lost):
        return []
    largest = float(extents[rows[lost]].max())
    return [_repair("parts as thin as rounding dropped", len(lost), middles[lost[0]], largest)]


def _cut_alone(
    points: FloatArray, members: list[Part], chosen: Mapping[int, FloatArray | None]
) -> tuple[FloatArray, list[Part], list[Repair]]:
    """Return vertices and parts, the chosen ones cut where they cross or lie on themselves.

    A place (3,) that is known of one is reported. A part that bounds nothing is left out; one that
    can't be cut stays as it is.
    """
    at, result, count = [points], [], len(points)
    repairs: list[Repair] = []
    for k, part in enumerate(members):
        if k not in chosen:
            result.append(part)
            continue
        own, triangles = _used(points, part.triangles)
        of = np.zeros(len(own), dtype=np.int64)
        try:
            cut = _resolved_group(own, triangles, of, chosen[k])
        except _NotUnitedError:
            result.append(part)
            continue
        repairs += cut.repairs
        if not len(cut.triangles):
            continue
        one = np.zeros(len(cut.triangles), dtype=np.int64)
        volume = float(signed_volumes(cut.vertices, cut.triangles, one, 1)[0]) / 6.0
        result.append(
            part._replace(
                triangles=cut.triangles + count,
                volume=volume,
                has_edges_of_two=False,
                is_nested=False,
            )
        )
        at.append(cut.vertices)
        count += len(cut.vertices)
    return np.concatenate(at), result, repairs


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


def _resolved_group(
    points: FloatArray, oriented: IntArray, of: IntArray, crossing: FloatArray | None = None
) -> _Piece:
    """Return the boundary of the space triangles wind around, by cutting their crossings.

    ``of`` (v,) is the part that each point is a corner of, and ``crossing`` (3,) is reported.
    """
    try:
        found = resolved(unfolded(points, oriented), oriented)
    except TooManyError as error:
        raise _NotUnitedError(f"parts can't be united: {error}") from error
    if found is None:
        raise _NotUnitedError("parts can't be united: where they cross, they do not close")
    at, triangles, moved = found
    piece = _collapsed(at, triangles, Corners(moved, of))
    _hold_to_winding((points, oriented), piece[:2])
    if crossing is not None:
        piece.repairs.append(_repair("bodies cut where they cross themselves", 1, crossing))
    return piece


def _by_library(found: PressedParts, members: list[Part]) -> _Piece:
    """Return the boundary of the solid of parts by the library."""
    points, grown = found.pressed.vertices, found.pressed.grown
    bodies = bodies_of(points, members)
    if any(body is None for body in bodies):
        raise _NotUnitedError("manifold3d refuses a part")
    wide = bodies_of(grown, members) if grown is not points else bodies
    wide = [body if other is None else other for body, other in zip(bodies, wide, strict=True)]
    size = float(np.abs(points).max())
    corners = Corners(points, found.of)
    return _collapsed(*boundary_of(bodies, found.cavity_of, wide, size), corners)


def _collapsed(points: FloatArray, triangles: IntArray, corners: Corners) -> _Piece:
    """Return triangles (m, 3) without needles of rounding, and the features that they lost."""
    triangles, lost, size = without_short_edges(points, triangles, corners)
    repairs = []
    if len(lost):
        kind = f"features smaller than {SHORT:g} of the size dropped"
        repairs.append(_repair(kind, len(lost), points[lost[0]], size))
    return _Piece(*_used(points, triangles), repairs)


def _hold_to_winding(given: Shell, united: Shell, tree: Tree | None = None) -> None:
    """Compare the union with its parts at random points, in the box and beside vertices.

    It winds once around the points around which they wind once or more. ``tree`` is of the parts'
    triangles, if it is known.
    """
    rng = np.random.default_rng(2)
    vertices, oriented = given
    corners = vertices[used_indices(oriented, len(vertices))[0]]
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    spread = rng.uniform(lower, upper, (_SAMPLES, 3))
    beside = corners[rng.integers(len(corners), size=_SAMPLES)]
    beside = beside + rng.normal(scale=1e-3 * float((upper - lower).max()), size=beside.shape)
    samples = np.concatenate([spread, beside])
    wanted = winding_numbers(samples, vertices, oriented, tree=tree) >= 1
    found = np.zeros(len(samples), dtype=np.int64)
    if len(united[1]):
        found = winding_numbers(samples, *united)
    # A part that is nested in itself, along edges of four, would leave walls inside of the solid.
    wrong = np.flatnonzero(found != wanted)
    if len(wrong):
        place = ", ".join(f"{x:.6g}" for x in samples[wrong[0]])
        raise _NotUnitedError(f"parts can't be united near ({place})")
