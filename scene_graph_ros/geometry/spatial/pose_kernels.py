"""Loops over poses: checks and products. Poses are rows of ``(n, 4, 4)`` arrays."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.spatial.pose_vectors import (
    compose_pose,
    copy_pose,
    INVALID,
    pose_defects,
    ROUGH,
)
from scene_graph_ros.geometry.tolerances import (
    MAX_COORDINATE,
    ROTATION_DEFECT,
    ROTATION_ROUNDING,
)

__all__ = [
    "BAD_BOTTOM_ROW",
    "FAR_AWAY",
    "NOT_FINITE",
    "NOT_ORTHONORMAL",
    "NOT_UNIT",
    "REFLECTION",
    "VALID",
    "check_poses",
    "invert_poses",
    "store_poses",
    "world_poses",
    "world_poses_of_children",
]

VALID = 0
NOT_FINITE = 1
BAD_BOTTOM_ROW = 2
FAR_AWAY = 3
NOT_ORTHONORMAL = 4
REFLECTION = 5
NOT_UNIT = 6

_POLISH_STEPS = 3  # The error is squared by each step: 1e-6 becomes rounding after two.


@lean_kernel
def _rotation_defect(X, i):
    """Return the largest entry of ``abs(R.T @ R - I)`` of row i."""
    worst = 0.0
    for a in range(3):
        for b in range(a, 3):
            product = X[i, 0, a] * X[i, 0, b] + X[i, 1, a] * X[i, 1, b] + X[i, 2, a] * X[i, 2, b]
            if a == b:
                product -= 1.0
            worst = max(worst, abs(product))
    return worst


@lean_kernel
def _determinant(X, i):
    """Return the determinant of the rotation of row i."""
    return (
        X[i, 0, 0] * (X[i, 1, 1] * X[i, 2, 2] - X[i, 1, 2] * X[i, 2, 1])
        - X[i, 0, 1] * (X[i, 1, 0] * X[i, 2, 2] - X[i, 1, 2] * X[i, 2, 0])
        + X[i, 0, 2] * (X[i, 1, 0] * X[i, 2, 1] - X[i, 1, 1] * X[i, 2, 0])
    )


@lean_kernel
def _pose_status(X, i):
    """Return the fault of row i: one of the status constants of this module."""
    for row in range(4):
        for column in range(4):
            if not math.isfinite(X[i, row, column]):
                return NOT_FINITE
    for column in range(4):
        expected = 1.0 if column == 3 else 0.0
        if abs(X[i, 3, column] - expected) > ROTATION_DEFECT:
            return BAD_BOTTOM_ROW
    for row in range(3):
        if abs(X[i, row, 3]) > MAX_COORDINATE:
            return FAR_AWAY
    if not _rotation_defect(X, i) <= ROTATION_DEFECT:
        return NOT_ORTHONORMAL
    if _determinant(X, i) < 0.0:
        return REFLECTION
    return VALID


@kernel
def check_poses(X):
    """Return (row, status) of the first invalid pose, or (-1, VALID)."""
    for i in range(X.shape[0]):
        status = _pose_status(X, i)
        if status != VALID:
            return i, status
    return -1, VALID


@lean_kernel
def _polish_rotation(out, k):
    """Make the rotation of row k orthonormal to rounding: R <- R (3 I - R^T R) / 2.

    The Newton-Schulz iteration for the polar factor (Higham, Functions of Matrices, eq. 8.20).
    """
    for _ in range(_POLISH_STEPS):
        if _rotation_defect(out, k) <= ROTATION_ROUNDING:
            return
        a00, a01, a02 = out[k, 0, 0], out[k, 0, 1], out[k, 0, 2]
        a10, a11, a12 = out[k, 1, 0], out[k, 1, 1], out[k, 1, 2]
        a20, a21, a22 = out[k, 2, 0], out[k, 2, 1], out[k, 2, 2]
        s00 = 1.5 - 0.5 * (a00 * a00 + a10 * a10 + a20 * a20)
        s11 = 1.5 - 0.5 * (a01 * a01 + a11 * a11 + a21 * a21)
        s22 = 1.5 - 0.5 * (a02 * a02 + a12 * a12 + a22 * a22)
        s01 = -0.5 * (a00 * a01 + a10 * a11 + a20 * a21)
        s02 = -0.5 * (a00 * a02 + a10 * a12 + a20 * a22)
        s12 = -0.5 * (a01 * a02 + a11 * a12 + a21 * a22)
        for row in range(3):
            x, y, z = out[k, row, 0], out[k, row, 1], out[k, row, 2]
            out[k, row, 0] = x * s00 + y * s01 + z * s02
            out[k, row, 1] = x * s01 + y * s11 + z * s12
            out[k, row, 2] = x * s02 + y * s12 + z * s22


@lean_kernel
def store_poses(X, rows, out):
    """Check all poses of X, then write row i to ``out[rows[i]]``, made rigid to rounding.

    Returns (row, status) of the first invalid pose; then nothing was written.
    """
    defects = 0
    for i in range(X.shape[0]):
        defects |= pose_defects(X, i)
    if defects & INVALID:
        for i in range(X.shape[0]):
            status = _pose_status(X, i)
            if status != VALID:
                return i, status
    for i in range(X.shape[0]):
        k = rows[i] & LAST_PLACE
        copy_pose(X, i, out, k)
        if defects & ROUGH and pose_defects(X, i) & ROUGH:
            _polish_rotation(out, k)
    return -1, VALID


@lean_kernel
def world_poses(parent, X_PF, X_WF):
    """Sweep a tree of frames from its root: ``X_WF[i] = X_WF[parent[i]] X_PF[i]``.

    Rows are ordered with parents before children; row 0 is the world, its own parent.
    """
    for row in range(4):
        for column in range(4):
            X_WF[0, row, column] = 1.0 if row == column else 0.0
    for i in range(1, X_PF.shape[0]):
        if parent[i] == 0:
            copy_pose(X_PF, i, X_WF, i)
        else:
            compose_pose(X_WF, parent[i], X_PF, i, X_WF, i)


@lean_kernel
def world_poses_of_children(rows, frame, X_WF, X_FG, X_WG):
    """Place geometries on their frames: ``X_WG[i] = X_WF[frame[i]] X_FG[i]`` for i in rows."""
    for slot in range(rows.shape[0]):
        i = rows[slot]
        compose_pose(X_WF, frame[i], X_FG, i, X_WG, i)


@kernel
def invert_poses(X_AB, X_BA):
    """Write the inverses of rigid poses."""
    for i in range(X_AB.shape[0]):
        for row in range(3):
            for column in range(3):
                X_BA[i, row, column] = X_AB[i, column, row]
            X_BA[i, row, 3] = -(
                X_AB[i, 0, row] * X_AB[i, 0, 3]
                + X_AB[i, 1, row] * X_AB[i, 1, 3]
                + X_AB[i, 2, row] * X_AB[i, 2, 3]
            )
            X_BA[i, 3, row] = 0.0
        X_BA[i, 3, 3] = 1.0
