"""The contacts of ``ContactArray``, of each kind: pairs of ids, and numbers as messages have them.

Sums over a surface are made here, by columns; a row becomes a message, or is written into the
bytes of one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any, NamedTuple

from geometry_msgs.msg import Point, Vector3, Wrench
import numpy as np
from numpy.typing import NDArray

from scene_graph_msgs.msg import (
    DeformableContact,
    GeometryName,
    PointContact,
    SurfaceContact,
)

__all__ = [
    "KINDS",
    "NO_ROWS",
    "ContactKind",
    "PairRows",
    "deformable_rows",
    "point_rows",
    "surface_rows",
]

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PairRows:
    """n contacts of one kind, sorted by (id_A, id_B)."""

    id_A: NDArray[np.int64]
    """(n,)."""
    id_B: NDArray[np.int64]
    """(n,)."""
    numbers: FloatArray
    """(n, k) in the order of the message's fields."""

    def __len__(self) -> int:
        return len(self.numbers)


_NO_IDS = np.empty(0, dtype=np.int64)
NO_ROWS = PairRows(_NO_IDS, _NO_IDS, np.empty((0, 0)))
"""No contacts, of any kind."""


class ContactKind(NamedTuple):
    """One of the sequences of ``ContactArray``."""

    field: str
    """Its name there."""
    width: int
    """How many numbers a contact has behind its two names."""
    make: Callable[[GeometryName, GeometryName, Sequence[float]], Any]
    """Returns the message of a row."""


_BLANK = PointContact()


def _point(a: GeometryName, b: GeometryName, n: Sequence[float]) -> PointContact:
    # The constructor makes all its defaults, also those that are given: that is half of the time.
    contact = copy(_BLANK)
    contact.geometry_a, contact.geometry_b = a, b
    contact.point_a = Point(x=n[0], y=n[1], z=n[2])
    contact.point_b = Point(x=n[3], y=n[4], z=n[5])
    contact.normal = Vector3(x=n[6], y=n[7], z=n[8])
    contact.depth = n[9]
    return contact


def _surface(a: GeometryName, b: GeometryName, n: Sequence[float]) -> SurfaceContact:
    force = Vector3(x=n[12], y=n[13], z=n[14])
    torque = Vector3(x=n[15], y=n[16], z=n[17])
    return SurfaceContact(
        geometry_a=a,
        geometry_b=b,
        centroid=Point(x=n[0], y=n[1], z=n[2]),
        area=n[3],
        normal=Vector3(x=n[4], y=n[5], z=n[6]),
        pressure=n[7],
        pressure_max=n[8],
        traction=Vector3(x=n[9], y=n[10], z=n[11]),
        wrench=Wrench(force=force, torque=torque),
    )


def _deformable(a: GeometryName, b: GeometryName, n: Sequence[float]) -> DeformableContact:
    return DeformableContact(
        geometry_a=a,
        geometry_b=b,
        centroid=Point(x=n[0], y=n[1], z=n[2]),
        area=n[3],
        normal=Vector3(x=n[4], y=n[5], z=n[6]),
        signed_distance=n[7],
    )


KINDS = (
    ContactKind("points", 10, _point),
    ContactKind("surfaces", 18, _surface),
    ContactKind("deformables", 8, _deformable),
)
"""In the order of their fields."""


def point_rows(table: Any) -> PairRows:
    """Return the contacts of a penetration table."""
    numbers = np.empty((len(table.depth), KINDS[0].width))
    numbers[:, 0:3], numbers[:, 3:6] = table.p_WCa, table.p_WCb
    numbers[:, 6:9], numbers[:, 9] = table.nhat_BA_W, table.depth
    return PairRows(
        np.asarray(table.id_A, np.int64), np.asarray(table.id_B, np.int64), numbers
    )  # fmt: skip


def surface_rows(surfaces: Any) -> PairRows:
    """Return the contacts of a table of contact surfaces; A is its M, B its N.

    Pressure counts as zero where it is negative, as it does in the table's forces.
    """
    count = len(surfaces)
    if not count:
        return NO_ROWS
    numbers = np.empty((count, KINDS[1].width))
    area, force = np.asarray(surfaces.total_area), np.asarray(surfaces.force_W)
    pressed, largest = _pressure(surfaces)
    weighted = surfaces.face_areas[:, np.newaxis] * surfaces.face_normals_W
    numbers[:, 0:3], numbers[:, 3] = surfaces.centroid_W, area
    numbers[:, 4:7] = _unit(np.add.reduceat(weighted, surfaces.face_start[:-1]), area)
    numbers[:, 7], numbers[:, 8] = pressed / area, largest
    numbers[:, 9:12] = force / area[:, np.newaxis]
    numbers[:, 12:15], numbers[:, 15:18] = force, surfaces.moment_W
    return PairRows(
        np.asarray(surfaces.id_M, np.int64), np.asarray(surfaces.id_N, np.int64), numbers
    )


def deformable_rows(contact: Any) -> PairRows:
    """Return the contacts of deformable geometries, summed over each surface."""
    if not len(contact):
        return NO_ROWS
    numbers = np.empty((len(contact), KINDS[2].width))
    for row, surface in zip(numbers, contact, strict=True):
        areas, total = surface.face_areas, surface.total_area
        row[0:3], row[3] = areas @ surface.contact_points_W / total, total
        row[4:7] = _unit((areas @ surface.nhats_BA_W)[np.newaxis], np.array([total]))[0]
        row[7] = surface.signed_distances.min()
    ids = np.array([(int(s.id_A), int(s.id_B)) for s in contact], dtype=np.int64)
    return PairRows(ids[:, 0], ids[:, 1], numbers)


_CANCELLED = 1e-12
"""Dimensionless. Of the area: what is left of normals that cancel is rounding below this, a few
units in the last place for each of thousands of faces."""


def _unit(weighted: FloatArray, area: FloatArray) -> FloatArray:
    """Return unit vectors (n, 3) of sums of ``area * normal``, zero where those cancel."""
    lengths = np.linalg.norm(weighted, axis=1)
    is_clear = lengths > _CANCELLED * area
    result: FloatArray = weighted / np.where(is_clear, lengths, 1.0)[:, np.newaxis]
    result[~is_clear] = 0.0
    return result


def _pressure(surfaces: Any) -> tuple[FloatArray, FloatArray]:
    """Return of each surface the integral (N) and the maximum (Pa) of pressure above zero."""
    pressure = surfaces.pressure
    largest = np.maximum(np.maximum.reduceat(pressure, surfaces.vertex_start[:-1]), 0.0)
    if pressure.min() >= 0.0:
        pressed = surfaces.face_areas * surfaces.face_pressures
        return np.add.reduceat(pressed, surfaces.face_start[:-1]), largest
    from scene_graph_ros.views.surfaces import triangles_of

    triangles, face = triangles_of(surfaces)
    corners = surfaces.vertices_W[triangles]
    edges = corners[:, 1:] - corners[:, :1]
    areas = 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    pressed = np.bincount(
        face, areas * _mean_above_zero(pressure[triangles]), len(surfaces.face_areas)
    )
    return np.add.reduceat(pressed, surfaces.face_start[:-1]), largest


def _mean_above_zero(p: FloatArray) -> FloatArray:
    """Return (t,) the mean of max(p, 0) over triangles whose corners have ``p`` (t, 3).

    Of a corner that alone has its sign, the zero line cuts off a triangle with the share
    p0^2 / ((p0 - p1) (p0 - p2)) of the area, in which the mean is p0 / 3.
    """
    mean = p.mean(axis=1)
    above = np.count_nonzero(p > 0.0, axis=1)
    result: FloatArray = np.where(above == 3, mean, 0.0)
    ordered = np.sort(p, axis=1)
    # The corner that is alone comes first: the largest, or the smallest.
    for count, order in ((1, (2, 1, 0)), (2, (0, 1, 2))):
        rows = above == count
        p0, p1, p2 = ordered[rows][:, order].T
        alone = p0**3 / (3.0 * (p0 - p1) * (p0 - p2))
        result[rows] = alone if count == 1 else mean[rows] - alone
    return result
