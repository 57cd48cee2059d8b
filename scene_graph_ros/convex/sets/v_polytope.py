"""The convex hull of finitely many points, in any number of dimensions."""

from __future__ import annotations

from collections.abc import Callable
import functools
from pathlib import Path
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError, SolverError
from scene_graph_ros.convex.questions.answers import gaps_of, Projection, Support
from scene_graph_ros.convex.questions.arguments import (
    as_corners_dimension,
    as_matrix,
    as_vector,
)
from scene_graph_ros.convex.sets.conversions import (
    corners_of,
    half_spaces_of_vertices,
    shape_of_hull,
    volume_of,
)
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.from_shapes import (
    is_query,
    placed_shape,
    vertices_of,
)
from scene_graph_ros.convex.solve.cones.lift import Lift
from scene_graph_ros.convex.solve.exact.corners import Points
from scene_graph_ros.convex.solve.nearest.nearest_in_hull import nearest_in_hull
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["VPolytope"]


_ROUNDING = 4.0 * EPSILON
"""Relative to coordinates: a nearest point that is off by no more may be the point itself."""

_NOTHING = np.zeros((0, 0))


class VPolytope(ConvexSet):
    """The hull of ``vertices (m, n)``, as rows; empty if there are none. It is always bounded.

    ``VPolytope(h_polyhedron)`` has the vertices of a bounded polyhedron,
    ``VPolytope(query, geometry_id, reference_frame=None)`` those of a box, a hull or a convex mesh
    that is registered, in a frame, the world by default.
    """

    _IS_ALWAYS_BOUNDED = True
    _HAS_QUICK_SUPPORT = True

    def __init__(
        self,
        vertices: Any = _NOTHING,
        geometry_id: GeometryId | None = None,
        reference_frame: FrameId | None = None,
    ) -> None:
        """Take points, a bounded polyhedron or a geometry. Raises ConvexSetError for others."""
        if is_query(vertices):
            assert geometry_id is not None
            vertices = vertices_of(
                *placed_shape(vertices, geometry_id, reference_frame), "VPolytope"
            )
        elif isinstance(vertices, ConvexSet):
            corners = vertices._corners()
            vertices = vertices if corners is None else corners
        self._vertices = as_matrix(vertices, "VPolytope: vertices")
        super().__init__(self._vertices.shape[1])

    @classmethod
    def make_box(cls, lb: Any, ub: Any) -> VPolytope:
        """Return the box between two corners ``(n,)``."""
        low = as_vector(lb, "VPolytope.make_box: lb")
        high = as_vector(ub, "VPolytope.make_box: ub", len(low))
        as_corners_dimension(len(low), "VPolytope.make_box: the length of lb")
        corners = np.array(np.meshgrid(*np.stack([low, high], axis=1), indexing="ij"))
        return cls(corners.reshape(len(low), -1).T if len(low) else np.zeros((1, 0)))

    @classmethod
    def make_unit_box(cls, dim: int) -> VPolytope:
        """Return the box from -1 to 1 along each axis."""
        n = as_corners_dimension(dim, "VPolytope.make_unit_box: dim")
        return cls.make_box(-np.ones(n), np.ones(n))

    @property
    def vertices(self) -> np.ndarray:
        """The points ``(m, n)`` as they were given."""
        return self._vertices

    def lift(self) -> Lift:
        """Return ``x = vertices.T @ w``, ``sum w = 1`` as equations and ``w >= 0`` as rows."""
        m, n = self._vertices.shape
        E = np.zeros((n + 1, n + m))
        E[:n, :n], E[:n, n:], E[n, n:] = np.eye(n), -self._vertices.T, 1.0
        A = np.concatenate([np.zeros((m, n)), -np.eye(m)], axis=1)
        return Lift(E, np.append(np.zeros(n), 1.0), A, np.zeros(m))

    def maybe_get_feasible_point(self) -> np.ndarray | None:
        """Return the first vertex; None if there is none."""
        return self._vertices[0] if len(self._vertices) else None

    @functools.cached_property
    def corners(self) -> Points | None:
        """The points."""
        return Points(self.vertices) if len(self.vertices) else None

    def _hull_of_points(self) -> Callable[[np.ndarray], ConvexSet]:
        return VPolytope

    def _is_quickly_empty(self) -> bool:
        return not len(self._vertices)

    def _half_spaces(self) -> tuple[np.ndarray, np.ndarray]:
        n = self.ambient_dimension
        if len(self._vertices):
            return half_spaces_of_vertices(self._vertices)
        if n == 0:
            raise ConvexSetError(
                "HPolyhedron: an empty VPolytope without dimensions is no HPolyhedron, which is"
                " {0}"
            )
        # Nothing is at once below -1 and above 1.
        return np.concatenate([np.eye(n)[:1], -np.eye(n)[:1]]), np.array([-1.0, -1.0])

    def maybe_get_point(self) -> np.ndarray | None:
        """Return the point where all vertices are equal."""
        is_one = len(self._vertices) and (self._vertices == self._vertices[0]).all()
        return self._vertices[0] if is_one else None

    def get_minimal_representation(self) -> VPolytope:
        """Return the hull by its corners alone.

        In the plane they are counter-clockwise, from the one furthest along -x. A point is left
        out if it is nearer than 1e-12 of the set's size to the hull of the others.
        """
        return VPolytope(corners_of(self._vertices))

    def write_obj(self, filename: str | Path) -> None:
        """Write corners and outward triangles as an OBJ file. Raises ConvexSetError unless 3D."""
        from scene_graph_ros.geometry.meshes.hull import convex_hull

        if self.ambient_dimension != 3 or not len(self._vertices):
            raise ConvexSetError(
                "VPolytope.write_obj: only points in 3 dimensions can be written, these are"
                f" {self._vertices.shape}"
            )
        hull = convex_hull(self._vertices)
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in hull.vertices.tolist()]
        lines += ["f " + " ".join(str(k + 1) for k in face) for face in hull.faces]
        Path(filename).write_text("\n".join(lines) + "\n")

    def _nearest(self, points: np.ndarray) -> np.ndarray:
        nearest, _, failed = nearest_in_hull(self._vertices, points)
        if failed >= 0:
            raise SolverError(
                f"VPolytope: no nearest point to {points[failed]} was found within the allowed"
                " steps; get_minimal_representation() may have fewer vertices"
            )
        return nearest

    def _outside(self, points: np.ndarray) -> np.ndarray:
        if not len(self._vertices):
            return np.full(len(points), np.inf)
        if not self.ambient_dimension:
            return np.zeros(len(points))
        found = np.linalg.norm(points - self._nearest(points), axis=1)
        size = np.abs(points).max(axis=1) + np.abs(self._vertices).max()
        return np.where(found <= _ROUNDING * np.sqrt(self.ambient_dimension) * size, 0.0, found)

    def _support(self, d: np.ndarray) -> Support:
        if not len(self._vertices):
            raise ConvexSetError("VPolytope.support: the set is empty; ask is_empty() first")
        reached = product(self._vertices, d)
        k = int(reached.argmax())
        return Support(float(reached[k]), self._vertices[k], 0.0)

    def _inner_reach(self, d: np.ndarray) -> tuple[np.ndarray, float] | None:
        return self._support(d).point, 0.0

    def _project(self, points: np.ndarray) -> Projection:
        nearest = self._nearest(points) if self.ambient_dimension else points.copy()

        def reach(direction: np.ndarray, k: int) -> float:
            return float(product(self._vertices - nearest[k], direction).max())

        distances, gaps = gaps_of(points, nearest, reach)
        return Projection(distances, nearest, gaps)

    @property
    def has_exact_volume(self) -> bool:
        """Always."""
        return True

    def _volume(self) -> float:
        return volume_of(self._vertices)

    def _shape_with_pose(self) -> tuple[Shape, np.ndarray]:
        return shape_of_hull(self._vertices)
