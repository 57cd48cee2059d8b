"""From half-spaces to vertices and back, and the volume of a hull: qhull, prepared and checked."""

from __future__ import annotations

from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.sets.affine_subspace import AffineSubspace
from scene_graph_ros.convex.solve.exact.feasibility import find_deepest
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.compiled.kernel import kernel
from scene_graph_ros.geometry.shapes.convex import Convex
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "corners_of",
    "half_spaces_of_vertices",
    "shape_of_hull",
    "vertices_of_polyhedron",
    "volume_of",
]

_SAME = 1e-11
"""Relative to a set's size: vertices this close are one, and normals this close are of one face.
Both are known to about 1e-15 times the condition of the rows that meet there."""

_NEAR = 1e-9
"""Relative to a set's size: what qhull's vertices may be off, whose faces are merged."""

_SIDE_ROUNDING = 512.0 * EPSILON
"""Relative to how many half widths a set is from the origin: so far may rounding of right sides
take rows apart that met in one vertex."""

_SAME_CORNER = 1e-12
"""Relative to a set's size: a corner nearer to the hull of the others is none."""

_SOLID = 1e-6
"""Of a set's half widths: one with a larger ball inside is surely not flat."""

_CROSSING = 1e-6
"""Determinant of unit rows: below it they are nearly parallel, and tell no point alone."""

_FLAT = 1e-12
"""Relative to a set's size: a set of points thinner than this is flat."""


def _hull(points: np.ndarray) -> Any:
    """Return qhull's answer about points that span space."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return ConvexHull(points)
    except QhullError as error:
        reason = str(error).strip().splitlines()[0]
        raise SolverError(f"no hull of {points.shape} points: {reason}") from error


def _frame(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return one of the points, orthonormal axes (n, k) and half widths (k,) of their hull."""
    center = points[0]
    _, _, axes = np.linalg.svd(points - center, full_matrices=False)
    local = (points - center) @ axes.T
    widths = 0.5 * (local.max(axis=0, initial=-np.inf) - local.min(axis=0, initial=np.inf))
    size = np.linalg.norm(points.max(axis=0) - points.min(axis=0))
    kept = widths > _FLAT * size
    return center, axes[kept].T, widths[kept]


def corners_of(points: np.ndarray) -> np.ndarray:
    """Return those of the points ``(m, n)`` that are corners of their hull."""
    points = np.unique(points, axis=0)
    if len(points) <= 1 or not points.shape[1]:
        return points[:1]
    center, axes, widths = _frame(points)
    local = (points - center) @ axes / widths
    if not axes.shape[1]:
        return points[:1]
    if axes.shape[1] == 1:
        return points[[int(local.argmin()), int(local.argmax())]]
    chosen = np.asarray(_hull(local).vertices)
    chosen = chosen[_are_apart(points[chosen])]
    if points.shape[1] == 2:
        # Qhull has them counter-clockwise in its coordinates, which may be mirrored.
        if np.linalg.det(axes) < 0.0:
            chosen = chosen[::-1]
        return np.roll(points[chosen], -int(points[chosen][:, 0].argmin()), axis=0)
    return points[np.sort(chosen)]


def _are_apart(corners: np.ndarray) -> np.ndarray:
    """Return a mask of corners ``(m, n)`` further than rounding from the hull of the others."""
    origin = corners[0]
    local = corners - origin
    most = _SAME_CORNER * float(np.linalg.norm(np.ptp(local, axis=0)))
    is_kept = np.ones(len(corners), dtype=np.bool_)
    for k in range(len(corners)):
        is_kept[k] = False
        nearest, _, failed = nearest_in_hull(local[is_kept], local[k : k + 1])
        distance = float(np.linalg.norm(local[k] - nearest[0]))
        is_kept[k] = failed >= 0 or distance > most
    return is_kept


def volume_of(points: np.ndarray) -> float:
    """Return the volume of the hull of points ``(m, n)``; 0 where it is flat."""
    if len(points) <= 1:
        return 0.0
    center, axes, widths = _frame(points)
    if axes.shape[1] < points.shape[1]:
        return 0.0
    local = (points - center) @ axes / widths
    if axes.shape[1] == 1:
        return float(2.0 * widths[0])
    return float(_hull(local).volume * np.prod(widths))


def shape_of_hull(points: np.ndarray) -> tuple[Convex, np.ndarray]:
    """Return the hull of points ``(m, 3)`` as a shape, and its pose ``(4, 4)``.

    Raises ConvexSetError without points.
    """
    if not len(points):
        raise ConvexSetError("VPolytope.to_shape_with_pose: the set is empty")
    return Convex(vertices=points), np.eye(4)


def half_spaces_of_vertices(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit rows and right sides of the hull of points ``(m, n)``, m > 0.

    Two rows for each direction in which the points are flat; faces in one plane are one row. Every
    right side is that of the furthest point, and further by its rounding, so that
    all points are inside exactly.
    """
    center, axes, widths = _frame(points)
    n = points.shape[1]
    normals = np.zeros((0, n))
    if axes.shape[1] == 1:
        normals = np.concatenate([axes.T, -axes.T])
    elif axes.shape[1] > 1:
        local = (points - center) @ axes / widths
        scaled = _hull(local).equations[:, :-1] / widths
        normals = (scaled / np.linalg.norm(scaled, axis=1)[:, None]) @ axes.T
        normals = _distinct(normals)
    across = np.linalg.svd(axes, full_matrices=True)[0][:, axes.shape[1] :].T
    A = np.concatenate([normals, across, -across])
    if not len(A):
        return A, np.zeros(0)
    rounding = n * EPSILON * (np.abs(points) @ np.abs(A.T)).max(axis=0)
    return A, (points @ A.T).max(axis=0) + rounding


def _distinct(rows: np.ndarray, same: float = _SAME) -> np.ndarray:
    """Return rows without those that are as near to one before as rounding."""
    is_kept = np.ones(len(rows), dtype=np.bool_)
    _mark_distinct(np.ascontiguousarray(rows), same, is_kept)
    return rows[is_kept]


@kernel
def _mark_distinct(rows, same, is_kept):
    """Unmark rows that are no further than ``same`` from one before that is kept."""
    m, n = rows.shape
    for i in range(m):
        for j in range(i):
            if is_kept[j]:
                furthest = 0.0
                for k in range(n):
                    furthest = max(furthest, abs(rows[i, k] - rows[j, k]))
                if furthest <= same:
                    is_kept[i] = False
                    break


def vertices_of_polyhedron(polyhedron: Any) -> np.ndarray:
    """Return the vertices ``(m, n)`` of an HPolyhedron. Raises ConvexSetError if unbounded.

    About an inner point, the rows are points of a dual hull, each of whose faces is a vertex; it
    is then put where its rows meet.
    """
    n = polyhedron.ambient_dimension
    if polyhedron.is_empty():
        return np.zeros((0, n))
    if not polyhedron.is_bounded():
        raise ConvexSetError(
            "VPolytope: the HPolyhedron is unbounded and has no hull of vertices; intersect it"
            " with a box first"
        )
    if n == 0:
        return np.zeros((1, 0))
    if n > 1:
        solid = _solid_vertices(polyhedron, _SOLID)
        if solid is not None:
            return solid
    hull = AffineSubspace(polyhedron)
    k = hull.affine_dimension()
    if k == 0:
        return hull.translation[None]
    if k < n:
        A = polyhedron.A @ hull.basis
        b = polyhedron.b - polyhedron.A @ hull.translation
        lengths = np.linalg.norm(polyhedron.A, axis=1)
        # Rows along the set say nothing within it.
        crossing = np.linalg.norm(A, axis=1) > _FLAT**0.5 * lengths
        inner = vertices_of_polyhedron(type(polyhedron)(A[crossing], b[crossing]))
        return hull.to_global_coordinates(inner)
    vertices = _solid_vertices(polyhedron, 0.0)
    assert vertices is not None
    return vertices


def _solid_vertices(polyhedron: Any, least: float) -> np.ndarray | None:
    """Return the vertices of a set that has an interior, None of one that may have none.

    The latter where no ball inside is larger than ``least`` of the set's half widths.
    """
    A, b = polyhedron.A, polyhedron.b
    n = A.shape[1]
    ends = np.array([[polyhedron.support(s * e).value * s for s in (-1, 1)] for e in np.eye(n)])
    if n == 1:
        return ends.T
    deepest = find_deepest(polyhedron.lift().rows)
    center = deepest.x
    widths = 0.5 * (ends[:, 1] - ends[:, 0])
    if least > 0.0 and not deepest.radius > least * widths.max():
        return None
    rows = A * widths
    slack = b - A @ center
    named = np.linalg.norm(A, axis=1) > 0.0
    rows, slack = rows[named], slack[named]
    dual = rows / slack[:, None]
    planes = _hull(dual).equations
    found = -planes[:, :-1] / planes[:, -1:]
    lengths = np.linalg.norm(rows, axis=1)
    unit, sides = rows / lengths[:, None], slack / lengths
    # Where many rows meet, qhull has many faces for one vertex.
    blur = max(_NEAR, _SIDE_ROUNDING * float((np.abs(center) / widths).max()))
    near = _distinct(found[np.lexsort(found.T)], blur)
    distinct = _distinct(_where_rows_meet(unit, sides, near, blur), blur)
    worst = (distinct @ unit.T - sides).max()
    if worst > blur:
        raise SolverError(
            f"VPolytope: a vertex of the HPolyhedron is {worst:.1e} of its width outside; call"
            " reduce_inequalities() first"
        )
    return center + distinct * widths


def _where_rows_meet(
    unit: np.ndarray, sides: np.ndarray, vertices: np.ndarray, blur: float
) -> np.ndarray:
    """Return vertices ``(m, n)``, each on the rows that it is near to."""
    n = vertices.shape[1]
    touching = np.abs(sides - vertices @ unit.T) <= blur
    usual = touching.sum(axis=1) == n
    rows = np.nonzero(touching[usual])[1].reshape(-1, n)
    meet = np.abs(np.linalg.det(unit[rows])) > _CROSSING
    usual[usual], rows = meet, rows[meet]
    found = vertices.copy()
    for _ in range(2):
        rest = sides[rows] - np.einsum("ijk,ik->ij", unit[rows], found[usual])
        found[usual] += np.linalg.solve(unit[rows], rest[..., None])[..., 0]
        for k in np.flatnonzero(~usual):
            near = touching[k]
            rest = sides[near] - unit[near] @ found[k]
            found[k] += np.linalg.lstsq(unit[near], rest)[0]
    return found
