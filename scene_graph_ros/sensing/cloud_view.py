"""One cloud of a sensor, at a pose: its points, and the verdicts of its rays on earlier points."""

from __future__ import annotations

from dataclasses import dataclass
import functools
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.geometry.spatial.poses import inverse
from scene_graph_ros.geometry.spatial.sums import moved
from scene_graph_ros.sensing.depth_kernels import widen
from scene_graph_ros.sensing.depth_view import DepthRules, new_points_memory, NewPoints
from scene_graph_ros.sensing.near_cells import ROBOT
from scene_graph_ros.sensing.ray_kernels import (
    bin_rays,
    find_windows,
    judge_by_rays,
    place_cloud,
    RayGrid,
    widen_rays,
)

if TYPE_CHECKING:
    from scene_graph_ros.sensing.self_filter import SelfFilter

__all__ = ["CloudView"]

FloatArray = NDArray[np.float64]

_LEAST_EDGE, _LARGEST_EDGE = 1e-3, 0.05
"""Of a cell of directions: tangents of angles."""

_FINER = 3
"""Times that the cells are halved where the rays fill few of them."""


@one_line()
@dataclass(frozen=True, eq=False)
class CloudView:
    """Points ``(n, 3)`` of S, m, that a sensor at the origin of S saw, at ``X_WS``.

    ``size`` are the rows and columns of an organized cloud, in which neighbours are beside each
    other, and ``cells`` ``(n,)`` the points' places in it, None for all; in one row or column the
    directions tell which are beside each other.
    ``mask`` ``(n,)`` uint8 says which points are the robot's. Of the rules ``step`` does not
    matter; depths are distances from the origin, ``error`` is the points' radius, m, and
    ``shadow`` counts points beside each other.
    """

    p_SPs: FloatArray
    X_WS: FloatArray
    rules: DepthRules
    mask: NDArray[np.uint8]
    cells: NDArray[np.int64] | None = None
    size: tuple[int, int] = (1, 0)

    @classmethod
    def of(
        cls,
        p_SPs: FloatArray,
        X_WS: FloatArray,
        rules: DepthRules,
        own: SelfFilter | None = None,
        *,
        cells: NDArray[np.int64] | None = None,
        size: tuple[int, int] = (1, 0),
    ) -> CloudView:
        """Look at finite points; without ``own`` none of them is a robot's."""
        p_SPs = np.ascontiguousarray(p_SPs, np.float64)
        mask = np.zeros(len(p_SPs), np.uint8)
        view = cls(p_SPs, np.array(X_WS, np.float64), rules, mask, cells, size)
        if own is not None:
            view._mark(own)
        return view

    def _mark(self, own: SelfFilter) -> None:
        """Mark the points of the robot, and those beside them."""
        if own.mark(self.p_SPs, self.X_WS, self.rules.padding, self.mask) and self.rules.shadow:
            self._widen()

    def _widen(self) -> None:
        shadow, mask = self.rules.shadow, self.mask
        if min(self.size) <= 1:
            widen_rays(self.grid, shadow * self.grid.edge, mask)
            return
        organized = np.zeros(self.size, np.uint8)
        cells = slice(None) if self.cells is None else self.cells
        organized.reshape(-1)[cells] = mask
        widen(organized, shadow)
        mask[:] = organized.reshape(-1)[cells]

    @functools.cached_property
    def grid(self) -> RayGrid:
        """The rays, sorted by their directions."""
        return _grid_of(self.p_SPs, self.rules.near)

    def own_points(self) -> FloatArray:
        """Return the points ``(n, 3)`` of W that are the robot's, m."""
        return moved(self.p_SPs[self.mask == ROBOT], self.X_WS)

    def points(self) -> NewPoints:
        """Return the points in range and region that are not the robot's."""
        rules, n = self.rules, len(self.p_SPs)
        p_WPs, radii = new_points_memory.take(n + 1)
        lower, upper = (np.array(corner, np.float64) for corner in (rules.lower, rules.upper))
        count = place_cloud(
            *(self.p_SPs, self.mask, float(rules.near), float(rules.far), self.X_WS),
            *(lower, upper, p_WPs),
        )
        radii[:count] = rules.error
        return NewPoints(p_WPs[:count], radii[:count])

    def judge(self, p_WPs: FloatArray, radii: FloatArray) -> NDArray[np.uint8]:
        """Return the verdicts on earlier points: KEPT, CLEARED or SEEN_AGAIN, ``(n,)``."""
        verdicts, rules = np.zeros(len(p_WPs), np.uint8), self.rules
        if len(p_WPs):
            judge_by_rays(
                *(p_WPs, radii, self.grid, self.mask, inverse(self.X_WS)),
                *(float(rules.near), float(rules.far), float(rules.margin), verdicts),
            )
        return verdicts


def _grid_of(p_SPs: FloatArray, near: float) -> RayGrid:
    """Sort rays into cells of about one each, as far as they lie evenly."""
    bounds, near = np.empty((6, 4)), max(near, np.finfo(np.float64).tiny ** 0.5)
    count = find_windows(p_SPs, near, bounds)
    spans = np.maximum(bounds[:, 2:] - bounds[:, :2], 0.0)
    has_rays = bounds[:, 2] >= bounds[:, 0]
    area = float((spans[:, 0] * spans[:, 1])[has_rays].sum())
    edge = float(np.clip(np.sqrt(area / max(count, 1)), _LEAST_EDGE, _LARGEST_EDGE))
    rays, rows = np.empty((count, 4)), np.empty(count, np.int64)
    scratch = np.empty(len(p_SPs), np.int64)
    for finer in range(_FINER + 1):
        sizes = np.zeros((6, 3), np.int64)
        sizes[has_rays, 0] = (spans[has_rays, 1] / edge).astype(np.int64) + 1
        sizes[has_rays, 1] = (spans[has_rays, 0] / edge).astype(np.int64) + 1
        ends = np.cumsum(sizes[:, 0] * sizes[:, 1])
        sizes[1:, 2] = ends[:-1]
        starts, corners = (
            np.zeros(int(ends[-1]) + 2, np.int64),
            np.where(has_rays[:, np.newaxis], bounds[:, :2], 0.0),
        )
        filled = bin_rays(p_SPs, near, edge, corners, sizes, scratch, starts, rays, rows)
        if 4 * filled >= count or finer == _FINER or edge < 2.0 * _LEAST_EDGE:
            break
        edge *= 0.5
    return RayGrid(edge, corners, sizes, starts[1:], rays, rows)
