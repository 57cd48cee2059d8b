"""Whether a region is free in a scene, and the geometries that reach into it."""

from __future__ import annotations

from collections.abc import Collection, Container, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.iris.obstacles import Obstacles
from scene_graph_ros.convex.iris.scene_obstacles import (
    check_query,
    obstacles_of,
    SceneObstacle,
)
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.geometry.broadphase.extents import extents_of
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["RegionCut", "RegionTest", "find_region_cuts"]

_ROUNDING = 32.0 * EPSILON
"""Relative to the largest coordinate: what products of rows and points may be off by."""


@one_line()
@dataclass(frozen=True, eq=False)
class RegionCut:
    """A geometry that reaches into a region, or may do so.

    ``depth`` is how far the nearest face has to move in, metres, so that the geometry is outside;
    0 where they touch. ``point`` ``(3,)`` in the world is one that they share. ``is_proven`` is
    False where a curved geometry touches the region as nearly as can be told.
    """

    geometry_id: GeometryId
    depth: float
    point: np.ndarray
    is_proven: bool


def find_region_cuts(
    region: HPolyhedron,
    query: QueryObject,
    *,
    ignored: Container[GeometryId] = frozenset(),
    among: Collection[GeometryId] | None = None,
) -> list[RegionCut]:
    """Return the geometries that reach into a bounded region of the world, by id; [] if free.

    All geometry with the proximity role counts, where it is in the query's snapshot, but for the
    ignored; or ``among`` alone. Meshes count by their hulls, and deformable ones by the hull of
    its vertices. That a geometry is outside is known from a face by more than rounding, or decided
    exactly. Raises ConvexSetError for any other region.
    """
    return RegionTest(region).cuts(query, ignored=ignored, among=among)


@one_line()
class RegionTest:
    """A bounded region of the world, ready to be looked at in one snapshot after another."""

    def __init__(self, region: HPolyhedron) -> None:
        """Raise ConvexSetError for a region that is unbounded or not in three dimensions."""
        self._region, self._box = region, _checked(region)
        self._normals, self._sides = _unit_rows(region)
        self.is_empty = region.is_empty()

    def cuts(
        self,
        query: QueryObject,
        *,
        ignored: Container[GeometryId] = frozenset(),
        among: Collection[GeometryId] | None = None,
    ) -> list[RegionCut]:
        """Return the same as `find_region_cuts`."""
        check_query(query, "find_region_cuts")
        if self.is_empty:
            return []
        near = _near(query, self._normals, self._sides, ignored, among)
        if not near:
            return []
        box = self._box
        obstacles = Obstacles([each.convex_set for each in near], box)
        size = max(float(np.abs([box.lb, box.ub]).max()), obstacles.size())
        left = obstacles.counts.copy()
        for normal, side in zip(self._normals, self._sides.tolist(), strict=True):
            left &= ~obstacles.beyond(left, normal, side + _ROUNDING * size)
        found = [
            self._cut(near[k].geometry_id, obstacles, k) for k in np.flatnonzero(left).tolist()
        ]
        return [cut for cut in found if cut is not None]

    def _cut(self, geometry_id: GeometryId, obstacles: Obstacles, k: int) -> RegionCut | None:
        """Return the cut of an obstacle into the region, None where it is shown not to."""
        decision = self._region.intersects_with(obstacles.sets[k], certificate=True)
        if not decision.value:
            return None
        floors = [obstacles.floor(k, normal) for normal in self._normals]
        depth = max(float((self._sides - floors).min(initial=np.inf)), 0.0)
        certificate = decision.certificate
        return RegionCut(geometry_id, depth, certificate.vector[:3], certificate.kind == "point")


def _checked(region: Any) -> Hyperrectangle:
    """Return the box around a region."""
    if not isinstance(region, HPolyhedron) or region.ambient_dimension != 3:
        raise ConvexSetError(
            "find_region_cuts: region must be an HPolyhedron in 3 dimensions, not"
            f" {quoted(region)}"
        )
    if region.is_empty():
        return Hyperrectangle(np.zeros(3), np.zeros(3))
    box = Hyperrectangle.maybe_calc_axis_aligned_bounding_box(region)
    if box is None:
        raise ConvexSetError(
            "find_region_cuts: the region is unbounded; intersect it with a box,"
            " HPolyhedron.make_box"
        )
    return box


def _unit_rows(region: HPolyhedron) -> tuple[np.ndarray, np.ndarray]:
    """Return the faces with normals of length 1, ``(m, 3)`` and ``(m,)``."""
    lengths = np.linalg.norm(region.A, axis=1)
    named = lengths > 0.0
    return region.A[named] / lengths[named, None], region.b[named] / lengths[named]


def _near(
    query: QueryObject,
    normals: np.ndarray,
    sides: np.ndarray,
    ignored: Container[GeometryId],
    among: Collection[GeometryId] | None,
) -> Sequence[SceneObstacle]:
    """Return the geometries that no ball shows to be beyond a face, by id."""
    inspector, snapshot = query.inspector(), query.snapshot
    arrays, X_WG = snapshot.proximity, snapshot.X_WG
    extents = extents_of(arrays.table)
    reach = np.abs(extents)
    # Parts of an extent add up: no geometry is further from its origin than by all of them.
    radii = reach.sum(axis=1)
    hulls = arrays.table.hull >= 0
    centers = X_WG[:, :3, 3].copy()
    middle = 0.5 * (arrays.table.lower[hulls] + arrays.table.upper[hulls])
    centers[hulls] += np.einsum("kij,kj->ki", X_WG[hulls, :3, :3], middle)
    ids = arrays.geometry_ids
    beyond = np.zeros(len(ids), dtype=bool)
    if len(sides) and len(ids):
        slack = (centers @ normals.T - sides).max(axis=1) - radii
        beyond = slack > _ROUNDING * (np.abs(centers).max(axis=1) + radii + np.abs(sides).max())
    deformable = inspector.get_all_deformable_geometry_ids()
    soft = {*deformable} & {*inspector.get_all_geometry_ids(Role.PROXIMITY)}
    soft |= {*snapshot.state.element_ids(Role.PROXIMITY)}
    wanted = [each for each, away in zip(ids, beyond.tolist(), strict=True) if not away]
    return [
        SceneObstacle(each, convex_set)
        for each in sorted({*wanted, *soft})
        if each not in ignored and (among is None or each in among)
        for convex_set in obstacles_of(query, each)
    ]
