"""The proximity properties that say how a mesh is repaired, and that it must be a solid."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.errors import MeshError, PropertyError
from scene_graph_ros.geometry.meshes.sources import report_of
from scene_graph_ros.geometry.model.contact_properties import MESH_GROUP
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape, REPAIR_TOLERANCE

__all__ = ["LARGEST_REPAIR", "check_solid", "mesh_meant", "solid_is_required"]

REPAIR = "repair_tolerance"
SOLID = "solid"
REQUIRED = "required"
IF_CLOSED = "if_closed"

LARGEST_REPAIR = 1e-2
"""Relative to the size: larger gaps are no faults of writing but openings."""


def mesh_meant(shape: Any, properties: ProximityProperties) -> Any:
    """Return the shape with the tolerance of its repair that properties name.

    Raises PropertyError for a tolerance that is no number from 0 to LARGEST_REPAIR.
    """
    is_mesh = isinstance(shape, MeshShape)
    if not is_mesh and not properties.has_group(MESH_GROUP):
        return shape
    value = properties.get_property_or_default(MESH_GROUP, REPAIR, None)
    if value is None:
        value = REPAIR_TOLERANCE
    tolerance = as_float(value)
    if tolerance is None or not 0.0 <= tolerance <= LARGEST_REPAIR:
        raise PropertyError(
            f"property ({MESH_GROUP!r}, {REPAIR!r}) must be a number from 0 to"
            f" {LARGEST_REPAIR:g}, a part of the mesh's size, not {quoted(value)}"
        )
    if not is_mesh or shape.repair_tolerance == tolerance:
        return shape
    return shape.with_repair_tolerance(tolerance)


def solid_is_required(properties: ProximityProperties) -> bool:
    """Tell whether a Mesh must be a solid as a whole.

    Raises PropertyError if ``("mesh", "solid")`` is neither "required" nor "if_closed".
    """
    word = properties.get_property_or_default(MESH_GROUP, SOLID, IF_CLOSED)
    if word not in (REQUIRED, IF_CLOSED):
        raise PropertyError(
            f"property ({MESH_GROUP!r}, {SOLID!r}) must be {REQUIRED!r} or {IF_CLOSED!r}, not"
            f" {word!r}"
        )
    return bool(word == REQUIRED)


def check_solid(shape: Any, properties: ProximityProperties, name: str) -> None:
    """Refuse, by MeshError, a Mesh that must be a solid and is none, with the report's reason."""
    if not properties.has_group(MESH_GROUP) or not solid_is_required(properties):
        return
    if not isinstance(shape, MeshShape) or shape.kind != ShapeKind.MESH:
        return
    report = report_of(shape)
    if not report.is_closed or report.reason:
        raise MeshError(
            f"geometry {name!r} must be a solid, ({MESH_GROUP!r}, {SOLID!r}) = {REQUIRED!r}:"
            f" {report.reason}"
        )
