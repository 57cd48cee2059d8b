"""The configurations that a path begins and may end at, checked."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.checker.path_ends import EndTrouble
from scene_graph_ros.planning.constraints.held_constraints import HeldConstraints
from scene_graph_ros.planning.constraints.proof_kernels import HELD
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.paths.search.position_space import moving_positions, normalized
from scene_graph_ros.planning.plan_failure import PlanFailure

__all__ = ["checked_ends", "checked_moves", "lead_violation", "violation"]


def checked_ends(
    checker: SceneGraphCollisionChecker, start: ArrayLike, goal: Any
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return start ``(nq,)`` and goals ``(m, nq)`` after checking them."""
    first, goals = (checker.checked_configurations(each) for each in (start, goal))
    if not len(goals):
        raise PlanningError("goal must have at least one configuration")
    return normalized(checker.plan.tree, first)[0], normalized(checker.plan.tree, goals)


def checked_moves(
    checker: SceneGraphCollisionChecker,
    start: NDArray[np.float64],
    goals: NDArray[np.float64],
    group: str | None,
) -> NDArray[np.bool_]:
    """Return ``(nq,)`` which positions may change, after checking that no others have to."""
    tree = checker.plan.tree
    moves = moving_positions(tree, group)
    stays = ~moves & (goals != start)
    if stays.any():
        row, column = np.argwhere(stays)[0]
        raise PlanningError(
            f"position {tree.position_names[column]!r} is not of group {group!r} and must stay at"
            f" {start[column]:.10g}; in goal {row} it is {goals[row, column]:.10g}"
        )
    return moves


def violation(held: HeldConstraints, q: NDArray[np.float64]) -> EndTrouble | None:
    """Return the condition that a configuration ``(nq,)`` violates, or None."""
    words = held.describe_excess(q)
    kinds = PlanFailure.START_VIOLATES_CONSTRAINT, PlanFailure.GOAL_VIOLATES_CONSTRAINT
    return None if words is None else EndTrouble(*kinds, words)


def lead_violation(held: HeldConstraints, lead: NDArray[np.float64]) -> str | None:
    """Return the condition that a way ``(k, nq)`` back to limits does not hold, or None."""
    edges = np.stack([lead[:-1], lead[1:]], axis=1)
    proofs = held.prove(edges)
    broken = np.flatnonzero(proofs.answers != HELD)
    return held.describe(edges[broken[0]], proofs, int(broken[0])) if len(broken) else None
