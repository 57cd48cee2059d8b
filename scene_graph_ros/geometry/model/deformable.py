"""Deformable geometries of the model: their reference meshes and their configurations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import math
import threading
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import (
    DeformableError,
    InvalidConfigurationError,
    OwnershipError,
)
from scene_graph_ros.geometry.meshes.cache import BuildCache
from scene_graph_ros.geometry.model.ids import GeometryId, SourceId
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.properties import GeometryProperties
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.box import Box
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh
    from scene_graph_ros.geometry.model.records import GeometryRecord
    from scene_graph_ros.geometry.model.state import GeometryState

__all__ = [
    "DEFORMABLE_GROUP",
    "Configuration",
    "Deformable",
    "checked_configurations",
    "deformable_of",
    "make_deformable",
    "read_embedded_meshes",
    "refuse_deformable",
]


DEFORMABLE_GROUP = "deformable"
_INSIDE = 2.0
_CAPACITY = 64
_meshes: BuildCache[VolumeMesh] = BuildCache(_CAPACITY)


class _Memo:
    """Derived values by name, computed once, on first use, by whichever thread asks first."""

    __slots__ = ("_lock", "_values")

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._values: dict[Any, Any] = {}

    def cached(self, key: Any, compute: Callable[[], Any]) -> Any:
        """Return the value of a name; other threads wait while it is computed."""
        if key not in self._values:
            with self._lock:
                if key not in self._values:
                    self._values[key] = compute()
        return self._values[key]


class Configuration(_Memo):
    """Where the vertices of a deformable geometry are, at one moment. It never changes."""

    __slots__ = ("deformable", "q_WG")

    def __init__(self, deformable: Deformable, q_WG: NDArray[np.float64]) -> None:
        """Take positions ``(v, 3)``, in m, that nobody writes to any more."""
        super().__init__()
        q_WG.flags.writeable = False
        self.deformable = deformable
        self.q_WG = q_WG


class Deformable(_Memo):
    """What is registered of a deformable geometry beside what every geometry has."""

    __slots__ = ("mesh", "reference")

    def __init__(self, mesh: VolumeMesh, X_WG: NDArray[np.float64]) -> None:
        """Take a mesh in G, and where G is in the world: the configuration to begin with."""
        super().__init__()
        self.mesh = mesh
        self.reference = Configuration(self, mesh.vertices @ X_WG[:3, :3].T + X_WG[:3, 3])


def make_deformable(
    instance: GeometryInstance, resolution_hint: float | None, reference_mesh: VolumeMesh | None
) -> Deformable:
    """Return the deformable that an instance on the world frame stands for.

    Raises DeformableError for a half space, a hint that is no positive length, or a mesh that is
    no VolumeMesh or comes with a hint; MeshError if the shape cannot be divided into tetrahedra.
    """
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

    label = f"deformable geometry {instance.name()!r}"
    hint: Any = resolution_hint
    if hint is not None:
        length = as_float(hint)
        if length is None or not 0.0 < length < math.inf:
            raise DeformableError(
                f"{label}: resolution_hint must be a positive number of metres, not {quoted(hint)}"
            )
        hint = length
    if reference_mesh is None:
        return Deformable(_tessellated(instance, hint, label), instance.pose())
    mesh: Any = reference_mesh
    if not isinstance(mesh, VolumeMesh):
        raise DeformableError(f"{label}: reference_mesh must be a VolumeMesh, not {mesh!r}")
    if hint is not None:
        raise DeformableError(
            f"{label}: a reference_mesh is taken as it is, resolution_hint {hint!r} is for shapes"
        )
    return Deformable(mesh, instance.pose())


def read_embedded_meshes(roles: Iterable[GeometryProperties | None]) -> None:
    """Read the meshes that properties of roles ask to embed, so that errors come now.

    Raises PropertyError, InvalidShapeError or MeshError.
    """
    for properties in roles:
        if isinstance(properties, GeometryProperties) and properties.has_group(DEFORMABLE_GROUP):
            from scene_graph_ros.geometry.model.driven_mesh import read_embedded_mesh

            read_embedded_mesh(properties)


def _tessellated(instance: GeometryInstance, hint: float | None, label: str) -> VolumeMesh:
    """Return the reference mesh of a shape; see SceneGraph.register_deformable_geometry.

    The tessellators make as few tetrahedra as represent a shape and its depth. To deform, it needs
    more: a box becomes a grid, and inside other shapes edges longer than twice the hint are cut.
    """
    shape = instance.shape()
    if shape.kind == ShapeKind.HALF_SPACE:
        raise DeformableError(f"{label}: a half space has no end, and so no volume mesh")
    from scene_graph_ros.geometry.meshes.box_grid import grid_box
    from scene_graph_ros.geometry.meshes.tessellate import tessellate_volume
    from scene_graph_ros.geometry.meshes.volume_io import VOLUME_FILE_TYPES
    from scene_graph_ros.geometry.meshes.volume_refinement import with_short_edges

    if hint is None:
        return tessellate_volume(shape, None)
    length = float(hint)
    if isinstance(shape, Box):
        return grid_box(shape, length)
    if isinstance(shape, MeshShape) and shape.file_type in VOLUME_FILE_TYPES:
        return tessellate_volume(shape, length)
    return _meshes.get(
        (shape, length),
        lambda: with_short_edges(tessellate_volume(shape, length), _INSIDE * length),
    )


def refuse_deformable(record: GeometryRecord, what: str) -> None:
    """Raise DeformableError, saying ``what``, if a geometry is deformable."""
    if record.deformable is not None:
        raise DeformableError(f"geometry {record.name!r} ({record.id!r}) is deformable: {what}")


def deformable_of(record: GeometryRecord) -> Deformable:
    """Return what a deformable geometry has. Raises DeformableError for a rigid one."""
    if record.deformable is None:
        raise DeformableError(
            f"geometry {record.name!r} ({record.id!r}) is rigid: it has a pose, and neither a"
            " volume mesh nor a configuration"
        )
    return record.deformable


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
    try:
        q_WG = np.array(value, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidConfigurationError(f"{label} must be numbers: {error}") from error
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
