"""The errors for trajectories and limits that make no sense."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["RetimingError", "TooLongError", "TrajectoryError"]


class TrajectoryError(SceneGraphError, ValueError):
    """Breaks, control points, times or limits that make no sense."""


class TooLongError(TrajectoryError):
    """A motion takes too long for the times of a message."""


class RetimingError(SceneGraphError, RuntimeError):
    """A retimer found no speeds along a path."""
