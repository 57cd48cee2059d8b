"""What a source says of where the vertices of its deformable geometries are, checked."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidConfigurationError, OwnershipError
from scene_graph_ros.geometry.model.deformable import Configuration
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.model.records import deformable_of
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = ["checked_configurations"]


def checked_configurations(
    state: GeometryState, source_id: SourceId, configurations: Any
) -> dict[GeometryId, Configuration]:
    """Return what a source says of its geometries, or raise; see Context.set_configurations."""
    state.require_source(source_id)
    if not isinstance(configurations, Mapping):
        raise TypeError(
            f"configurations must map geometry ids to vertex positions, not {configurations!r}"
        )
    source = state.source_names[source_id]
    result = {}
    for geometry_id, value in configurations.items():
        record = state.geometry(geometry_id)
        if record.source_id != source_id:
            raise OwnershipError(
                f"geometry {record.name!r} ({geometry_id!r}) belongs to source"
                f" {state.source_names[record.source_id]!r}: {source!r} cannot deform it"
            )
        deformable = deformable_of(record)
        label = f"q_WG of geometry {record.name!r} of source {source!r}"
        q_WG = _checked_positions(value, len(deformable.mesh.vertices), label)
        result[geometry_id] = Configuration(deformable, q_WG)
    return result


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
