"""The errors for trajectories and limits that make no sense."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["RetimingError", "TrajectoryError"]


class TrajectoryError(SceneGraphError, ValueError):
    """Breaks, control points, times or limits that make no sense."""


class RetimingError(SceneGraphError, RuntimeError):
    """A retimer found no speeds along a path."""
