"""Answers about contact surfaces and deformable geometry; imported when one is first asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import Any

from msg_adapters.contact_surfaces import contact_surfaces_to_msg
from msg_adapters.deformables import (
    configurations_to_msg,
    deformable_contacts_to_msg,
    volume_mesh_to_msg,
)
from msg_adapters.errors import MessageError
from msg_adapters.queries import point_contacts_to_msg
from scene_graph_ros.geometry.query.query_object import QueryObject
from scene_graph_ros.geometry.query.representation import as_representation
from scene_graph_ros.node.services.queries import QueryScope

__all__ = ["contact_surfaces", "deformable_configurations", "deformable_contact"]


def contact_surfaces(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputeContactSurfaces."""
    if request.with_gradients and not request.with_faces:
        raise MessageError("with_gradients is about faces, and with_faces is false")
    representation = as_representation(request.representation)
    tally = scope.tally

    def answer(query: QueryObject) -> tuple[Any, Any]:
        rest: Any = ()
        if request.with_fallback:
            question = QueryObject.compute_contact_surfaces_with_fallback
            table, rest = scope.ask(query, question, representation)
        else:
            table = scope.ask(query, QueryObject.compute_contact_surfaces, representation)
        faces = len(table.face_areas) if request.with_faces else 0
        tally.add(len(table) + len(rest), faces)
        return table, rest

    answers = scope.each(answer)
    tables = [table for table, _ in answers]
    response.table = contact_surfaces_to_msg(
        tables,
        scope.legend,
        with_faces=request.with_faces,
        with_gradients=request.with_gradients,
    )
    if request.with_fallback:
        response.contacts = point_contacts_to_msg([rest for _, rest in answers], scope.legend)


def deformable_contact(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer ComputeDeformableContact."""
    tally = scope.tally

    def answer(query: QueryObject) -> Any:
        contact = scope.ask(query, QueryObject.compute_deformable_contact)
        tally.add(len(contact), sum(surface.num_contact_points for surface in contact))
        return contact

    response.table = deformable_contacts_to_msg(scope.each(answer), scope.legend)


def deformable_configurations(request: Any, response: Any, scope: QueryScope) -> None:
    """Answer GetDeformableConfigurations."""
    snapshot = scope.snapshot
    names, inspector = snapshot.names, snapshot.inspector
    if request.geometries:
        ids = [names.geometry_id(reference) for reference in request.geometries]
        if len(set(ids)) < len(ids):
            raise MessageError("geometries names one more than once")
    else:
        ids = sorted(inspector.get_all_deformable_geometry_ids())
    positions = [snapshot.query.get_configurations_in_world(g) for g in ids]
    vertices = sum(len(each) for each in positions)
    scope.require("max_rows_per_response", vertices, "vertices of the answer")
    labels = dict(zip(_labels(ids, snapshot), positions, strict=True))
    response.geometries = [names.geometry_name(g) for g in ids]
    response.configurations = configurations_to_msg(
        labels, stamp_ns=snapshot.stamp, frame_id=scope.limit("world_frame")
    )
    if request.with_reference_meshes:
        meshes = [inspector.get_reference_mesh(g) for g in ids]
        response.reference_meshes = [volume_mesh_to_msg(mesh) for mesh in meshes]


def _labels(ids: list[Any], snapshot: Any) -> Iterator[str]:
    """Name geometries as their sources do, or by paths where that would name two the same."""
    names = [snapshot.inspector.get_name(g) for g in ids]
    count = Counter(names)
    for geometry_id, name in zip(ids, names, strict=True):
        yield name if count[name] == 1 else snapshot.names.geometry_path(geometry_id)
