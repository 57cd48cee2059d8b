"""Voxels of grids: messages of maps, validated and applied.

Imported where a source has a voxel grid.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from msg_adapters.stamps import checked_stamp_from_msg
from msg_adapters.voxel_maps import (
    TooManyVoxelsError,
    voxels_from_occupancy_grid,
    voxels_from_octomap,
)
from scene_graph_ros.geometry.errors import NameConflictError, UnknownIdError
from scene_graph_ros.geometry.model.voxel_set import new_voxels
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.voxel_grid import VoxelGrid
from scene_graph_ros.geometry.spatial.poses import compose, inverse
from scene_graph_ros.node.world.bounded_channel import NewestChannel
from scene_graph_ros.node.world.faults import Fault
from scene_graph_ros.node.world.grids import NoGridError, SourceGrids
from scene_graph_ros.node.world.imported_types import imported_type
from scene_graph_ros.node.world.intake import Intake, UNSTAMPED
from scene_graph_ros.node.world.message_sizes import most_bytes
from scene_graph_ros.node.world.scene import SourceRecord
from scene_graph_ros.node.world.source_channel import Kept
from scene_graph_ros.node.world.source_topics import voxel_settings, VOXELS, voxels_topic
from scene_graph_ros.node.world.time_limits import TimeLimits
from scene_graph_ros.scene_files.sensor_settings import OCCUPANCY_GRID
from scene_graph_ros.sensing.voxel_resampling import resampled_states

__all__ = ["VoxelChannel"]

_BYTES_PER_VOXEL = 8
"""Of a message: a cell of a flat map takes one, a node of a full octree with colours eight."""


class VoxelChannel(NewestChannel[SourceGrids]):
    """The topic of maps of one source; of several messages the newest good one counts."""

    noun = VOXELS

    def __init__(
        self, record: SourceRecord, intake: Intake, most_voxels: int, world_frame: str
    ) -> None:
        """Read maps of ``most_voxels`` at most.

        Raises UnavailableError for a type of messages that is not installed.
        """
        self._settings = voxel_settings(record)
        super().__init__(record, intake, imported_type(self._settings.type))
        self._most, self._world_frame = most_voxels, world_frame

    @property
    def wanted_topics(self) -> Mapping[str, bool]:
        """Name of the topic, before namespaces and remapping."""
        return {voxels_topic(self.record): False}

    def _apply_one(self, kept: Kept, grids: SourceGrids, limits: TimeLimits) -> int:
        most = most_bytes(1) + _BYTES_PER_VOXEL * self._most
        if len(kept.data) > most:
            return self._fault(
                Fault.TOO_LARGE, f"a message has {len(kept.data)} bytes, at most {most} are read"
            )
        message = self._read(kept.data, most)
        frame = message.header.frame_id
        try:
            geometry = grids.grid()
            grids.check_frame(frame, geometry, self._world_frame)
        except NoGridError as error:
            return self._fault(Fault.UNKNOWN_GEOMETRY, str(error))
        except (UnknownIdError, NameConflictError) as error:
            return self._fault(Fault.UNKNOWN_FRAME, str(error), frame)
        stamp = checked_stamp_from_msg(message.header.stamp) or limits.now
        used = limits.of_static() if kept.is_static else limits
        late = used.problem(stamp, stamp if grids.stamp == UNSTAMPED else grids.stamp)
        if late is not None:
            return self._fault(late[0], f"a map {late[1]}")
        shape = grids.inspector.get_shape(geometry)
        try:
            found = self._states(message, shape, grids.inspector.get_pose_in_frame(geometry))
        except TooManyVoxelsError as error:
            return self._fault(Fault.TOO_LARGE, str(error))
        name = quoted(grids.inspector.get_name(geometry))
        grids.put(geometry, new_voxels(shape, found, f"voxel grid {name}"), stamp)
        self.newest = _counted(found)
        self.intake.count(found.size)
        return 1

    def _states(
        self, message: Any, shape: VoxelGrid, X_FG: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Return a message's states in the grid's voxels; raises MessageError."""
        counts = shape.occupancy.shape
        if self._settings.type == OCCUPANCY_GRID:
            cells = message.info.width * message.info.height
            if cells > self._most:
                raise TooManyVoxelsError(
                    f"a map has {cells} cells, more than max_voxels_per_map, {self._most}"
                )
            placed = voxels_from_occupancy_grid(
                message, occupied=self._settings.occupied, free=self._settings.free
            )
            height = np.inf
        else:
            region = _box_around(X_FG, np.array(counts) * shape.voxel)
            placed = voxels_from_octomap(message, region=region, most=self._most)
            height = placed.grid.voxel
        edge = placed.grid.voxel
        X_MG = compose(inverse(placed.X_MG), X_FG)
        states = placed.grid.occupancy
        return resampled_states(states, (edge, edge, height), X_MG, counts, shape.voxel)


def _box_around(
    X_FG: NDArray[np.float64], lengths: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners in F of the box around a grid."""
    middle = X_FG[:3, :3] @ (0.5 * lengths) + X_FG[:3, 3]
    half = np.abs(X_FG[:3, :3]) @ (0.5 * lengths)
    return middle - half, middle + half


def _counted(states: NDArray[np.uint8]) -> dict[str, int]:
    """Return counts for diagnostics."""
    free, occupied, unknown = np.bincount(states.reshape(-1), minlength=3).tolist()
    return {"free voxels": free, "occupied voxels": occupied, "unknown voxels": unknown}
