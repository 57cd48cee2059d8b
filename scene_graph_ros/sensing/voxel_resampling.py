"""The states of a map in the voxels of a grid that is elsewhere, turned, or of another edge.

A voxel is occupied where a cell of the map that it meets is, free where all of them are, and else
unknown, as is all outside of the map. So all parts of a free voxel are free.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.shapes.voxel_grid import Voxel

__all__ = ["resampled_states"]

_FREE, _OCCUPIED, _UNKNOWN = int(Voxel.FREE), int(Voxel.OCCUPIED), int(Voxel.UNKNOWN)

_RANKS = np.array([0, 2, 1], np.uint8)
"""Of the states by how bad they are: free, unknown, occupied; and the states of these."""

_ROUNDING = 1e-6
"""Of a cell: a voxel that meets a cell by less than this along an axis does not meet it."""

_ALIKE = 1e-9
"""Edges are the same, and axes parallel, up to this."""


@inlined_kernel
def _span(middle, half, count):
    """Return (first, behind the last, is inside): cells along an axis, and whether all exist."""
    low, high = middle - half + _ROUNDING, middle + half - _ROUNDING
    first = np.int64(max(min(np.floor(low), count + 1.0), -1.0))
    last = np.int64(max(min(np.floor(max(high, low)), count + 1.0), -1.0))
    return max(first, 0), min(last + 1, count), first >= 0 and last < count


@lean_kernel
def _resample(states, cells, X_MG, voxel, half, result):
    """Write the states of a grid's voxels; ``cells`` ``(3,)`` are the lengths of a map's cell.

    ``half`` ``(3,)`` are a voxel's half extents along the map's axes, in cells.
    """
    nx, ny, nz = states.shape
    for i in range(result.shape[0]):
        for j in range(result.shape[1]):
            for k in range(result.shape[2]):
                x, y, z = (i + 0.5) * voxel, (j + 0.5) * voxel, (k + 0.5) * voxel
                p = X_MG[0, 0] * x + X_MG[0, 1] * y + X_MG[0, 2] * z + X_MG[0, 3]
                q = X_MG[1, 0] * x + X_MG[1, 1] * y + X_MG[1, 2] * z + X_MG[1, 3]
                r = X_MG[2, 0] * x + X_MG[2, 1] * y + X_MG[2, 2] * z + X_MG[2, 3]
                ax, bx, in_x = _span(p / cells[0], half[0], nx)
                ay, by, in_y = _span(q / cells[1], half[1], ny)
                az, bz, in_z = _span(r / cells[2], half[2], nz)
                found = _FREE if in_x and in_y and in_z else _UNKNOWN
                for a in range(ax, bx):
                    for b in range(ay, by):
                        for c in range(az, bz):
                            state = states[a, b, c]
                            if state == _OCCUPIED:
                                found = _OCCUPIED
                            elif state == _UNKNOWN and found == _FREE:
                                found = _UNKNOWN
                result[i, j, k] = found


def _along_axes(
    states: NDArray[np.uint8],
    lengths: NDArray[np.float64],
    p_MG: NDArray[np.float64],
    counts: tuple[int, int, int],
    voxel: float,
) -> NDArray[np.uint8]:
    """Return the same for a grid whose axes are parallel to the map's: the worst axis by axis."""
    worst = _RANKS[states]
    for axis in range(3):
        n, half = states.shape[axis], 0.5 * voxel / lengths[axis]
        middle = ((np.arange(counts[axis]) + 0.5) * voxel + p_MG[axis]) / lengths[axis]
        low = np.floor(middle - half + _ROUNDING)
        high = np.floor(np.maximum(middle + half - _ROUNDING, middle - half + _ROUNDING))
        # One unknown cell before the map's, and one behind, are all that is outside of it.
        pads = [(1, 1) if k == axis else (0, 0) for k in range(3)]
        padded = np.pad(worst, pads, constant_values=_RANKS[_UNKNOWN])
        first = np.clip(low, -1, n).astype(np.int64) + 1
        last = np.clip(high, -1, n).astype(np.int64) + 1
        worst = padded.take(first, axis=axis)
        for k in range(1, int((last - first).max()) + 1):
            np.maximum(worst, padded.take(np.minimum(first + k, last), axis=axis), out=worst)
    result: NDArray[np.uint8] = _RANKS[worst]
    return result


def resampled_states(
    states: NDArray[np.uint8],
    cells: tuple[float, float, float],
    X_MG: NDArray[np.float64],
    counts: tuple[int, int, int],
    voxel: float,
) -> NDArray[np.uint8]:
    """Return the states ``counts`` of voxels of an edge (m) of a grid G.

    ``states`` ``(nx, ny, nz)`` are those of a map M whose cells have these lengths (m) from its
    origin on; a length may be infinite, of a map that says the same at all heights. ``X_MG`` is
    the pose ``(4, 4)`` of the grid in the map. A voxel that is turned counts as the box around it
    along the map's axes. Cells that it meets by less than 1e-6 of their length are left out.
    """
    result = np.full(counts, _UNKNOWN, np.uint8)
    if not result.size:
        return result
    shift, lengths = X_MG[:3, 3] / voxel, np.array(cells)
    whole = np.round(shift)
    is_parallel = np.abs(X_MG[:3, :3] - np.eye(3)).max() <= _ALIKE
    is_alike = np.abs(lengths / voxel - 1.0).max() <= _ALIKE
    if (
        is_parallel
        and is_alike
        and np.abs(shift - whole).max() <= _ROUNDING
        and np.abs(whole).max() < 2**31
    ):
        first = whole.astype(np.int64)
        begin, end = np.maximum(first, 0), np.minimum(first + counts, states.shape)
        if (begin < end).all():
            into = tuple(slice(a, b) for a, b in zip(begin - first, end - first, strict=True))
            result[into] = states[tuple(slice(a, b) for a, b in zip(begin, end, strict=True))]
        return result
    if is_parallel:
        return _along_axes(states, lengths, X_MG[:3, 3], counts, voxel)
    X_MG = np.ascontiguousarray(X_MG)
    half = 0.5 * voxel * np.abs(X_MG[:3, :3]).sum(axis=1) / lengths
    _resample(np.ascontiguousarray(states), lengths, X_MG, voxel, half, result)
    return result
