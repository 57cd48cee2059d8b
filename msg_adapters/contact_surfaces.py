"""Contact surfaces: tables to and from columns of a message, and faces as a point cloud."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from msg_adapters.arrays import (
    float64s_to_msg,
    int64s_to_msg,
    uint8s_to_msg,
    uint32s_to_msg,
    uint64s_to_msg,
)
from msg_adapters.errors import MessageError
from msg_adapters.names import legend, SceneNames
from msg_adapters.poses import header_to_msg
from scene_graph_msgs.msg import ContactSurfaceTable
from scene_graph_ros.views.surfaces import corner_rows

__all__ = [
    "CLOUD_FIELDS",
    "SurfaceArrays",
    "contact_surfaces_to_msg",
    "face_points_from_msg",
    "face_points_to_msg",
    "surface_arrays_from_msg",
]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

CLOUD_FIELDS = (
    "x", "y", "z", "normal_x", "normal_y", "normal_z", "pressure", "area"
)  # fmt: skip
"""Of a face in a point cloud: centroid (m), unit normal out of B into A, mean pressure (Pa), area
(m^2); float32 as viewers want it."""

_CLOUD_TYPE = np.dtype([*((name, "<f4") for name in CLOUD_FIELDS), ("surface", "<u4")])


class SurfaceArrays(NamedTuple):
    """One contact surface of a message."""

    id_A: int
    id_B: int
    is_compliant_A: bool
    is_compliant_B: bool
    total_area: float
    centroid_W: FloatArray
    force_W: FloatArray
    """(3,) N, on A."""
    moment_W: FloatArray
    """(3,) Nm, on A about the centroid."""
    vertices_W: FloatArray
    """(v, 3) metres."""
    pressure: FloatArray
    """(v,) pascals."""
    faces: tuple[IntArray, ...]
    """The rows of ``vertices_W`` of each face."""
    face_normals_W: FloatArray
    """(f, 3) out of B into A."""
    face_areas: FloatArray
    face_centroids_W: FloatArray
    face_pressures: FloatArray
    grad_pressure_A_W: FloatArray | None
    """(f, 3) Pa/m; None where the message has none, zero where A is rigid."""
    grad_pressure_B_W: FloatArray | None


def contact_surfaces_to_msg(
    tables: Sequence[Any],
    names: SceneNames | None,
    *,
    with_faces: bool = True,
    with_gradients: bool = False,
) -> ContactSurfaceTable:
    """Return one table of contact surfaces per configuration as columns.

    A is M and B is N. Without ``names`` the legend stays empty.
    """

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([np.asarray(getattr(table, name)) for table in tables])

    msg = ContactSurfaceTable(
        configuration_start=uint64s_to_msg(np.cumsum([0, *(len(table) for table in tables)])),
        id_a=int64s_to_msg(joined("id_M")),
        id_b=int64s_to_msg(joined("id_N")),
        is_compliant_a=uint8s_to_msg(joined("is_compliant_M")),
        is_compliant_b=uint8s_to_msg(joined("is_compliant_N")),
        areas=float64s_to_msg(joined("total_area")),
        centroids=float64s_to_msg(joined("centroid_W")),
        forces=float64s_to_msg(joined("force_W")),
        torques=float64s_to_msg(joined("moment_W")),
        vertex_start=uint64s_to_msg([0]),
        face_start=uint64s_to_msg([0]),
        corner_start=uint64s_to_msg([0]),
        geometries=legend(names, joined("id_M"), joined("id_N")),
    )
    if with_faces:
        _put_faces(msg, tables, joined)
        if with_gradients:
            msg.face_gradients_a = float64s_to_msg(joined("grad_pressure_M_W"))
            msg.face_gradients_b = float64s_to_msg(joined("grad_pressure_N_W"))
    return msg


def _put_faces(msg: ContactSurfaceTable, tables: Sequence[Any], joined: Any) -> None:
    rows = [corner_rows(table) for table in tables]
    vertices = np.cumsum([0, *(len(table.pressure) for table in tables)])
    corners = [c + shift for (_, c), shift in zip(rows, vertices[:-1], strict=True)]
    msg.vertex_start = uint64s_to_msg(_cumulated(joined("num_vertices")))
    msg.face_start = uint64s_to_msg(_cumulated(joined("num_faces")))
    msg.vertices = float64s_to_msg(joined("vertices_W"))
    msg.pressures = float64s_to_msg(joined("pressure"))
    msg.corner_start = uint64s_to_msg(
        _cumulated(np.concatenate([np.diff(start) for start, _ in rows]))
    )
    msg.corners = uint32s_to_msg(np.concatenate(corners))
    msg.face_normals = float64s_to_msg(joined("face_normals_W"))
    msg.face_areas = float64s_to_msg(joined("face_areas"))
    msg.face_centroids = float64s_to_msg(joined("face_centroids_W"))
    msg.face_pressures = float64s_to_msg(joined("face_pressures"))


def _cumulated(counts: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.uint64)


def surface_arrays_from_msg(msg: ContactSurfaceTable) -> list[list[SurfaceArrays]]:
    """Return the contact surfaces of each configuration, with their faces as far as sent."""
    surfaces = [_surface(msg, row) for row in range(len(msg.id_a))]
    starts = [int(start) for start in msg.configuration_start]
    return [surfaces[begin:end] for begin, end in itertools.pairwise(starts)]


def _vectors(values: Any, begin: int, end: int) -> FloatArray:
    return np.array(values[3 * begin : 3 * end], dtype=np.float64).reshape(-1, 3)


def _surface(msg: ContactSurfaceTable, row: int) -> SurfaceArrays:
    has_faces = len(msg.face_start) > 1
    v, v_end = (int(i) for i in msg.vertex_start[row : row + 2]) if has_faces else (0, 0)
    f, f_end = (int(i) for i in msg.face_start[row : row + 2]) if has_faces else (0, 0)
    starts = [int(start) for start in msg.corner_start[f : f_end + 1]]
    faces = tuple(
        np.array(msg.corners[begin:end], dtype=np.int64) - v
        for begin, end in itertools.pairwise(starts)
    )
    has_gradients = len(msg.face_gradients_a) > 0
    return SurfaceArrays(
        int(msg.id_a[row]),
        int(msg.id_b[row]),
        bool(msg.is_compliant_a[row]),
        bool(msg.is_compliant_b[row]),
        float(msg.areas[row]),
        _vectors(msg.centroids, row, row + 1)[0],
        _vectors(msg.forces, row, row + 1)[0],
        _vectors(msg.torques, row, row + 1)[0],
        _vectors(msg.vertices, v, v_end),
        np.array(msg.pressures[v:v_end], dtype=np.float64),
        faces,
        _vectors(msg.face_normals, f, f_end),
        np.array(msg.face_areas[f:f_end], dtype=np.float64),
        _vectors(msg.face_centroids, f, f_end),
        np.array(msg.face_pressures[f:f_end], dtype=np.float64),
        _vectors(msg.face_gradients_a, f, f_end) if has_gradients else None,
        _vectors(msg.face_gradients_b, f, f_end) if has_gradients else None,
    )


def face_points_to_msg(surfaces: Any, *, stamp_ns: int, frame_id: str) -> PointCloud2:
    """Return a point per face: see CLOUD_FIELDS, and ``surface`` (uint32), its row in the table.

    The row is also that of the surface in a ``ContactArray`` with the same stamp.
    """
    count = len(surfaces.face_areas)
    points = np.empty(count, dtype=_CLOUD_TYPE)
    for axis, name in enumerate("xyz"):
        points[name] = surfaces.face_centroids_W[:, axis]
        points[f"normal_{name}"] = surfaces.face_normals_W[:, axis]
    points["pressure"], points["area"] = surfaces.face_pressures, surfaces.face_areas
    points["surface"] = np.repeat(np.arange(len(surfaces)), np.asarray(surfaces.num_faces))
    kinds = {"f": PointField.FLOAT32, "u": PointField.UINT32}
    return PointCloud2(
        header=header_to_msg(stamp_ns, frame_id),
        height=1,
        width=count,
        fields=[
            PointField(name=name, offset=offset, datatype=kinds[kind.kind], count=1)
            for name, (kind, offset) in _fields()
        ],
        is_bigendian=False,
        point_step=_CLOUD_TYPE.itemsize,
        row_step=_CLOUD_TYPE.itemsize * count,
        data=uint8s_to_msg(points.view(np.uint8)),
        is_dense=True,
    )


def _fields() -> list[tuple[str, tuple[np.dtype[Any], int]]]:
    fields = _CLOUD_TYPE.fields
    assert fields is not None
    return [(name, (fields[name][0], fields[name][1])) for name in _CLOUD_TYPE.names or ()]


def face_points_from_msg(msg: PointCloud2) -> NDArray[Any]:
    """Return the faces ``(f,)`` of a point cloud as records with the fields of CLOUD_FIELDS.

    Raises MessageError for a cloud that is laid out otherwise.
    """
    found = [(field.name, field.offset) for field in msg.fields]
    wanted = [(name, offset) for name, (_, offset) in _fields()]
    if found != wanted or msg.point_step != _CLOUD_TYPE.itemsize or msg.is_bigendian:
        raise MessageError(f"the fields of the cloud are {found}, not {wanted}")
    return np.frombuffer(bytes(msg.data), dtype=_CLOUD_TYPE)
