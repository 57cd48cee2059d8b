"""Poses as matrices ``(4, 4)`` and as messages, without kernels."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Point, Pose, Quaternion, Transform, Vector3
import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["as_matrix", "matrix_of", "place_of", "pose_msg", "transform_msg"]

_RIGID = 1e-6


def as_matrix(X: ArrayLike) -> NDArray[np.float64]:
    """Take a rigid pose ``(4, 4)``, a place ``(3,)``, or an object with ``as_matrix``, as a pose.

    Raises ValueError for anything else.
    """
    given: Any = X
    array = np.array(given.as_matrix() if hasattr(given, "as_matrix") else given, dtype=np.float64)
    if array.shape == (3,):
        array = place_of(array)
    if array.shape != (4, 4) or not np.isfinite(array).all():
        raise ValueError(f"a pose is (4, 4) finite numbers, or a place (3,), not {array.shape}")
    off = abs(array[:3, :3].T @ array[:3, :3] - np.eye(3)).max()
    if off > _RIGID or np.linalg.det(array[:3, :3]) < 0.0 or (array[3] != (0, 0, 0, 1)).any():
        raise ValueError(f"a pose must be rigid, with 0, 0, 0, 1 in its last row, not\n{array}")
    return array


def place_of(p: ArrayLike) -> NDArray[np.float64]:
    """Return the pose at ``(3,)`` that is not turned."""
    X = np.eye(4)
    X[:3, 3] = p
    return X


def matrix_of(pose: Pose) -> NDArray[np.float64]:
    """Return a message's pose."""
    q = pose.orientation
    w, x, y, z = np.array([q.w, q.x, q.y, q.z]) / np.linalg.norm([q.w, q.x, q.y, q.z])
    X = place_of([pose.position.x, pose.position.y, pose.position.z])
    X[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return X


def _quaternion(R: NDArray[np.float64]) -> Quaternion:
    """Return the unit quaternion of a rotation; the largest of its numbers is found first."""
    (a, b, c), (d, e, f), (g, h, i) = R.tolist()
    four = np.array(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, b + d, c + g],
            [c - g, b + d, 1 - a + e - i, f + h],
            [d - b, c + g, f + h, 1 - a - e + i],
        ]
    )
    row = four[int(np.argmax(np.diag(four)))]
    w, x, y, z = (row / np.linalg.norm(row)).tolist()
    return Quaternion(w=w, x=x, y=y, z=z)


def pose_msg(X: ArrayLike) -> Pose:
    """Return a pose as a message. Raises ValueError for an array that is none."""
    matrix = as_matrix(X)
    x, y, z = matrix[:3, 3].tolist()
    return Pose(position=Point(x=x, y=y, z=z), orientation=_quaternion(matrix[:3, :3]))


def transform_msg(X: ArrayLike) -> Transform:
    """Return the same as a transform."""
    pose = pose_msg(X)
    p = pose.position
    return Transform(translation=Vector3(x=p.x, y=p.y, z=p.z), rotation=pose.orientation)
