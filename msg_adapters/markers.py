"""Markers of geometries: one marker for each, placed in the world, with a name that stays.

A marker is known to viewers by ``(ns, id)``: ns is ``<role>/<source>/<frame>`` and id comes from
the geometry's id, so both stay the same as long as the geometry lives. ``SceneMarkers`` keeps
the marker objects of a scene and only writes poses into them; what does not change is built once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from geometry_msgs.msg import Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.meshes import (
    capsule_triangles,
    hull_triangles,
    resource_uri,
    surface_triangles,
    triangle_points_to_msg,
    Triangles,
)
from msg_adapters.poses import header_to_msg
from msg_adapters.stamps import stamp_to_msg
from scene_graph_ros.geometry.model.rgba import Rgba
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.spatial.poses import quaternions_from_poses

__all__ = [
    "HALF_SPACE_EXTENT",
    "HALF_SPACE_THICKNESS",
    "SMALLEST_SIZE",
    "MarkerItem",
    "SceneMarkers",
    "marker_from_shape",
    "marker_id",
]

HALF_SPACE_EXTENT = 20.0
"""Metres. Edge length of the plate that stands for a half space."""

HALF_SPACE_THICKNESS = 1e-3
"""Metres. Thickness of that plate, whose upper side is the boundary: thin beside all else."""

SMALLEST_SIZE = 1e-6
"""Metres. Of a point, a sphere of radius 0: viewers warn about markers without any size."""

DEFAULT_COLOR = Rgba(0.7, 0.7, 0.7, 1.0)
"""Of what has no colour and no file with materials of its own."""

_VIEWER_FILE_TYPES = frozenset({"dae", "glb", "obj", "stl"})
"""Mesh files that RViz and Foxglove read by themselves."""

_FILE_TYPES_WITH_MATERIALS = frozenset({"dae", "glb", "obj"})
"""Those of them that can say what they are made of."""

_MAX_INT32 = 2**31 - 1


class MarkerItem(NamedTuple):
    """A geometry to draw."""

    geometry_id: int
    ns: str
    shape: Shape
    rgba: Rgba | None
    """None: the materials in its mesh file where it has one, else DEFAULT_COLOR."""
    as_hull: bool = False
    """Draw the convex hull of a mesh instead of the mesh."""


def marker_id(geometry_id: int) -> int:
    """Return the marker id of a geometry: its own id, folded into 31 bits."""
    return int(geometry_id) & _MAX_INT32


def _vector(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=float(x), y=float(y), z=float(z))


def _color(rgba: Rgba) -> ColorRGBA:
    return ColorRGBA(r=rgba.r, g=rgba.g, b=rgba.b, a=rgba.a)


def _set_primitive(marker: Marker, kind: int, size: tuple[float, float, float]) -> None:
    marker.type = kind
    marker.scale = _vector(*size)


def _set_triangles(marker: Marker, mesh: Triangles) -> None:
    _set_primitive(marker, Marker.TRIANGLE_LIST, (1.0, 1.0, 1.0))
    marker.points = triangle_points_to_msg(mesh)


def _set_mesh(marker: Marker, item: MarkerItem, package_shares: Mapping[str, Path] | None) -> None:
    shape = item.shape
    assert isinstance(shape, MeshShape)
    if item.as_hull:
        _set_triangles(marker, hull_triangles(shape))
        return
    # Viewers mirror a mesh without turning its triangles, so mirrored ones go as triangles.
    is_readable = shape.file_type in _VIEWER_FILE_TYPES and min(shape.scale) > 0.0
    if shape.path is None or not is_readable:
        _set_triangles(marker, surface_triangles(shape))
        return
    _set_primitive(marker, Marker.MESH_RESOURCE, shape.scale)
    marker.mesh_resource = resource_uri(shape.path, package_shares)
    if item.rgba is None and shape.file_type in _FILE_TYPES_WITH_MATERIALS:
        marker.mesh_use_embedded_materials = True
        # Any other colour would tint the materials.
        marker.color = ColorRGBA(r=0.0, g=0.0, b=0.0, a=0.0)


_Setter = Callable[[Marker, Any], None]
_SETTERS: dict[ShapeKind, _Setter] = {
    ShapeKind.SPHERE: lambda m, s: _set_primitive(
        m, Marker.SPHERE, (max(2.0 * s.radius, SMALLEST_SIZE),) * 3
    ),
    ShapeKind.CAPSULE: lambda m, s: _set_triangles(m, capsule_triangles(s)),
    ShapeKind.BOX: lambda m, s: _set_primitive(m, Marker.CUBE, (s.width, s.depth, s.height)),
    ShapeKind.CYLINDER: lambda m, s: _set_primitive(
        m, Marker.CYLINDER, (2.0 * s.radius, 2.0 * s.radius, s.length)
    ),
    ShapeKind.ELLIPSOID: lambda m, s: _set_primitive(
        m, Marker.SPHERE, (2.0 * s.a, 2.0 * s.b, 2.0 * s.c)
    ),
    ShapeKind.HALF_SPACE: lambda m, s: _set_primitive(
        m, Marker.CUBE, (HALF_SPACE_EXTENT, HALF_SPACE_EXTENT, HALF_SPACE_THICKNESS)
    ),
    ShapeKind.CONVEX: lambda m, s: _set_triangles(m, hull_triangles(s)),
}


def marker_from_shape(
    item: MarkerItem, *, frame_id: str, package_shares: Mapping[str, Path] | None = None
) -> Marker:
    """Return the marker of a geometry, at the origin of ``frame_id``.

    Raises MeshError or InvalidShapeError where the mesh can't be read.
    """
    marker = Marker(ns=item.ns, id=marker_id(item.geometry_id), action=Marker.ADD)
    marker.header.frame_id = frame_id
    marker.color = _color(item.rgba or DEFAULT_COLOR)
    if item.shape.kind == ShapeKind.MESH:
        _set_mesh(marker, item, package_shares)
    else:
        _SETTERS[item.shape.kind](marker, item.shape)
    return marker


class SceneMarkers:
    """The markers of one role: built once per geometry, then only moved.

    Row i of the poses given to ``full`` and ``moved`` belongs to item i. The returned messages
    share their markers with this object: publish them before the next call.
    """

    def __init__(self, *, frame_id: str, package_shares: Mapping[str, Path] | None = None) -> None:
        """Place markers in ``frame_id``, the world; see ``resource_uri`` for package_shares."""
        self._frame_id = frame_id
        self._package_shares = package_shares
        self._markers: dict[MarkerItem, Marker] = {}
        self._order: list[Marker] = []
        self._plates = np.empty(0, dtype=np.int64)
        self._sent = np.empty((0, 4, 4))
        self._stale: dict[tuple[str, int], None] = {}

    def set_items(self, items: Iterable[MarkerItem]) -> None:
        """Take over which geometries there are; what vanished is left for ``deletions``.

        Nothing changes where a mesh can't be read, which raises MeshError or InvalidShapeError.
        """
        items = list(items)
        # Poses that were sent stay known, so that unchanged markers are not sent again.
        sent = dict(zip(self._markers, self._sent, strict=True))
        markers = {item: self._markers.get(item) or self._build(item) for item in items}
        keys = {(marker.ns, marker.id) for marker in markers.values()}
        if len(keys) != len(items):
            raise ValueError("two markers have the same namespace and id")
        for marker in self._order:
            if (marker.ns, marker.id) not in keys:
                self._stale[marker.ns, marker.id] = None
        for key in keys:
            self._stale.pop(key, None)
        self._markers = markers
        self._order = list(markers.values())
        is_plate = [item.shape.kind == ShapeKind.HALF_SPACE for item in items]
        self._plates = np.flatnonzero(np.array(is_plate, dtype=bool))
        never = np.full((4, 4), np.nan)
        self._sent = np.array([sent.get(item, never) for item in items]).reshape(-1, 4, 4)

    def _build(self, item: MarkerItem) -> Marker:
        return marker_from_shape(
            item, frame_id=self._frame_id, package_shares=self._package_shares
        )

    @property
    def markers(self) -> Sequence[Marker]:
        """The markers in the order of the items."""
        return self._order

    def full(self, X_WG: NDArray[np.float64], stamp_ns: int) -> MarkerArray:
        """Return all markers at ``X_WG`` ``(n, 4, 4)``."""
        return self._place(np.arange(len(self._order)), X_WG, stamp_ns)

    def moved(self, X_WG: NDArray[np.float64], stamp_ns: int) -> MarkerArray:
        """Return the markers whose pose is another than when they were last returned."""
        return self._place(self.moved_rows(X_WG), X_WG, stamp_ns)

    def moved_rows(self, X_WG: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the rows whose pose is another than when it was last returned."""
        self._check(X_WG)
        # Not a number, which stands for "never", differs from everything.
        return np.flatnonzero((self._sent != X_WG).any(axis=(1, 2)))

    def deletions(self, stamp_ns: int) -> MarkerArray:
        """Return a deletion for each marker that vanished since the last call."""
        header = header_to_msg(stamp_ns, self._frame_id)
        markers = [
            Marker(header=header, ns=ns, id=identity, action=Marker.DELETE)
            for ns, identity in self._stale
        ]
        self._stale.clear()
        return MarkerArray(markers=markers)

    def _check(self, X_WG: NDArray[np.float64]) -> None:
        if X_WG.shape != (len(self._order), 4, 4):
            raise ValueError(f"{len(self._order)} markers take (n, 4, 4) poses, not {X_WG.shape}")

    def place(self, rows: NDArray[np.int64], X_WG: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses of the markers of some rows, and take them as sent."""
        self._check(X_WG)
        self._sent[rows] = X_WG[rows]
        X_WM = X_WG[rows]
        plates = np.isin(rows, self._plates)
        # The plate of a half space hangs below its boundary.
        X_WM[plates, :3, 3] -= 0.5 * HALF_SPACE_THICKNESS * X_WM[plates, :3, 2]
        return X_WM

    def _place(
        self, rows: NDArray[np.int64], X_WG: NDArray[np.float64], stamp_ns: int
    ) -> MarkerArray:
        X_WM, stamp = self.place(rows, X_WG), stamp_to_msg(stamp_ns)
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
