"""The voxels of a grid, at one moment."""

from __future__ import annotations

import functools
from typing import Any, TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import InvalidConfigurationError
from scene_graph_ros.geometry.shapes.voxel_grid import checked_occupancy, VoxelGrid

if TYPE_CHECKING:
    from scene_graph_ros.geometry.tables.voxel_bits import PlacedVoxels

__all__ = ["VoxelSet", "initial_voxels", "new_voxels"]


class VoxelSet:
    """States of voxels that never change. Bits for kernels are made when they are asked for."""

    def __init__(
        self, shape: VoxelGrid, occupancy: NDArray[np.uint8], other: VoxelSet | None = None
    ) -> None:
        """Take states ``(nx, ny, nz)`` that nobody writes to.

        ``other`` are the same voxels, of which unknown ones count for the opposite.
        """
        self.shape = shape
        """The shape whose voxels they are."""
        self.occupancy = occupancy
        """``(nx, ny, nz)`` uint8, read-only."""
        self._other = other
        self.unknown_is_free = shape.unknown_is_free
        """Whether unknown voxels count as free: as the shape has it, or as a query asks."""
        if other is not None:
            self.unknown_is_free = not other.unknown_is_free

    def with_unknown(self, *, is_free: bool) -> VoxelSet:
        """Return the same voxels with unknown ones that count as free, or not.

        There are two such objects at most, so that bits for kernels are made once.
        """
        if is_free == self.unknown_is_free:
            return self
        if self._other is None:
            self._other = VoxelSet(self.shape, self.occupancy, self)
        return self._other

    @property
    def solid(self) -> NDArray[np.bool_]:
        """The mask of the voxels that count as solid, ``(nx, ny, nz)``."""
        return self.shape.is_solid(self.occupancy, unknown_is_free=self.unknown_is_free)

    @functools.cached_property
    def placed(self) -> PlacedVoxels:
        """The voxels for kernels. Threads that ask at once may make it more than once."""
        from scene_graph_ros.geometry.tables.voxel_bits import place_voxels

        return place_voxels(self.solid, self.shape.voxel)


def initial_voxels(shape: VoxelGrid) -> VoxelSet:
    """Return the voxels that a shape begins with, the same object each time."""
    begun = shape.begun
    if begun is None:
        begun = shape.begun = VoxelSet(shape, shape.occupancy)
    assert isinstance(begun, VoxelSet)
    return begun


def new_voxels(shape: VoxelGrid, value: Any, label: str) -> VoxelSet:
    """Return voxels that were set, copied; ``value`` as `Context.set_voxels` takes it.

    Voxels of the same shape that never change, such as those of another context, are taken as
    they are. Raises InvalidConfigurationError, which begins with ``label``.
    """
    if isinstance(value, VoxelSet) and value.shape is shape:
        return value
    error = InvalidConfigurationError
    return VoxelSet(shape, checked_occupancy(value, shape.voxel, f"{label}: occupancy", error))
