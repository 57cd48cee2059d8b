"""How the examples call a geometry."""

from scene_graph_msgs.msg import GeometryName


def path_of(geometry: GeometryName) -> str:
    """Return ``frame/name``, or only the name where it says it all."""
    if geometry.frame == "world" or geometry.frame in geometry.name:
        return geometry.name
    return f"{geometry.frame}/{geometry.name}"
