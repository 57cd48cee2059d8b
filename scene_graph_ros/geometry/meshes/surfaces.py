"""Make a triangle mesh fit for exact queries: welded, cleaned, oriented, with pseudonormals.

Rules, in this order:

1. vertices with equal coordinates are one vertex;
2. triangles that use a vertex twice are dropped, and of triangles on the same three vertices
   only the first is kept;
3. the mesh is *closed* when every edge is shared by exactly two triangles that run through it in
   opposite ways; a closed mesh with negative volume is turned inside out;
4. triangles without area (height below DEGENERATE_TRIANGLE of the longest side) count for rule 3
   but are dropped from the surface, whose other triangles cover them.
"""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.bvh import build_bvh
from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.tolerances import CONVEX_VOLUME, DEGENERATE_TRIANGLE

__all__ = ["Surface", "build_surface", "is_closed_surface", "is_convex_surface"]


class Surface(NamedTuple):
    """One mesh of ``Surfaces``, with indices counted from 0."""

    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray
    vertex_pseudonormals: np.ndarray
    edge_pseudonormals: np.ndarray
    is_closed: bool
    node_lower: np.ndarray
    node_upper: np.ndarray
    node_left: np.ndarray
    node_right: np.ndarray
    order: np.ndarray


def build_surface(vertices: np.ndarray, triangles: np.ndarray, *, name: str) -> Surface:
    """Build the surface of a mesh; see the rules of this module.

    Args:
        vertices: (n, 3) finite.
        triangles: (m, 3) indices.
        name: what messages call the mesh.

    Raises:
        MeshError: no triangle with an area is left.

    """
    vertices, triangles = _weld(vertices, triangles)
    edge_twin, is_closed = _twins(triangles)
    if is_closed and _signed_volume(vertices, triangles) < 0.0:
        triangles = np.ascontiguousarray(triangles[:, ::-1])
        edge_twin, _ = _twins(triangles)
    crosses = _crosses(vertices, triangles)
    doubled_area = np.linalg.norm(crosses, axis=1)
    longest = _side_lengths(vertices, triangles).max(axis=1, initial=0.0)
    solid = doubled_area > DEGENERATE_TRIANGLE * longest**2
    if not solid.any():
        raise MeshError(f"{name}: there is no triangle with an area")
    normals = crosses / np.where(solid, doubled_area, 1.0)[:, None]
    _borrow_normals(vertices, triangles, normals, solid, edge_twin)
    at_vertices = _vertex_pseudonormals(vertices, triangles, normals, solid)
    at_edges = _edge_pseudonormals(normals, edge_twin)
    triangles = np.ascontiguousarray(triangles[solid])
    corners = vertices[triangles]
    tree = build_bvh(corners.min(axis=1), corners.max(axis=1))
    return Surface(
        vertices, triangles, normals[solid], at_vertices, at_edges[solid], is_closed, *tree
    )


def is_closed_surface(triangles: np.ndarray) -> bool:
    """Tell whether (m, 3) triangles are closed as rule 3 says, with their indices as they are."""
    return _twins(triangles)[1]


def is_convex_surface(surface: Surface, hull: Hull) -> bool:
    """Tell whether a closed surface is the boundary of its own convex hull.

    It is when both enclose the same volume, to CONVEX_VOLUME.
    """
    if not surface.is_closed or not hull.faces:
        return False
    fans = [np.column_stack([np.full(len(f) - 2, f[0]), f[1:-1], f[2:]]) for f in hull.faces]
    of_hull = _signed_volume(hull.vertices, np.concatenate(fans))
    of_surface = _signed_volume(surface.vertices, surface.triangles)
    return abs(of_hull - of_surface) <= CONVEX_VOLUME * of_hull


def _weld(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Apply rules 1 and 2; vertices that no triangle uses go as well."""
    vertices = vertices + 0.0  # -0.0 and 0.0 are one coordinate
    vertices, _, inverse = distinct_rows(vertices)
    triangles = inverse[triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    triangles = triangles[np.sort(distinct_rows(np.sort(triangles, axis=1)).first)]
    used, triangles = used_indices(triangles, len(vertices))
    return vertices[used], triangles


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


def _twins(triangles: np.ndarray) -> tuple[np.ndarray, bool]:
    """Find the half edge across each half edge.

    Half edge 3 t + k runs from corner k to corner k+1 of triangle t.

    Returns:
        (3 m,) the opposite half edge, or -1 at a border and where an edge is not shared by exactly
        two triangles that agree in orientation; and whether all have one.

    """
    start = triangles.reshape(-1)
    end = np.roll(triangles, -1, axis=1).reshape(-1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((start, high, low))
    is_first = np.ones(len(order) + 1, dtype=bool)
    is_first[1:-1] = (np.diff(low[order]) != 0) | (np.diff(high[order]) != 0)
    groups = np.flatnonzero(is_first)
    twin = np.full(len(order), -1, dtype=np.int64)
    pairs = groups[:-1][np.diff(groups) == 2]
    one, other = order[pairs], order[pairs + 1]
    opposite = start[one] != start[other]
    twin[one[opposite]] = other[opposite]
    twin[other[opposite]] = one[opposite]
    return twin, bool(len(twin) and (twin >= 0).all())


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
    angles = np.arctan2(sine, cosine)
    sums = np.zeros_like(vertices)
    weighted = angles[:, :, None] * normals[:, None, :]
    for axis in range(3):
        sums[:, axis] = np.bincount(
            triangles.reshape(-1), weighted[:, :, axis].reshape(-1), len(vertices)
        )
    fallback = np.zeros_like(vertices)
    fallback[triangles[solid].reshape(-1)] = np.repeat(normals[solid], 3, axis=0)
    return _normalized(sums, fallback)


def _edge_pseudonormals(normals: np.ndarray, edge_twin: np.ndarray) -> np.ndarray:
    """Average the normals of the two triangles at each edge; (m, 3, 3)."""
    own = np.repeat(normals, 3, axis=0)
    other = np.where((edge_twin >= 0)[:, None], normals[edge_twin // 3], own)
    return _normalized(own + other, own).reshape(-1, 3, 3)


def _normalized(vectors: np.ndarray, fallback: np.ndarray) -> np.ndarray:
    """Return unit vectors; where normals cancel (a fold), those of ``fallback``."""
    lengths = np.linalg.norm(vectors, axis=1)
    usable = lengths > 0.0
    return np.where(usable[:, None], vectors / np.where(usable, lengths, 1.0)[:, None], fallback)
