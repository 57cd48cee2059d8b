"""Pairs of robots' bodies with clouds that do not move, apart from all others of a plan.

There is a faster way to decide them by yes or no than that of all other pairs, see ``cloud_scan``.
"""

from __future__ import annotations

from itertools import product as product_of
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.planning.pairs.checker_plan import CheckerPlan
from scene_graph_ros.planning.pairs.cloud_grid import count_points, grid_scale, king_moves
from scene_graph_ros.planning.pairs.cloud_tables import CloudScratch, CloudTable
from scene_graph_ros.robots.tree_kernels import LANES

__all__ = ["SplitPlan", "new_scratch", "split_of"]

_SLACK = 1e-13
"""Of all lengths that are added: more than rounding moves points by."""

_GROUP = 1.3
"""How much larger than its largest body's ball that of a group may be."""

_PARTS = np.array(list(product_of((0.0, 0.25, 0.5, 0.75), repeat=3)))
"""Of a hull's box: boxes that are tried in it."""

_INWARDS = 1.0 - 1e-12
"""Times the radii of balls in hulls: more than rounding adds to them."""

_KEPT = 4
"""Plans whose pairs are kept apart."""


class SplitPlan(NamedTuple):
    """A plan in two."""

    plan: CheckerPlan
    others: CheckerPlan
    """Without pairs with clouds that do not move."""
    rows: NDArray[np.int64]
    """Which of the plan's pairs these are."""
    table: CloudTable


def new_scratch(plan: CheckerPlan) -> CloudScratch:
    """Return scratch for one thread."""
    robots = len(plan.carried)
    return CloudScratch(
        np.empty((robots, 12, LANES)),
        np.empty((robots, 6, LANES)),
        np.full((robots, 2), -1),
    )


_splits: dict[int, SplitPlan] = {}
"""The newest last. Each step is one operation of a dict: no lock is left behind."""


def split_of(plan: CheckerPlan) -> SplitPlan | None:
    """Return the plan's pairs in two, or None where none is with a cloud that does not move."""
    if not plan.shapes.clouds:
        return None
    key = id(plan.pairs)
    known = _splits.get(key)
    if known is not None and _is_of(known.plan, plan):
        return known
    split = _split(plan)
    if split is not None:
        _splits.pop(key, None)
        _splits[key] = split
        for oldest in list(_splits)[:-_KEPT]:
            _splits.pop(oldest, None)
    return split


def _is_of(known: CheckerPlan, plan: CheckerPlan) -> bool:
    """Tell whether nothing that a split is made of has changed."""
    return (
        known.pairs is plan.pairs and known.shapes is plan.shapes and known.bodies is plan.bodies
    )


def _split(plan: CheckerPlan) -> SplitPlan | None:
    table, robots = plan.shapes.table, len(plan.carried)
    first = plan.shapes.first_element
    first_field = len(table.kind) - len(plan.shapes.fields)
    a, b = plan.pairs.bodies.T
    row_b = plan.bodies.rows[b]
    is_quick = (b >= robots) & (row_b >= first) & (row_b < first_field)
    is_quick &= np.isfinite(plan.bodies.radii[a])
    is_quick &= plan.bodies.rows[a] < first
    if not is_quick.any():
        return None
    pairs = np.flatnonzero(is_quick)
    cloud_of = row_b[pairs] - first
    pairs = pairs[np.lexsort([a[pairs], cloud_of])]
    cloud_of = row_b[pairs] - first
    groups: list[tuple[int, int]] = []
    clouds: list[tuple[int, int, int]] = []
    for cloud in np.unique(cloud_of).tolist():
        own = np.flatnonzero(cloud_of == cloud)
        begin = len(groups)
        groups += _groups(plan, a[pairs], int(own[0]), int(own[-1]) + 1)
        clouds.append((cloud, begin, len(groups)))
    starts, planes = _planes(plan)
    X_WC = np.stack([plan.bodies.X_WG[b[pairs[groups[g][0]]] - robots] for _, g, _ in clouds])
    R_CW = X_WC[:, :, :3].transpose(0, 2, 1)
    X_CW = np.concatenate([R_CW, product(-R_CW, X_WC[:, :, 3:])], axis=2)
    counts = np.stack([count_points(plan.shapes.clouds[cloud].tree) for cloud, _, _ in clouds])
    quick = CloudTable(
        pairs,
        np.ascontiguousarray(a[pairs]),
        plan.pairs.paddings[pairs],
        plan.pairs.touching[pairs],
        np.array(groups, np.int64).reshape(-1, 2),
        np.array(clouds, np.int64),
        np.ascontiguousarray(X_CW),
        np.ascontiguousarray(X_WC),
        np.array([_slack(plan, cloud, X) for (cloud, _, _), X in zip(clouds, X_WC, strict=True)]),
        counts,
        np.stack([king_moves(each) for each in counts]),
        np.stack([grid_scale(plan.shapes.clouds[cloud].tree) for cloud, _, _ in clouds]),
        starts,
        planes,
        _inner(plan, starts, planes),
    )
    rows = np.flatnonzero(~is_quick)
    return SplitPlan(plan, plan.with_rows(rows), rows, quick)


def _slack(plan: CheckerPlan, cloud: int, X_WC: NDArray[np.float64]) -> float:
    tree = plan.shapes.clouds[cloud].tree
    far = float(np.abs(tree.bounds).max()) if len(tree.points) else 0.0
    out = float(plan.reaches.max(initial=0.0)) + float(np.abs(plan.tree.X_WB[:3, 3]).max())
    links = float(np.abs(plan.tree.table.X_PJ[:, :, 3]).sum())
    return _SLACK * (1.0 + far + float(np.abs(X_WC[:, 3]).max()) + out + links)


def _groups(
    plan: CheckerPlan, bodies: NDArray[np.int64], first: int, last: int
) -> list[tuple[int, int]]:
    """Return neighbours in the order of bodies that one ball hardly larger than theirs holds.

    That is where all joints are at zero; elsewhere only the time that it saves may be another.
    """
    tree, table = plan.tree, plan.bodies
    X_WJ = tree.link_poses(tree.zero_configuration()) if tree.num_positions else None
    if X_WJ is None or not np.isfinite(X_WJ).all():
        return [(k, k + 1) for k in range(first, last)]
    X_WG = product(X_WJ[plan.owners[: len(plan.carried)]], plan.X_LG)
    centers = np.einsum("nij,nj->ni", X_WG[:, :3, :3], table.centers[: len(X_WG)])
    centers += X_WG[:, :3, 3]
    result, begin = [], first
    for k in range(first + 1, last + 1):
        if k < last:
            own = bodies[begin : k + 1]
            middle, radii = centers[own].mean(axis=0), table.radii[own]
            if (np.linalg.norm(centers[own] - middle, axis=1) + radii).max() <= (
                _GROUP * radii.max()
            ):
                continue
        result.append((begin, k))
        begin = k
    return result


def _planes(plan: CheckerPlan) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the planes of the faces of robots' bodies that are hulls or boxes."""
    table, found = plan.shapes.table, [np.empty((0, 4))]
    counts = [0]
    for row in plan.bodies.rows[: len(plan.carried)].tolist():
        planes = np.empty((0, 4))
        if table.kind[row] == ShapeKind.BOX:
            normals = np.concatenate([np.eye(3), -np.eye(3)])
            planes = np.column_stack([normals, np.tile(table.size[row], 2)])
        elif table.hull[row] >= 0:
            hulls, hull = table.hulls, table.hull[row]
            faces = slice(hulls.face_start[hull], hulls.face_start[hull + 1])
            planes = np.column_stack([hulls.face_normals[faces], hulls.face_offsets[faces]])
            planes = planes[_spread(planes[:, :3])]
        found.append(planes)
        counts.append(len(planes))
    return np.cumsum(counts).astype(np.int64), np.concatenate(found)


def _inner(
    plan: CheckerPlan, starts: NDArray[np.int64], planes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return rounded boxes ``(r, 4)`` in robots' bodies, see ``CloudTable``.

    In hulls they are the largest of some about the same centre.
    """
    bodies, robots = plan.bodies, len(plan.carried)
    result = np.ascontiguousarray(bodies.inner[:robots, 1:])
    for a in range(robots):
        own = planes[starts[a] : starts[a + 1]]
        is_box = plan.shapes.table.kind[bodies.rows[a]] == ShapeKind.BOX
        if is_box or not len(own) or result[a, 3] < 0.0:
            continue
        halves = _PARTS * (0.5 * (bodies.upper[a] - bodies.lower[a]))
        room = own[:, 3] - product(own[:, :3], bodies.centers[a])
        for axis in range(3):
            room = room - halves[:, axis, np.newaxis] * np.abs(own[:, axis])
        radii = _INWARDS * room.min(axis=1)
        best = int(np.where(radii > 0.0, _volumes(halves, radii), -np.inf).argmax())
        result[a, :3], result[a, 3] = halves[best], radii[best]
    return result


def _volumes(halves: NDArray[np.float64], radii: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the volumes of boxes ``(n, 3)``, by half their edges, within balls (Steiner's)."""
    x, y, z = halves.T
    squares, cubes = radii * radii, radii * radii * radii
    faces, edges = x * y + y * z + z * x, x + y + z
    result: NDArray[np.float64] = 8.0 * (x * y * z + radii * faces)
    return result + np.pi * (2.0 * squares * edges + 4.0 / 3.0 * cubes)


def _spread(normals: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return an order of normals ``(n, 3)`` in which those that follow each other differ.

    Each in turn is of another cell of directions, so that few planes tell where most points are.
    """
    largest = np.abs(normals).argmax(axis=1)
    rows = np.arange(len(normals))
    signs = normals > 0.0
    steep = np.abs(normals) > 0.5 * np.abs(normals[rows, largest])[:, np.newaxis]
    bits = np.array([1, 2, 4])
    cells = largest * 64 + (signs * bits).sum(axis=1) + 8 * (steep * bits).sum(axis=1)
    order = np.argsort(cells, kind="stable")
    first = np.searchsorted(cells[order], cells[order])
    rank = np.empty_like(rows)
    rank[order] = rows - first
    return np.lexsort([cells, rank])
