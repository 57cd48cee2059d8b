"""The proximity properties that say how a mesh is taken: repaired, in pieces, as a solid."""

from __future__ import annotations

from typing import Any

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.sources import report_of
from scene_graph_ros.geometry.model.contact_properties import MESH_GROUP, PIECES
from scene_graph_ros.geometry.model.properties import ProximityProperties
from scene_graph_ros.geometry.property_errors import PropertyValueError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_pieces import BY_COACD, BY_OBJECTS, MeshPieces
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape, REPAIR_TOLERANCE

__all__ = ["LARGEST_REPAIR", "check_solid", "mesh_meant", "solid_is_required"]

REPAIR = "repair_tolerance"
THRESHOLD = "pieces_threshold"
SEED = "pieces_seed"
SOLID = "solid"
REQUIRED = "required"
IF_CLOSED = "if_closed"

LARGEST_REPAIR = 1e-2
"""Relative to the size: larger gaps are no faults of writing but openings."""


_THRESHOLDS = (0.01, 1.0)
"""Between these CoACD keeps its threshold."""

_DEFAULT_THRESHOLD = 0.05
_LARGEST_SEED = 2**32 - 1


def mesh_meant(shape: Any, properties: ProximityProperties) -> Any:
    """Return the shape with the tolerance of its repair and the pieces that properties name.

    Raises PropertyError for a tolerance that is no number from 0 to LARGEST_REPAIR, and for pieces
    that are none.
    """
    is_mesh = isinstance(shape, MeshShape)
    if not is_mesh and not properties.has_group(MESH_GROUP):
        return shape
    tolerance, pieces = REPAIR_TOLERANCE, None
    if properties.has_group(MESH_GROUP):
        tolerance = _number(properties, REPAIR, REPAIR_TOLERANCE, (0.0, LARGEST_REPAIR))
        pieces = _pieces(properties)
    if not is_mesh:
        return shape
    if shape.repair_tolerance != tolerance:
        shape = shape.with_repair_tolerance(tolerance)
    if shape.kind != ShapeKind.MESH or shape.pieces == pieces:
        return shape
    return shape.with_pieces(pieces)


def _pieces(properties: ProximityProperties) -> MeshPieces | None:
    """Return the pieces that properties name. Raises PropertyError for other values."""
    word = properties.get_property_or_default(MESH_GROUP, PIECES, None)
    if word not in (None, BY_OBJECTS, BY_COACD):
        raise PropertyValueError(
            f"property ({MESH_GROUP!r}, {PIECES!r}) must be {BY_COACD!r} or {BY_OBJECTS!r}, not"
            f" {quoted(word)}"
        )
    for name in (THRESHOLD, SEED):
        if word != BY_COACD and properties.has_property(MESH_GROUP, name):
            raise PropertyValueError(
                f"property ({MESH_GROUP!r}, {name!r}) comes with ({MESH_GROUP!r}, {PIECES!r}) ="
                f" {BY_COACD!r}"
            )
    if word is None or word == BY_OBJECTS:
        return None if word is None else MeshPieces(BY_OBJECTS)
    threshold = _number(properties, THRESHOLD, _DEFAULT_THRESHOLD, _THRESHOLDS)
    seed = properties.get_property_or_default(MESH_GROUP, SEED, 0)
    if not isinstance(seed, int) or isinstance(seed, bool) or not 0 <= seed <= _LARGEST_SEED:
        raise PropertyValueError(
            f"property ({MESH_GROUP!r}, {SEED!r}) must be a whole number from 0 to"
            f" {_LARGEST_SEED}, not {quoted(seed)}"
        )
    return MeshPieces(BY_COACD, threshold, seed)


def _number(
    properties: ProximityProperties,
    name: str,
    default: float,
    bounds: tuple[float, float],
) -> float:
    """Return a number that is a part of the mesh's size. Raises PropertyError."""
    value = properties.get_property_or_default(MESH_GROUP, name, None)
    number = as_float(default if value is None else value)
    low, high = bounds
    if number is None or not low <= number <= high:
        raise PropertyValueError(
            f"property ({MESH_GROUP!r}, {name!r}) must be a number from {low:g} to {high:g}, a"
            f" part of the mesh's size, not {quoted(value)}"
        )
    return number


def solid_is_required(properties: ProximityProperties) -> bool:
    """Tell whether a Mesh must be a solid as a whole.

    Raises PropertyError if ``("mesh", "solid")`` is neither "required" nor "if_closed".
    """
    word = properties.get_property_or_default(MESH_GROUP, SOLID, IF_CLOSED)
    if word not in (REQUIRED, IF_CLOSED):
        raise PropertyValueError(
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
    report = report_of(shape.with_pieces(None))
    if not report.is_closed or report.reason:
        raise MeshError(
            f"geometry {name!r} must be a solid, ({MESH_GROUP!r}, {SOLID!r}) = {REQUIRED!r}:"
            f" {report.reason}"
        )
