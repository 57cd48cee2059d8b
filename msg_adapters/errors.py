"""Errors of requests beside the core's own."""

from scene_graph_ros.geometry.errors import SceneGraphError

__all__ = ["MessageError", "StaleError", "TooLargeError", "UnavailableError"]


class MessageError(SceneGraphError, ValueError):
    """A message whose fields contradict each other or hold a value that has no meaning."""


class StaleError(SceneGraphError, TimeoutError):
    """No poses as new as asked for came in time."""


class TooLargeError(SceneGraphError, ValueError):
    """A request or its answer is over a limit."""


class UnavailableError(SceneGraphError, RuntimeError):
    """Something that is not installed or is switched off."""
