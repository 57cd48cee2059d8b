"""Convex hulls of points: vertices, edges and polygonal faces, also of flat and thin sets."""

from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.distinct_rows import distinct_rows, used_indices
from scene_graph_ros.geometry.meshes.vertex_cells import VertexCells
from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.geometry.tolerances import HULL_COPLANARITY, HULL_FLATNESS

__all__ = ["Hull", "convex_hull", "triangles_of_hull"]


_APART = (0.0, 1e-13, 1e-12)
"""Relative to the extent, tried in turn: points that are nearer to each other count as one. With
corners of needles qhull may give up, or faces be left that have no area."""


class Hull(NamedTuple):
    """One convex hull. Faces are polygons, counter-clockwise seen from outside.

    A point has no edges and no faces, a segment one edge and no faces, a flat polygon two faces
    with opposite normals.
    """

    vertices: np.ndarray
    """(v, 3)."""
    neighbors: list[np.ndarray]
    """Per vertex, the sorted indices of the vertices it shares an edge with."""
    faces: list[np.ndarray]
    """Per face, indices of its corners."""
    normals: np.ndarray
    """(f, 3) unit, out of the hull."""
    offsets: np.ndarray
    """(f,): inside is where ``normals @ x <= offsets``."""
    cells: VertexCells | None = None
    """Of a hull for queries with more vertices than ``vertex_cells.CELL_LIMIT``."""


def convex_hull(points: np.ndarray) -> Hull:
    """Compute the convex hull of ``(n, 3)`` points.

    Triangles in a common plane are merged. Every vertex is one of the points, unrounded; points
    within rounding of an edge or face may be left out.

    Raises:
        MeshError: there is no point, or a coordinate is not finite.

    """
    points = np.ascontiguousarray(points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1:] != (3,) or not len(points):
        raise MeshError(f"points for a convex hull must be (n, 3) with n > 0, got {points.shape}")
    if not np.isfinite(points).all():
        row = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise MeshError(f"points for a convex hull: row {row} is not finite: {points[row]}")
    points = distinct_rows(points).rows
    extent = float(np.max(points.max(axis=0) - points.min(axis=0)))
    for apart in _APART:
        kept = _thinned(points, apart * extent) if apart else points
        # A set that qhull finds too flat for a solid is treated as flat; each step accepts more.
        for flatness in HULL_FLATNESS:
            axes = _spanning_axes(kept, flatness * extent)
            if len(axes) < 3:
                return _flat_hull(kept, axes, HULL_COPLANARITY * extent)
            try:
                faces = _solid_faces(kept, HULL_COPLANARITY * extent)
            except _TooFlatError as error:
                reason = error
                continue
            return _assemble(kept, faces, [])
    raise MeshError(f"no convex hull of {len(points)} points: {reason}")


def _thinned(points: np.ndarray, apart: float) -> np.ndarray:
    """Return points (k, 3) of which one is left where several are no further apart."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    n, pairs = len(points), cKDTree(points).query_pairs(apart, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    _, group = connected_components(graph, directed=False)
    return np.ascontiguousarray(points[np.unique(group, return_index=True)[1]])


def triangles_of_hull(hull: Hull) -> np.ndarray:
    """Return (m, 3) indices: the faces cut into fans, those with fewer corners first.

    A flat hull has two sides; one without area has no triangles.
    """
    by_size: dict[int, list[np.ndarray]] = {}
    for face in hull.faces:
        by_size.setdefault(len(face), []).append(face)
    fans = [np.empty((0, 3), dtype=np.int64)]
    for size, faces in sorted(by_size.items()):
        corners = np.array(faces, dtype=np.int64)
        # Face by face: the fans of one are beside each other.
        fan = [corners[:, (0, k, k + 1)] for k in range(1, size - 1)]
        fans.append(np.stack(fan, axis=1).reshape(-1, 3))
    return np.concatenate(fans)


class _TooFlatError(Exception):
    """Qhull found no solid among the points, or one with faces that have no area."""


def _flat_hull(points: np.ndarray, axes: np.ndarray, tolerance: float) -> Hull:
    """Return the hull of points that span a plane, a line or nothing but themselves."""
    if len(axes) == 0:
        return _assemble(points[:1], [], [])
    if len(axes) == 1:
        along = product(points - points[0], axes[0])
        return _assemble(points[[along.argmin(), along.argmax()]], [], [(0, 1)])
    corners = _polygon(points, np.cross(axes[0], axes[1]), tolerance)
    return _assemble(points, [corners, corners[::-1]], [])


def _spanning_axes(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Return (d, 3) orthonormal axes of the points' affine hull, d = 0 to 3."""
    offsets = points - points[0]
    start = points[np.argmax(np.einsum("ij,ij->i", offsets, offsets))]
    offsets = points - start
    axes: list[np.ndarray] = []
    for _ in range(3):
        lengths = np.sqrt(np.einsum("ij,ij->i", offsets, offsets))
        farthest = int(lengths.argmax())
        if not lengths[farthest] > tolerance:
            break
        axis = offsets[farthest] / lengths[farthest]
        for other in axes:  # once more, since cancellation left the residual inexact
            axis = axis - product(axis, other) * other
        axis /= length(axis)
        axes.append(axis)
        offsets = offsets - np.outer(product(offsets, axis), axis)
    return np.array(axes).reshape(-1, 3)


def _polygon(points: np.ndarray, normal: np.ndarray, tolerance: float) -> np.ndarray:
    """Order the corners of coplanar points counter-clockwise about ``normal``.

    Monotone chain (Andrew 1979); points within ``tolerance`` of an edge are left out.
    """
    x_axis = np.eye(3)[np.abs(normal).argmin()]
    x_axis = np.cross(x_axis, normal)
    x_axis /= length(x_axis)
    y_axis = np.cross(normal, x_axis)
    relative = points - points[0]
    flat = np.column_stack([product(relative, x_axis), product(relative, y_axis)])
    order = np.lexsort((flat[:, 1], flat[:, 0]))

    def chain(sequence: np.ndarray) -> list[int]:
        kept: list[int] = []
        for k in sequence:
            while len(kept) > 1:
                a, b = flat[kept[-2]], flat[kept[-1]]
                edge, step = flat[k] - a, b - a
                # Height of b over the line from a to k; b stays when it is outside of it.
                height = step[1] * edge[0] - step[0] * edge[1]
                if -height > tolerance * np.hypot(edge[0], edge[1]):
                    break
                kept.pop()
            kept.append(int(k))
        return kept

    return np.array(chain(order)[:-1] + chain(order[::-1])[:-1], dtype=np.int64)


def _solid_faces(points: np.ndarray, tolerance: float) -> list[np.ndarray]:
    """Return the polygons of the hull of points that span space."""
    triangles, adjacent = _triangulated_hull(points)
    corner = points[triangles]
    crosses = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    doubled_areas = np.linalg.norm(crosses, axis=1)
    normals = crosses / np.where(doubled_areas > 0.0, doubled_areas, 1.0)[:, None]

    def coplanar(seed: int, others: np.ndarray) -> np.ndarray:
        relative = points[triangles[others]] - corner[seed, 0]
        heights = np.einsum("tci,i->tc", relative, normals[seed])
        return np.abs(heights).max(axis=-1) <= tolerance

    heights = np.einsum("tkcj,tj->tkc", corner[adjacent] - corner[:, None, :1], normals)
    has_coplanar = (np.abs(heights).max(axis=2) <= tolerance).any(axis=1)
    # Grow faces from the largest triangles, whose planes are known best, so nothing drifts.
    face_of = np.full(len(triangles), -1, dtype=np.int64)
    faces: list[np.ndarray] = []
    for seed in np.argsort(-doubled_areas, kind="stable"):
        if face_of[seed] >= 0:
            continue
        face_of[seed] = len(faces)
        members, pending = [seed], [seed] if has_coplanar[seed] else []
        while pending:
            around = adjacent[pending.pop()]
            around = around[face_of[around] < 0]
            for t in around[coplanar(seed, around)] if len(around) else ():
                if face_of[t] < 0:
                    face_of[t] = len(faces)
                    members.append(t)
                    pending.append(t)
        if len(members) == 1:
            faces.append(triangles[seed].astype(np.int64))
        else:
            used = np.unique(triangles[members])
            faces.append(used[_polygon(points[used], normals[seed], tolerance)])
    if min(map(len, faces)) < 3:
        raise _TooFlatError("a face has two corners")
    return faces


def _triangulated_hull(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (t, 3) outward triangles of the hull and (t, 3) indices of their neighbours."""
    from scipy.spatial import ConvexHull, QhullError

    # The faces of a hull don't change under an affine map. Scaling each axis by a power of two
    # is exact and gives qhull a set about as wide in all directions.
    relative = points - points[0]
    span = relative.max(axis=0) - relative.min(axis=0)
    exponent = np.where(span > 0.0, -np.frexp(np.where(span > 0.0, span, 1.0))[1], 0)
    try:
        hull = ConvexHull(np.ldexp(relative, exponent))
    except QhullError as error:
        reason = str(error).strip().splitlines()[0]
        raise _TooFlatError(reason) from error
    triangles = hull.simplices
    corner = hull.points[triangles]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    inward = np.einsum("ij,ij->i", cross, hull.equations[:, :3]) < 0.0
    triangles = np.where(inward[:, None], triangles[:, ::-1], triangles)
    return triangles, hull.neighbors


def _assemble(points: np.ndarray, faces: list[np.ndarray], edges: list[tuple[int, int]]) -> Hull:
    """Keep the used vertices and derive adjacency and planes from polygons (and bare edges)."""
    ends = np.cumsum([len(face) for face in faces], dtype=np.int64)
    starts = np.concatenate([[0], ends[:-1]]).astype(np.int64)[: len(faces)]
    # All faces one behind the other: to look at each alone takes seconds for large meshes.
    corners = np.concatenate([np.zeros(0, dtype=np.int64), *faces])
    following = np.arange(1, len(corners) + 1)
    following[ends - 1] = starts
    bare = np.array(edges, dtype=np.int64).reshape(-1, 2)
    directed = np.concatenate([bare, np.column_stack([corners, corners[following]])])
    used, directed = used_indices(directed, len(points))
    if not len(used):
        used = np.zeros(1, dtype=np.int64)
    vertices, corners = points[used], directed[len(bare) :, 0]
    both = distinct_rows(np.concatenate([directed, directed[:, ::-1]])).rows
    first = np.searchsorted(both[:, 0], np.arange(len(used) + 1))
    neighbors = np.split(both[:, 1], first[1:-1])
    normals, offsets = _planes(vertices, corners, starts, ends - starts)
    return Hull(vertices, neighbors, np.split(corners, ends[:-1])[: len(faces)], normals, offsets)


def _planes(
    vertices: np.ndarray, faces: np.ndarray, starts: np.ndarray, sizes: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals and the largest offsets of polygons' corners, listed in ``faces``."""
    normals = np.empty((len(sizes), 3))
    offsets = np.empty(len(sizes))
    for size in np.unique(sizes):
        rows = np.flatnonzero(sizes == size)
        corners = vertices[faces[starts[rows, None] + np.arange(size)]]
        normals[rows] = _normals(corners)
        offsets[rows] = np.einsum("fcj,fj->fc", corners, normals[rows]).max(axis=1)
    return normals, offsets


def _normals(corners: np.ndarray) -> np.ndarray:
    """Return the (f, 3) unit normals of (f, c, 3) polygons, counter-clockwise about them.

    The normal is the product of a long diagonal and of the short way from one of its ends to the
    corner furthest from it. Differences of near points are exact, so the sides of a thin plate
    contain their long edges; products of two long diagonals (Newell's method) would lose that.
    """
    every = np.arange(len(corners))
    relative = corners - corners[:, :1]
    far = np.linalg.norm(relative, axis=2).argmax(axis=1)
    diagonal = relative[every, far]
    heights = np.linalg.norm(np.cross(relative, diagonal[:, None]), axis=2)
    third = heights.argmax(axis=1)
    from_first = relative[every, third]
    from_far = corners[every, third] - corners[every, far]
    is_first_nearer = np.linalg.norm(from_first, axis=1) <= np.linalg.norm(from_far, axis=1)
    short = np.where(is_first_nearer[:, None], from_first, from_far)
    normal = np.cross(diagonal, short)
    normal /= np.abs(normal).max(axis=1, keepdims=True)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # The third corner comes before or after the far end; the area is to the left accordingly.
    return np.where((third > far)[:, None], normal, -normal)
