"""Errors of convex sets; the message names the argument, its value and the remedy."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["ConvexSetError", "SolverError"]


class ConvexSetError(SceneGraphError, ValueError):
    """An argument that makes no set, or a question that the set has no answer to."""


class SolverError(SceneGraphError, RuntimeError):
    """A program that could not be solved as exactly as promised; the message has the residuals."""
