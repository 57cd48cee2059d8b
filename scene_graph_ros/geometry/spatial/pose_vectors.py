"""Products and checks of poses, four numbers at a time.

The compiler finds no such instructions in loops over rows and columns of single poses. All arrays
are C-contiguous, ``(n, 4, 4)``.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    as_lanes,
    load_four,
    load_number,
    magnitude,
    reordering,
    store_lanes,
)
from scene_graph_ros.geometry.tolerances import (
    MAX_COORDINATE,
    ROTATION_DEFECT,
    ROTATION_ROUNDING,
)

__all__ = [
    "INVALID",
    "ROUGH",
    "compose_pose",
    "copy_pose",
    "pose_defects",
    "remember_pose",
]

ROUGH = 1
"""The rotation is not orthonormal to rounding."""
INVALID = 2
"""The pose is not rigid, or so far away that it has to be looked at again."""

_POSE = 16
"""Numbers of a pose."""
_BOTTOM = (0.0, 0.0, 0.0, 1.0)
_UNIT_COLUMNS = (1.0, 1.0, 1.0, 0.0)
_MAX_SQUARE = MAX_COORDINATE * MAX_COORDINATE
_VALID = (ROTATION_DEFECT, ROTATION_DEFECT, ROTATION_DEFECT, _MAX_SQUARE)
_SMOOTH = (ROTATION_ROUNDING, ROTATION_ROUNDING, ROTATION_ROUNDING, _MAX_SQUARE)
"""How far squares of columns may be from those of unit columns, and that of the place from 0."""

_ahead, _behind = reordering(1, 2, 0, 3), reordering(2, 0, 1, 3)
"""Columns of a row, the first three in a circle."""


@inlined_kernel
def _load_rows(X, i):
    at = i * _POSE
    return load_four(X, at), load_four(X, at + 4), load_four(X, at + 8)


@inlined_kernel
def _store_rows(rows, X, i):
    """Write the first three rows of a pose, and the last as it has to be."""
    at = i * _POSE
    store_lanes(X, at, rows[0])
    store_lanes(X, at + 4, rows[1])
    store_lanes(X, at + 8, rows[2])
    store_lanes(X, at + 12, as_lanes(_BOTTOM))


@inlined_kernel
def _row_of_product(X_AB, at, rows):
    """Return the row at ``X_AB.flat[at]``, of a pose, times the pose of these rows."""
    p = load_number(X_AB, at + 3)
    return (
        load_number(X_AB, at) * rows[0]
        + load_number(X_AB, at + 1) * rows[1]
        + load_number(X_AB, at + 2) * rows[2]
        + as_lanes((0.0, 0.0, 0.0, p))
    )


@inlined_kernel
def compose_pose(X_AB, i, X_BC, j, X_AC, k):
    """Write ``X_AB[i] X_BC[j]`` to ``X_AC[k]``."""
    at, rows = i * _POSE, _load_rows(X_BC, j)
    x = _row_of_product(X_AB, at, rows)
    y = _row_of_product(X_AB, at + 4, rows)
    z = _row_of_product(X_AB, at + 8, rows)
    _store_rows((x, y, z), X_AC, k)


@inlined_kernel
def copy_pose(X, i, copy, k):
    """Write ``X[i]`` to ``copy[k]``, with a last row as it has to be."""
    _store_rows(_load_rows(X, i), copy, k)


@inlined_kernel
def remember_pose(X, i, known, k):
    """Write ``X[i]`` to ``known[k]``; return whether another pose was there."""
    rows, before = _load_rows(X, i), _load_rows(known, k)
    _store_rows(rows, known, k)
    return any_of((rows[0] != before[0]) | (rows[1] != before[1]) | (rows[2] != before[2]))


@inlined_kernel
def pose_defects(X, i):
    """Return the faults of ``X[i]``: ROUGH, INVALID, both or 0."""
    x, y, z = _load_rows(X, i)
    y_ahead, z_ahead = _ahead(y), _ahead(z)
    # The squares of the columns, the last being the place, and the products of two of the others.
    lengths = magnitude(x * x + y * y + z * z - as_lanes(_UNIT_COLUMNS))
    angles = magnitude(x * _ahead(x) + y * y_ahead + z * z_ahead)
    bottom = magnitude(load_four(X, i * _POSE + 12) - as_lanes(_BOTTOM))
    valid, smooth = as_lanes(_VALID), as_lanes(_SMOOTH)
    # Its last number is no part of the determinant, whatever it is.
    volume = x * (y_ahead * _behind(z) - _behind(y) * z_ahead)
    is_valid = all_of((lengths <= valid) & (angles <= valid) & (bottom <= ROTATION_DEFECT))
    is_valid &= volume[0] + volume[1] + volume[2] >= 0.0
    is_smooth = all_of((lengths <= smooth) & (angles <= smooth))
    return (0 if is_smooth else ROUGH) | (0 if is_valid else INVALID)
