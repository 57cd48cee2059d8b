"""The queries' table of the geometries with the proximity role: arrays, row by row."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.sources import validate
from scene_graph_ros.geometry.model.contact_properties import MESH_GROUP, uses_triangles
from scene_graph_ros.geometry.model.derived import derived, Part, renewed
from scene_graph_ros.geometry.model.hydroelastic_properties import (
    read_hydroelastic_properties,
    refuse_elements,
)
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.model.layout import RoleArrays
from scene_graph_ros.geometry.model.mesh_properties import check_solid, mesh_meant
from scene_graph_ros.geometry.model.properties import GeometryProperties, ProximityProperties
from scene_graph_ros.geometry.model.records import GeometryRecord
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.scene_config import SceneGraphConfig
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.tables.changed_table import changed_table, TableOfShapes
from scene_graph_ros.geometry.tables.held_table import HeldTable, hold
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable

__all__ = [
    "ProximityArrays",
    "proximity_arrays",
    "read_mesh_data",
    "shape_table",
    "with_proximity",
]


class ProximityArrays(NamedTuple):
    """The geometries with the proximity role; rows ascend by geometry id."""

    table: ShapeTable
    held: HeldTable
    """The same, for kernels that take it as one array."""
    rows: RoleArrays
    """What places them; some of it once more:"""
    ids: NDArray[np.int64]
    """(n,) integer values of the geometry ids, ascending."""
    geometry_ids: tuple[GeometryId, ...]
    frame: NDArray[np.int32]
    """(n,) row of the frame each geometry hangs on; 0 is the world."""
    X_FG: NDArray[np.float64]
    """(n, 4, 4) pose in that frame."""
    is_anchored: NDArray[np.bool_]
    """(n,) whether the frame is the world."""
    has_elements: bool
    """Whether there are shapes of many elements beside these: ``GeometryState.element_ids``."""
    filter_bits: NDArray[np.uint8] | None
    """(n, ceil(n / 8)) or None without any: pair (i, j) was excluded by a declaration where
    ``(filter_bits[i, j >> 3] >> (j & 7)) & 1``; pairs on one frame are not marked."""


def _is_exact(record: GeometryRecord) -> bool:
    """Tell whether a mesh is its triangles; other shapes have none."""
    if not isinstance(record.shape, MeshShape):
        return False
    properties = record.properties[Role.PROXIMITY]
    assert isinstance(properties, ProximityProperties)
    return uses_triangles(properties)


def with_proximity(
    record: GeometryRecord, properties: GeometryProperties, config: SceneGraphConfig
) -> GeometryRecord:
    """Return a geometry's record with the proximity role, by properties and the scene's values.

    Its mesh is taken as the properties say. Raises PropertyError for the properties, MeshError for
    data that cannot be read, are no mesh, or no solid where one is required. The data is kept for
    the queries, so nothing is read twice.
    """
    assert isinstance(properties, ProximityProperties)
    filled = config.default_proximity_properties.filled(
        properties, record.shape, is_deformable=record.deformable is not None
    )
    both = {**record.properties, Role.PROXIMITY: filled}
    record = record._replace(properties=both, given=properties.read_only_copy())
    uses_triangles(filled)
    if record.deformable is not None:
        return record
    shape = mesh_meant(record.shape, filled)
    if shape is not record.shape:
        record = record._replace(shape=shape)
    refuse_elements(record.shape, filled, record.name)
    read_hydroelastic_properties(record.shape, filled, record.name)
    read_mesh_data(record.shape, filled, record.name)
    return record


def read_mesh_data(shape: Any, properties: Any, name: str) -> None:
    """Read and keep the data of a Convex or Mesh; other shapes have none.

    This may take long, so it is called once before a model is locked for a change.
    """
    if not isinstance(shape, MeshShape) and not properties.has_group(MESH_GROUP):
        return
    shape = mesh_meant(shape, properties)
    if isinstance(shape, MeshShape):
        validate(shape)
    check_solid(shape, properties, name)


@derived(Part.FRAMES, Part.FILTERS, Role.PROXIMITY)
def proximity_arrays(state: GeometryState) -> ProximityArrays:
    """Return the arrays of a state, computed on first use and kept while they hold."""
    rows = state.role_arrays(Role.PROXIMITY)
    return ProximityArrays(
        table=shape_table(state),
        held=_held_table(state),
        rows=rows,
        ids=rows.ids,
        geometry_ids=rows.geometry_ids,
        frame=rows.frame,
        X_FG=rows.X_FG,
        is_anchored=rows.frame == 0,
        has_elements=bool(state.element_ids(Role.PROXIMITY)),
        filter_bits=_filter_bits(state),
    )


@derived(Role.PROXIMITY)
def _held_table(state: GeometryState) -> HeldTable:
    return hold(shape_table(state))


@derived(Part.FILTERS, Role.PROXIMITY)
def _filter_bits(state: GeometryState) -> NDArray[np.uint8] | None:
    return state.filters.bit_matrix(state.rigid_ids(Role.PROXIMITY))


def shape_table(state: GeometryState) -> ShapeTable:
    """Return the shapes of the rows of ``proximity_arrays``, which no pose or filter changes."""
    return _table(state).table


@renewed(Role.PROXIMITY)
def _table(state: GeometryState, before: TableOfShapes | None) -> TableOfShapes:
    records = [state.geometries[i] for i in state.rigid_ids(Role.PROXIMITY)]
    return changed_table(before, [r.shape for r in records], [_is_exact(r) for r in records])
