"""Errors of convex sets; the message names the argument, its value and the remedy."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["ConvexSetError", "SampleError", "SolverError", "StoppedError"]


class ConvexSetError(SceneGraphError, ValueError):
    """An argument that makes no set, or a question that the set has no answer to."""


class SampleError(ConvexSetError):
    """A sample that is in one of the obstacles, or nearer to it than rounding."""

    def __init__(self, message: str, obstacle: int) -> None:
        """``obstacle`` is its number."""
        super().__init__(message)
        self.obstacle = obstacle


class SolverError(SceneGraphError, RuntimeError):
    """A program that could not be solved as exactly as promised; the message has the residuals."""


class StoppedError(SolverError):
    """A program that was not solved to its end, as its caller had it stop."""
