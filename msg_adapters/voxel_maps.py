"""Maps of space: messages of nav_msgs and octomap_msgs to and from voxel grids.

``octomap_msgs`` need not be installed: its messages are read by their fields.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from nav_msgs.msg import OccupancyGrid
import numpy as np
from numpy.typing import ArrayLike, NDArray

from msg_adapters.errors import MessageError
from msg_adapters.poses import pose_from_msg, pose_to_msg
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.shapes.voxel_grid import MOST_VOXELS, Voxel, VoxelGrid
from scene_graph_ros.sensing.octree_stream import MIDDLE, OctreeError, OctreeStream
from scene_graph_ros.sensing.octree_writing import binary_octree, full_octree

__all__ = [
    "PlacedGrid",
    "TooManyVoxelsError",
    "occupancy_grid_to_msg",
    "octomap_data",
    "voxels_from_occupancy_grid",
    "voxels_from_octomap",
]

_EXTRA = {"OcTree": 0, "ColorOcTree": 3}
"""Bytes of a node behind its log-odds, by the name of the kind of tree."""


class TooManyVoxelsError(MessageError):
    """A map that is right, and larger than it may be."""


class PlacedGrid(NamedTuple):
    """A grid of voxels and where it is in its message's frame."""

    grid: VoxelGrid
    X_MG: NDArray[np.float64]
    """``(4, 4)``"""


def voxels_from_occupancy_grid(
    msg: OccupancyGrid,
    *,
    layers: int = 1,
    occupied: int = 65,
    free: int = 25,
    unknown_is_free: bool = False,
) -> PlacedGrid:
    """Return a ``nav_msgs/OccupancyGrid`` as voxels, alike in all layers along z.

    A cell of at least ``occupied`` per cent is occupied, of at most ``free`` free, and unknown in
    between or at -1. The resolution is the shortest decimal that is that float of a message.
    Raises MessageError for data of another length, for numbers that are no per cent, for a
    resolution that is none, and for more than MOST_VOXELS.
    """
    rows, cols = int(msg.info.height), int(msg.info.width)
    data = np.asarray(msg.data, dtype=np.int8)
    if len(data) != rows * cols:
        raise MessageError(
            f"OccupancyGrid: data has {len(data)} cells, not the {rows * cols} of {rows} rows of"
            f" {cols}"
        )
    bad = (data < -1) | (data > 100)
    if bad.any():
        k = int(bad.argmax())
        raise MessageError(f"OccupancyGrid: data[{k}] must be from -1 to 100, not {data[k]}")
    if layers < 0 or len(data) * layers > MOST_VOXELS:
        raise MessageError(
            f"OccupancyGrid: {len(data)} cells in {layers} layers are not from 0 to {MOST_VOXELS}"
            " voxels"
        )
    states = np.full(len(data), int(Voxel.UNKNOWN), np.uint8)
    states[data >= occupied] = Voxel.OCCUPIED
    states[(data >= 0) & (data <= free)] = Voxel.FREE
    occupancy = np.repeat(states.reshape(rows, cols).T[:, :, np.newaxis], layers, axis=2)
    edge = float(str(np.float32(msg.info.resolution)))
    grid = _grid(occupancy, edge, "OccupancyGrid", unknown_is_free)
    return PlacedGrid(grid, pose_from_msg(msg.info.origin, "OccupancyGrid origin"))


def occupancy_grid_to_msg(
    grid: VoxelGrid, X_MG: ArrayLike, occupancy: NDArray[np.uint8] | None = None
) -> OccupancyGrid:
    """Return voxels seen along z: 100 where one is occupied, else -1 where one is unknown, else 0.

    ``occupancy`` ``(nx, ny, nz)`` are the states of now, by default those to begin with.
    """
    states = grid.occupancy if occupancy is None else occupancy
    msg = OccupancyGrid()
    msg.info.resolution = grid.voxel
    msg.info.width, msg.info.height = states.shape[0], states.shape[1]
    msg.info.origin = pose_to_msg(np.asarray(X_MG, dtype=np.float64))
    cells = np.zeros(states.shape[:2], np.int8)
    cells[(states == Voxel.UNKNOWN).any(axis=2)] = -1
    cells[(states == Voxel.OCCUPIED).any(axis=2)] = 100
    msg.data = cells.T.reshape(-1).tolist()
    return msg


def voxels_from_octomap(
    msg: Any,
    *,
    region: tuple[ArrayLike, ArrayLike] | None = None,
    unknown_is_free: bool = False,
    most: int = MOST_VOXELS,
) -> PlacedGrid:
    """Return an ``octomap_msgs/Octomap``, binary or full, as the voxels around all that it knows.

    ``region``, the lower and upper corner (m) of a box in the map's frame, says that voxels
    outside of it are left out. Leaves above the lowest level are as many voxels as they hold.
    Raises MessageError for a kind of tree, a resolution or data that can't be read, and
    TooManyVoxelsError for more than ``most`` voxels.
    """
    data = np.asarray(msg.data, dtype=np.int8).view(np.uint8)
    edge = float(msg.resolution)
    if not (np.isfinite(edge) and edge > 0.0):
        raise MessageError(f"Octomap: resolution must be positive, not {edge}")
    if msg.id not in _EXTRA:
        raise MessageError(f"Octomap: id must be one of {sorted(_EXTRA)}, not {quoted(msg.id)}")
    stream = OctreeStream(data, is_binary=bool(msg.binary), extra=_EXTRA[msg.id])
    try:
        lower, upper = _within(*stream.extent(), edge, region)
        counts = (upper - lower).tolist()
        if math.prod(counts) > most:
            raise TooManyVoxelsError(
                f"Octomap: what is known spans {' x '.join(map(str, counts))} voxels, more than"
                f" {most}. Give a region."
            )
        occupancy = stream.states(lower, upper)
    except OctreeError as error:
        raise MessageError(f"Octomap: {error}") from error
    X_MG = np.eye(4)
    X_MG[:3, 3] = (lower - MIDDLE) * edge
    return PlacedGrid(_grid(occupancy, edge, "Octomap", unknown_is_free), X_MG)


def octomap_data(
    grid: VoxelGrid,
    X_MG: ArrayLike,
    occupancy: NDArray[np.uint8] | None = None,
    *,
    binary: bool = True,
) -> list[int]:
    """Return the ``data`` of an ``octomap_msgs/Octomap`` of id "OcTree", of the grid's edge.

    In a full one, ``binary`` False, voxels have the log-odds at which OctoMap stops counting: -2
    where free, 3.5 where occupied. Raises MessageError for a grid that is turned, or not whole
    voxels from the map's origin.
    """
    states = grid.occupancy if occupancy is None else occupancy
    X = np.asarray(X_MG, dtype=np.float64)
    first = X[:3, 3] / grid.voxel
    whole = np.round(first)
    if not np.array_equal(X[:3, :3], np.eye(3)) or not np.abs(first - whole).max() <= 1e-6:
        raise MessageError(
            "Octomap: the grid must be parallel to the map's axes, and whole voxels from its"
            f" origin, not at {X[:3].tolist()}"
        )
    if np.abs(whole).max() > 4 * MIDDLE:
        whole = np.clip(whole, -4 * MIDDLE, 4 * MIDDLE)  # outside, as it is
    write = binary_octree if binary else full_octree
    try:
        stream = write(states, whole.astype(np.int64) + MIDDLE)
    except OctreeError as error:
        raise MessageError(f"Octomap: {error}") from error
    data: list[int] = stream.view(np.int8).tolist()
    return data


def _within(
    lower: NDArray[np.int64],
    upper: NDArray[np.int64],
    edge: float,
    region: tuple[ArrayLike, ArrayLike] | None,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the keys of the first voxel of what is known in a region, and behind the last."""
    if region is not None:
        corners = np.asarray(region, dtype=np.float64)
        if corners.shape != (2, 3) or not np.isfinite(corners).all():
            raise MessageError(f"region must be two corners of three numbers, not {region!r}")
        asked = np.clip(corners / edge, -MIDDLE, MIDDLE) + MIDDLE
        lower = np.maximum(lower, np.floor(asked[0]).astype(np.int64))
        upper = np.minimum(upper, np.ceil(asked[1]).astype(np.int64))
    return lower, np.maximum(upper, lower)


def _grid(
    occupancy: NDArray[np.uint8],
    edge: float,
    name: str,
    unknown_is_free: bool,
) -> VoxelGrid:
    try:
        return VoxelGrid(occupancy, edge, unknown_is_free=unknown_is_free)
    except ValueError as error:
        raise MessageError(f"{name}: {error}") from error
