"""The meaning of a mesh's triangles: the boundary of a solid, and sheets beside it.

1. Vertices with equal coordinates are one vertex; triangles that use one twice are dropped.
2. Where edges are not of two triangles each, the mesh is repaired (``repair``).
3. Triangles joined along edges of two are a part (``parts``). One without an open edge is closed,
   and oriented by its volume; any other is a sheet.
4. Closed parts are united, but for cavities (``union``).
5. Sheets end where the solid begins (``clip``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.solids.clip import outside_of_solid
from scene_graph_ros.geometry.meshes.solids.half_edges import (
    edges_of,
    mates_of,
    open_half_edges,
)
from scene_graph_ros.geometry.meshes.solids.kept_solid import kept_solid
from scene_graph_ros.geometry.meshes.solids.mesh_report import merged, MeshReport, Repair
from scene_graph_ros.geometry.meshes.solids.parts import (
    are_flat,
    find_parts,
    joined_parts,
    Parts,
    signed_volumes,
    size_of,
)
from scene_graph_ros.geometry.meshes.solids.repair import repaired, share_turned, without_copies
from scene_graph_ros.geometry.meshes.solids.shed import without_membranes
from scene_graph_ros.geometry.meshes.solids.union import unite, United, without_small_sheets
from scene_graph_ros.geometry.meshes.solids.walk import count_apart, walk_parts

__all__ = ["Solid", "one_closed_part", "solid_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


_TURNED = 0.1
"""Of all edges: as many may not run alike, where the ways of triangles say what is open."""


_FACTORS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)
"""Odd, so that each of three coordinates changes a number of 64 bits."""


class Solid(NamedTuple):
    """The triangles that are surface, those of the solid first; no vertex is of both kinds."""

    vertices: FloatArray
    """(v, 3)."""
    triangles: IntArray
    """(m, 3): the solid's run counter-clockwise seen from outside."""
    part: IntArray
    """(m,): the connected part of each triangle, ascending, the solid's first."""
    solid_parts: int
    """How many of the parts bound the solid."""
    report: MeshReport
    open_edges: FloatArray
    """(k, 2, 3): the ends of edges that are open."""


_NOTHING = Solid(
    np.zeros((0, 3)),
    np.zeros((0, 3), dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    0,
    MeshReport(0, 0, 0, (), False, "there is no triangle"),
    np.zeros((0, 2, 3)),
)


def solid_of(vertices: FloatArray, triangles: IntArray, repair_tolerance: float) -> Solid:
    """Return the solid of (m, 3) triangles over (v, 3) vertices, cut where they cross each other.

    ``repair_tolerance`` is relative to the size: how large gaps are that are closed.
    """
    if not len(triangles):
        return _NOTHING
    found = kept_solid(
        vertices,
        triangles,
        (repair_tolerance,),
        lambda: _of_any_parts(vertices, triangles, repair_tolerance),
    )
    return Solid(*found)


def _welded(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    if not len(triangles):
        return vertices[:0], triangles
    distinct = distinct_rows(vertices + 0.0)  # -0.0 and 0.0 are one coordinate
    triangles = _of_three_vertices(distinct.inverse[triangles])
    used, triangles = used_indices(triangles, len(distinct.rows))
    return distinct.rows[used], triangles


def _of_three_vertices(triangles: IntArray) -> IntArray:
    """Leave out triangles that use a vertex twice: they run through each edge both ways."""
    a, b, c = triangles.T
    return triangles[(a != b) & (b != c) & (c != a)]


def _are_distinct(vertices: FloatArray) -> bool:
    """Tell whether (v, 3) vertices surely have unequal coordinates, by a number made of each."""
    bits = (vertices + 0.0).view(np.uint64)  # -0.0 and 0.0 are one coordinate
    x, y, z = (bits[:, axis] * factor for axis, factor in enumerate(_FACTORS))
    numbers = np.sort(x + y + z)
    return bool((numbers[1:] != numbers[:-1]).all())


def one_closed_part(vertices: FloatArray, triangles: IntArray) -> Solid | None:
    """Return the solid of a mesh that is one closed part as it is, else None.

    It may cross itself: then its solid is that of ``solid_of``.
    """
    triangles = _of_three_vertices(triangles)
    if count_apart(triangles, len(vertices)) > 1 and _are_distinct(vertices):
        return None
    vertices, triangles = _welded(vertices, triangles)
    edges = edges_of(triangles)
    if len(triangles) < 4 or not (edges.counts == 2).all():
        return None
    mate = mates_of(edges)
    if (edges.start == edges.start[mate]).any():
        return None
    label, _, is_two_sided = walk_parts(mate, edges.start)
    if len(is_two_sided) > 1:
        return None
    volumes = signed_volumes(vertices, triangles, label, 1)
    if are_flat(vertices, triangles, label, volumes)[0]:
        return None
    if volumes[0] < 0.0:
        triangles = np.ascontiguousarray(triangles[:, ::-1])
    report = MeshReport(1, 0, 0, (), True, "")
    return Solid(vertices, triangles, label, 1, report, np.zeros((0, 2, 3)))


def _of_any_parts(vertices: FloatArray, triangles: IntArray, tolerance: float) -> Solid:
    size = size_of(vertices, triangles)
    # What is closed by the file's own numbers is a part, whatever else has the same vertices.
    triangles = _of_three_vertices(triangles)
    alone = find_parts(vertices, triangles)
    at, rest = _welded(vertices, triangles[~alone.is_closed[alone.label]])
    if not len(rest) and not alone.is_closed.any():
        return _NOTHING
    repairs: list[Repair] = []
    parts, membranes = find_parts(at, rest), rest[:0]
    if not parts.is_closed.all() or _has_doubles(rest):
        parts, membranes, repairs = _repaired_parts(at, rest, tolerance * size)
    parts = joined_parts(alone, parts, len(vertices))
    membranes = membranes + len(vertices)
    vertices = np.concatenate([vertices, at])
    united = unite(vertices, parts, tolerance * size)
    repairs += united.repairs
    if len(parts.against):
        x, y, z = (float(c) for c in vertices[parts.triangles[parts.against[0]]].mean(axis=0))
        repairs.append(Repair("triangles turned", len(parts.against), (x, y, z)))
    least = size if len(united.triangles) else 0.0
    sheets_of = without_small_sheets(vertices, parts, least, repairs)
    open_triangles = np.concatenate([sheets_of, membranes])
    sheets = vertices[open_triangles]
    sheet_label = _labels(open_triangles)
    open_edges = vertices[open_half_edges(open_triangles)[0]]
    if len(sheets) and len(united.triangles):
        before = len(sheets)
        sheets, of = outside_of_solid(sheets, united.vertices, united.triangles, size)
        sheet_label = sheet_label[of]
        open_edges = vertices[open_half_edges(open_triangles[np.unique(of)])[0]]
        if len(np.unique(of)) < before:
            gone = np.setdiff1d(np.arange(before), of)
            x, y, z = (float(c) for c in vertices[open_triangles[gone[0]]].mean(axis=0))
            repairs.append(Repair("triangles inside of the solid dropped", len(gone), (x, y, z)))
    report = _report(parts, united, len(np.unique(sheet_label)), repairs, open_edges)
    return _assembled(united, (sheets, sheet_label), report, open_edges)


def _repaired_parts(
    vertices: FloatArray, triangles: IntArray, tolerance: float
) -> tuple[Parts, IntArray, list[Repair]]:
    """Return parts, membranes (k, 3) and repairs, by the ways of triangles or as closes most."""
    turned, doubled = share_turned(triangles), _has_doubles(triangles)
    ways: list[tuple[IntArray, int | None, list[Repair]]] = []
    if turned <= _TURNED:
        copies = list[Repair]()
        single = without_copies(vertices, triangles, copies)
        # Where nothing is open, what is written twice is of two bodies.
        if copies and len(open_half_edges(triangles, by_ways=True)[1]):
            ways.append((single, None, copies))
        ways.append((triangles, None, []))
    if turned or doubled:
        ways += [(triangles, layers, []) for layers in ((2, 0) if doubled else (2,))]
    found = []
    for given, layers, before in ways:
        rest, repairs = repaired(vertices, given, tolerance, layers=layers)
        rest, membranes = without_membranes(vertices, rest)
        parts = find_parts(vertices, rest, tolerance)
        still_open = int(np.count_nonzero(~parts.is_closed[parts.label]))
        by_ways = layers is None
        one = parts, membranes, before + repairs
        # Where all run as they do in the file, the file says what is inside.
        if not still_open and not (by_ways and len(parts.against) + len(membranes)):
            return one
        found.append((still_open, by_ways, one))
    return min(found, key=lambda each: each[:2])[2]


def _has_doubles(triangles: IntArray) -> bool:
    return len(distinct_rows(np.sort(triangles, axis=1)).first) < len(triangles)


def _labels(triangles: IntArray) -> IntArray:
    """Return the connected part of each triangle, by edges of two."""
    if not len(triangles):
        return np.zeros(0, dtype=np.int64)
    edges = edges_of(triangles)
    return np.asarray(walk_parts(mates_of(edges), edges.start)[0])


def _report(
    parts: Parts, united: United, sheets: int, repairs: list[Repair], open_edges: FloatArray
) -> MeshReport:
    """Put the findings in words; ``open_edges`` (k, 2, 3) are those of the sheets."""
    closed = int(parts.is_closed.sum())
    reason = united.doubt
    if sheets:
        reason = "it folds back on itself, so it has two sides and no inside"
        if len(open_edges):
            place = ", ".join(f"{x:.6g}" for x in open_edges[0].mean(axis=0))
            edges = "1 edge is" if len(open_edges) == 1 else f"{len(open_edges)} edges are"
            reason = f"{edges} open, one at ({place}), so a sheet has two sides and no inside"
        reason = "; ".join(filter(None, [united.doubt, reason]))
    is_closed = closed > 0 and not sheets and not united.doubt
    return MeshReport(closed, united.cavities, sheets, tuple(merged(repairs)), is_closed, reason)


def _assembled(
    united: United,
    sheets: tuple[FloatArray, IntArray],
    report: MeshReport,
    open_edges: FloatArray,
) -> Solid:
    """Put the solid and the sheets behind each other, each sorted by part."""
    solid_label = _labels(united.triangles)
    order = np.argsort(solid_label, kind="stable")
    corners, sheet_label = sheets
    sheet_order = np.argsort(sheet_label, kind="stable")
    _, sheet_label = np.unique(sheet_label[sheet_order], return_inverse=True)
    distinct = distinct_rows(corners[sheet_order].reshape(-1, 3))
    of_sheets = distinct.inverse.reshape(-1, 3)
    a, b, c = of_sheets.T
    is_triangle = (a != b) & (b != c) & (c != a)
    count = int(solid_label.max(initial=-1)) + 1
    return Solid(
        np.concatenate([united.vertices, distinct.rows]),
        np.concatenate([united.triangles[order], of_sheets[is_triangle] + len(united.vertices)]),
        np.concatenate([solid_label[order], sheet_label[is_triangle] + count]),
        count,
        report,
        open_edges,
    )
