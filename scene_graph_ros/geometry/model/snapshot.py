"""A model and poses that never change any more, for queries and publishers."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import (
    InvalidConfigurationError,
    InvalidPoseError,
    OwnershipError,
)
from scene_graph_ros.geometry.loans import Lender
from scene_graph_ros.geometry.model.deformable import Configuration
from scene_graph_ros.geometry.model.height_set import HeightSet, initial_heights
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.layout import FrameLayout, RoleArrays
from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.model.no_copies import NotCopied
from scene_graph_ros.geometry.model.point_set import initial_points, PointSet
from scene_graph_ros.geometry.model.proximity import proximity_arrays, ProximityArrays
from scene_graph_ros.geometry.model.records import (
    deformable_of,
    refuse_deformable,
    WORLD_FRAME_ID,
)
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.model.voxel_set import initial_voxels, VoxelSet
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.height_field import HeightField
from scene_graph_ros.geometry.shapes.point_cloud import PointCloud
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.spatial.pose_kernels import (
    store_poses,
    VALID,
    world_poses,
    world_poses_of_children,
)
from scene_graph_ros.geometry.spatial.poses import refuse_pose, to_pose_array
from scene_graph_ros.geometry.spatial.sums import product

__all__ = ["NO_CONFIGURATIONS", "SetValue", "Snapshot", "refuse_frame_pose", "stacked_poses"]

Poses = NDArray[np.float64]

_PROXIMITY = Role.PROXIMITY  # a look-up of a member takes longer

SetValue: TypeAlias = Configuration | PointSet | HeightSet | VoxelSet
"""What is set of a geometry beside poses."""

NO_CONFIGURATIONS: Mapping[GeometryId, SetValue] = MappingProxyType({})
"""Deformable geometry is in its reference configuration, clouds and fields are as registered."""


def refuse_frame_pose(name: str, status: int, value: Any) -> Exception:
    """Return the error for an invalid pose of the frame called ``name``."""
    return refuse_pose(f"X_PF of frame {name!r}", status, value)


def stacked_poses(state: GeometryState, poses: Mapping[FrameId, Any]) -> tuple[Any, Poses]:
    """Return the rows of the frames, and their poses as given, ``(k,)`` and ``(k, 4, 4)``.

    Raises UnknownIdError for an unknown frame, OwnershipError for the world, and InvalidPoseError
    for a pose that is no ``(4, 4)`` array.
    """
    if not isinstance(poses, Mapping):
        raise TypeError(f"poses must map frame ids to poses, not {quoted(poses)}")
    layout = state.layout()
    rows = np.array([layout.row.get(frame_id, 0) for frame_id in poses], dtype=np.int64)
    if not rows.all():
        for frame_id in poses:
            if state.frame(frame_id).id == WORLD_FRAME_ID:
                raise OwnershipError("the world frame cannot be moved")
    values = list(poses.values())
    if all(type(X) is np.ndarray and X.shape == (4, 4) and X.dtype == float for X in values):
        # Rows of C's order, whatever order those that are given have.
        X_PFs = np.empty((len(values), 4, 4))
        if values:
            np.concatenate(values, out=X_PFs.reshape(-1, 4))
        return rows, X_PFs
    X_PFs = np.empty((len(values), 4, 4))
    for i, (row, X_PF) in enumerate(zip(rows, values, strict=True)):
        label = f"X_PF of frame {layout.names[row]!r}"
        array = to_pose_array(X_PF, label)
        if array.ndim != 2:
            raise InvalidPoseError(f"pose {label} must be one (4, 4) array, not {array.shape}")
        X_PFs[i] = array
    return rows, X_PFs


def _place_all(X_WG: Poses, rows: RoleArrays, X_WF: Poses) -> None:
    """Write the poses of all geometries of a role."""
    world_poses_of_children(rows.all_rows, rows.frame, X_WF, rows.X_FG, X_WG)


def _lender_of_poses(rows: RoleArrays) -> Lender:
    return Lender(rows.X_FG.shape)


class Snapshot(NotCopied):
    """One moment of a context. Everything derived from it is computed once, on first use.

    Any number of threads may use a snapshot.
    """

    _instead = "it never changes, so share it"
    __slots__ = (
        "_X_PF",
        "_X_WF",
        "_X_WG",
        "_configurations",
        "_layout",
        "_proximity",
        "elements",
        "memory",
        "pose_version",
        "state",
    )

    def __init__(
        self,
        state: GeometryState,
        X_PF: Poses,
        pose_version: int,
        memory: Memory | None = None,
        configurations: Mapping[GeometryId, SetValue] = NO_CONFIGURATIONS,
        before: Snapshot | None = None,
    ) -> None:
        """Take a shared state, and poses ``(f, 4, 4)`` in its layout that nobody writes to.

        Deformable geometries that ``configurations`` does not name are in their reference
        configuration, clouds have the points that they were registered with. Values that a
        snapshot ``before`` knows of the same state are not looked up again.
        """
        assert state.shared
        self.state = state
        """The model, not to be changed."""
        self._layout: FrameLayout | None
        self._proximity: ProximityArrays | None
        if before is not None and before.state is state:
            self._layout, self._proximity = before._layout, before._proximity
        else:
            self._layout = self._proximity = None
        self._configurations = configurations
        self.elements: Any = None
        """What queries know of its shapes of many elements, once one has asked."""
        self._X_PF = X_PF
        self._X_WF: Poses | None = None
        self._X_WG: dict[Role, Poses] = {}
        self.pose_version = pose_version
        self.memory = memory or Memory()

    @property
    def snapshot(self) -> Snapshot:
        """This snapshot; a context has the same property, and gives its current one."""
        return self

    @property
    def inspector(self) -> SceneGraphInspector:
        """Answers about the model of this snapshot."""
        return SceneGraphInspector(self.state)

    @property
    def model_version(self) -> int:
        """A number that is the same for the same model only."""
        return self.state.version

    @property
    def proximity(self) -> ProximityArrays:
        """The rigid geometries with the proximity role."""
        result = self._proximity
        if result is None:
            result = self._proximity = proximity_arrays(self.state)
        return result

    def role_arrays(self, role: Role) -> RoleArrays:
        """Return ids, frames and fixed poses of the rigid geometries with a role, rows by id."""
        return self.state.role_arrays(role)

    @property
    def X_PF(self) -> Poses:
        """(f, 4, 4) frames in their parents, not to be written to."""
        return self._X_PF

    @property
    def X_WF(self) -> Poses:
        """(f, 4, 4) frames in the world, not to be written to; row 0 is the world."""
        result = self._X_WF
        if result is None:
            layout = self._layout
            if layout is None:
                layout = self._layout = self.state.layout()
            if layout.is_flat:
                result = self._X_WF = self._X_PF
                return result
            with self.memory.lock:
                result = self._X_WF
                if result is None:
                    result = np.empty_like(self._X_PF)
                    world_poses(layout.parent, self._X_PF, result)
                    self._X_WF = result
        return result

    @property
    def X_WG(self) -> Poses:
        """(n, 4, 4) rigid geometries with the proximity role in W, not to be written to."""
        result = self._X_WG.get(_PROXIMITY)
        if result is None:
            result = self._placed(_PROXIMITY, self.proximity.rows)
        return result

    def X_WG_of(self, role: Role) -> Poses:
        """Return ``(n, 4, 4)`` rigid geometries with a role in W, rows as in role_arrays."""
        result = self._X_WG.get(role)
        if result is None:
            result = self._placed(role, self.state.role_arrays(role))
        return result

    def _placed(self, role: Role, rows: RoleArrays) -> Poses:
        """Place the geometries with a role, unless another thread has done it meanwhile."""
        X_WF = self.X_WF
        if rows.same_frames is not None:
            return self._X_WG.setdefault(role, X_WF[rows.same_frames])
        with self.memory.lock:
            result = self._X_WG.get(role)
            if result is None:
                result = self._X_WG[role] = self._place(role, rows, X_WF)
        return result

    def _place(self, role: Role, rows: RoleArrays, X_WF: Poses) -> Poses:
        """Place the geometries with a role on their frames, in memory that is free if there is."""
        lender = self.memory.of(_lender_of_poses, rows, role)
        # In an array of before, which is lent for the same rows, the anchored ones are right.
        result = lender.take(_place_all, rows, X_WF)
        world_poses_of_children(rows.moving_rows, rows.frame, X_WF, rows.X_FG, result)
        return result

    def pose_in_world(self, target: FrameId | GeometryId) -> Poses:
        """Return ``X_WF`` of a frame or ``X_WG`` of a geometry, a new ``(4, 4)`` array.

        Raises UnknownIdError if there is no such frame or geometry, DeformableError for a
        deformable geometry, which has no pose.
        """
        if isinstance(target, GeometryId):
            record = self.state.geometry(target)
            refuse_deformable(record, "it has a configuration in the world, and no pose")
            pose: Poses = product(self._world_pose_of_frame(record.frame_id), record.X_FG)
            return pose
        return self._world_pose_of_frame(self.state.frame(target).id)

    def pose_in_parent(self, frame_id: FrameId) -> Poses:
        """Return ``X_PF``, a new ``(4, 4)`` array. Raises UnknownIdError for an unknown frame."""
        return self._X_PF[self.state.layout().row[self.state.frame(frame_id).id]].copy()

    def _world_pose_of_frame(self, frame_id: FrameId) -> Poses:
        return self.X_WF[self.state.layout().row[frame_id]].copy()

    def configuration(self, geometry_id: GeometryId) -> Configuration:
        """Return the positions of the vertices of a deformable geometry.

        Raises UnknownIdError for an unknown geometry, DeformableError for a rigid one.
        """
        deformable = deformable_of(self.state.geometry(geometry_id))
        known = self._configurations.get(geometry_id)
        # The same id may have been registered anew, after a removal, with another mesh.
        if not isinstance(known, Configuration) or known.deformable is not deformable:
            return deformable.reference
        return known

    @property
    def configurations(self) -> Mapping[GeometryId, SetValue]:
        """The state of geometries beside poses, not to be written to."""
        return self._configurations

    def point_set(self, geometry_id: GeometryId) -> PointSet:
        """Return the points that a cloud has.

        Raises UnknownIdError for an unknown geometry, InvalidConfigurationError unless it is a
        PointCloud.
        """
        record = self.state.geometry(geometry_id)
        shape = record.shape
        if not isinstance(shape, PointCloud):
            raise InvalidConfigurationError(
                f"geometry {record.name!r} ({geometry_id!r}) is a {shape.type_name}, which has no"
                " points"
            )
        known = self._configurations.get(geometry_id)
        if not isinstance(known, PointSet) or known.shape is not shape:
            return initial_points(shape)
        return known

    def height_set(self, geometry_id: GeometryId) -> HeightSet:
        """Return the heights that a height field has.

        Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for what is no
        HeightField.
        """
        record = self.state.geometry(geometry_id)
        shape = record.shape
        if not isinstance(shape, HeightField):
            raise InvalidConfigurationError(
                f"geometry {record.name!r} ({geometry_id!r}) is a {shape.type_name}, which has no"
                " heights"
            )
        known = self._configurations.get(geometry_id)
        if not isinstance(known, HeightSet) or known.shape is not shape:
            return initial_heights(shape)
        return known

    def voxel_set(self, geometry_id: GeometryId) -> VoxelSet:
        """Return the voxels that a grid has.

        Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for what is no
        VoxelGrid.
        """
        record = self.state.geometry(geometry_id)
        shape = record.shape
        if not isinstance(shape, VoxelGrid):
            raise InvalidConfigurationError(
                f"geometry {record.name!r} ({geometry_id!r}) is a {shape.type_name}, which has no"
                " voxels"
            )
        known = self._configurations.get(geometry_id)
        if not isinstance(known, VoxelSet) or known.shape is not shape:
            return initial_voxels(shape)
        return known

    def element_set(self, geometry_id: GeometryId) -> PointSet | HeightSet | VoxelSet:
        """Return the points of a cloud, the heights of a height field, or the voxels of a grid.

        Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for others.
        """
        if isinstance(self.state.geometry(geometry_id).shape, HeightField):
            return self.height_set(geometry_id)
        if isinstance(self.state.geometry(geometry_id).shape, VoxelGrid):
            return self.voxel_set(geometry_id)
        return self.point_set(geometry_id)

    def driven_mesh_configurations(self, geometry_id: GeometryId, role: Role) -> list[Poses]:
        """Return the positions ``(n, 3)`` in W, in m, of each driven mesh of a role.

        Raises UnknownIdError, DeformableError for a rigid geometry, and RoleError if it lacks the
        role.
        """
        from scene_graph_ros.geometry.model.driven_mesh import driven_positions

        mesh = self.state.driven_mesh(geometry_id, role)
        return [driven_positions(mesh, self.configuration(geometry_id))]

    def with_unknown_voxels(self, *, is_free: bool) -> Snapshot:
        """Return this moment with unknown voxels of all grids that count as free, or as solid.

        This snapshot stays as it is; it is returned itself where no grid counts them otherwise.
        """
        sets = {grid: self.voxel_set(grid) for grid in self.inspector.get_all_voxel_grid_ids()}
        changed = {
            grid: voxels.with_unknown(is_free=is_free)
            for grid, voxels in sets.items()
            if voxels.unknown_is_free != is_free
        }
        if not changed:
            return self
        configurations = {**self._configurations, **changed}
        return Snapshot(
            self.state, self._X_PF, self.pose_version, self.memory, configurations, self
        )

    def with_frame_poses(
        self, poses: Mapping[FrameId, Any], *, memory: Memory | None = None
    ) -> Snapshot:
        """Return a snapshot with other poses for some frames, of any source: "what if".

        It shares the memory of this snapshot's context unless it is given another.
        Raises as Context.set_frame_poses does; this snapshot stays as it is.
        """
        rows, given = stacked_poses(self.state, poses)
        X_PF = self._X_PF.copy()
        bad, status = store_poses(given, rows, X_PF)
        if status != VALID:
            raise refuse_frame_pose(self.state.layout().names[rows[bad]], status, given[bad])
        memory = memory or self.memory
        return Snapshot(self.state, X_PF, self.pose_version, memory, self._configurations)
