"""Checks of planners' arguments."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.planning.errors import PlanningError
from scene_graph_ros.planning.ik.pose_target import PoseTarget
from scene_graph_ros.planning.parallel.deadline import checked_timeout

__all__ = ["checked_numbers", "checked_tolerance", "targets_of"]

_FINEST_SAVING = 1e-4
"""Of a path's length: corners that save less are never cut off."""


def checked_numbers(
    seed: int, timeout: float | None, least_saving: float
) -> tuple[float | None, float]:
    """Return timeout and least saving, after checking them and the seed."""
    root = as_float(seed)
    if root is None or root < 0.0 or not root.is_integer():
        raise PlanningError(f"seed must be a whole number from 0 on, not {quoted(seed)}")
    patience = checked_timeout(timeout, PlanningError)
    saving = as_float(least_saving)
    if saving is None or not _FINEST_SAVING <= saving <= 1.0:
        raise PlanningError(
            f"least_saving must be from {_FINEST_SAVING:g} to 1, not {quoted(least_saving)}"
        )
    return patience, saving


def checked_tolerance(name: str, value: float) -> float:
    """Return the tolerance of a start's position, after checking it."""
    units = {"start_tolerance": "rad or m", "start_overlap": "m"}[name]
    slack = as_float(value)
    if slack is None or not 0.0 <= slack < math.inf:
        raise PlanningError(f"{name} must be {units} from 0 on, not {quoted(value)}")
    return slack


def targets_of(goal: Any) -> Sequence[PoseTarget] | None:
    """Return the targets of tools; None for a goal of configurations."""
    if isinstance(goal, PoseTarget):
        return (goal,)
    if isinstance(goal, Sequence) and any(isinstance(each, PoseTarget) for each in goal):
        other = next((each for each in goal if not isinstance(each, PoseTarget)), None)
        if other is not None:
            raise PlanningError(f"goal has targets, and {quoted(other)} among them")
        return tuple(goal)
    return None
