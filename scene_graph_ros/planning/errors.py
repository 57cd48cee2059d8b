"""The errors of collision checkers and planners."""

from __future__ import annotations

import math

from scene_graph_ros.geometry.errors import SceneGraphError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float

__all__ = ["CollisionCheckerError", "OutOfTimeError", "PlanningError", "finite_number"]


class CollisionCheckerError(SceneGraphError, ValueError):
    """Arguments of a collision checker that make no sense."""


class PlanningError(SceneGraphError, ValueError):
    """Arguments of a planner that make no sense."""


class OutOfTimeError(SceneGraphError, TimeoutError):
    """The time limit of a call was over before there was an answer; the message names both."""


def finite_number(name: str, value: object) -> float:
    """Return a finite number. Raises CollisionCheckerError naming it."""
    number = as_float(value)
    if number is None or not math.isfinite(number):
        raise CollisionCheckerError(f"{name} must be a finite number, not {quoted(value)}")
    return number
