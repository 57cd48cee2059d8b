"""Markers of geometries: one marker for each, placed in the world, with a name that stays.

A marker is known to viewers by ``(ns, id)``: ns is ``<role>/<source>/<frame>`` and id comes from
the geometry's id, so both stay the same as long as the geometry lives. ``SceneMarkers`` keeps
the marker objects of a scene and only writes poses into them; all else is built once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from geometry_msgs.msg import Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.marker_rows import (
    HALF_SPACE_EXTENT,
    HALF_SPACE_THICKNESS,
    marker_id,
    MarkerRows,
)
from msg_adapters.meshes import resource_uri, triangle_points_to_msg
from msg_adapters.plain_look import PlainLook
from msg_adapters.poses import header_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses
from scene_graph_ros.views.draw_list import DrawItem
from scene_graph_ros.views.items import DEFAULT_COLOR
from scene_graph_ros.views.triangles import (
    capsule_triangles,
    hull_triangles,
    surface_triangles,
    Triangles,
)

__all__ = [
    "HALF_SPACE_EXTENT",
    "HALF_SPACE_THICKNESS",
    "SMALLEST_SIZE",
    "SceneMarkers",
    "marker_and_triangles",
    "marker_from_shape",
    "marker_id",
    "plain_look",
]

SMALLEST_SIZE = 1e-6
"""Metres. Of a point, a sphere of radius 0: viewers warn about markers without any size."""

_VIEWER_FILE_TYPES = frozenset({"dae", "obj", "stl"})
"""Mesh files that RViz and Foxglove read by themselves, and alike: glTF some turn, some do not."""

_FILE_TYPES_WITH_MATERIALS = frozenset({"dae", "obj"})
"""Those of them that can say what they are made of."""


def _vector(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=float(x), y=float(y), z=float(z))


def _color(rgba: Rgba) -> ColorRGBA:
    return ColorRGBA(r=rgba.r, g=rgba.g, b=rgba.b, a=rgba.a)


def _set_primitive(marker: Marker, kind: int, size: tuple[float, float, float]) -> None:
    marker.type = kind
    marker.scale = _vector(*size)


def _mesh_triangles(item: DrawItem) -> Triangles | None:
    """Return the triangles that stand for a mesh; None where viewers read its file."""
    shape = item.shape
    assert isinstance(shape, MeshShape)
    if not item.is_as_given:
        return hull_triangles(shape)
    # Viewers mirror a mesh without turning its triangles, so mirrored ones go as triangles.
    is_readable = shape.file_type in _VIEWER_FILE_TYPES and min(shape.scale) > 0.0
    return None if shape.path is not None and is_readable else surface_triangles(shape)


def _set_mesh_file(
    marker: Marker, item: DrawItem, package_shares: Mapping[str, Path] | None
) -> None:
    shape = item.shape
    assert isinstance(shape, MeshShape)
    assert shape.path is not None
    _set_primitive(marker, Marker.MESH_RESOURCE, shape.scale)
    marker.mesh_resource = resource_uri(shape.path, package_shares)
    if item.rgba is None and shape.file_type in _FILE_TYPES_WITH_MATERIALS:
        marker.mesh_use_embedded_materials = True
        # Any other colour would tint the materials.
        marker.color = ColorRGBA(r=0.0, g=0.0, b=0.0, a=0.0)


Size = tuple[float, float, float]
_PRIMITIVES: dict[ShapeKind, Callable[[Any], tuple[int, Size]]] = {
    ShapeKind.SPHERE: lambda s: (Marker.SPHERE, (max(2.0 * s.radius, SMALLEST_SIZE),) * 3),
    ShapeKind.BOX: lambda s: (Marker.CUBE, (s.width, s.depth, s.height)),
    ShapeKind.CYLINDER: lambda s: (
        Marker.CYLINDER,
        (2.0 * s.radius, 2.0 * s.radius, s.length),
    ),
    ShapeKind.ELLIPSOID: lambda s: (Marker.SPHERE, (2.0 * s.a, 2.0 * s.b, 2.0 * s.c)),
    ShapeKind.HALF_SPACE: lambda s: (
        Marker.CUBE,
        (HALF_SPACE_EXTENT, HALF_SPACE_EXTENT, HALF_SPACE_THICKNESS),
    ),
}
_TRIANGLES: dict[ShapeKind, Callable[[Any], Triangles]] = {
    ShapeKind.CAPSULE: capsule_triangles,
    ShapeKind.CONVEX: hull_triangles,
}


def plain_look(item: DrawItem) -> PlainLook | None:
    """Return the marker of a geometry as a few numbers; None where it takes triangles."""
    primitive = _PRIMITIVES.get(item.shape.kind)
    if primitive is None:
        return None
    kind, size = primitive(item.shape)
    color = item.rgba or DEFAULT_COLOR
    return PlainLook(
        item.group,
        marker_id(item.geometry_id),
        kind,
        Marker.ADD,
        size,
        (color.r, color.g, color.b, color.a),
    )


def marker_from_shape(
    item: DrawItem, *, frame_id: str, package_shares: Mapping[str, Path] | None = None
) -> Marker:
    """Return the marker of a geometry, at the origin of ``frame_id``.

    Raises MeshError or InvalidShapeError where the mesh can't be read.
    """
    look = plain_look(item)
    if look is not None:
        return look.marker(frame_id)
    marker, triangles = marker_and_triangles(
        item, frame_id=frame_id, package_shares=package_shares
    )
    if triangles is not None:
        marker.points = triangle_points_to_msg(triangles)
    return marker


def marker_and_triangles(
    item: DrawItem, *, frame_id: str, package_shares: Mapping[str, Path] | None = None
) -> tuple[Marker, Triangles | None]:
    """Return the marker of a geometry that is not plain, and the triangles it is to have, if any.

    Raises MeshError or InvalidShapeError where the mesh can't be read.
    """
    marker = Marker(ns=item.group, id=marker_id(item.geometry_id), action=Marker.ADD)
    marker.header.frame_id = frame_id
    marker.color = _color(item.rgba or DEFAULT_COLOR)
    make = _TRIANGLES.get(item.shape.kind)
    triangles = _mesh_triangles(item) if make is None else make(item.shape)
    if triangles is None:
        _set_mesh_file(marker, item, package_shares)
    else:
        _set_primitive(marker, Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0))
    return marker, triangles


class SceneMarkers:
    """The markers of one role: built once per geometry, then only moved.

    Row i of the poses given to ``full`` and ``moved`` belongs to item i. The returned messages
    share their markers with this object: publish them before the next call.
    """

    def __init__(self, *, frame_id: str, package_shares: Mapping[str, Path] | None = None) -> None:
        """Place markers in ``frame_id``, the world; see ``resource_uri`` for package_shares."""
        self._frame_id = frame_id
        self._package_shares = package_shares
        self._rows = MarkerRows()
        self._order: list[Marker] = []

    def set_items(self, items: Iterable[DrawItem]) -> None:
        """Take over the list of geometries; vanished ones are left for ``deletions``.

        Nothing changes where a mesh can't be read, which raises MeshError or InvalidShapeError.
        """
        items = list(items)
        known = dict(zip(self._rows.items, self._order, strict=True))
        markers = [known.get(item) or self._build(item) for item in items]
        self._rows.set_items(items)
        self._order = markers

    def _build(self, item: DrawItem) -> Marker:
        return marker_from_shape(
            item, frame_id=self._frame_id, package_shares=self._package_shares
        )

    def full(self, X_WG: NDArray[np.float64], stamp_ns: int) -> MarkerArray:
        """Return all markers at ``X_WG`` ``(n, 4, 4)``."""
        return self._place(np.arange(len(self._order)), X_WG, stamp_ns)

    def moved(self, X_WG: NDArray[np.float64], stamp_ns: int) -> MarkerArray:
        """Return the markers whose pose is another than when they were last returned."""
        return self._place(self._rows.moved(X_WG), X_WG, stamp_ns)

    def deletions(self, stamp_ns: int) -> MarkerArray:
        """Return a deletion for each marker that vanished since the last call."""
        header = header_to_msg(stamp_ns, self._frame_id)
        markers = [
            Marker(header=header, ns=group, id=marker_id(identity), action=Marker.DELETE)
            for group, identity in self._rows.take_vanished()
        ]
        return MarkerArray(markers=markers)

    def _place(
        self, rows: NDArray[np.int64], X_WG: NDArray[np.float64], stamp_ns: int
    ) -> MarkerArray:
        X_WM, stamp = self._rows.place(rows, X_WG), stamp_to_msg(stamp_ns)
        markers = [self._order[row] for row in rows.tolist()]
        _write_poses(markers, X_WM)
        for marker in markers:
            marker.header.stamp = stamp
        return MarkerArray(markers=markers)


def _write_poses(markers: Sequence[Marker], X_WM: NDArray[np.float64]) -> None:
    positions = X_WM[:, :3, 3].tolist()
    quaternions = quaternions_from_poses(X_WM).tolist()
    for marker, p, q in zip(markers, positions, quaternions, strict=True):
        position, orientation = marker.pose.position, marker.pose.orientation
        position.x, position.y, position.z = p
        orientation.x, orientation.y, orientation.z, orientation.w = q
