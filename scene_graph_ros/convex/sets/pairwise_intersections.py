"""Which sets of two lists meet, also where joints turn without an end."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_list
from scene_graph_ros.convex.questions.extents import bounds_of
from scene_graph_ros.convex.questions.quick_pairs import meet_quickly, near_boxes
from scene_graph_ros.convex.sets.cartesian_product import CartesianProduct
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.point import Point
from scene_graph_ros.convex.solve.floats.quick_points import OPEN, POINT
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = [
    "as_joints",
    "check_if_satisfies_convexity_radius",
    "check_widths",
    "compute_pairwise_intersections",
    "own_box",
    "translated",
]

_TURN = 2.0 * np.pi

_ROUNDING = 1e-12
"""Relative to the coordinates: boxes that are so near may touch; the sets themselves decide."""

_ENDLESS = 1e150
"""In place of an end, where coordinates have none; their sums are still numbers."""

_ROOM = 16
"""For so many neighbours a set there is room at first."""

Boxes = tuple[np.ndarray, np.ndarray]


def check_if_satisfies_convexity_radius(
    convex_set: ConvexSet, continuous_revolute_joints: Sequence[int]
) -> bool:
    """Tell whether a set is narrower than pi along each joint that turns without an end.

    Then a straight line between two of its points is the shortest way between them (Cohn,
    Petersen, Simchowitz and Tedrake, "Non-Euclidean Motion Planning with Graphs of
    Geodesically-Convex Sets", 2023). Raises ConvexSetError for joints that the set doesn't have.
    """
    label = "check_if_satisfies_convexity_radius"
    _checked([convex_set], f"{label}: convex_set")
    joints = as_joints(continuous_revolute_joints, convex_set.ambient_dimension, label)
    for direction in np.eye(convex_set.ambient_dimension)[joints]:
        ways = [convex_set.support(sign * direction) for sign in (1.0, -1.0)]
        if not sum(each.value for each in ways) < np.pi:
            return False
    return True


def compute_pairwise_intersections(
    convex_sets_A: Sequence[ConvexSet],
    convex_sets_B: Sequence[ConvexSet] | None = None,
    continuous_revolute_joints: Sequence[int] = (),
    *,
    bboxes_A: Sequence[Hyperrectangle] | None = None,
    bboxes_B: Sequence[Hyperrectangle] | None = None,
    preprocess_bbox: bool = True,
) -> tuple[list[tuple[int, int]], list[np.ndarray]]:
    """Return the pairs (i, j) of sets that have a point in common, and an offset ``(n,)`` each.

    Set i of A, moved by the offset, meets set j of B: whole turns of the joints that turn without
    an end, 0 elsewhere. Without ``convex_sets_B`` the sets of A are compared with each other, and
    both (i, j) and (j, i) are there; joints may then come second, as whole numbers. Sets whose
    boxes are apart are not asked; for others, that of boxes and points is a comparison, of the
    rest an exact decision (`ConvexSet.intersects_with`).

    ``bboxes_A`` and ``bboxes_B`` are boxes around the sets, which otherwise are computed. Raises
    ConvexSetError for sets that are empty or unbounded, of different dimensions, or as wide as pi
    along such a joint. With ``preprocess_bbox=False`` no boxes are computed, only how wide sets
    are along such joints: each pair is asked, which pays where nearly all meet, and sets may be
    unbounded or empty.
    """
    label = "compute_pairwise_intersections"
    A = _checked(convex_sets_A, f"{label}: convex_sets_A")
    if _are_joints(convex_sets_B) and not len(continuous_revolute_joints):
        convex_sets_B, continuous_revolute_joints = None, convex_sets_B  # type: ignore[assignment]
    is_one_list = convex_sets_B is None
    if not is_one_list and not len(as_list(convex_sets_B, f"{label}: convex_sets_B")):
        raise ConvexSetError(
            f"{label}: convex_sets_B must be one set or more, not empty; without joints leave it"
            " out, as in compute_pairwise_intersections(sets)"
        )
    B = A if convex_sets_B is None else _checked(convex_sets_B, f"{label}: convex_sets_B")
    n = A[0].ambient_dimension
    if B[0].ambient_dimension != n:
        raise ConvexSetError(
            f"{label}: convex_sets_B have {B[0].ambient_dimension} dimensions, convex_sets_A {n}"
        )
    joints = as_joints(continuous_revolute_joints, n, label)
    bounds = None if preprocess_bbox else joints
    boxes_A = _boxes(A, bboxes_A, f"{label}: bboxes_A", bounds)
    boxes_B = boxes_A if is_one_list else _boxes(B, bboxes_B, f"{label}: bboxes_B", bounds)
    check_widths(boxes_A, joints, f"{label}: convex_sets_A")
    check_widths(boxes_B, joints, f"{label}: convex_sets_B")
    pairs, turns = _near_pairs(boxes_A, boxes_B, joints, is_one_list)
    offsets = _TURN * turns
    is_there = _meet_all(A, B, (boxes_A, boxes_B), pairs, offsets)
    pairs, offsets = pairs[is_there], offsets[is_there]
    if is_one_list:
        pairs = np.stack([pairs, pairs[:, ::-1]], axis=1).reshape(2 * len(pairs), 2)
        offsets = np.stack([offsets, 0.0 - offsets], axis=1).reshape(len(pairs), n)
    return [(i, j) for i, j in pairs.tolist()], list(offsets)


def _are_joints(values: Any) -> bool:
    """Tell whether these are whole numbers, and at least one."""
    is_list = isinstance(values, (list, tuple, np.ndarray)) and len(values) > 0
    return is_list and all(
        isinstance(each, (int, np.integer)) and not isinstance(each, bool) for each in values
    )


def as_joints(joints: Any, dimension: int, label: str) -> list[int]:
    """Return different indices of coordinates. Raises ConvexSetError."""
    found: list[int] = []
    for joint in as_list(joints, f"{label}: continuous_revolute_joints"):
        is_whole = isinstance(joint, (int, np.integer)) and not isinstance(joint, bool)
        if not is_whole or not 0 <= joint < dimension or int(joint) in found:
            raise ConvexSetError(
                f"{label}: continuous_revolute_joints must be different whole numbers from 0 to"
                f" {dimension - 1}, not {quoted(joints)}"
            )
        found.append(int(joint))
    return found


def translated(convex_set: ConvexSet, offset: np.ndarray) -> ConvexSet:
    """Return all points of a set, moved by an offset ``(n,)``."""
    if not offset.any():
        return convex_set
    if isinstance(convex_set, Point):
        return Point(convex_set.x + offset)
    if isinstance(convex_set, Hyperrectangle):
        return Hyperrectangle(convex_set.lb + offset, convex_set.ub + offset)
    if isinstance(convex_set, HPolyhedron):
        return HPolyhedron(convex_set.A, convex_set.b + product(convex_set.A, offset))
    return CartesianProduct([convex_set], A=np.eye(len(offset)), b=-offset)


def _checked(sets: Any, label: str) -> list[ConvexSet]:
    found = as_list(sets, label)
    if not found:
        raise ConvexSetError(f"{label} must be one set or more, not empty")
    for k, each in enumerate(found):
        if not isinstance(each, ConvexSet):
            raise ConvexSetError(f"{label}[{k}] must be a ConvexSet, not {quoted(each)}")
        if each.ambient_dimension != found[0].ambient_dimension:
            raise ConvexSetError(
                f"{label}[{k}] has {each.ambient_dimension} dimensions, {label}[0] has"
                f" {found[0].ambient_dimension}"
            )
    return found


def own_box(convex_set: ConvexSet) -> Boxes | None:
    """Return the corners of a box, or a point, exactly; None of other sets."""
    if isinstance(convex_set, Point):
        return convex_set.x, convex_set.x
    if isinstance(convex_set, Hyperrectangle):
        return convex_set.lb, convex_set.ub
    box = convex_set.own_box if isinstance(convex_set, HPolyhedron) else None
    if box is not None and (box[0] <= box[1]).all():
        return box
    return None


def _boxes(
    sets: list[ConvexSet],
    given: Sequence[Hyperrectangle] | None,
    label: str,
    bounds: list[int] | None,
) -> Boxes:
    """Return the lower and upper corners ``(m, n)`` of boxes around sets.

    With ``bounds`` boxes of other sets are computed along these coordinates alone.
    """
    n = sets[0].ambient_dimension
    given = None if given is None else as_list(given, label)
    for each in given or ():
        if not isinstance(each, Hyperrectangle) or each.ambient_dimension != n:
            raise ConvexSetError(
                f"{label} must be Hyperrectangles in {n} dimensions, not {quoted(each)}"
            )
    if given is not None and len(given) != len(sets):
        raise ConvexSetError(f"{label} must have {len(sets)} boxes, one a set, not {len(given)}")
    found = []
    for k, each in enumerate(sets):
        box = own_box(each) if given is None else (given[k].lb, given[k].ub)
        if box is None:
            box = bounds_of(each) if bounds is None else _bounds_along(each, bounds)
        if box is None:
            raise ConvexSetError(f"{label}: set {k}, {quoted(each)}, is empty or unbounded")
        found.append(box)
    low, high = (np.array(corners) for corners in zip(*found, strict=True))
    return low, high


def _bounds_along(of: ConvexSet, coordinates: list[int]) -> Boxes | None:
    """Return corners ``(n,)`` around a set along some coordinates, without an end along others."""
    low, high = np.full((2, of.ambient_dimension), _ENDLESS)
    for k in coordinates:
        if of.is_empty():
            return None
        axis = np.eye(of.ambient_dimension)[k]
        down, up = of.support(-axis), of.support(axis)
        low[k], high[k] = down.value + down.gap, up.value + up.gap
    if not (np.isfinite(low) & np.isfinite(high)).all():
        return None
    return -low, high


def check_widths(boxes: Boxes, joints: list[int], label: str) -> None:
    """Raise ConvexSetError where a box ``(m, n)``, ``(m, n)`` is as wide as pi along a joint."""
    widths = (boxes[1] - boxes[0])[:, joints]
    if (widths >= np.pi).any():
        k, column = (int(v) for v in np.argwhere(widths >= np.pi)[0])
        raise ConvexSetError(
            f"{label}[{k}] is {widths[k, column]:.6g} wide along joint {joints[column]}, which"
            " turns without an end; it must be narrower than pi"
        )


def _near_pairs(
    boxes_A: Boxes, boxes_B: Boxes, joints: list[int], is_one_list: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs ``(k, 2)`` of boxes that may touch, after how many turns ``(k, n)``.

    Of one list each pair is there once. Two intervals narrower than pi meet after one number of
    turns at most.
    """
    n = boxes_A[0].shape[1]
    is_turning = np.zeros(n, dtype=np.bool_)
    is_turning[joints] = True
    A, B = np.stack(boxes_A), np.stack(boxes_B)
    room = _ROOM * len(A[0])
    while True:
        pairs, turns = np.empty((room, 2), np.int64), np.empty((room, n))
        count = near_boxes(A, B, is_turning, is_one_list, _ROUNDING, pairs, turns)
        if count <= room:
            return pairs[:count], turns[:count]
        room = count


def _meet_all(
    A: list[ConvexSet],
    B: list[ConvexSet],
    boxes: tuple[Boxes, Boxes],
    pairs: np.ndarray,
    offsets: np.ndarray,
) -> np.ndarray:
    """Tell of each pair whether the first set, moved by an offset, meets the second one."""
    found = _meet_quickly(A, B, boxes, pairs, offsets)
    middles_A, middles_B = (0.5 * low + 0.5 * high for low, high in boxes)
    result = found == POINT
    for k in np.flatnonzero(found == OPEN).tolist():
        i, j = pairs[k].tolist()
        line = middles_A[i] + offsets[k], middles_B[j]
        result[k] = _meet(translated(A[i], offsets[k]), B[j], line)
    return result


def _meet_quickly(
    A: list[ConvexSet],
    B: list[ConvexSet],
    boxes: tuple[Boxes, Boxes],
    pairs: np.ndarray,
    offsets: np.ndarray,
) -> np.ndarray:
    """Return POINT, EMPTY or OPEN of each pair: polyhedra where they are in one call."""
    found = np.full(len(pairs), OPEN)
    sets = A if A is B else [*A, *B]
    is_asked = np.array([type(each) is HPolyhedron for each in sets])
    second = pairs + np.array([0, 0 if A is B else len(A)])
    asked = np.flatnonzero(is_asked[second].all(axis=1) & ~offsets.any(axis=1))
    if not len(asked):
        return found
    rows = [each._linear_rows() if of else None for each, of in zip(sets, is_asked, strict=True)]
    some = [of for of in rows if of is not None]
    firsts = np.cumsum([0, *(0 if of is None else len(of[1]) for of in rows)])
    low = np.maximum(boxes[0][0][pairs[asked, 0]], boxes[1][0][pairs[asked, 1]])
    high = np.minimum(boxes[0][1][pairs[asked, 0]], boxes[1][1][pairs[asked, 1]])
    status = np.empty(len(asked), np.int64)
    meet_quickly(
        np.concatenate([of[0] for of in some]),
        np.concatenate([of[1] for of in some]),
        firsts,
        second[asked],
        0.5 * low + 0.5 * high,
        status,
    )
    found[asked] = status
    return found


def _meet(first: ConvexSet, second: ConvexSet, line: tuple[np.ndarray, np.ndarray]) -> bool:
    """Tell whether two sets meet; on the line between two points ``(n,)`` it is seen soonest."""
    a, b = own_box(first), own_box(second)
    if a is not None and b is not None:
        return bool((a[0] <= b[1]).all() and (b[0] <= a[1]).all())
    x = _middle_on(line, (first, second))
    if _is_well_inside(first, x) and _is_well_inside(second, x):
        return True
    return first.intersects_with(second)


def _middle_on(
    line: tuple[np.ndarray, np.ndarray], sets: tuple[ConvexSet, ConvexSet]
) -> np.ndarray:
    """Return the middle of half-spaces' part of a line, a point of it where that is empty."""
    start, way = line[0], line[1] - line[0]
    low, high = 0.0, 1.0
    for each in sets:
        if isinstance(each, HPolyhedron):
            slopes, room = product(each.A, way), each.b - product(each.A, start)
            up, down = slopes > 0.0, slopes < 0.0
            with np.errstate(over="ignore"):
                high = min(high, float((room[up] / slopes[up]).min(initial=np.inf)))
                low = max(low, float((room[down] / slopes[down]).max(initial=-np.inf)))
    part = min(max(0.5 * (low + high), 0.0), 1.0) if low <= high else 0.5
    return start + part * way


def _is_well_inside(convex_set: ConvexSet, x: np.ndarray) -> bool:
    """Tell whether a point is inside by more than rounding; False where that isn't shown."""
    if isinstance(convex_set, Hyperrectangle):
        return bool((convex_set.lb <= x).all() and (x <= convex_set.ub).all())
    if not isinstance(convex_set, HPolyhedron):
        return False
    A, b = convex_set.A, convex_set.b
    rounding = 2.0 * (len(x) + 2) * EPSILON * (product(np.abs(A), np.abs(x)) + np.abs(b))
    return bool((product(A, x) + rounding <= b).all())
