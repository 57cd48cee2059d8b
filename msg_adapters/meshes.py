"""Meshes in markers: corners of triangles, and where viewers find a file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from geometry_msgs.msg import Point

from scene_graph_ros.views.triangles import Triangles

__all__ = ["resource_uri", "triangle_points_to_msg"]


def triangle_points_to_msg(mesh: Triangles) -> list[Point]:
    """Return three points per triangle, as TRIANGLE_LIST markers take them.

    Corners shared by triangles are the same object, so don't change them.
    """
    points = [Point(x=x, y=y, z=z) for x, y, z in mesh.vertices.tolist()]
    return [points[index] for index in mesh.triangles.ravel().tolist()]


def resource_uri(path: Path, package_shares: Mapping[str, Path] | None = None) -> str:
    """Return the address of a file for viewers: ``package://`` if a package holds it, else ``file://``.

    ``package_shares`` maps package names to their share folders; a viewer on another machine
    finds only files of packages.
    """
    for name, share in (package_shares or {}).items():
        if path.is_relative_to(share):
            return f"package://{name}/{path.relative_to(share).as_posix()}"
    return path.as_uri()
