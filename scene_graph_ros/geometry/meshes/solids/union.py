"""Unite closed parts that overlap, touch or are nested, by ``manifold3d``.

The solid is the set of points around which the parts wind, cavities counted as -1. The result is
held to winding numbers at random points, which are counted apart. Parts that cross themselves are
cut together with those that they overlap, and so are parts that the library refuses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.distinct_rows import used_indices
from scene_graph_ros.geometry.meshes.solids.cavities import Part
from scene_graph_ros.geometry.meshes.solids.crossing_parts import crossing_parts, without_folds
from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing
from scene_graph_ros.geometry.meshes.solids.cut import (
    collapsed,
    cut_where_they_cross,
    hold_to_winding,
    NotUnitedError,
    Piece,
    self_crossing,
    Shell,
    used_part,
)
from scene_graph_ros.geometry.meshes.solids.folds import first_fold
from scene_graph_ros.geometry.meshes.solids.manifolds import bodies_of, boundary_of
from scene_graph_ros.geometry.meshes.solids.mesh_report import merged, Repair, repair_at
from scene_graph_ros.geometry.meshes.solids.overlaps import groups_of_boxes
from scene_graph_ros.geometry.meshes.solids.pairing import is_nested_in_itself
from scene_graph_ros.geometry.meshes.solids.parts import Parts, size_of
from scene_graph_ros.geometry.meshes.solids.pressed_parts import (
    folds_at,
    pressed_parts,
    PressedParts,
)
from scene_graph_ros.geometry.meshes.solids.slivers import Corners, SHORT, with_near_ones_welded
from scene_graph_ros.geometry.meshes.solids.winding import Tree, winding_numbers
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes

__all__ = ["United", "unite", "without_small_sheets"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_NARROW = 1e-11
"""Relative to the size: a union's folds are told from slivers that are left out of its surface
(``surfaces``). Where one is narrower than bodies are near, the sides of points that are nearest to
it are those of either sheet."""

_SKIN = 1e-11
"""Relative to the largest coordinate: skins and slits that pressing leaves are not thicker."""

_WIDE = 1e-6
"""Relative to the same: what is narrower is the end of a wedge."""

_SKINS = "bodies in cavities leave slits or skins of rounding where they touch walls"

_CUT_OFF = "cavities that reach out of their part cut off"

_FILLING = "parts that reach out of one which runs the other way taken as bodies"

LEAST_PART = 1e-12
"""Relative to the whole: a part of this size, in length, is dropped."""

_TOO_SMALL = "parts smaller than 1e-12 of the whole dropped"


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


def unite(vertices: FloatArray, parts: Parts, tolerance: float) -> United:
    """Return the boundary of the solid of all closed parts.

    Args:
        vertices: (v, 3).
        parts: over these vertices; its sheets are left out.
        tolerance: metres; slits between parts that are not wider are closed.

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
        repairs.append(repair_at(_TOO_SMALL, len(dropped), point, largest))
    found = [part for part, kept in zip(found, is_kept, strict=True) if kept]
    pieces: list[Shell] = []
    cavities, doubt = 0, ""
    lower = np.array([part.lower for part in found]).reshape(-1, 3)
    upper = np.array([part.upper for part in found]).reshape(-1, 3)
    alone = []
    for group in groups_of_boxes(lower - tolerance, upper):
        members = [found[i] for i in group]
        middle = _middle(lower[group], upper[group])
        try:
            if len(group) == 1 and self_crossing(vertices, members[0].triangles) is None:
                alone.append(members[0].triangles)
                continue
            piece = _united_group(vertices, members, middle, tolerance)
            pieces.append((piece.vertices + middle, piece.triangles))
            cavities += piece.cavities
            repairs += [
                repair_at(r.kind, r.count, r.point + middle, r.size) for r in piece.repairs
            ]
            doubt = doubt or piece.doubt
        except NotUnitedError as error:
            alone.extend(member.triangles for member in members)
            doubt = error.told(middle)
    if alone:
        pieces.insert(0, used_part(vertices, np.concatenate(alone)))
    return United(*_together(pieces), cavities, merged(repairs), doubt)


def without_small_sheets(
    vertices: FloatArray, parts: Parts, size: float, repairs: list[Repair]
) -> IntArray:
    """Return the triangles (k, 3) of open parts, but for those that are too small beside a solid.

    Such are also parts so flat that they enclose nothing but for rounding. ``size`` is that of the
    whole, metres.
    """
    is_open = ~parts.is_closed[parts.label]
    triangles, label = parts.triangles[is_open], parts.label[is_open]
    corners = triangle_boxes(vertices, triangles)
    lower, upper = np.full((2, len(parts.is_closed), 3), np.inf)
    np.minimum.at(lower, label, corners[0])
    np.minimum.at(upper, label, -corners[1])
    extents = (-upper - lower).max(axis=1)[label]
    small = extents <= LEAST_PART * size
    if small.any():
        point, largest = corners[0][small][0], float(extents[small].max())
        repairs.append(repair_at(_TOO_SMALL, len(np.unique(label[small])), point, largest))
    return triangles[~small]


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


def _middle(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return a point amid boxes (k, 3): there the library, which rounds, is most exact.

    It has few digits, so that hardly any coordinate is rounded when it is subtracted.
    """
    lower, upper = lower.min(axis=0), upper.max(axis=0)
    step = math.ldexp(1.0, math.frexp((upper - lower).max())[1] - 5)
    return np.asarray(np.round(0.5 * (lower + upper) / step) * step)


def _together(pieces: Sequence[Shell]) -> Shell:
    if not pieces:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)
    starts = np.cumsum([0, *(len(v) for v, _ in pieces)])
    triangles = [t + s for (_, t), s in zip(pieces, starts, strict=False)]
    return np.concatenate([v for v, _ in pieces]), np.concatenate(triangles)


def _united_group(
    vertices: FloatArray, members: list[Part], middle: FloatArray, tolerance: float
) -> Piece:
    """Return the boundary of the solid of parts whose boxes overlap, with the middle as origin."""
    points, members = _about(middle, vertices, members)
    if len(members) == 1:
        triangles = members[0].triangles
        return _cut_at(Piece(points, triangles, []), self_crossing(points, triangles))
    members = [
        part._replace(
            is_nested=not part.has_edges_of_two and is_nested_in_itself(points, part.triangles)
        )
        for part in members
    ]
    crossing = crossing_parts(points, members)
    found = pressed_parts(points, members, tolerance)
    folded = folds_at(points, members, found)
    if not folded:
        return _united_parts(found, members, crossing)
    cut = without_folds(points, members, folded)
    if not cut.members:
        return Piece(*_together([]), cut.repairs)
    found = pressed_parts(cut.points, cut.members, tolerance)
    # The library might unite what is left of them wrongly, where rounding has it cross itself.
    piece = _united_parts(found, cut.members, {**crossing, **folded})
    return piece._replace(repairs=cut.repairs + piece.repairs, doubt=cut.doubt or piece.doubt)


def _cut_at(piece: Piece, crossing: FloatArray | None) -> Piece:
    """Return a piece cut where it crosses itself, if a point (3,) is known where it does."""
    points, triangles, repairs, *_ = piece
    if crossing is None:
        return piece
    of = np.zeros(len(points), dtype=np.int64)
    cut = cut_where_they_cross(points, triangles, of, crossing).piece
    return cut._replace(repairs=repairs + cut.repairs)


def _united_parts(
    found: PressedParts, members: list[Part], crossing: Mapping[int, FloatArray | None]
) -> Piece:
    """Return the boundary of the solid of parts that are pressed together.

    ``crossing`` are parts that the library would unite wrongly, and where they cross themselves.
    """
    points, oriented = given = found.pressed.vertices, found.oriented
    repairs: list[Repair] = []
    for kind, some in ((_CUT_OFF, found.cavities.reaching), (_FILLING, found.cavities.filling)):
        if some:
            at = points[members[some[0]].triangles].mean(axis=(0, 1))
            repairs.append(repair_at(kind, len(some), at))
    if found.pressed.slits:
        kind, widest = "slits pressed together", found.pressed.widest
        repairs.append(repair_at(kind, found.pressed.slits, found.pressed.point, widest))
    united = None if crossing else _by_library(found, members)
    if united is None:
        at = next((at for at in crossing.values() if at is not None), None)
        if at is None:
            at = first_crossing(points, found.triangles)
        united = cut_where_they_cross(points, oriented, found.of, at).piece
    repairs += united.repairs + _vanished(members, given, united[:2], found.pressed.tree)
    return Piece(*united[:2], repairs, int(np.sum(np.array(found.cavities.of) >= 0)), united.doubt)


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
    return [repair_at("parts as thin as rounding dropped", len(lost), middles[lost[0]], largest)]


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


def _by_library(found: PressedParts, members: list[Part]) -> Piece | None:
    """Return the boundary of the solid of parts by the library, or None where that fails."""
    first = None
    for points, grown in found.pressed.ways:
        bodies = bodies_of(points, members)
        if any(body is None for body in bodies):
            continue
        wide = bodies_of(grown, members) if grown is not points else bodies
        wide = [own if other is None else other for own, other in zip(bodies, wide, strict=True)]
        piece = _with_cavities(found, points, bodies, wide)
        if piece is None:
            continue
        if len(found.pressed.ways) == 1 or first_fold(*piece[:2], _SKIN, _WIDE) is None:
            return piece
        first = first or piece
    return first._replace(doubt=_SKINS) if first else None


def _with_cavities(
    found: PressedParts, points: FloatArray, bodies: list[Any], wide: list[Any]
) -> Piece | None:
    """Return the boundary of the solid of bodies, or None where it winds otherwise than parts do.

    ``wide`` are the cavities as they count for what they have in common.
    """
    size = float(np.abs(points).max())
    corners = Corners(points, found.of)
    piece = collapsed(*boundary_of(bodies, found.cavities.of, wide, size), corners)
    if max(found.cavities.of) >= 0:
        welded = with_near_ones_welded(*piece[:2], corners)
        if len(welded) < len(piece.triangles) or (welded != piece.triangles).any():
            shell = used_part(piece.vertices, welded)
            piece = piece._replace(vertices=shell[0], triangles=shell[1])
    try:
        tree = build_bvh(*triangle_boxes(*piece[:2])) if len(piece.triangles) else None
        hold_to_winding((points, found.oriented), piece[:2], (found.pressed.tree, tree))
        return _cut_at(piece, first_crossing(*piece[:2], tree, _NARROW))
    except NotUnitedError:
        return None
