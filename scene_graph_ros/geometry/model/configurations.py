"""A source's state beside poses, checked: vertices that deform, points, heights, voxels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidConfigurationError, OwnershipError
from scene_graph_ros.geometry.model.deformable import Configuration
from scene_graph_ros.geometry.model.height_set import HeightSet, new_heights
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.model.point_set import new_points, PointSet
from scene_graph_ros.geometry.model.records import deformable_of, GeometryRecord
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.model.voxel_set import new_voxels, VoxelSet
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = [
    "checked_configurations",
    "checked_height_sets",
    "checked_point_sets",
    "checked_voxel_sets",
    "is_of",
]


def checked_configurations(
    state: GeometryState, source_id: SourceId, configurations: Any
) -> dict[GeometryId, Configuration]:
    """Return a source's configurations, or raise; see Context.set_configurations."""
    result = {}
    for record, label, value in _own(state, source_id, configurations, "deform it", "q_WG"):
        deformable = deformable_of(record)
        q_WG = _checked_positions(value, len(deformable.mesh.vertices), label)
        result[record.id] = Configuration(deformable, q_WG)
    return result


def checked_point_sets(
    state: GeometryState, source_id: SourceId, points: Any
) -> dict[GeometryId, PointSet]:
    """Return a source's point sets, or raise; see Context.set_points."""
    result = {}
    for record, label, value in _own(state, source_id, points, "set its points", "p_GPs"):
        shape = record.shape
        if not isinstance(shape, PointCloud):
            raise InvalidConfigurationError(
                f"{label}: it is a {shape.type_name}, whose points can't be set; register a"
                " PointCloud"
            )
        result[record.id] = new_points(shape, value, label)
    return result


def checked_height_sets(
    state: GeometryState, source_id: SourceId, heights: Any
) -> dict[GeometryId, HeightSet]:
    """Return the heights that a source sets, or raise; see Context.set_heights."""
    result = {}
    for record, label, value in _own(state, source_id, heights, "set its heights", "heights"):
        shape = record.shape
        if not isinstance(shape, HeightField):
            raise InvalidConfigurationError(
                f"{label}: it is a {shape.type_name}, whose heights can't be set; register a"
                " HeightField"
            )
        result[record.id] = new_heights(shape, value, label)
    return result


def checked_voxel_sets(
    state: GeometryState, source_id: SourceId, voxels: Any
) -> dict[GeometryId, VoxelSet]:
    """Return the voxels that a source sets, or raise; see Context.set_voxels."""
    result = {}
    for record, label, value in _own(state, source_id, voxels, "set its voxels", "occupancy"):
        shape = record.shape
        if not isinstance(shape, VoxelGrid):
            raise InvalidConfigurationError(
                f"{label}: it is a {shape.type_name}, whose voxels can't be set; register a"
                " VoxelGrid"
            )
        result[record.id] = new_voxels(shape, value, label)
    return result


def is_of(
    value: Configuration | PointSet | HeightSet | VoxelSet, record: GeometryRecord | None
) -> bool:
    """Tell whether an entry is of the geometry that has its id now, if any."""
    if record is None:
        return False
    if isinstance(value, Configuration):
        return record.deformable is value.deformable
    return record.shape is value.shape


def _own(
    state: GeometryState, source_id: SourceId, given: Any, verb: str, symbol: str
) -> Iterator[tuple[GeometryRecord, str, Any]]:
    """Yield record, label and value of each geometry in a mapping, which must be the source's."""
    state.require_source(source_id)
    if not isinstance(given, Mapping):
        raise TypeError(f"geometry ids must map to {symbol}, not {quoted(given)}")
    source = state.source_names[source_id]
    for geometry_id, value in given.items():
        record = state.geometry(geometry_id)
        if record.source_id != source_id:
            raise OwnershipError(
                f"geometry {record.name!r} ({geometry_id!r}) belongs to source"
                f" {state.source_names[record.source_id]!r}: {source!r} cannot {verb}"
            )
        yield record, f"{symbol} of geometry {record.name!r} of source {source!r}", value


def _checked_positions(value: Any, count: int, label: str) -> NDArray[np.float64]:
    q_WG = real_array(value, f"{label} must be numbers", InvalidConfigurationError)
    if q_WG.shape not in ((count, 3), (3 * count,)):
        raise InvalidConfigurationError(
            f"{label} must be ({count}, 3) or ({3 * count},), not {q_WG.shape}"
        )
    q_WG = q_WG.reshape(count, 3)
    bad = ~(np.abs(q_WG) <= MAX_COORDINATE).all(axis=1)
    if bad.any():
        row = int(bad.argmax())
        raise InvalidConfigurationError(
            f"{label}: vertex {row} must be finite and within {MAX_COORDINATE:g} m of the"
            f" origin, not {q_WG[row].tolist()}"
        )
    return q_WG
