"""Configurations of a convex set, for a motion to end at."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.convex.sets.convex_set import ConvexSet
from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.paths.search.position_space import moving_positions

__all__ = ["goals_in_set"]

_DRAWN = 7
"""Random configurations whose nearest ones in the set are goals, beside the start's."""

_FAR = np.pi
"""rad or m from the start: how far random positions without limits are, at most."""

_ROUNDS = 20
"""Of projections on the set and on limits in turn."""

_SAME = 1e-6
"""rad or m: goals that are nearer to each other are one."""


def goals_in_set(
    checker: SceneGraphCollisionChecker,
    goal: ConvexSet,
    start: ArrayLike,
    group: str | None,
    seed: int,
) -> NDArray[np.float64]:
    """Return configurations ``(m, nq)`` in a set of the positions that may move.

    The nearest one comes first. They are the nearest ones in the set to the start and to a few
    random configurations, within limits where the set is. All else stays as it is at the start
    ``(nq,)``. Raises PlanningError for a set of another dimension, and for one that is empty.
    """
    tree = checker.plan.tree
    moves = moving_positions(tree, group)
    count, size = int(moves.sum()), goal.ambient_dimension
    if size != count:
        whose = "all positions" if group is None else f"the positions of group {group!r}"
        raise PlanningError(f"goal is a set in {size} dimensions, and {whose} are {count}")
    first = checker.checked_configurations(start)[0]
    lower, upper = tree.lower[moves], tree.upper[moves]
    near = first[moves]
    low = np.where(np.isfinite(lower), lower, np.minimum(near - _FAR, upper))
    high = np.where(np.isfinite(upper), upper, np.maximum(near + _FAR, lower))
    drawn = low + np.random.default_rng(seed).random((_DRAWN, count)) * (high - low)
    points = np.concatenate([near[np.newaxis], drawn])
    for _ in range(_ROUNDS):
        projected = goal.projection(points)
        if projected is None:
            raise PlanningError("goal is an empty set")
        points = projected.points
        inside = points.clip(lower, upper)
        if (inside == points).all():
            break
        points, last = inside, points
    else:
        points = last
    points = points[np.argsort(np.linalg.norm(points - near, axis=1), kind="stable")]
    kept = [points[0]]
    for point in points[1:]:
        if all(np.abs(point - other).max() > _SAME for other in kept):
            kept.append(point)
    result = np.repeat(first[np.newaxis], len(kept), axis=0)
    result[:, moves] = kept
    return result
