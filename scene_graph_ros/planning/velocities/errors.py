"""Arguments of a filter of velocities that make no sense."""

from __future__ import annotations

from scene_graph_ros.planning.errors import PlanningError

__all__ = ["SafeVelocityError"]


class SafeVelocityError(PlanningError):
    """A velocity, time step, limit or obstacle that a filter of velocities can't take."""
