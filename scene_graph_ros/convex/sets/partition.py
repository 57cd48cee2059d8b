"""Sets cut into pieces that are narrower than half a turn."""

from __future__ import annotations

from collections.abc import Sequence
import math

import numpy as np

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.convex.questions.arguments import as_list
from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.convex.sets.h_polyhedron import HPolyhedron
from scene_graph_ros.convex.sets.hyperrectangle import Hyperrectangle
from scene_graph_ros.convex.sets.intersection import Intersection
from scene_graph_ros.convex.sets.pairwise_intersections import as_joints
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["partition_convex_set"]


def partition_convex_set(
    convex_set: ConvexSet | Sequence[ConvexSet],
    continuous_revolute_joints: Sequence[int],
    epsilon: float = 1e-5,
) -> list[ConvexSet]:
    """Return pieces whose union is a set, or several sets in turn, none wider than pi - epsilon.

    Along joints that turn without an end, as `GcsTrajectoryOptimization` asks for. Pieces of a set
    are equally wide, and neighbours overlap by ``epsilon`` (rad). A narrow set stays as
    it is. Raises ConvexSetError without a set, for sets that are empty or unbounded along such a
    joint, and unless epsilon is between 0 and pi / 2.
    """
    label = "partition_convex_set"
    overlap = as_float(epsilon)
    if overlap is None or not 0.0 < overlap < 0.5 * math.pi:
        raise ConvexSetError(
            f"{label}: epsilon must be between 0 and pi / 2, not {quoted(epsilon)}"
        )
    given = (
        [convex_set]
        if isinstance(convex_set, ConvexSet)
        else as_list(convex_set, f"{label}: convex_set")
    )
    if not given:
        raise ConvexSetError(f"{label}: convex_set must be a set, or sets, one at least")
    pieces: list[ConvexSet] = []
    for number, each in enumerate(given):
        if not isinstance(each, ConvexSet):
            raise ConvexSetError(f"{label}: set {number} must be a ConvexSet, not {quoted(each)}")
        if each.is_empty():
            raise ConvexSetError(f"{label}: set {number}, {quoted(each)}, is empty; leave it out")
        joints = as_joints(continuous_revolute_joints, each.ambient_dimension, label)
        whole = [each]
        for joint in joints:
            whole = [part for piece in whole for part in _cut(piece, joint, overlap, label)]
        pieces += whole
    return pieces


def _cut(whole: ConvexSet, joint: int, overlap: float, label: str) -> list[ConvexSet]:
    """Return the pieces of a set along one joint."""
    axis = np.eye(whole.ambient_dimension)[joint]
    down, up = whole.support(-axis), whole.support(axis)
    low, high = -(down.value + down.gap), up.value + up.gap
    if not math.isfinite(high - low):
        raise ConvexSetError(
            f"{label}: {quoted(whole)} is unbounded along joint {joint}; intersect it with a box"
        )
    if high - low <= math.pi - overlap:
        return [whole]
    count = math.ceil((high - low - overlap) / (math.pi - 2.0 * overlap))
    step = (high - low - overlap) / count
    starts = [low + k * step for k in range(count)]
    return [
        _between(whole, axis, start, high if start == starts[-1] else start + step + overlap)
        for start in starts
    ]


def _between(whole: ConvexSet, axis: np.ndarray, low: float, high: float) -> ConvexSet:
    """Return the points of a set whose coordinate along an axis is between two numbers."""
    if isinstance(whole, Hyperrectangle):
        lb, ub = (np.where(axis > 0.0, at, old) for at, old in ((low, whole.lb), (high, whole.ub)))
        return Hyperrectangle(np.maximum(lb, whole.lb), np.minimum(ub, whole.ub))
    slab = HPolyhedron(np.stack([axis, -axis]), [high, -low])
    if isinstance(whole, HPolyhedron):
        return whole.intersection(slab)
    return Intersection([whole, slab])
