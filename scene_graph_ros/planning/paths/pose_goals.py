"""Configurations for a path to end at, where its goal says where tools are to be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.planning.checker.collision_checker import SceneGraphCollisionChecker
from scene_graph_ros.planning.ik.pose_solver import (
    inverse_kinematics,
    InverseKinematicsFailure,
)
from scene_graph_ros.planning.ik.pose_target import PoseTarget
from scene_graph_ros.planning.parallel.deadline import Deadline
from scene_graph_ros.planning.plan_failure import PlanFailure

__all__ = ["PoseGoals", "find_pose_goals", "load_pose_kernels"]

_WANTED = 8
"""Configurations that are looked for, of each target."""

_QUOTED = 5
"""Targets of which is said what is wrong with them."""


class PoseGoals(NamedTuple):
    """Configurations that reach targets, or why there are none."""

    configurations: NDArray[np.float64]
    """``(m, nq)``."""
    targets: tuple[int, ...]
    """Which target each of them reaches."""
    failure: PlanFailure | None
    reason: str


def load_pose_kernels(checker: SceneGraphCollisionChecker, targets: Sequence[PoseTarget]) -> None:
    """Load or compile the kernels of the search. Raises KinematicTreeError for unknown links."""
    for target in targets:
        checker.plan.tree.link_index(target.link)
    for target in targets[:1]:
        inverse_kinematics(checker, target, tries=2)
    checker.check_configs_collision_free(checker.plan.tree.zero_configuration()[np.newaxis])


def find_pose_goals(
    checker: SceneGraphCollisionChecker,
    targets: Sequence[PoseTarget],
    *,
    near: NDArray[np.float64],
    group: str | None,
    seed: int,
    deadline: Deadline,
) -> PoseGoals:
    """Return free configurations that put a tool where one of the targets says.

    They are looked for near ``near`` ``(nq,)`` first, one target after the other, until
    the time is over.
    """
    found: list[NDArray[np.float64]] = []
    rows: list[int] = []
    failures: list[PlanFailure] = []
    words: list[str] = []
    for row, target in enumerate(targets):
        solved = inverse_kinematics(
            checker,
            target,
            near=near,
            group=group,
            solutions=_WANTED,
            seed=seed,
            timeout=deadline.left,
            watch=deadline.look,
        )
        found.append(solved.configurations)
        rows += [row] * len(solved.configurations)
        if solved.failure is not None:
            is_blocked = solved.failure is InverseKinematicsFailure.COLLIDES
            failures.append(
                PlanFailure.GOAL_COLLIDES if is_blocked else PlanFailure.GOAL_UNREACHED
            )
            words.append(str(solved.reason))
        if deadline.is_over():
            break
    q = np.concatenate(found)
    if len(q):
        return PoseGoals(q, tuple(rows), None, "")
    if len(words) < len(targets) or deadline.is_over():
        text = "the goal was not reached in time:"
        if len(targets) > 1:
            text = f"none of {len(targets)} goals was reached in time; goal {len(words) - 1}:"
        return PoseGoals(q, (), PlanFailure.TIMEOUT, f"{text} {words[-1]}")
    kind = min(failures, key=lambda failure: failure.value)
    if len(targets) == 1:
        return PoseGoals(q, (), kind, f"the goal: {words[0]}")
    listed = "; ".join(f"goal {row}: {each}" for row, each in enumerate(words[:_QUOTED]))
    return PoseGoals(q, (), kind, f"none of {len(targets)} goals can be reached: {listed}")
