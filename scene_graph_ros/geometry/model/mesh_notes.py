"""Which meshes of a scene are no solids, or doubtful ones, in a sentence each."""

from __future__ import annotations

from scene_graph_ros.geometry.meshes.sources import report_of
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape

__all__ = ["mesh_notes", "piece_notes"]


def mesh_notes(inspector: SceneGraphInspector) -> list[str]:
    """Return a sentence for each mesh with the proximity role that has a reason in its report.

    A mesh that several geometries share is named once.
    """
    notes: dict[MeshShape, str] = {}
    for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY):
        shape = inspector.get_shape(geometry_id)
        if not isinstance(shape, Mesh) or inspector.is_deformable(geometry_id):
            continue
        if shape not in notes:
            report = report_of(shape)
            name = inspector.get_name(geometry_id)
            notes[shape] = f"mesh {name!r}: {report.reason}" if report.reason else ""
    return [note for note in notes.values() if note]


def piece_notes(inspector: SceneGraphInspector) -> list[str]:
    """Return a sentence for each mesh in pieces: how many, and how far they leave the solid."""
    notes: dict[MeshShape, str] = {}
    for geometry_id in inspector.get_all_geometry_ids(Role.PROXIMITY):
        shape = inspector.get_shape(geometry_id)
        if isinstance(shape, Mesh) and shape.pieces is not None and shape not in notes:
            notes[shape] = f"mesh {inspector.get_name(geometry_id)!r}: {report_of(shape).pieces}"
    return list(notes.values())
