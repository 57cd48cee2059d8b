"""Make a triangle mesh fit for exact queries: its solid, with pseudonormals.

``solids.solid_of`` says which triangles are surface. Of these, triangles without area (height
below DEGENERATE_TRIANGLE of the longest side) close the surface by their edges, but are dropped
from it: others cover them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, TYPE_CHECKING

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.hull import Hull, triangles_of_hull
from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.mesh_report import MeshReport
from scene_graph_ros.geometry.meshes.triangle_boxes import triangle_boxes
from scene_graph_ros.geometry.shapes.mesh_shape import REPAIR_TOLERANCE
from scene_graph_ros.geometry.spatial.elementary import arc_tangents
from scene_graph_ros.geometry.tolerances import CONVEX_VOLUME, DEGENERATE_TRIANGLE

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.solids.solid import Solid

__all__ = [
    "Surface",
    "build_surface",
    "is_closed_surface",
    "is_convex_surface",
    "with_area",
]

NEARLY_FLAT = 1e-12
"""Relative to a mesh's size: as little may a corner be above its neighbour's plane in a convex
mesh. It is the promised accuracy of a distance."""


_SLIVER = 1e-11
"""Relative to a mesh's size: needles of this height are where parts meet; where bodies are united
to rounding their normals point anywhere."""

_NEEDLE = 1e-3
"""Relative to the longest side: the height of a triangle that is a needle."""

_MOST_NEEDLES = 64
"""How many may lie beside each other: as many T vertices as can be on an edge."""

Tree = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Surface(NamedTuple):
    """One mesh of ``Surfaces``, with indices counted from 0."""

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    vertex_pseudonormals: np.ndarray
    edge_pseudonormals: np.ndarray
    part: np.ndarray
    solid_parts: int
    node_lower: np.ndarray
    node_upper: np.ndarray
    node_left: np.ndarray
    node_right: np.ndarray
    order: np.ndarray
    report: MeshReport
    open_edges: np.ndarray
    """(k, 2, 3) metres: the ends of edges that stayed open."""

    @property
    def tree(self) -> Tree:
        """The hierarchy of boxes of the triangles."""
        return self.node_lower, self.node_upper, self.node_left, self.node_right, self.order

    @property
    def is_solid(self) -> np.ndarray:
        """(m,): whether a triangle bounds the solid; others are sheets."""
        return self.part < self.solid_parts

    @property
    def is_closed(self) -> bool:
        """Whether the surface bounds a solid, and has no sheet beside it."""
        return bool(self.solid_parts and self.part[-1] < self.solid_parts)


def build_surface(
    vertices: np.ndarray,
    triangles: np.ndarray,
    *,
    name: str,
    repair_tolerance: float = REPAIR_TOLERANCE,
) -> Surface:
    """Build the surface of a mesh; see the rules of this module.

    Args:
        vertices: (n, 3) finite.
        triangles: (m, 3) indices.
        name: the mesh's name in messages.
        repair_tolerance: relative to the mesh's size.

    Raises:
        MeshError: no triangle with an area is left.

    """
    # Only scenes with meshes need it.
    from scene_graph_ros.geometry.meshes.solids.solid import one_closed_part, solid_of

    solid = one_closed_part(vertices, triangles)
    if solid is not None:
        surface = _surface_of(solid, name)
        if _crossing(surface) is None and _winds_once(surface):
            return surface
    solid = solid_of(vertices, triangles, repair_tolerance)
    surface = _surface_of(solid, name)
    where = _crossing(surface)
    if where is None or surface.report.reason:
        return surface
    place = ", ".join(f"{x:.6g}" for x in where)
    reason = f"the surface crosses itself at ({place})"
    return surface._replace(report=replace(surface.report, reason=reason, is_closed=False))


def _crossing(surface: Surface) -> np.ndarray | None:
    """Return a point where the boundary of the solid crosses itself, or None."""
    from scene_graph_ros.geometry.meshes.solids.crossings import first_crossing

    if surface.is_closed:
        return first_crossing(surface.vertices, surface.triangles, surface.tree)
    return first_crossing(surface.vertices, surface.triangles[surface.is_solid])


def _winds_once(surface: Surface) -> bool:
    """Tell whether the boundary of the solid winds once around what is inside, as far as tried."""
    from scene_graph_ros.geometry.meshes.solids.probes import wound_otherwise

    if surface.is_closed:
        return wound_otherwise(surface.vertices, surface.triangles, surface.tree) is None
    triangles = surface.triangles[surface.is_solid]
    return not len(triangles) or wound_otherwise(surface.vertices, triangles) is None


def _surface_of(solid: Solid, name: str) -> Surface:
    """Return the surface with its normals and its tree."""
    vertices, triangles = solid.vertices, solid.triangles
    crosses = _crosses(vertices, triangles)
    doubled_area = np.linalg.norm(crosses, axis=1)
    longest = _side_lengths(vertices, triangles).max(axis=1, initial=0.0)
    size = float(np.ptp(vertices, axis=0).max(initial=0.0)) if len(vertices) else 0.0
    # Uniting leaves slivers in a solid; what a sheet has is the file's own.
    least = np.minimum(_SLIVER * size, _NEEDLE * longest) * (solid.part < solid.solid_parts)
    has_area = doubled_area > np.maximum(DEGENERATE_TRIANGLE * longest, least) * longest
    if not has_area.any():
        raise MeshError(f"{name}: there is no triangle with an area")
    normals = crosses / np.where(has_area, doubled_area, 1.0)[:, None]
    edges = edges_of(triangles)
    _borrow_normals(vertices, triangles, normals, has_area, mates_of(edges))
    at_vertices = _vertex_pseudonormals(vertices, triangles, normals, has_area)
    at_edges = _edge_pseudonormals(vertices, triangles, normals, has_area, edges)
    triangles = np.ascontiguousarray(triangles[has_area])
    part, solid_parts = _parts_left(solid.part, has_area, solid.solid_parts)
    lower, upper, left, right, order = build_bvh(*triangle_boxes(vertices, triangles))
    return Surface(
        vertices=vertices,
        triangles=triangles,
        normals=normals[has_area],
        vertex_pseudonormals=at_vertices,
        edge_pseudonormals=at_edges[has_area],
        part=part,
        solid_parts=solid_parts,
        node_lower=lower,
        node_upper=upper,
        node_left=left,
        node_right=right,
        order=order,
        report=solid.report,
        open_edges=solid.open_edges,
    )


def _parts_left(
    part: np.ndarray, has_area: np.ndarray, solid_parts: int
) -> tuple[np.ndarray, int]:
    """Return the numbers of parts that have triangles with an area, and how many are solid."""
    rows = np.unique(part[has_area])
    numbers = np.searchsorted(rows, part[has_area])
    return numbers.astype(np.int64), int(np.searchsorted(rows, solid_parts))


def is_closed_surface(triangles: np.ndarray) -> bool:
    """Tell whether at each edge of (m, 3) triangles two meet that run through it in opposite ways.

    Their indices are taken as they are.
    """
    edges = edges_of(triangles)
    mate = mates_of(edges)
    return bool(len(mate) and (mate >= 0).all() and (edges.start != edges.start[mate]).all())


def is_convex_surface(surface: Surface, hull: Hull) -> bool:
    """Tell whether a closed surface is the boundary of its own convex hull.

    It is when no edge is hollow, to NEARLY_FLAT, and both enclose the same volume, to
    CONVEX_VOLUME: a surface without hollow edges could wind around a point twice.
    """
    if not surface.is_closed or surface.solid_parts > 1 or not hull.faces:
        return False
    if _has_hollow_edge(surface):
        return False
    of_hull = _signed_volume(hull.vertices, triangles_of_hull(hull))
    of_surface = _signed_volume(surface.vertices, surface.triangles)
    return abs(of_hull - of_surface) <= CONVEX_VOLUME * of_hull


def _has_hollow_edge(surface: Surface) -> bool:
    """Tell whether a triangle's corner is above the plane of its neighbour across an edge."""
    mate = mates_of(edges_of(surface.triangles))
    half = np.flatnonzero(mate >= 0)
    corner = surface.triangles[mate[half] // 3, (mate[half] % 3 + 2) % 3]
    plane = surface.triangles[half // 3, 0]
    arms = surface.vertices[corner] - surface.vertices[plane]
    heights = np.einsum("ij,ij->i", arms, surface.normals[half // 3])
    size = float(np.ptp(surface.vertices, axis=0).max())
    return bool((heights > NEARLY_FLAT * size).any())


def with_area(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return a mask of the (m, 3) triangles with an area; see DEGENERATE_TRIANGLE."""
    doubled_area = np.linalg.norm(_crosses(vertices, triangles), axis=1)
    longest = _side_lengths(vertices, triangles).max(axis=1, initial=0.0)
    return np.asarray(doubled_area > DEGENERATE_TRIANGLE * longest**2)


def _crosses(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return (m, 3) normals of twice the triangles' areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _signed_volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Return six times the volume inside closed triangles; negative if they face inwards."""
    arms = vertices[triangles[:, 0]] - vertices[0]
    return float(np.einsum("ij,ij->", arms, _crosses(vertices, triangles)))


def _side_lengths(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return (m, 3): entry k is the length from corner k to corner k+1."""
    corners = vertices[triangles]
    return np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)


def _borrow_normals(
    vertices: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    solid: np.ndarray,
    edge_twin: np.ndarray,
) -> None:
    """Give triangles without area the normal of the neighbour across their longest side."""
    flat = np.flatnonzero(~solid)
    normals[flat] = 0.0
    if not len(flat):
        return
    sides = _side_lengths(vertices, triangles[flat]).argmax(axis=1)
    across = edge_twin[3 * flat + sides]
    known = solid.copy()
    for _ in range(len(flat)):  # needles can lie beside needles
        reachable = (across >= 0) & ~known[flat] & known[across // 3]
        if not reachable.any():
            return
        normals[flat[reachable]] = normals[across[reachable] // 3]
        known[flat[reachable]] = True


def _vertex_pseudonormals(
    vertices: np.ndarray, triangles: np.ndarray, normals: np.ndarray, solid: np.ndarray
) -> np.ndarray:
    """Sum the normals weighted by the angle at the vertex (Baerentzen and Aanaes 2005, eq. 2)."""
    corners = vertices[triangles]
    forward = np.roll(corners, -1, axis=1) - corners
    backward = np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(forward, backward), axis=2)
    cosine = np.einsum("tkj,tkj->tk", forward, backward)
    angles = arc_tangents(sine.ravel(), cosine.ravel()).reshape(sine.shape)
    sums = np.zeros_like(vertices)
    weighted = angles[:, :, None] * normals[:, None, :]
    for axis in range(3):
        sums[:, axis] = np.bincount(
            triangles.reshape(-1), weighted[:, :, axis].reshape(-1), len(vertices)
        )
    fallback = np.zeros_like(vertices)
    fallback[triangles[solid].reshape(-1)] = np.repeat(normals[solid], 3, axis=0)
    return _normalized(sums, fallback)


def _edge_pseudonormals(
    vertices: np.ndarray,
    triangles: np.ndarray,
    normals: np.ndarray,
    has_area: np.ndarray,
    edges: Edges,
) -> np.ndarray:
    """Average the normals of all triangles at each edge; (m, 3, 3)."""
    own = np.repeat(normals, 3, axis=0)
    # A triangle without area has at its longest side the normals of those beyond the others.
    flat = np.flatnonzero(~has_area)
    lengths = _side_lengths(vertices, triangles[flat])
    order = np.argsort(lengths, axis=1, kind="stable")
    sides = 3 * flat[:, None] + order
    mate = mates_of(edges)
    beyond = np.stack([_beyond_needles(flat, sides, sides[:, k], mate) for k in (0, 1)])
    weights = np.where(beyond >= 0, np.take_along_axis(lengths, order, axis=1)[:, :2].T, 0.0)
    total = weights.sum(axis=0)
    known = total > 0.0
    mean = np.einsum("kt,ktj->tj", weights, normals[beyond])[known] / total[known, None]
    own[sides[known, 2]] = mean
    row = edges.rows()
    sums = np.stack([np.bincount(row, own[:, axis]) for axis in range(3)], axis=1)
    return _normalized(sums[row], own).reshape(-1, 3, 3)


def _beyond_needles(
    flat: np.ndarray, sides: np.ndarray, half: np.ndarray, mate: np.ndarray
) -> np.ndarray:
    """Return the triangles (k,) with an area across half edges (k,) of flat triangles, or -1.

    ``sides`` (k, 3) are the half edges of these, the longest one last. Where needles lie beside
    needles the way leads on, from one long side of each to the other.
    """
    place = np.full(len(mate) // 3, -1)
    place[flat] = np.arange(len(flat))
    half, beyond, going = half.copy(), np.full(len(flat), -1), np.arange(len(flat))
    for _ in range(_MOST_NEEDLES):
        across = mate[half[going]]
        at = np.where(across >= 0, place[across // 3], -1)
        has_arrived = (across >= 0) & (at < 0)
        beyond[going[has_arrived]] = across[has_arrived] // 3
        going, across, at = going[at >= 0], across[at >= 0], at[at >= 0]
        if not len(going):
            break
        half[going] = np.where(across == sides[at, 2], sides[at, 1], sides[at, 2])
    return beyond


def _normalized(vectors: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    """Return unit vectors; where normals cancel (a fold), those of ``fallback``."""
    lengths = np.linalg.norm(vectors, axis=1)
    usable = lengths > 0.0
    return np.where(usable[:, None], vectors / np.where(usable, lengths, 1.0)[:, None], fallback)
