"""Deformable geometry: meshes and configurations to and from messages, and its contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from msg_adapters.arrays import (
    float64s_to_msg,
    int64s_to_msg,
    rows_from_msg,
    uint8s_to_msg,
    uint32s_to_msg,
    uint64s_to_msg,
)
from msg_adapters.errors import MessageError
from msg_adapters.names import legend, SceneNames
from msg_adapters.poses import header_to_msg
from msg_adapters.scene import instance_from_msg
from msg_adapters.shapes import resolve_file, Resolver
from msg_adapters.stamps import checked_stamp_from_msg
from scene_graph_msgs.msg import (
    DeformableConfigurations,
    DeformableContactTable,
    DeformableGeometryDescription,
)
from scene_graph_msgs.msg import VolumeMesh as VolumeMeshMsg
from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.quoting import quoted

__all__ = [
    "ConfigurationBatch",
    "DeformableDescription",
    "configurations_from_msg",
    "configurations_to_msg",
    "deformable_contacts_to_msg",
    "deformable_from_msg",
    "volume_mesh_from_msg",
    "volume_mesh_to_msg",
]

FloatArray = NDArray[np.float64]


def volume_mesh_from_msg(msg: VolumeMeshMsg) -> VolumeMesh:
    """Return the mesh. Raises MessageError for lengths, MeshError for a mesh without volume."""
    vertices = rows_from_msg(msg.vertices, 3, "vertices")
    if len(msg.tetrahedra) % 4:
        raise MessageError(f"tetrahedra has {len(msg.tetrahedra)} entries, no multiple of 4")
    tetrahedra = np.array(msg.tetrahedra, dtype=np.int64).reshape(-1, 4)
    return VolumeMesh(vertices, tetrahedra)


def volume_mesh_to_msg(mesh: VolumeMesh) -> VolumeMeshMsg:
    """Return the message of a volume mesh."""
    return VolumeMeshMsg(
        vertices=float64s_to_msg(mesh.vertices), tetrahedra=uint32s_to_msg(mesh.tetrahedra)
    )


class DeformableDescription(NamedTuple):
    """A deformable geometry to register."""

    instance: GeometryInstance
    resolution_hint: float | None
    reference_mesh: VolumeMesh | None


def deformable_from_msg(
    msg: DeformableGeometryDescription, resolve: Resolver = resolve_file
) -> DeformableDescription:
    """Return the geometry to register; ``resolve`` finds files, also of meshes to embed.

    Raises the errors of ``instance_from_msg`` and ``volume_mesh_from_msg``.
    """
    has_mesh = len(msg.reference_mesh.vertices) > 0 or len(msg.reference_mesh.tetrahedra) > 0
    return DeformableDescription(
        instance_from_msg(msg.geometry, resolve),
        float(msg.resolution_hint[0]) if len(msg.resolution_hint) else None,
        volume_mesh_from_msg(msg.reference_mesh) if has_mesh else None,
    )


class ConfigurationBatch(NamedTuple):
    """Where the vertices of some geometries are said to be, not checked against the scene."""

    names: tuple[str, ...]
    stamp_ns: int
    """0: when it arrives."""
    frame_id: str
    positions: tuple[FloatArray, ...]
    """(v, 3) metres in the world, of each geometry; numbers may be anything."""


def configurations_from_msg(msg: DeformableConfigurations) -> ConfigurationBatch:
    """Return the configurations of a message. Raises MessageError where its lengths don't fit."""
    counts = [int(count) for count in msg.vertex_counts]
    if len(counts) != len(msg.names):
        raise MessageError(f"{len(msg.names)} names come with {len(counts)} vertex_counts")
    if 3 * sum(counts) != len(msg.positions):
        raise MessageError(
            f"positions has {len(msg.positions)} numbers, not 3 for each of {sum(counts)} vertices"
        )
    positions = np.array(msg.positions, dtype=np.float64).reshape(-1, 3)
    return ConfigurationBatch(
        tuple(msg.names),
        checked_stamp_from_msg(msg.header.stamp),
        msg.header.frame_id,
        tuple(np.split(positions, np.cumsum(counts)[:-1])) if counts else (),
    )


def configurations_to_msg(
    configurations: Mapping[str, FloatArray], *, stamp_ns: int, frame_id: str
) -> DeformableConfigurations:
    """Return the message of positions ``(v, 3)``, in m in the world, by name of the geometry.

    Raises MessageError for an array of another shape.
    """
    arrays = [np.asarray(positions, dtype=np.float64) for positions in configurations.values()]
    for name, array in zip(configurations, arrays, strict=True):
        if array.ndim != 2 or array.shape[1] != 3:
            raise MessageError(f"positions of {quoted(name)} are {array.shape}, not (v, 3)")
    return DeformableConfigurations(
        header=header_to_msg(stamp_ns, frame_id),
        names=list(configurations),
        vertex_counts=uint32s_to_msg([len(array) for array in arrays]),
        positions=float64s_to_msg(np.concatenate([a.ravel() for a in arrays]) if arrays else []),
    )


def deformable_contacts_to_msg(
    contacts: Sequence[Any], names: SceneNames | None
) -> DeformableContactTable:
    """Return the deformable contact of each configuration as columns.

    Without ``names`` the legend stays empty.
    """
    surfaces = [surface for contact in contacts for surface in contact]

    def joined(name: str, width: int = 1, dtype: Any = np.float64) -> NDArray[Any]:
        """Join a column of faces; where B is rigid it has none, but zeros."""
        columns: list[Any] = [np.empty(0, dtype)]
        for surface in surfaces:
            column = getattr(surface, name)
            count = width * surface.num_contact_points
            columns.append(np.zeros(count, dtype) if column is None else np.ravel(column))
        return np.concatenate(columns)

    id_A = np.array([int(surface.id_A) for surface in surfaces], dtype=np.int64)
    id_B = np.array([int(surface.id_B) for surface in surfaces], dtype=np.int64)
    msg = DeformableContactTable(
        configuration_start=uint64s_to_msg(np.cumsum([0, *(len(each) for each in contacts)])),
        id_a=int64s_to_msg(id_A),
        id_b=int64s_to_msg(id_B),
        is_b_deformable=uint8s_to_msg([surface.is_B_deformable for surface in surfaces]),
        face_start=uint64s_to_msg(np.cumsum([0, *(s.num_contact_points for s in surfaces)])),
        corner_start=uint64s_to_msg(_corner_start(surfaces)),
        corners=float64s_to_msg(joined("vertices_W")),
        contact_points=float64s_to_msg(joined("contact_points_W")),
        face_areas=float64s_to_msg(joined("face_areas")),
        face_normals=float64s_to_msg(joined("nhats_BA_W")),
        signed_distances=float64s_to_msg(joined("signed_distances")),
    )
    for side in "AB":
        fields = {
            "tetrahedra": uint32s_to_msg(joined(f"tetrahedra_{side}", 1, np.int64)),
            "tetrahedron_vertices": uint32s_to_msg(joined(f"vertex_indices_{side}", 4, np.int64)),
            "weights": float64s_to_msg(joined(f"barycentric_coordinates_{side}", 4)),
        }
        for field, values in fields.items():
            setattr(msg, f"{field}_{side.lower()}", values)
    _put_participation(msg, contacts)
    msg.geometries = legend(names, id_A, id_B, msg.participating_ids)
    return msg


def _corner_start(surfaces: Sequence[Any]) -> NDArray[np.int64]:
    counts = [np.diff(surface.face_starts) for surface in surfaces]
    return np.cumsum(np.concatenate([[0], *counts]).astype(np.int64))


def _put_participation(msg: DeformableContactTable, contacts: Sequence[Any]) -> None:
    items = [item for contact in contacts for item in contact.participation.items()]
    vertices = [participation.vertices for _, participation in items]
    msg.participating_ids = int64s_to_msg([int(geometry_id) for geometry_id, _ in items])
    msg.participation_start = uint64s_to_msg(np.cumsum([0, *(len(v) for v in vertices)]))
    msg.participating_vertices = uint32s_to_msg(np.concatenate([np.empty(0), *vertices]))
