"""Loops over positions and quaternions (x, y, z, w): from and to poses, rows of ``(n, 4, 4)``."""

import math

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.spatial.pose_kernels import FAR_AWAY, NOT_FINITE, NOT_UNIT, VALID
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE, QUATERNION_NORM_DEFECT

__all__ = [
    "judge",
    "poses_from_components_kernel",
    "poses_from_quaternions_kernel",
    "quaternions_from_poses_kernel",
    "write_pose",
]


@lean_kernel
def judge(p0, p1, p2, x, y, z, w):
    """Return the fault of a position and a quaternion: a status of `pose_kernels`."""
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if (
        abs(norm - 1.0) <= QUATERNION_NORM_DEFECT
        and abs(p0) <= MAX_COORDINATE
        and abs(p1) <= MAX_COORDINATE
        and abs(p2) <= MAX_COORDINATE
    ):
        return VALID
    if not (
        math.isfinite(x)
        and math.isfinite(y)
        and math.isfinite(z)
        and math.isfinite(w)
        and math.isfinite(p0)
        and math.isfinite(p1)
        and math.isfinite(p2)
    ):
        return NOT_FINITE
    if max(abs(p0), abs(p1), abs(p2)) > MAX_COORDINATE:
        return FAR_AWAY
    return NOT_UNIT


@lean_kernel
def write_pose(p0, p1, p2, x, y, z, w, X, i):
    """Write row i of X (Diebel, Representing Attitude, eq. 125), normalizing the quaternion."""
    s = 2.0 / (x * x + y * y + z * z + w * w)
    X[i, 0, 0] = 1.0 - s * (y * y + z * z)
    X[i, 0, 1] = s * (x * y - z * w)
    X[i, 0, 2] = s * (x * z + y * w)
    X[i, 0, 3] = p0
    X[i, 1, 0] = s * (x * y + z * w)
    X[i, 1, 1] = 1.0 - s * (x * x + z * z)
    X[i, 1, 2] = s * (y * z - x * w)
    X[i, 1, 3] = p1
    X[i, 2, 0] = s * (x * z - y * w)
    X[i, 2, 1] = s * (y * z + x * w)
    X[i, 2, 2] = 1.0 - s * (x * x + y * y)
    X[i, 2, 3] = p2
    X[i, 3, 0] = 0.0
    X[i, 3, 1] = 0.0
    X[i, 3, 2] = 0.0
    X[i, 3, 3] = 1.0


@lean_kernel
def poses_from_quaternions_kernel(p, q, X):
    """Write poses from positions (n, 3) and quaternions (n, 4) in the order x, y, z, w.

    Returns (row, status) of the first invalid row; rows from there on are not written.
    """
    for i in range(p.shape[0]):
        p0, p1, p2 = p[i, 0], p[i, 1], p[i, 2]
        x, y, z, w = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
        status = judge(p0, p1, p2, x, y, z, w)
        if status != VALID:
            return i, status
        write_pose(p0, p1, p2, x, y, z, w, X, i)
    return -1, VALID


@lean_kernel
def poses_from_components_kernel(rows, X, statuses):
    """Write the pose of each row of x, y, z, qx, qy, qz, qw that is right, and its status.

    Returns how many are right; ``rows`` is ``(n, 7)``, X ``(n, 4, 4)``, ``statuses`` ``(n,)``.
    """
    count = 0
    for i in range(rows.shape[0]):
        p0, p1, p2 = rows[i, 0], rows[i, 1], rows[i, 2]
        x, y, z, w = rows[i, 3], rows[i, 4], rows[i, 5], rows[i, 6]
        statuses[i] = judge(p0, p1, p2, x, y, z, w)
        if statuses[i] == VALID:
            write_pose(p0, p1, p2, x, y, z, w, X, i)
            count += 1
    return count


@kernel
def quaternions_from_poses_kernel(X, q):
    """Write unit quaternions (x, y, z, w) with w >= 0; the largest component is computed first.

    Shepperd's method (Journal of Guidance and Control, 1978): no loss near half turns.
    """
    for i in range(X.shape[0]):
        r00, r11, r22 = X[i, 0, 0], X[i, 1, 1], X[i, 2, 2]
        trace = r00 + r11 + r22
        if trace >= r00 and trace >= r11 and trace >= r22:
            x = X[i, 2, 1] - X[i, 1, 2]
            y = X[i, 0, 2] - X[i, 2, 0]
            z = X[i, 1, 0] - X[i, 0, 1]
            w = 1.0 + trace
        elif r00 >= r11 and r00 >= r22:
            x = 1.0 + r00 - r11 - r22
            y = X[i, 0, 1] + X[i, 1, 0]
            z = X[i, 0, 2] + X[i, 2, 0]
            w = X[i, 2, 1] - X[i, 1, 2]
        elif r11 >= r22:
            x = X[i, 0, 1] + X[i, 1, 0]
            y = 1.0 - r00 + r11 - r22
            z = X[i, 1, 2] + X[i, 2, 1]
            w = X[i, 0, 2] - X[i, 2, 0]
        else:
            x = X[i, 0, 2] + X[i, 2, 0]
            y = X[i, 1, 2] + X[i, 2, 1]
            z = 1.0 - r00 - r11 + r22
            w = X[i, 1, 0] - X[i, 0, 1]
        length = math.sqrt(x * x + y * y + z * z + w * w)
        if w < 0.0:
            length = -length
        q[i, 0] = x / length
        q[i, 1] = y / length
        q[i, 2] = z / length
        q[i, 3] = w / length
