"""The errors for values of properties, beside those of `errors` for their names."""

from scene_graph_ros.geometry.errors import PropertyError

__all__ = ["PropertyValueError"]


class PropertyValueError(PropertyError, ValueError):
    """The value of a property, a colour or a label that is out of range, or of the wrong kind."""
