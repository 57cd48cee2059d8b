"""Regions to look at: translucent hulls with their edges, red where something is in them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple
import zlib

from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from msg_adapters.meshes import triangle_points_to_msg
from msg_adapters.poses import header_to_msg
from scene_graph_ros.geometry.meshes.hull import convex_hull
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.views.triangles import Triangles

__all__ = ["RegionForm", "region_deletions_to_msg", "region_form", "region_markers_to_msg"]

_COLORS = (
    Rgba(0.1, 0.5, 0.9, 0.2),
    Rgba(0.95, 0.6, 0.1, 0.2),
    Rgba(0.2, 0.7, 0.3, 0.2),
    Rgba(0.7, 0.3, 0.8, 0.2),
    Rgba(0.1, 0.75, 0.75, 0.2),
    Rgba(0.75, 0.7, 0.1, 0.2),
)
_CUT = Rgba(0.9, 0.1, 0.1, 0.3)
_EDGE, _LETTERS, _DOT = 0.004, 0.04, 0.03
"""Metres: how thick edges are, how high words are, and the diameter of shared points."""

FACES, EDGES, WORDS, SHARED = range(4)
"""Ids of a region's markers."""


class RegionForm(NamedTuple):
    """The drawing of a region, in the world."""

    triangles: Triangles
    edges: NDArray[np.float64]
    """``(2 k, 3)``, both ends of each."""
    center: NDArray[np.float64]
    """``(3,)``, where its name stands."""


def region_form(corners: NDArray[np.float64]) -> RegionForm:
    """Return the drawing of the hull of corners ``(m, 3)``, m > 0; a flat one is a sheet."""
    hull = convex_hull(corners)
    fans = [
        (face[0], first, second) for face in hull.faces for first, second in pairwise(face[1:])
    ]
    triangles = Triangles(hull.vertices, np.array(fans, dtype=np.int64).reshape(-1, 3))
    ends = [(i, int(j)) for i, others in enumerate(hull.neighbors) for j in others if i < j]
    edges = hull.vertices[np.array(ends, dtype=np.int64).reshape(-1)]
    return RegionForm(triangles, edges, corners.mean(axis=0))


def region_markers_to_msg(
    name: str,
    form: RegionForm | None,
    reason: str,
    shared: Sequence[NDArray[np.float64]],
    *,
    stamp_ns: int,
    frame_id: str,
) -> list[Marker]:
    """Return the markers of a region: faces, edges, its name, and points that others share.

    ``reason`` says why it is not free, "" where it is. Nothing but words is shown of a region
    without a form.
    """
    color = _CUT if reason else _COLORS[zlib.crc32(name.encode()) % len(_COLORS)]
    line = ColorRGBA(r=color.r, g=color.g, b=color.b, a=0.9)

    def marker(identity: int, kind: int, size: float) -> Marker:
        made = Marker(header=header_to_msg(stamp_ns, frame_id), ns=_group(name), id=identity)
        made.type, made.action = kind, Marker.ADD
        made.pose.orientation.w = 1.0
        made.scale = Vector3(x=size, y=size, z=size)
        made.color = line
        return made

    faces = marker(FACES, Marker.TRIANGLE_LIST, 1.0)
    edges = marker(EDGES, Marker.LINE_LIST, _EDGE)
    words = marker(WORDS, Marker.TEXT_VIEW_FACING, _LETTERS)
    dots = marker(SHARED, Marker.SPHERE_LIST, _DOT)
    faces.color = ColorRGBA(r=color.r, g=color.g, b=color.b, a=color.a)
    words.text = f"{name}: {reason}" if reason else name
    if form is not None:
        faces.points = triangle_points_to_msg(form.triangles)
        edges.points = [Point(x=x, y=y, z=z) for x, y, z in form.edges.tolist()]
        x, y, z = form.center.tolist()
        words.pose.position = Point(x=x, y=y, z=z)
    dots.points = [Point(x=p[0], y=p[1], z=p[2]) for p in map(np.ndarray.tolist, shared)]
    for each in (faces, edges, dots):
        if not each.points:
            each.action = Marker.DELETE
    return [faces, edges, words, dots]


def region_deletions_to_msg(name: str, *, stamp_ns: int, frame_id: str) -> list[Marker]:
    """Return the deletions of a region's markers."""
    header = header_to_msg(stamp_ns, frame_id)
    return [
        Marker(header=header, ns=_group(name), id=identity, action=Marker.DELETE)
        for identity in (FACES, EDGES, WORDS, SHARED)
    ]


def _group(name: str) -> str:
    return f"regions/{name}"
