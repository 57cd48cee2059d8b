"""Boxes in which no pair can meet, and that they cover a region."""

from __future__ import annotations

from dataclasses import dataclass, field
import functools
import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.one_line import one_line
from scene_graph_ros.planning.certified.motion_reaches import motion_reaches
from scene_graph_ros.planning.certified.rational_kinematics import RationalForwardKinematics
from scene_graph_ros.planning.certified.tangent_region import TangentRegion
from scene_graph_ros.planning.checker.robot_clearance import poses_of_rows
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = ["BoxLevel", "DistanceCertificate", "RegionGrid", "needed_distances"]

_ROUNDING = 1e-9
"""Metres that are kept free for what rounding moves links by, and relative to the size of a row of
the region, by how much a box must be outside of it to be left out."""


@dataclass(frozen=True, eq=False)
class BoxLevel:
    """Cells of the region's bounding box after it was halved ``halvings`` ``(nq,)`` times.

    ``proven`` and ``outside`` ``(m, nq)`` are the numbers of cells along each position.
    """

    halvings: NDArray[np.int64]
    proven: NDArray[np.int64]
    outside: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class RegionGrid:
    """Where the cells of a region of q, or of s, are in q."""

    region: TangentRegion
    kinematics: RationalForwardKinematics | None
    """What relates s and q; None for a region of q."""

    @functools.cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The bounds ``(nq,)`` in q."""
        ends = self.region.lower, self.region.upper
        if self.kinematics is None:
            return ends
        low, high = (self.kinematics.compute_q_value(each) for each in ends)
        # The inverse rounds, too.
        out = 4.0 * np.spacing(np.maximum(np.abs(low), np.abs(high)))
        return low - out, high + out

    def halves(self, halvings: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return half of the width ``(nq,)`` of cells."""
        lower, upper = self.bounds
        return np.asarray(0.5 * (upper - lower) / 2.0**halvings)

    def centers(
        self, halvings: NDArray[np.int64], cells: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return the centres ``(m, nq)`` of cells."""
        return np.asarray(self.bounds[0] + (2 * cells + 1) * self.halves(halvings))

    def is_outside(
        self, halvings: NDArray[np.int64], cells: NDArray[np.int64]
    ) -> NDArray[np.bool_]:
        """Return a mask of the cells without a point of the region, with room for rounding."""
        region = self.region
        if not len(region.C):
            return np.zeros(len(cells), dtype=np.bool_)
        centers, half = self.centers(halvings, cells), self.halves(halvings)
        low, high = centers - half, centers + half
        if self.kinematics is not None:
            (first, last) = self.bounds
            low, high = (np.clip(each, first, last) for each in (low, high))
            low, high = (self.kinematics.compute_s_value(each) for each in (low, high))
        positive, negative = np.maximum(region.C, 0.0), np.minimum(region.C, 0.0)
        least = low @ positive.T + high @ negative.T
        sizes = np.abs(region.d) + np.abs(region.C) @ np.maximum(
            np.abs(region.lower), np.abs(region.upper)
        )
        return np.asarray((least > region.d + _ROUNDING * sizes).any(axis=1))

    def contains(self, q: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return a mask ``(m,)`` of the configurations ``(m, nq)`` in the region."""
        return self.region.contains(
            q if self.kinematics is None else self.kinematics.compute_s_value(q)
        )


@one_line()
@dataclass(frozen=True, eq=False)
class DistanceCertificate:
    """A certificate of a region by distances.

    ``status`` is ``proven``; ``collision``, with a configuration ``q`` of the region that is not
    free; or ``undecided``, where the boxes did not suffice: the share ``open_share`` of the
    region's bounding box is in none of them. In the centre of each box the distance of each pair
    is larger than all that any point of it can move relative to the other within the box.
    """

    plan: CheckerPlan = field(repr=False)
    snapshot: Snapshot = field(repr=False)
    grid: RegionGrid
    levels: tuple[BoxLevel, ...] = field(repr=False)
    split: tuple[int, ...]
    """Which position is halved after each level."""
    status: str
    reason: str
    q: NDArray[np.float64] | None = None
    open_share: float = 0.0

    @property
    def is_success(self) -> bool:
        """Whether the region is free; `verify` shows it."""
        return self.status == "proven"

    @property
    def num_boxes(self) -> int:
        """How many boxes were proven."""
        return sum(len(level.proven) for level in self.levels)

    @property
    def boxes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Centres, and half of the widths, of all proven boxes, ``(m, nq)`` each, in q."""
        centers, halves = [], []
        for level in self.levels:
            found = self.grid.centers(level.halvings, level.proven)
            centers.append(found)
            halves.append(np.broadcast_to(self.grid.halves(level.halvings), found.shape))
        return np.concatenate(centers), np.concatenate(halves)

    def verify(self) -> bool:
        """Tell whether the boxes cover the region and no pair can meet in any.

        Distances are those of the scene's own queries, one configuration after the other; the
        search asked the checker's kernels. Both are exact to double precision, with 1e-9 m to
        spare.
        """
        return self.is_success and self._covers() and all(map(self._is_free, self.levels))

    def _covers(self) -> bool:
        """Tell whether halving the bounding box again and again leaves nothing over."""
        n = len(self.grid.region.lower)
        halvings, alive = np.zeros(n, dtype=np.int64), {(0,) * n}
        for number, level in enumerate(self.levels):
            if (level.halvings != halvings).any():
                return False
            ended = {
                tuple(cell) for part in (level.proven, level.outside) for cell in part.tolist()
            }
            if not ended <= alive or not self.grid.is_outside(halvings, level.outside).all():
                return False
            alive -= ended
            if number < len(self.split):
                k = self.split[number]
                halvings = halvings.copy()
                halvings[k] += 1
                alive = {
                    (*cell[:k], 2 * cell[k] + side, *cell[k + 1 :])
                    for cell in alive
                    for side in (0, 1)
                }
        return not alive

    def _is_free(self, level: BoxLevel) -> bool:
        """Tell whether distances at the centres exceed the bodies' motion within the boxes."""
        plan = self.plan
        reaches = motion_reaches(plan, *self.grid.bounds)
        needed = needed_distances(plan, reaches @ self.grid.halves(level.halvings))
        rows = plan.bodies.rows[plan.pairs.bodies]
        rows[plan.pairs.swaps] = rows[plan.pairs.swaps, ::-1]
        for q in self.grid.centers(level.halvings, level.proven):
            X_WG = poses_of_rows(plan, q)
            near = np.flatnonzero(plan.least_distances(X_WG) <= needed)
            if not len(near):
                continue
            pairs, distances = plan.shapes.solve(X_WG, rows[near], math.inf)
            found = {(int(a), int(b)): d for (a, b), d in zip(pairs, distances, strict=True)}
            if any(
                found[int(a), int(b)] < needed[p]
                for p, (a, b) in zip(near, rows[near], strict=True)
            ):
                return False
        return True


def needed_distances(plan: CheckerPlan, ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance ``(p,)`` of each pair that is enough for so long ways ``(p,)``."""
    return np.asarray(plan.pairs.paddings + ways * (1.0 + _ROUNDING) + _ROUNDING)
