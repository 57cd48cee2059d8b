"""A grid of boxes that are free, occupied, or unknown: a map of the space that sensors saw."""

from __future__ import annotations

import enum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import whole_array
from scene_graph_ros.geometry.reals import as_float
from scene_graph_ros.geometry.shapes.element_shape import ElementKind, ElementShape
from scene_graph_ros.geometry.tolerances import MAX_SHAPE_SIZE, MIN_SHAPE_SIZE

__all__ = ["MOST_VOXELS", "Voxel", "VoxelGrid", "checked_occupancy"]

MOST_VOXELS = 2**28
"""Voxels of one grid: so many take 256 MB, and 33 MB more when a query reads them."""

Occupancy = NDArray[np.uint8]


class Voxel(enum.IntEnum):
    """The state of a voxel."""

    FREE = 0
    OCCUPIED = 1
    UNKNOWN = 2


class VoxelGrid(ElementShape):
    """The union of the occupied boxes of a grid and, unless that is ruled out, the unknown ones.

    ``occupancy[i, j, k]``, a `Voxel`, is the closed box of edge ``voxel`` (m) with its lower
    corner at ``(i, j, k) voxel`` in G. Its index as an element is that in the order of C,
    ``(i ny + j) nz + k``. `Context.set_voxels` says which voxels there are now.
    """

    __slots__ = ("_occupancy", "_unknown_is_free", "_voxel", "begun")
    kind: ClassVar[ElementKind] = ElementKind.VOXEL_GRID  # type: ignore[assignment]

    def __init__(
        self, occupancy: ArrayLike, voxel: float, *, unknown_is_free: bool = False
    ) -> None:
        """Copy an occupancy ``(nx, ny, nz)``, of any length along each axis, also 0.

        Raises InvalidShapeError for arrays of another shape or type, for more than MOST_VOXELS,
        for an edge that is none and, naming its index, for a voxel in none of the three states.
        """
        edge = as_float(voxel)
        if edge is None or not MIN_SHAPE_SIZE <= edge <= MAX_SHAPE_SIZE:
            raise InvalidShapeError(
                f"VoxelGrid: voxel must be an edge from {MIN_SHAPE_SIZE:g} m to"
                f" {MAX_SHAPE_SIZE:g} m, not {quoted(voxel)}"
            )
        if not isinstance(unknown_is_free, bool):
            raise InvalidShapeError(
                f"VoxelGrid: unknown_is_free must be True or False, not {quoted(unknown_is_free)}"
            )
        self._voxel, self._unknown_is_free = edge, unknown_is_free
        self._occupancy = checked_occupancy(
            occupancy, edge, "VoxelGrid: occupancy", InvalidShapeError
        )
        self.begun: object | None = None
        """The model's voxels of it before any were set."""

    @property
    def occupancy(self) -> Occupancy:
        """The states to begin with, ``(nx, ny, nz)`` uint8, read-only."""
        return self._occupancy

    @property
    def voxel(self) -> float:
        """The edge of a voxel, m."""
        return self._voxel

    @property
    def unknown_is_free(self) -> bool:
        """Whether queries take unknown voxels for free ones."""
        return self._unknown_is_free

    def is_solid(
        self, occupancy: Occupancy, *, unknown_is_free: bool | None = None
    ) -> NDArray[np.bool_]:
        """Return the mask of the voxels that the shape is of, or would be with another rule."""
        if self._unknown_is_free if unknown_is_free is None else unknown_is_free:
            return np.asarray(occupancy == Voxel.OCCUPIED)
        return np.asarray(occupancy != Voxel.FREE)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, VoxelGrid):
            return NotImplemented
        return (self._voxel, self._unknown_is_free) == (
            other._voxel,
            other._unknown_is_free,
        ) and np.array_equal(self._occupancy, other._occupancy)

    def __hash__(self) -> int:
        key = self._voxel, self._unknown_is_free, self._occupancy.shape
        return hash((VoxelGrid, *key, self._occupancy.tobytes()))

    def __repr__(self) -> str:
        counts = "x".join(map(str, self._occupancy.shape))
        free = ", unknown_is_free=True" if self._unknown_is_free else ""
        return f"VoxelGrid({counts}, voxel={self._voxel:g}{free})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self._occupancy, self._voxel, self._unknown_is_free)


def _again(occupancy: Occupancy, voxel: float, unknown_is_free: bool) -> VoxelGrid:
    return VoxelGrid(occupancy, voxel, unknown_is_free=unknown_is_free)


def checked_occupancy(value: Any, edge: float, label: str, error: type[Exception]) -> Occupancy:
    """Return states ``(nx, ny, nz)``, copied and read-only; raises as VoxelGrid does."""
    if type(value) is np.ndarray and value.dtype.kind in "iub":
        given = value  # as small as it is
    else:
        given = whole_array(value, f"{label} must be whole numbers", error)
    if given.ndim != 3:
        raise error(f"{label} must be (nx, ny, nz), not {given.shape}")
    if given.size > MOST_VOXELS:
        raise error(f"{label} must have at most {MOST_VOXELS} voxels, not {given.size}")
    if max(given.shape) * edge > MAX_SHAPE_SIZE:
        raise error(
            f"{label} must be at most {MAX_SHAPE_SIZE:g} m long along each axis, not"
            f" {max(given.shape)} voxels of {edge:g} m"
        )
    if given.size and (given.min() < Voxel.FREE or given.max() > Voxel.UNKNOWN):
        bad = (given < Voxel.FREE) | (given > Voxel.UNKNOWN)
        i, j, k = np.unravel_index(int(bad.argmax()), given.shape)
        raise error(
            f"{label}[{i}, {j}, {k}] must be 0 (free), 1 (occupied) or 2 (unknown), not"
            f" {given[i, j, k]}"
        )
    result = np.array(given, np.uint8, order="C")
    result.setflags(write=False)
    return result
