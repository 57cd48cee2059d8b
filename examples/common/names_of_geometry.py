"""How the examples call a geometry."""

from scene_graph_msgs.msg import GeometryName, GeometryNames


def path_of(geometry: GeometryName) -> str:
    """Return ``frame/name``, or only the name where it says it all."""
    return _path(geometry.frame, geometry.name)


def paths_of(geometries: GeometryNames) -> dict[int, str]:
    """Return the same of each geometry by its id."""
    paths = map(_path, geometries.frame, geometries.name)
    return dict(zip(geometries.id, paths, strict=True))


def _path(frame: str, name: str) -> str:
    return name if frame == "world" or frame in name else f"{frame}/{name}"
