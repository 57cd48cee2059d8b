"""Why there is no region."""

from __future__ import annotations

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["RegionError", "RegionNotFoundError"]


class RegionError(SceneGraphError, ValueError):
    """Arguments that no region can be grown from; the message names them and the remedy."""


class RegionNotFoundError(SceneGraphError, RuntimeError):
    """No region passed its test; the message has its progress and a remedy."""
