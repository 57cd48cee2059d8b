"""Questions about a model that need no moving pose."""

from __future__ import annotations

import itertools
from typing import Protocol, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.meshes.hull import Hull
from scene_graph_ros.geometry.meshes.solids.mesh_report import MeshReport
from scene_graph_ros.geometry.meshes.sources import hull_of, report_of
from scene_graph_ros.geometry.model.geometry_set import GeometrySet
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.instance import GeometryInstance
from scene_graph_ros.geometry.model.names import trimmed_name
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.paths import path_of
from scene_graph_ros.geometry.model.properties import (
    GeometryProperties,
    IllustrationProperties,
    PerceptionProperties,
    ProximityProperties,
)
from scene_graph_ros.geometry.model.records import deformable_of, WORLD_FRAME_ID
from scene_graph_ros.geometry.model.roles import checked_role, Role
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.model.version import GeometryVersion
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.mesh import Mesh
from scene_graph_ros.geometry.shapes.mesh_shape import MeshShape
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.shape import Shape
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid

if TYPE_CHECKING:
    from scene_graph_ros.geometry.meshes.surface_mesh import SurfaceMesh
    from scene_graph_ros.geometry.meshes.volume_mesh import VolumeMesh

__all__ = ["SceneGraphInspector"]


class _HasState(Protocol):
    @property
    def state(self) -> GeometryState: ...


class SceneGraphInspector(NotCopied):
    """Answers about sources, frames, geometries, roles and filters.

    An inspector of a scene graph or a context follows its changes and is for the thread that
    makes them; an inspector of a snapshot never changes and is for any thread. Every method that
    takes an id raises UnknownIdError if it names nothing, and one that takes a role RoleError for
    anything else. Lists are in the order of registration, unless the method says otherwise.
    """

    __slots__ = ("_holder",)
    _instead = "ask its scene graph, context or query object for another"

    def __init__(self, holder: _HasState) -> None:
        self._holder = holder

    def __repr__(self) -> str:
        return f"SceneGraphInspector({self._state.summary()})"

    @property
    def _state(self) -> GeometryState:
        return self._holder.state

    # The whole scene.

    def num_sources(self) -> int:
        """Count the sources, among them the scene graph's own, which has the world frame."""
        return len(self._state.source_names)

    def num_frames(self) -> int:
        """Count the frames, the world included."""
        return len(self._state.frames)

    def num_geometries(self) -> int:
        """Count the geometries."""
        return len(self._state.geometries)

    def num_anchored_geometries(self) -> int:
        """Count the geometries that never move: the rigid ones on the world frame."""
        state = self._state
        return sum(state.geometries[i].is_anchored for i in state.frame_geometries[WORLD_FRAME_ID])

    def num_dynamic_geometries(self) -> int:
        """Count the geometries on frames that move, and the deformable ones."""
        return self.num_geometries() - self.num_anchored_geometries()

    def num_deformable_geometries(self) -> int:
        """Count the deformable geometries."""
        return len(self.get_all_deformable_geometry_ids())

    def num_geometries_with_role(self, role: Role) -> int:
        """Count the geometries with a role; UNASSIGNED counts those without any."""
        with_role = self._state.with_role.get(checked_role(role))
        return len(self.get_all_geometry_ids(role)) if with_role is None else len(with_role)

    def world_frame_id(self) -> FrameId:
        """Return the id of the world frame."""
        return WORLD_FRAME_ID

    def get_all_source_ids(self) -> list[SourceId]:
        """Return all sources, the scene graph's own first."""
        return list(self._state.source_names)

    def get_all_frame_ids(self) -> list[FrameId]:
        """Return all frames, parents before children, the world first."""
        return list(self._state.frames)

    all_frame_ids = get_all_frame_ids

    def get_all_geometry_ids(self, role: Role | None = None) -> list[GeometryId]:
        """Return all geometries, or those with ``role``; UNASSIGNED means without any."""
        state = self._state
        if role is None:
            return list(state.geometries)
        checked_role(role)
        return [i for i, record in state.geometries.items() if state.has_role(record, role)]

    def get_all_deformable_geometry_ids(self) -> list[GeometryId]:
        """Return all deformable geometries."""
        return [i for i, r in self._state.geometries.items() if r.deformable is not None]

    def get_all_cloud_ids(self) -> list[GeometryId]:
        """Return all geometries that are a `PointCloud`, whose points a context has."""
        records = self._state.geometries.items()
        return [i for i, record in records if isinstance(record.shape, PointCloud)]

    def get_all_height_field_ids(self) -> list[GeometryId]:
        """Return all geometries that are a `HeightField`, whose heights a context has."""
        records = self._state.geometries.items()
        return [i for i, record in records if isinstance(record.shape, HeightField)]

    def get_all_voxel_grid_ids(self) -> list[GeometryId]:
        """Return all geometries that are a `VoxelGrid`, whose voxels a context has."""
        records = self._state.geometries.items()
        return [i for i, record in records if isinstance(record.shape, VoxelGrid)]

    def get_unchanged_geometry_ids(self, before: SceneGraphInspector) -> list[GeometryId]:
        """Return the geometries of which all is as ``before`` says, also frame and source."""
        other: object = before
        if not isinstance(other, SceneGraphInspector):
            raise TypeError(f"before must be a SceneGraphInspector, not {quoted(other)}")
        new, old = self._state, other._state
        return [
            i
            for i, record in new.geometries.items()
            if old.geometries.get(i) is record
            and old.frames[record.frame_id] is new.frames[record.frame_id]
            and old.source_names[record.source_id] == new.source_names[record.source_id]
        ]

    def get_geometry_ids(
        self, geometry_set: GeometrySet, role: Role | None = None
    ) -> list[GeometryId]:
        """Return the geometries a set means, sorted; those with ``role`` only if it is given."""
        return sorted(self._state.ids_of_set(geometry_set, role))

    def get_collision_candidates(self) -> list[tuple[GeometryId, GeometryId]]:
        """Return all pairs that collision queries check, each sorted, and sorted.

        That is every two geometries with the proximity role but those on one frame, two anchored
        ones, and those excluded by declarations. Pairs with a deformable geometry are a matter of
        deformable contact alone.
        """
        filtered = self._state.collision_filtered
        ids = sorted(self._state.with_role[Role.PROXIMITY])
        return [pair for pair in itertools.combinations(ids, 2) if not filtered(*pair)]

    def num_excluded_pairs(self) -> int:
        """Count the pairs on different frames that declarations keep from collision queries."""
        state = self._state
        ids = sorted(state.with_role[Role.PROXIMITY])
        frames = np.array([int(state.geometries[i].frame_id) for i in ids], dtype=np.int64)
        pairs = state.filters.excluded_rows(ids)
        return int(np.count_nonzero(frames[pairs[:, 0]] != frames[pairs[:, 1]]))

    def geometry_version(self) -> GeometryVersion:
        """Return a token per role that changes with the role's geometries, or its filters."""
        versions = self._state.role_versions
        return GeometryVersion(
            proximity=versions[Role.PROXIMITY],
            illustration=versions[Role.ILLUSTRATION],
            perception=versions[Role.PERCEPTION],
        )

    # Sources.

    def source_is_registered(self, source_id: SourceId) -> bool:
        """Tell whether there is a source with this id."""
        given: object = source_id
        return isinstance(given, SourceId) and given in self._state.source_names

    def get_name(self, any_id: SourceId | FrameId | GeometryId) -> str:
        """Return the name of a source, a frame or a geometry."""
        if isinstance(any_id, GeometryId):
            return self._state.geometry(any_id).name
        if isinstance(any_id, FrameId):
            return self._state.frame(any_id).name
        return self._state.source_names[self._state.require_source(any_id)]

    get_source_name = get_name
    get_name_by_frame_id = get_name
    get_name_by_geometry_id = get_name

    def get_source_id_by_name(self, name: str) -> SourceId:
        """Return the source with a name. Raises UnknownIdError if there is none."""
        source_id = self._state.source_by_name.get(trimmed_name("source", name))
        if source_id is None:
            raise UnknownIdError(f"no source is named {name!r}")
        return source_id

    def num_frames_for_source(self, source_id: SourceId) -> int:
        """Count the frames of a source."""
        return len(self.frames_for_source(source_id))

    def frames_for_source(self, source_id: SourceId) -> list[FrameId]:
        """Return a source's frames as registered; the world's is the scene's own source's."""
        own = self._state.source_frames[self._state.require_source(source_id)]
        is_worlds = self._state.frames[WORLD_FRAME_ID].source_id == source_id
        return [WORLD_FRAME_ID, *own] if is_worlds else list(own)

    get_frames_for_source = frames_for_source

    def get_geometries_for_source(self, source_id: SourceId) -> list[GeometryId]:
        """Return the geometries of a source, anchored ones included."""
        self._state.require_source(source_id)
        return [i for i, r in self._state.geometries.items() if r.source_id == source_id]

    # Frames.

    def belongs_to_source(self, any_id: FrameId | GeometryId, source_id: SourceId) -> bool:
        """Tell whether a source registered the frame or geometry."""
        return self.get_owning_source_id(any_id) == self._state.require_source(source_id)

    def get_owning_source_id(self, any_id: FrameId | GeometryId) -> SourceId:
        """Return the source that registered the frame or geometry."""
        if isinstance(any_id, GeometryId):
            return self._state.geometry(any_id).source_id
        return self._state.frame(any_id).source_id

    def get_owning_source_name(self, any_id: FrameId | GeometryId) -> str:
        """Return the name of the source that registered the frame or geometry."""
        return self._state.source_names[self.get_owning_source_id(any_id)]

    def get_path(self, any_id: FrameId | GeometryId) -> str:
        """Return ``source/frame`` or ``source/frame/geometry``, as scene files call it."""
        return path_of(self._state, any_id)

    def get_parent_frame(self, frame_id: FrameId) -> FrameId:
        """Return the parent of a frame; the world is its own parent."""
        return self._state.frame(frame_id).parent_id

    def get_child_frames(self, frame_id: FrameId) -> list[FrameId]:
        """Return the frames whose parent is the given one."""
        return list(self._state.frame_children[self._state.frame(frame_id).id])

    def get_frame_group(self, frame_id: FrameId) -> int:
        """Return the group number of a frame, -1 of the world's: no other has that."""
        return self._state.frame(frame_id).frame_group

    def get_frame_id_by_name(self, source_id: SourceId, name: str) -> FrameId:
        """Return a source's frame with a name. Raises UnknownIdError if there is none."""
        key = (self._state.require_source(source_id), trimmed_name("frame", name))
        if key not in self._state.frame_by_name:
            source = self._state.source_names[source_id]
            raise UnknownIdError(f"source {source!r} has no frame named {name!r}")
        return self._state.frame_by_name[key]

    def num_geometries_for_frame(self, frame_id: FrameId) -> int:
        """Count the geometries on a frame."""
        return len(self._state.frame_geometries[self._state.frame(frame_id).id])

    def num_geometries_for_frame_with_role(self, frame_id: FrameId, role: Role) -> int:
        """Count the geometries on a frame that have a role."""
        return len(self.get_geometries(frame_id, role))

    def get_geometries(self, frame_id: FrameId, role: Role | None = None) -> list[GeometryId]:
        """Return the geometries on a frame, those with ``role`` only if it is given."""
        state = self._state
        if role is not None:
            checked_role(role)
        ids = state.frame_geometries[state.frame(frame_id).id]
        return [i for i in ids if role is None or state.has_role(state.geometries[i], role)]

    def get_geometry_id_by_name(self, frame_id: FrameId, role: Role, name: str) -> GeometryId:
        """Return the geometry on a frame with a role and a name, which is trimmed first.

        Raises UnknownIdError if there is none, NameConflictError if there are several, which only
        geometries without a role can be.
        """
        state = self._state
        label = trimmed_name("geometry", name)
        if checked_role(role) is Role.UNASSIGNED:
            on_frame = self.get_geometries(frame_id, role)
            named = [i for i in on_frame if state.geometries[i].name == label]
        else:
            found = state.geometry_by_name.get((state.frame(frame_id).id, role, label))
            named = [] if found is None else [found]
        where = f"on frame {state.frame(frame_id).name!r} with role {role.name} named {label!r}"
        if not named:
            raise UnknownIdError(f"there is no geometry {where}")
        if len(named) > 1:
            raise NameConflictError(f"there are {len(named)} geometries {where}: {named}")
        return named[0]

    # Geometries.

    def get_frame_id(self, geometry_id: GeometryId) -> FrameId:
        """Return the frame a geometry moves with, also if it hangs on another geometry."""
        return self._state.geometry(geometry_id).frame_id

    def get_parent_geometry(self, geometry_id: GeometryId) -> GeometryId | None:
        """Return the geometry that a geometry hangs on, or None if it hangs on its frame."""
        return self._state.geometry(geometry_id).parent_id

    def is_anchored(self, geometry_id: GeometryId) -> bool:
        """Tell whether a geometry is on the world frame, and rigid."""
        return self._state.geometry(geometry_id).is_anchored

    def is_deformable(self, geometry_id: GeometryId) -> bool:
        """Tell whether a geometry is deformable."""
        return self._state.is_deformable(geometry_id)

    def get_reference_mesh(self, geometry_id: GeometryId) -> VolumeMesh:
        """Return the mesh in G of a deformable geometry. Raises DeformableError if it is rigid."""
        return deformable_of(self._state.geometry(geometry_id)).mesh

    def get_driven_meshes(self, geometry_id: GeometryId, role: Role) -> list[SurfaceMesh]:
        """Return the surfaces in G that a deformable geometry carries along for a role.

        Where their vertices are now, tells get_driven_mesh_configurations_in_world of a query
        object. Raises DeformableError for a rigid geometry, RoleError if it lacks the role.
        """
        return [self._state.driven_mesh(geometry_id, role).surface]

    def get_shape(self, geometry_id: GeometryId) -> Shape:
        """Return the shape of a geometry."""
        return self._state.geometry(geometry_id).shape

    def get_pose_in_frame(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return ``X_FG`` ``(4, 4)``, read-only: the pose in the geometry's frame."""
        return self._state.geometry(geometry_id).X_FG

    def get_pose_in_parent(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return ``X_PG`` ``(4, 4)``, read-only: the pose in the parent, frame or geometry."""
        return self._state.geometry(geometry_id).X_PG

    X_FG = get_pose_in_frame
    X_PG = get_pose_in_parent

    def get_roles(self, geometry_id: GeometryId) -> set[Role]:
        """Return the roles of a geometry."""
        return set(self._state.geometry(geometry_id).properties)

    def get_properties(self, geometry_id: GeometryId, role: Role) -> GeometryProperties | None:
        """Return the properties for a role, read-only, or None if the geometry lacks it."""
        return self._state.geometry(geometry_id).properties.get(checked_role(role))

    def get_proximity_properties(self, geometry_id: GeometryId) -> ProximityProperties | None:
        """Return the proximity properties, read-only, or None."""
        return self.get_properties(geometry_id, Role.PROXIMITY)  # type: ignore[return-value]

    def get_illustration_properties(
        self, geometry_id: GeometryId
    ) -> IllustrationProperties | None:
        """Return the illustration properties, read-only, or None."""
        return self.get_properties(geometry_id, Role.ILLUSTRATION)  # type: ignore[return-value]

    def get_perception_properties(self, geometry_id: GeometryId) -> PerceptionProperties | None:
        """Return the perception properties, read-only, or None."""
        return self.get_properties(geometry_id, Role.PERCEPTION)  # type: ignore[return-value]

    def get_convex_hull(self, geometry_id: GeometryId) -> Hull | None:
        """Return the convex hull of a Convex or Mesh in G, or None for other shapes.

        Raises MeshError if its data cannot be read, which was not tried before it had the
        proximity role.
        """
        shape = self._state.geometry(geometry_id).shape
        return hull_of(shape) if isinstance(shape, MeshShape) else None

    def get_mesh_report(self, geometry_id: GeometryId) -> MeshReport | None:
        """Return a Mesh's report as a solid, with its repairs, or None for other shapes.

        Raises MeshError as get_convex_hull does.
        """
        shape = self._state.geometry(geometry_id).shape
        return report_of(shape) if isinstance(shape, Mesh) else None

    def collision_filtered(self, id_A: GeometryId, id_B: GeometryId) -> bool:
        """Tell whether collision queries skip a pair: same frame, both anchored, or excluded.

        Raises RoleError if one of them has no proximity role.
        """
        return self._state.collision_filtered(id_A, id_B)

    def clone_geometry_instance(self, geometry_id: GeometryId) -> GeometryInstance:
        """Return a new instance with the same shape, name, ``X_PG`` and roles, and an id anew.

        An instance is neither rigid nor deformable: to copy a deformable geometry, register it as
        one with ``reference_mesh=get_reference_mesh(geometry_id)``.
        """
        record = self._state.geometry(geometry_id)
        instance = GeometryInstance(record.X_PG, record.shape, record.name)
        for properties in record.properties.values():
            instance.set_properties(properties)
        return instance
