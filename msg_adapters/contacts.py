"""Contacts: result tables to ``ContactArray`` and to markers."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Vector3
import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from msg_adapters.contact_rows import ContactKind, KINDS, NO_ROWS, PairRows, point_rows
from msg_adapters.names import SceneNames
from msg_adapters.poses import header_to_msg
from scene_graph_msgs.msg import ContactArray

__all__ = [
    "CONTACT_MARKER_NAMESPACE",
    "contact_markers_to_msg",
    "contact_points",
    "contacts_to_msg",
]

CONTACT_MARKER_NAMESPACE = "contacts"

_POINTS, _SURFACES, _DEFORMABLES = KINDS

_POINTS_ID = 0
_NORMALS_ID = 1

_LINE_WIDTH = 0.2
"""Width of a normal's line, relative to the diameter of the points."""


def _contacts(kind: ContactKind, rows: PairRows, names: SceneNames) -> list[Any]:
    name = names.geometry_name
    return [
        kind.make(name(id_A), name(id_B), numbers)
        for id_A, id_B, numbers in zip(
            rows.id_A.tolist(), rows.id_B.tolist(), rows.numbers.tolist(), strict=True
        )
    ]


def contacts_to_msg(
    table: Any,
    names: SceneNames,
    *,
    stamp_ns: int,
    frame_id: str,
    scene_version: int,
    surfaces: PairRows = NO_ROWS,
    deformables: PairRows = NO_ROWS,
) -> ContactArray:
    """Return all contacts of a scene, stamped as its poses; ``frame_id`` is the world's.

    ``table`` holds the penetrations; ``surfaces`` and ``deformables`` come from
    ``contact_rows``. Names of geometries are shared between contacts, so don't change them.
    """
    return ContactArray(
        header=header_to_msg(stamp_ns, frame_id),
        scene_version=int(scene_version),
        points=_contacts(_POINTS, point_rows(table), names),
        surfaces=_contacts(_SURFACES, surfaces, names),
        deformables=_contacts(_DEFORMABLES, deformables, names),
    )


def _points(rows: NDArray[np.float64]) -> list[Point]:
    return [Point(x=x, y=y, z=z) for x, y, z in rows.tolist()]


def contact_markers_to_msg(
    table: Any,
    *,
    stamp_ns: int,
    frame_id: str,
    point_diameter: float = 0.02,
    normal_length: float = 0.1,
    color: tuple[float, float, float, float] = (0.9, 0.1, 0.1, 1.0),
) -> MarkerArray:
    """Return both witness points of each contact as balls, and a line from Cb along the normal.

    Lengths are in metres. The line points out of B into A and is as long as ``normal_length``, or
    as the depth where that is larger, so that it ends outside the overlap. There are two markers,
    for any number of contacts; without contacts they delete the ones before.
    """
    header = header_to_msg(stamp_ns, frame_id)
    count = len(table.depth)
    markers = [
        Marker(
            header=header,
            ns=CONTACT_MARKER_NAMESPACE,
            id=identity,
            type=kind,
            action=Marker.ADD if count else Marker.DELETE,
        )
        for identity, kind in ((_POINTS_ID, Marker.SPHERE_LIST), (_NORMALS_ID, Marker.LINE_LIST))
    ]
    if not count:
        return MarkerArray(markers=markers)
    balls, lines = markers
    for marker in markers:
        marker.color = ColorRGBA(**dict(zip("rgba", map(float, color), strict=True)))
        marker.pose.orientation.w = 1.0
    diameter = float(point_diameter)
    balls.scale = Vector3(x=diameter, y=diameter, z=diameter)
    lines.scale = Vector3(x=_LINE_WIDTH * diameter)
    p_WBalls, p_WLines = contact_points(table, normal_length)
    balls.points, lines.points = _points(p_WBalls), _points(p_WLines)
    return MarkerArray(markers=markers)


def contact_points(
    table: Any, normal_length: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the centres of the balls and the ends of the lines, ``(2 n, 3)`` each."""
    p_WCa, p_WCb = np.asarray(table.p_WCa), np.asarray(table.p_WCb)
    lengths = np.maximum(np.asarray(table.depth), float(normal_length))
    p_WEnd = p_WCb + lengths[:, np.newaxis] * np.asarray(table.nhat_BA_W)
    balls, lines = (np.stack(pair, axis=1) for pair in ((p_WCa, p_WCb), (p_WCb, p_WEnd)))
    return balls.reshape(-1, 3), lines.reshape(-1, 3)
