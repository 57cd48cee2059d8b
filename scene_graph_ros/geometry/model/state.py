"""The model: everything about sources, frames and geometries that does not depend on poses.

A state is shared between a scene graph, its contexts and their snapshots until one of them
changes it; that one then continues with a copy (see ``owner.py``). A shared state is never
changed, so any number of threads may read it. One that is not shared is changed in place, and
only by an ``Edit``, as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
import itertools
from typing import Any, TYPE_CHECKING

from scene_graph_ros.geometry.accuracy import Accuracy, Engine
from scene_graph_ros.geometry.errors import OwnershipError, RoleError, UnknownIdError
from scene_graph_ros.geometry.model.collision_filter import CollisionFilterScope
from scene_graph_ros.geometry.model.derived import derived, DerivedValues, Part
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.layout import (
    frame_layout,
    FrameLayout,
    role_arrays,
    RoleArrays,
)
from scene_graph_ros.geometry.model.pair_filter import PairFilter
from scene_graph_ros.geometry.model.records import (
    deformable_of,
    FrameRecord,
    GeometryRecord,
    WORLD_FRAME_ID,
)
from scene_graph_ros.geometry.model.renderer import Renderer
from scene_graph_ros.geometry.model.roles import checked_role, Role
from scene_graph_ros.geometry.model.scene_config import SceneGraphConfig
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.element_shape import ElementShape

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.driven_mesh import DrivenMesh

__all__ = ["ROLES", "GeometryState", "new_version"]

ROLES = (Role.PROXIMITY, Role.ILLUSTRATION, Role.PERCEPTION)
_INTERNAL_SOURCE = SourceId.get_new_id()
_WORLD_GROUP = -1
"""Of frames; groups of others are not negative."""
_versions = itertools.count(1)


def new_version() -> int:
    """Return the number of a model, or of the geometries with a role, that is like no other."""
    return next(_versions)


class GeometryState:
    """Tables of records by id, and the indices into them.

    Insertion-ordered dicts serve as ordered sets. Frames are stored parents before children.
    """

    # Each question reads some of them, which takes half as long as from a dict of attributes.
    __slots__ = (
        "accuracy",
        "config",
        "derived",
        "engine",
        "filters",
        "frame_by_name",
        "frame_children",
        "frame_geometries",
        "frames",
        "geometries",
        "geometry_by_name",
        "geometry_children",
        "renderers",
        "role_versions",
        "shared",
        "source_by_name",
        "source_frames",
        "source_names",
        "version",
        "with_role",
    )

    def __init__(self) -> None:
        world = FrameRecord(
            WORLD_FRAME_ID, _INTERNAL_SOURCE, WORLD_FRAME_ID, "world", _WORLD_GROUP
        )
        self.shared = False
        self.accuracy = Accuracy.EXACT
        self.engine = Engine.NATIVE
        self.config = SceneGraphConfig()
        self.renderers: Mapping[str, Renderer] = {}  # replaced as a whole, so copies may share it
        self.source_names: dict[SourceId, str] = {_INTERNAL_SOURCE: "scene_graph_internal"}
        self.source_by_name: dict[str, SourceId] = {"scene_graph_internal": _INTERNAL_SOURCE}
        self.source_frames: dict[SourceId, dict[FrameId, None]] = {_INTERNAL_SOURCE: {}}
        self.frames: dict[FrameId, FrameRecord] = {WORLD_FRAME_ID: world}
        self.frame_by_name: dict[tuple[SourceId, str], FrameId] = {}
        self.frame_children: dict[FrameId, dict[FrameId, None]] = {WORLD_FRAME_ID: {}}
        self.frame_geometries: dict[FrameId, dict[GeometryId, None]] = {WORLD_FRAME_ID: {}}
        self.geometries: dict[GeometryId, GeometryRecord] = {}
        self.geometry_children: dict[GeometryId, dict[GeometryId, None]] = {}
        self.geometry_by_name: dict[tuple[FrameId, Role, str], GeometryId] = {}
        self.with_role: dict[Role, dict[GeometryId, None]] = {role: {} for role in ROLES}
        self.filters = PairFilter()
        self.version = new_version()
        self.role_versions: dict[Role, int] = {role: new_version() for role in ROLES}
        self.derived = DerivedValues()

    def copy(self) -> GeometryState:
        """Return an independent state; records and caches are shared, for they never change."""
        result = object.__new__(GeometryState)
        for name in GeometryState.__slots__:
            setattr(result, name, getattr(self, name))
        result.shared = False
        for name in (
            "source_names",
            "source_by_name",
            "frames",
            "frame_by_name",
            "geometries",
            "geometry_by_name",
            "role_versions",
        ):
            setattr(result, name, dict(getattr(self, name)))
        for name in (
            "source_frames",
            "frame_children",
            "frame_geometries",
            "geometry_children",
            "with_role",
        ):
            nested = getattr(self, name)
            setattr(result, name, {key: dict(members) for key, members in nested.items()})
        result.filters = self.filters.copy()
        result.derived = self.derived.copy()
        return result

    @property
    def state(self) -> GeometryState:
        """This state, so that an inspector takes it like any other holder of one."""
        return self

    def summary(self) -> str:
        """Return the counts of a ``repr``."""
        counts = {
            "source": len(self.source_names) - 1,
            "frame": len(self.frames) - 1,
            "geometry": len(self.geometries),
        }
        plurals = {"geometry": "geometries"}
        return ", ".join(
            f"{count} {noun if count == 1 else plurals.get(noun, noun + 's')}"
            for noun, count in counts.items()
        )

    # What is derived.

    def layout(self) -> FrameLayout:
        """Return the rows of the frames."""
        return _layout(self)

    def rigid_ids(self, role: Role) -> tuple[GeometryId, ...]:
        """Return the rigid geometries with a role, sorted: the rows of ``role_arrays``.

        Those of many elements are not among them, as their elements change: see ``element_ids``.
        """
        return _RIGID_IDS[role](self)

    def element_ids(self, role: Role) -> tuple[GeometryId, ...]:
        """Return the geometries with a role that are many elements, sorted."""
        return _ELEMENT_IDS[role](self)

    def role_arrays(self, role: Role) -> RoleArrays:
        """Return the rows of the rigid geometries with a role."""
        return _ROWS[role](self)

    def deformable_ids(self, role: Role) -> tuple[GeometryId, ...]:
        """Return the deformable geometries with a role, sorted."""
        return _DEFORMABLE_IDS[role](self)

    # Look-ups that refuse what is not there.

    def require_source(self, source_id: Any) -> SourceId:
        """Return the id. Raises UnknownIdError if no such source is registered."""
        if not isinstance(source_id, SourceId) or source_id not in self.source_names:
            raise UnknownIdError(f"no source is registered with id {quoted(source_id)}")
        return source_id

    def frame(self, frame_id: Any) -> FrameRecord:
        """Return a frame. Raises UnknownIdError if no such frame is registered."""
        record = self.frames.get(frame_id) if isinstance(frame_id, FrameId) else None
        if record is None:
            raise UnknownIdError(f"no frame is registered with id {quoted(frame_id)}")
        return record

    def geometry(self, geometry_id: Any) -> GeometryRecord:
        """Return a geometry. Raises UnknownIdError if no such geometry is registered."""
        record = self.geometries.get(geometry_id) if isinstance(geometry_id, GeometryId) else None
        if record is None:
            raise UnknownIdError(f"no geometry is registered with id {quoted(geometry_id)}")
        return record

    def own_frame(self, source_id: SourceId, frame_id: FrameId) -> FrameRecord:
        """Return a frame of a source. Raises OwnershipError if another source registered it."""
        self.require_source(source_id)
        record = self.frame(frame_id)
        self._require_owner(source_id, record, "frame")
        return record

    def own_geometry(self, source_id: SourceId, geometry_id: GeometryId) -> GeometryRecord:
        """Return a geometry of a source. Raises OwnershipError if another registered it."""
        self.require_source(source_id)
        record = self.geometry(geometry_id)
        self._require_owner(source_id, record, "geometry")
        return record

    def _require_owner(
        self, source_id: SourceId, record: FrameRecord | GeometryRecord, what: str
    ) -> None:
        if record.source_id != source_id:
            raise OwnershipError(
                f"{what} {record.name!r} ({record.id!r}) belongs to source"
                f" {self.source_names[record.source_id]!r}, not to"
                f" {self.source_names[source_id]!r}"
            )

    # Sets and pairs.

    def ids_of_set(self, geometry_set: GeometrySet, role: Role | None = None) -> set[GeometryId]:
        """Return the geometries a set means, those with ``role`` only if it is given.

        Raises UnknownIdError if the set has ids that are not registered.
        """
        if not isinstance(geometry_set, GeometrySet):
            raise TypeError(f"geometry_set must be a GeometrySet, not {quoted(geometry_set)}")
        found = {self.geometry(geometry_id).id for geometry_id in geometry_set.geometry_ids()}
        for frame_id in geometry_set.frame_ids():
            found.update(self.frame_geometries[self.frame(frame_id).id])
        if role is None:
            return found
        checked_role(role)
        return {i for i in found if self.has_role(self.geometries[i], role)}

    def proximity_ids(
        self, geometry_set: GeometrySet, scope: CollisionFilterScope
    ) -> frozenset[GeometryId]:
        """Return the geometries of a set that a filter declaration is about."""
        ids = self.ids_of_set(geometry_set, Role.PROXIMITY)
        if scope is CollisionFilterScope.OMIT_DEFORMABLE:
            ids = {i for i in ids if not self.is_deformable(i)}
        return frozenset(ids)

    @staticmethod
    def has_role(record: GeometryRecord, role: Role) -> bool:
        """Tell whether a geometry has a role; UNASSIGNED means it has none."""
        if role is Role.UNASSIGNED:
            return not record.properties
        return role in record.properties

    def is_deformable(self, geometry_id: GeometryId) -> bool:
        """Tell whether a geometry deforms. Raises UnknownIdError."""
        return self.geometry(geometry_id).deformable is not None

    def driven_mesh(self, geometry_id: GeometryId, role: Role) -> DrivenMesh:
        """Return the mesh that a deformable geometry carries along for a role.

        Raises UnknownIdError, DeformableError for a rigid geometry, and RoleError if it lacks the
        role.
        """
        record = self.geometry(geometry_id)
        deformable = deformable_of(record)
        properties = record.properties.get(checked_role(role))
        if properties is None:
            raise RoleError(
                f"deformable geometry {record.name!r} ({record.id!r}) has no role {role.name}, so"
                " no driven mesh for it"
            )
        from scene_graph_ros.geometry.model.driven_mesh import driven_mesh

        return driven_mesh(deformable, properties)

    def collision_filtered(self, id_A: GeometryId, id_B: GeometryId) -> bool:
        """Tell whether a pair is never checked: by its frames, or by declarations.

        Raises RoleError if one of the two has no proximity role.
        """
        records = (self.geometry(id_A), self.geometry(id_B))
        for record in records:
            if Role.PROXIMITY not in record.properties:
                raise RoleError(
                    f"geometry {record.name!r} ({record.id!r}) has no proximity role, so it is in"
                    " no pair that could be filtered"
                )
        # Two anchored geometries are on one frame, the world. Deformable ones are on it only in
        # name, so that it says nothing of what they can touch.
        are_rigid = records[0].deformable is None and records[1].deformable is None
        if are_rigid and records[0].frame_id == records[1].frame_id:
            return True
        return self.filters.is_excluded(id_A, id_B)


@derived(Part.FRAMES)
def _layout(state: GeometryState) -> FrameLayout:
    return frame_layout(state.frames.values(), state.source_frames)


def _rows_of(role: Role) -> Callable[[GeometryState], RoleArrays]:
    @derived(Part.FRAMES, role)
    def rows(state: GeometryState) -> RoleArrays:
        records = [state.geometries[geometry_id] for geometry_id in state.rigid_ids(role)]
        return role_arrays(records, state.layout())

    return rows


def _ids_of(role: Role, kind: str) -> Callable[[GeometryState], tuple[GeometryId, ...]]:
    @derived(role)
    def ids(state: GeometryState) -> tuple[GeometryId, ...]:
        of_role = state.with_role[role]
        return tuple(sorted(i for i in of_role if _kind_of(state.geometries[i]) == kind))

    return ids


def _kind_of(record: GeometryRecord) -> str:
    """Return the kind of a geometry's placement, beside the pose of its frame."""
    if record.deformable is not None:
        return "deformable"
    return "elements" if isinstance(record.shape, ElementShape) else "rigid"


_ROWS = {role: _rows_of(role) for role in ROLES}
_RIGID_IDS = {role: _ids_of(role, "rigid") for role in ROLES}
_DEFORMABLE_IDS = {role: _ids_of(role, "deformable") for role in ROLES}
_ELEMENT_IDS = {role: _ids_of(role, "elements") for role in ROLES}
