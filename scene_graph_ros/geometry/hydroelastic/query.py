"""Answer the queries about contact surfaces of one snapshot."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.accuracy import Engine
from scene_graph_ros.geometry.errors import UnsupportedPairError
from scene_graph_ros.geometry.hydroelastic.body_table import body_table, BodyKind
from scene_graph_ros.geometry.hydroelastic.contact_surface import ContactSurfaces
from scene_graph_ros.geometry.hydroelastic.driver import solve_surfaces
from scene_graph_ros.geometry.hydroelastic.element_table import build_element_table, ElementTable
from scene_graph_ros.geometry.model.contact_properties import MATERIAL_GROUP
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.candidates.rows import candidate_rows
from scene_graph_ros.geometry.query.distance.solve import describe
from scene_graph_ros.geometry.query.penetration.ask import penetrations_of
from scene_graph_ros.geometry.query.representation import as_representation, ContactRepresentation
from scene_graph_ros.geometry.query.results import Penetrations
from scene_graph_ros.geometry.query.settings import Settings

__all__ = ["compute_contact_surfaces", "compute_contact_surfaces_with_fallback"]

_PAIRS_WITH_SURFACE = (
    (BodyKind.COMPLIANT_VOLUME, BodyKind.RIGID_SURFACE),
    (BodyKind.COMPLIANT_VOLUME, BodyKind.COMPLIANT_VOLUME),
    (BodyKind.COMPLIANT_VOLUME, BodyKind.RIGID_HALF_SPACE),
    (BodyKind.COMPLIANT_VOLUME, BodyKind.COMPLIANT_HALF_SPACE),
    (BodyKind.COMPLIANT_HALF_SPACE, BodyKind.RIGID_SURFACE),
)
"""The pairs of kinds that have a contact surface: one side must give way, and one must end."""

_HAS_SURFACE = np.zeros((len(BodyKind), len(BodyKind)), dtype=np.bool_)
for _pair in _PAIRS_WITH_SURFACE:
    _HAS_SURFACE[_pair] = _HAS_SURFACE[_pair[::-1]] = True

_WORDS = {
    BodyKind.NONE: "without hydroelastic properties",
    BodyKind.RIGID_SURFACE: "rigid",
    BodyKind.COMPLIANT_VOLUME: "compliant",
    BodyKind.RIGID_HALF_SPACE: "a rigid half space",
    BodyKind.COMPLIANT_HALF_SPACE: "a compliant half space",
}


def compute_contact_surfaces(
    snapshot: Snapshot, representation: ContactRepresentation | str
) -> ContactSurfaces:
    """Return the contact surfaces of all pairs.

    Raises:
        QueryArgumentError: ``representation`` is neither "triangle" nor "polygon".
        UnsupportedPairError: a pair penetrates that has no contact surface.

    """
    chosen = as_representation(representation)
    table = _element_table(snapshot.state)
    with_surface, others = _candidates(snapshot, table)
    if len(others) or snapshot.proximity.has_elements:
        _refuse_contact(snapshot, table, others)
    return _surfaces(snapshot, table, with_surface, chosen)


def _refuse_contact(snapshot: Snapshot, table: ElementTable, others: NDArray[np.int64]) -> None:
    """Raise UnsupportedPairError if any of these pairs, which have no surface, penetrates."""
    query = "compute_contact_surfaces"
    settings = Settings(snapshot.state.accuracy, Engine.NATIVE)
    penetrations = penetrations_of(snapshot, others, settings, query)
    if len(penetrations):
        both = (penetrations.id_A[0], penetrations.id_B[0])
        names = [_described(snapshot, table, int(id_)) for id_ in both]
        raise UnsupportedPairError(
            f"{query}: {names[0]}, against {names[1]}, has no contact surface: one side must be"
            " compliant, and one be no half space. Declare hydroelastic properties, filter the"
            " pair, or ask compute_contact_surfaces_with_fallback for points where there is no"
            " surface."
        )


def _described(snapshot: Snapshot, table: ElementTable, id_: int) -> str:
    """Name a geometry in a message, and say why it may have no surface."""
    row = int(np.searchsorted(snapshot.proximity.ids, id_))
    if row < len(snapshot.proximity.ids) and snapshot.proximity.ids[row] == id_:
        return f"{describe(snapshot, row)}, which is {_WORDS[BodyKind(table.kind[row])]}"
    geometry_id = GeometryId(id_)
    record = snapshot.state.geometry(geometry_id)
    kind = f"{record.shape.type_name} {record.name!r} ({geometry_id!r})"
    return f"{kind}, which is of many elements without pressure"


def compute_contact_surfaces_with_fallback(
    snapshot: Snapshot, representation: ContactRepresentation | str
) -> tuple[ContactSurfaces, Penetrations]:
    """Return contact surfaces where pairs have one, and penetrations of the other pairs.

    Raises:
        QueryArgumentError: ``representation`` is neither "triangle" nor "polygon".
        UnsupportedPairError: two half spaces, not both anchored and not filtered.

    """
    chosen = as_representation(representation)
    table = _element_table(snapshot.state)
    with_surface, others = _candidates(snapshot, table)
    settings = Settings(snapshot.state.accuracy, snapshot.state.engine)
    query = "compute_contact_surfaces_with_fallback"
    penetrations = penetrations_of(snapshot, others, settings, query)
    return _surfaces(snapshot, table, with_surface, chosen), penetrations


@derived(Role.PROXIMITY)
def _element_table(state: GeometryState) -> ElementTable:
    return build_element_table(body_table(state))


def _candidates(
    snapshot: Snapshot, table: ElementTable
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the candidate rows that have a contact surface, and the others."""
    # Margins reach out of the shapes, which are what the broad phase knows.
    reach = float(np.sort(table.margin)[-2:].sum())
    pairs = candidate_rows(snapshot, reach)
    kinds = table.kind[pairs]
    has_surface = _HAS_SURFACE[kinds[:, 0], kinds[:, 1]]
    if has_surface.all():
        return pairs, pairs[:0]
    return pairs[has_surface], pairs[~has_surface]


def _surfaces(
    snapshot: Snapshot,
    table: ElementTable,
    pairs: NDArray[np.int64],
    representation: ContactRepresentation,
) -> ContactSurfaces:
    triangles = representation is ContactRepresentation.TRIANGLE
    patches = solve_surfaces(table, snapshot.X_WG, pairs, triangles)
    ids = snapshot.proximity.ids[patches.rows]
    kinds, totals = table.kind[patches.rows], patches.totals
    compliant = (kinds == BodyKind.COMPLIANT_VOLUME) | (kinds == BodyKind.COMPLIANT_HALF_SPACE)
    columns = {
        "id_M": ids[:, 0],
        "id_N": ids[:, 1],
        "total_area": totals[:, 0],
        "centroid_W": totals[:, 1:4],
        "force_W": totals[:, 4:7],
        "moment_W": totals[:, 7:10],
        "is_compliant_M": compliant[:, 0],
        "is_compliant_N": compliant[:, 1],
        "num_faces": np.diff(patches.face_start),
        "num_vertices": np.diff(patches.vertex_start),
    }
    state = snapshot.state
    return ContactSurfaces(columns, patches, representation, _materials(state), state)


@derived(Role.PROXIMITY)
def _materials(state: GeometryState) -> Mapping[int, Mapping[str, Any]]:
    materials: dict[int, Mapping[str, Any]] = {}
    for geometry_id in state.rigid_ids(Role.PROXIMITY):
        properties = state.geometries[geometry_id].properties[Role.PROXIMITY]
        known = properties.has_group(MATERIAL_GROUP)
        group = properties.get_properties_in_group(MATERIAL_GROUP) if known else {}
        materials[int(geometry_id)] = MappingProxyType(group)
    return MappingProxyType(materials)
