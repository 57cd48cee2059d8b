"""Regions that are proven free by distances: boxes are halved until no pair can meet in any.

Boxes of one size are looked at together, as the same distances are enough for all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.planning.certified.distance_certificate import (
    BoxLevel,
    DistanceCertificate,
    needed_distances,
    RegionGrid,
)
from scene_graph_ros.planning.certified.errors import CertificateError
from scene_graph_ros.planning.certified.motion_reaches import motion_reaches
from scene_graph_ros.planning.certified.tangent_region import bounded_region
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.configuration_checks import first_pairs
from scene_graph_ros.planning.pairs.check_kernels import NO_PAIR
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan

__all__ = ["certify_by_distances", "checked_max_boxes", "search_boxes"]


def certify_by_distances(
    checker: SceneGraphCollisionChecker,
    region: HPolyhedron,
    *,
    max_boxes: int = 1_000_000,
    threads: int = 1,
) -> DistanceCertificate:
    """Return a certificate by distances of a polyhedron of q, within the joints' limits.

    At the centre of a box each pair has a distance; within the box no point of it can move by more
    than its joints' motions times their reach. Where that is less, the pair cannot meet in the
    box; otherwise the box is halved. The count of boxes grows with the power of the number of
    joints: for up to four of them. At most ``max_boxes`` are looked at. Paddings are kept.

    Raises CertificateError for a region that is no polyhedron of q, empty, flat or unbounded, and
    for joints that are neither revolute nor prismatic.
    """
    if not isinstance(checker, SceneGraphCollisionChecker):
        raise CertificateError(
            f"checker must be a SceneGraphCollisionChecker, not {quoted(checker)}"
        )
    if not isinstance(region, HPolyhedron):
        raise CertificateError(f"region must be an HPolyhedron, not {quoted(region)}")
    tree = checker.plan.tree
    bounded = bounded_region(tree.position_names, (tree.lower, tree.upper), region.A, region.b)
    return search_boxes(checker, RegionGrid(bounded, None), checked_max_boxes(max_boxes), threads)


def checked_max_boxes(max_boxes: object) -> int:
    """Return a positive whole number. Raises CertificateError."""
    if type(max_boxes) is not int or max_boxes < 1:
        raise CertificateError(
            f"max_boxes must be a positive whole number, not {quoted(max_boxes)}"
        )
    return max_boxes


def search_boxes(
    checker: SceneGraphCollisionChecker, grid: RegionGrid, max_boxes: int, threads: int
) -> DistanceCertificate:
    """Halve a region's bounding box until all is proven, something collides, or boxes run out."""
    plan, snapshot = checker.plan, checker.snapshot
    reaches = motion_reaches(plan, *grid.bounds)
    n = len(grid.region.lower)
    halvings, cells = np.zeros(n, dtype=np.int64), np.zeros((1, n), dtype=np.int64)
    levels: list[BoxLevel] = []
    split: list[int] = []
    looked_at = 0
    while True:
        looked_at += len(cells)
        outside = grid.is_outside(halvings, cells)
        inner = cells[~outside]
        centers, half = grid.centers(halvings, inner), grid.halves(halvings)
        first = _too_near(plan, reaches @ half, centers, threads)
        is_open = first != NO_PAIR
        levels.append(BoxLevel(halvings.copy(), inner[~is_open], cells[outside]))
        left = inner[is_open]
        arguments = plan, snapshot, grid, tuple(levels)
        if not len(left):
            return DistanceCertificate(*arguments, tuple(split), "proven", "")
        witness = _colliding(plan, grid, centers[is_open], threads)
        if witness is not None:
            reason = f"it collides at {np.array2string(witness, precision=4)}"
            return DistanceCertificate(*arguments, tuple(split), "collision", reason, witness)
        if looked_at + 2 * len(left) > max_boxes:
            share = float(len(left) * 0.5 ** int(halvings.sum()))
            reason = (
                f"{looked_at} boxes left {share:.2%} of the region's bounding box open; max_boxes"
                f" is {max_boxes}"
            )
            return DistanceCertificate(
                *arguments, tuple(split), "undecided", reason, open_share=share
            )
        # Halve along the position that moves the pairs most that are too near.
        k = int(np.argmax((reaches[np.unique(first[is_open])] * half).max(axis=0)))
        split.append(k)
        halvings[k] += 1
        cells = np.repeat(left, 2, axis=0)
        cells[:, k] = 2 * cells[:, k] + np.tile([0, 1], len(left))


def _too_near(
    plan: CheckerPlan, ways: NDArray[np.float64], q: NDArray[np.float64], threads: int
) -> NDArray[np.int64]:
    """Return a pair of each configuration that is too near for such ways, or NO_PAIR."""
    # What only touches its padding is none to the kernel.
    paddings = needed_distances(plan, ways) + plan.pairs.touching
    return first_pairs(plan.with_paddings(paddings), q, threads)


def _colliding(
    plan: CheckerPlan, grid: RegionGrid, q: NDArray[np.float64], threads: int
) -> NDArray[np.float64] | None:
    """Return a configuration in the region that is not free, if one of these is."""
    inside = q[grid.contains(q)]
    rows = np.flatnonzero(first_pairs(plan, inside, threads) != NO_PAIR)
    return inside[rows[0]] if len(rows) else None
