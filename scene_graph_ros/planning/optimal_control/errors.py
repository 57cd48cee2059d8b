"""The errors for dynamics and programs that make no sense."""

from __future__ import annotations

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["DynamicsError", "MissingCasadiError", "TrajectoryOptimizationError"]


class TrajectoryOptimizationError(SceneGraphError, ValueError):
    """Arguments of a trajectory optimization that make no sense."""


class DynamicsError(TrajectoryOptimizationError):
    """Dynamics that can't be traced, have other sizes than said, or are no numbers."""


class MissingCasadiError(SceneGraphError, ImportError):
    """CasADi is needed, and not installed."""
