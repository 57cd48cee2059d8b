"""A copy of the model with a pose for every frame, and configurations of deformable geometry."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import itertools
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidPoseError, OwnershipError
from scene_graph_ros.geometry.loans import Lender
from scene_graph_ros.geometry.model.configurations import (
    checked_configurations,
    checked_height_sets,
    checked_point_sets,
    checked_voxel_sets,
    is_of,
)
from scene_graph_ros.geometry.model.ids import FrameId, GeometryId, SourceId
from scene_graph_ros.geometry.model.inspector import SceneGraphInspector
from scene_graph_ros.geometry.model.layout import FrameLayout
from scene_graph_ros.geometry.model.memory import Memory
from scene_graph_ros.geometry.model.owner import ModelOwner
from scene_graph_ros.geometry.model.snapshot import (
    NO_CONFIGURATIONS,
    refuse_frame_pose,
    SetValue,
    Snapshot,
    stacked_poses,
)
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.spatial.pose_kernels import store_poses, VALID
from scene_graph_ros.geometry.spatial.poses import is_for_kernels, to_pose_array

__all__ = ["Context"]

_pose_versions = itertools.count(1)

_FEW = 100
"""Poses are copied in less time than it takes to find out which memory is free."""


class _Fit(NamedTuple):
    """What a moment has beside poses: it stays the same from pose to pose."""

    layout: FrameLayout
    model_version: int
    """Of the model that the layout was last compared with."""
    lender: Lender
    """Of arrays of poses."""
    configurations: Mapping[GeometryId, SetValue]
    """Where vertices that deform are, and which points clouds have, as far as any were set."""


_Moment = tuple[_Fit, NDArray[np.float64], int]
"""All that a context has beside its model, so that it changes at once.

The poses ``X_PF`` (f, 4, 4) in the layout's rows, which are written to while no snapshot has them,
and the version of the poses. Each pose that is set makes one: a tuple is made in a tenth of the
time of a tuple with names.
"""


class Context(ModelOwner):
    """A model of its own, and ``X_PF`` of every frame; frames start at the identity.

    Deformable geometries start in their reference configuration, where they were registered.

    One thread writes; any thread may ask for the snapshot, which never changes again.
    """

    def __repr__(self) -> str:
        return f"Context({self.state.summary()})"

    def __init__(self, state: GeometryState) -> None:
        super().__init__(state)
        layout = state.layout()
        X_PF = np.tile(np.eye(4), (len(layout.ids), 1, 1))
        fit = _Fit(layout, state.version, Lender(X_PF.shape), NO_CONFIGURATIONS)
        self._moment: _Moment = fit, X_PF, next(_pose_versions)
        self._poses_are_shared = False
        """Whether a snapshot may have the moment's array of poses."""
        self._snapshot: Snapshot | None = None
        self._memory = Memory()

    @property
    def model_version(self) -> int:
        """A number that is the same for the same model only."""
        return self.state.version

    @property
    def pose_version(self) -> int:
        """A number that grows with every change of a pose, a configuration or a cloud."""
        return self._moment[2]

    @property
    def snapshot(self) -> Snapshot:
        """The current moment; the same object until the model or a pose changes."""
        with self._lock:
            last, state = self._snapshot, self._state if self._edit is None else self.state
            fit, X_PF, version = self._moment
            # What a snapshot shares is never changed: another model is another object.
            if last is None or last.state is not state or last.pose_version != version:
                if fit.model_version != state.version:  # else a call that finds nothing
                    fit, X_PF, version = self._fitted()
                self._poses_are_shared = state.shared = True
                last = self._snapshot = Snapshot(
                    state, X_PF, version, self._memory, fit.configurations, last
                )
            return last

    def inspector(self) -> SceneGraphInspector:
        """Return an inspector that follows the changes of this context's model."""
        return SceneGraphInspector(self)

    def set_frame_poses(
        self, source_id: SourceId, poses: Mapping[FrameId, Any] | NDArray[np.float64]
    ) -> None:
        """Move frames of a source: ``X_PF`` in their parents, in m.

        ``poses`` maps frame ids to ``(4, 4)`` poses; frames that are not in it stay. An array
        ``(n, 4, 4)`` moves all frames of the source in the order of their registration. Either
        every pose is taken or, if an error is raised, none: InvalidPoseError naming the frame for
        a pose that is not rigid and finite, or for a wrong number of poses; UnknownIdError for an
        unknown source or frame; OwnershipError for a frame of another source.
        """
        with self._lock:
            # Not the property: it is a call, and hardly ever finds an edit.
            state = self._state if self._edit is None else self.state
            fit = self._moment[0]
            if fit.model_version != state.version:  # as above
                fit = self._fitted()[0]
            layout = fit.layout
            rows = layout.source_rows.get(source_id) if type(source_id) is SourceId else None
            if rows is None:
                rows = layout.source_rows[state.require_source(source_id)]
            if type(poses) is not np.ndarray and isinstance(poses, Mapping):
                if not poses.keys() <= state.source_frames[source_id].keys():
                    self._refuse_frames(source_id, poses)
                rows, given = stacked_poses(state, poses)
            elif (
                type(poses) is np.ndarray
                and poses.shape == (len(rows), 4, 4)
                and is_for_kernels(poses)
            ):
                given = poses
            else:
                given = self._batch(source_id, len(rows), poses)
            bad, status = self._store(rows, given)
            if status != VALID:
                raise refuse_frame_pose(layout.names[rows[bad]], status, given[bad])

    def _store(self, rows: NDArray[np.int64], given: NDArray[np.float64]) -> tuple[int, int]:
        """Put another moment in place, if all poses are valid; return store_poses's answer."""
        found: tuple[int, int]
        moment = fit, X_PF, _ = self._moment
        if self._poses_are_shared:
            X_PF = _other_poses(fit, X_PF, len(rows))
            found = store_poses(given, rows, X_PF)
            if found[1] == VALID:
                self._moment = fit, X_PF, next(_pose_versions)
                self._poses_are_shared = False
            return found
        # Of what nobody looks at the version comes first: the kernel writes all poses or none.
        self._moment = fit, X_PF, next(_pose_versions)
        found = store_poses(given, rows, X_PF)
        if found[1] != VALID:
            self._moment = moment
        return found

    def set_frame_pose(self, source_id: SourceId, frame_id: FrameId, X_PF: Any) -> None:
        """Move one frame of a source; see set_frame_poses."""
        state = self.state
        state.require_source(source_id)
        self.set_frame_poses(source_id, {state.frame(frame_id).id: X_PF})

    def frame_poses(self, source_id: SourceId) -> NDArray[np.float64]:
        """Return ``X_PF`` ``(n, 4, 4)`` of a source's frames in the order of registration."""
        with self._lock:
            self.state.require_source(source_id)
            fit, X_PF, _ = self._fitted()
            return X_PF[fit.layout.source_rows[source_id]]

    def frame_pose(self, frame_id: FrameId) -> NDArray[np.float64]:
        """Return ``X_PF`` ``(4, 4)`` of a frame. Raises UnknownIdError for an unknown frame."""
        with self._lock:
            fit, X_PF, _ = self._fitted()
            return X_PF[fit.layout.row[self.state.frame(frame_id).id]].copy()

    def set_configurations(
        self, source_id: SourceId, configurations: Mapping[GeometryId, ArrayLike]
    ) -> None:
        """Move the vertices of deformable geometries of a source.

        ``configurations`` maps geometry ids to positions ``(v, 3)`` or ``(3 v,)`` in the world,
        in m, in the order of the reference mesh's vertices; geometries that are not in it stay.
        Either all are taken (and copied) or, if an error is raised, none:
        InvalidConfigurationError naming source and geometry for positions that are not finite or
        not as many as there are vertices; DeformableError for a rigid geometry; UnknownIdError
        for an unknown source or geometry; OwnershipError for a geometry of another source.
        """
        with self._lock:
            self._take(checked_configurations(self.state, source_id, configurations))

    def set_points(self, source_id: SourceId, points: Mapping[GeometryId, Any]) -> None:
        """Give clouds of a source other points.

        ``points`` maps ids of geometries that are a `PointCloud` to positions ``(n, 3)`` in G, in
        m, any n, also 0; or to a pair of these and radii ``(n,)``, in m, which a cloud with a
        radius for each point needs. Others keep their points. Either all are taken (and copied)
        or, if an error is raised, none: InvalidConfigurationError naming source and geometry for
        a geometry that is no cloud, for arrays of another shape or type, and, by its index, for a
        point that is not finite or a radius out of range; UnknownIdError for an unknown source or
        geometry; OwnershipError for a geometry of another source.
        """
        with self._lock:
            self._take(checked_point_sets(self.state, source_id, points))

    def points(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return the points ``(n, 3)`` of a cloud in G, in m, in the order they were set in.

        Read-only. Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for
        a geometry that is no cloud.
        """
        return self.snapshot.point_set(geometry_id).points

    def set_heights(self, source_id: SourceId, heights: Mapping[GeometryId, Any]) -> None:
        """Give height fields of a source other heights.

        ``heights`` maps ids of geometries that are a `HeightField` to heights ``(rows, cols)``
        above G's xy plane, in m, of the shape that it has. Others keep theirs. Either all are
        taken (and copied) or, if an error is raised, none: InvalidConfigurationError naming
        source and geometry for what is no height field, for arrays of another shape or type, and,
        by its index, for a height that is not finite or not above the floor; UnknownIdError for
        an unknown source or geometry; OwnershipError for a geometry of another source.
        """
        with self._lock:
            self._take(checked_height_sets(self.state, source_id, heights))

    def heights(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return the heights ``(rows, cols)`` of a height field above G's xy plane, in m.

        Read-only. Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for
        what is no height field.
        """
        return self.snapshot.height_set(geometry_id).heights

    def set_voxels(self, source_id: SourceId, voxels: Mapping[GeometryId, Any]) -> None:
        """Give voxel grids of a source other voxels.

        ``voxels`` maps ids of geometries that are a `VoxelGrid` to states ``(nx, ny, nz)``, each
        a `Voxel`, of any shape; the edge and the place of the grid stay. Others keep theirs.
        Either all are taken (and copied) or, if an error is raised, none:
        InvalidConfigurationError naming source and geometry for what is no voxel grid, for arrays
        of another type, and, by its index, for a number that is no state; UnknownIdError for an
        unknown source or geometry; OwnershipError for a geometry of another source.
        """
        with self._lock:
            self._take(checked_voxel_sets(self.state, source_id, voxels))

    def voxels(self, geometry_id: GeometryId) -> NDArray[np.uint8]:
        """Return the states ``(nx, ny, nz)`` of a voxel grid's boxes, each a `Voxel`.

        Read-only. Raises UnknownIdError for an unknown geometry, InvalidConfigurationError for
        what is no voxel grid.
        """
        return self.snapshot.voxel_set(geometry_id).occupancy

    def _take(self, accepted: Mapping[GeometryId, SetValue]) -> None:
        """Put another moment in place, with some of its geometries set anew."""
        if not accepted:
            return
        state = self.state
        fit, X_PF, _ = self._moment
        # Those of geometries that were removed meanwhile are let go.
        known = {
            geometry_id: value
            for geometry_id, value in fit.configurations.items()
            if is_of(value, state.geometries.get(geometry_id))
        }
        fit = fit._replace(configurations={**known, **accepted})
        self._moment = fit, X_PF, next(_pose_versions)

    def configuration(self, geometry_id: GeometryId) -> NDArray[np.float64]:
        """Return the positions ``(v, 3)`` of a deformable geometry's vertices in W, read-only.

        Raises UnknownIdError for an unknown geometry, DeformableError for a rigid one.
        """
        return self.snapshot.configuration(geometry_id).q_WG

    def clone(self) -> Context:
        """Return an independent context with the same model and poses."""
        with self._lock:
            fit, X_PF, _ = self._fitted()
            result = Context(self.share())
            own, _, version = result._moment
            own = own._replace(configurations=fit.configurations)
            result._moment = own, X_PF.copy(), version
            return result

    def __deepcopy__(self, memo: dict[int, Any]) -> Context:
        return self.clone()

    def _refuse_frames(self, source_id: SourceId, frame_ids: Iterable[FrameId]) -> None:
        """Raise the error for the first frame that is not the source's."""
        names = self.state.source_names
        for frame_id in frame_ids:
            record = self.state.frame(frame_id)
            if record.source_id != source_id:
                raise OwnershipError(
                    f"frame {record.name!r} ({frame_id!r}) belongs to source"
                    f" {names[record.source_id]!r}: {names[source_id]!r} cannot move it"
                )

    def _batch(self, source_id: SourceId, count: int, poses: Any) -> NDArray[np.float64]:
        """Return ``(count, 4, 4)`` poses of a source as kernels take them, unchecked."""
        shape = (count, 4, 4)
        label = f"X_PFs of source {self.state.source_names[source_id]!r}"
        if isinstance(poses, (list, tuple)):
            poses = np.array([to_pose_array(X, label) for X in poses]).reshape(-1, 4, 4)
        given = to_pose_array(poses, label)
        if given.shape != shape:
            raise InvalidPoseError(
                f"{label} must be {shape}, one for each frame, not {given.shape}"
            )
        return given

    def _fitted(self) -> _Moment:
        """Bring the poses into the rows of the current model; new frames start at identity."""
        state, moment = self.state, self._moment
        fit, X_PF, version = moment
        if fit.model_version == state.version:
            return moment
        layout, before = state.layout(), fit.layout
        fit = fit._replace(model_version=state.version)
        if layout is not before:
            kept = [(row, before.row[i]) for row, i in enumerate(layout.ids) if i in before.row]
            new_rows, old_rows = zip(*kept, strict=True)
            before_X_PF, X_PF = X_PF, np.tile(np.eye(4), (len(layout.ids), 1, 1))
            X_PF[list(new_rows)] = before_X_PF[list(old_rows)]
            fit = fit._replace(layout=layout, lender=Lender(X_PF.shape))
            version = next(_pose_versions)
        self._moment = fitted = fit, X_PF, version
        if X_PF is not moment[1]:
            self._poses_are_shared = False
        return fitted


def _other_poses(fit: _Fit, X_PF: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return poses to write ``count`` of to: a snapshot keeps the array it was given."""
    if count + 1 < len(X_PF) or len(X_PF) <= _FEW:
        return X_PF.copy()
    # All but the world's are going to be written, whose pose is right in an array of before.
    return fit.lender.take(_begin, X_PF)


def _begin(new: NDArray[np.float64], X_PF: NDArray[np.float64]) -> None:
    """Write the world's pose to new memory."""
    new[0] = X_PF[0]
