"""The border for poses: all input leaves as a rigid, contiguous ``float64`` array.

``X_AB`` is the pose of frame B measured and expressed in frame A: ``p_AQ = X_AB @ p_BQ``.
Quaternions are in ROS order (x, y, z, w), angles in radians, lengths in metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidPoseError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.spatial import pose_kernels as kernels
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.geometry.spatial.quaternion_kernels import (
    poses_from_quaternions_kernel,
    quaternions_from_poses_kernel,
)
from scene_graph_ros.geometry.spatial.sums import product
from scene_graph_ros.geometry.tolerances import (
    MAX_COORDINATE,
    QUATERNION_NORM_DEFECT,
    ROTATION_DEFECT,
)

__all__ = [
    "as_pose",
    "as_poses",
    "compose",
    "identity",
    "inverse",
    "is_for_kernels",
    "pose_from_xyz_rpy",
    "poses_from_quaternions",
    "quaternions_from_poses",
    "refuse_pose",
    "rotation_from_rpy",
    "to_pose_array",
]

Poses = NDArray[np.float64]

_FLOAT64 = np.dtype(np.float64)

_REASONS = {
    kernels.NOT_FINITE: "has an entry that is not finite",
    kernels.BAD_BOTTOM_ROW: "has a last row other than 0, 0, 0, 1",
    kernels.FAR_AWAY: f"has a coordinate beyond {MAX_COORDINATE:g} m",
    kernels.NOT_ORTHONORMAL: f"is not rigid: R.T @ R is off I by more than {ROTATION_DEFECT:g}",
    kernels.REFLECTION: "is a reflection: its determinant is negative",
    kernels.NOT_UNIT: f"has a quaternion of norm off 1 by more than {QUATERNION_NORM_DEFECT:g}",
}


def _quote(value: Any) -> str:
    return np.array2string(np.asarray(value), precision=9, separator=", ").replace("\n", "")


def _row_name(name: str, row: int, rows: int) -> str:
    return name if rows == 1 else f"{name}[{row}]"


def refuse_pose(name: str, status: int, value: Any) -> InvalidPoseError:
    """Return the error that names a pose, its fault, and its value."""
    return InvalidPoseError(f"pose {name} {_REASONS[status]}: {_quote(value)}")


def is_for_kernels(X: NDArray[Any]) -> bool:
    """Tell whether kernels take an array of numbers as it is: to numba others are other types."""
    return X.dtype is _FLOAT64 and X.flags.carray


def to_pose_array(X: Any, name: str) -> Poses:
    """Return X as contiguous ``float64``, ``(4, 4)`` or ``(n, 4, 4)``, its values unchecked.

    Anything with ``as_matrix()`` is accepted. Raises InvalidPoseError for another shape or type.
    """
    if not isinstance(X, np.ndarray) and hasattr(X, "as_matrix"):
        X = X.as_matrix()
    try:
        given = np.asarray(X)
    except ValueError as error:
        raise InvalidPoseError(f"pose {name} is not an array of numbers: {quoted(X)}") from error
    if given.dtype.kind not in "fiu" or np.ma.is_masked(X):
        raise InvalidPoseError(
            f"pose {name} is not an array of real numbers, but of {given.dtype}, shape"
            f" {given.shape}: {quoted(X)}"
        )
    if given.shape[-2:] != (4, 4) or given.ndim not in (2, 3):
        raise InvalidPoseError(
            f"pose {name} must be (4, 4) or (n, 4, 4), not {given.shape}: {_quote(given)}"
        )
    if given.dtype is _FLOAT64:
        array = np.ascontiguousarray(given)
    else:
        with np.errstate(over="ignore"):  # a float beyond float64 is infinite, and refused
            array = np.ascontiguousarray(given, dtype=np.float64)
    # A read-only array is another type to numba: without the copy it would compile a second time.
    return array if array.flags.writeable else array.copy()


def as_pose(X: Any, name: str) -> Poses:
    """Validate one pose and return a read-only ``(4, 4)`` copy, orthonormal to rounding.

    ``name`` appears in the error, e.g. ``"X_PG of geometry 'ball'"``.
    Raises InvalidPoseError if X is not finite or not rigid.
    """
    array = to_pose_array(X, name)
    if array.ndim != 2:
        raise InvalidPoseError(f"pose {name} must be one (4, 4) array, not {array.shape}")
    result = as_poses(array[np.newaxis], name)[0]
    result.setflags(write=False)
    return result


def as_poses(X: Any, name: str) -> Poses:
    """Validate poses and return a ``(n, 4, 4)`` copy, orthonormal to rounding.

    X is ``(n, 4, 4)``, or a sequence of poses. Raises InvalidPoseError naming the row.
    """
    if isinstance(X, Sequence):
        X = np.array([to_pose_array(X_i, f"{name}[{i}]") for i, X_i in enumerate(X)])
        X = X.reshape(-1, 4, 4)
    array = to_pose_array(X, name)
    if array.ndim != 3:
        raise InvalidPoseError(f"poses {name} must be (n, 4, 4), not {array.shape}")
    result = np.empty_like(array)
    row, status = kernels.store_poses(array, np.arange(len(array)), result)
    if status != kernels.VALID:
        raise refuse_pose(_row_name(name, row, len(array)), status, array[row])
    return result


def identity() -> Poses:
    """Return a read-only identity pose."""
    return _IDENTITY


_IDENTITY = np.eye(4)
_IDENTITY.setflags(write=False)


def inverse(X_AB: Poses) -> Poses:
    """Return ``X_BA`` of a rigid pose ``(4, 4)`` or of each of ``(n, 4, 4)``."""
    batch = to_pose_array(X_AB, "to invert").reshape(-1, 4, 4)
    result = np.empty_like(batch)
    kernels.invert_poses(batch, result)
    return result.reshape(np.shape(X_AB))


def compose(X_AB: Poses, X_BC: Poses) -> Poses:
    """Return ``X_AC = X_AB X_BC``; either side may be one pose or a batch of the same length."""
    X_AC: Poses = product(np.asarray(X_AB), np.asarray(X_BC))
    X_AC[..., 3, :] = (0.0, 0.0, 0.0, 1.0)
    return X_AC


def poses_from_quaternions(
    p: ArrayLike, q_xyzw: ArrayLike, name: str = "from quaternions"
) -> Poses:
    """Return ``(n, 4, 4)`` poses from positions ``(n, 3)`` in m and quaternions ``(n, 4)``.

    Quaternions are normalized. Raises InvalidPoseError, naming the row, for a value that is not
    finite or a norm further from 1 than QUATERNION_NORM_DEFECT.
    """
    positions = real_array(p, f"positions of poses {name} must be numbers", InvalidPoseError)
    rule = f"quaternions of poses {name} must be numbers"
    quaternions = real_array(q_xyzw, rule, InvalidPoseError)
    if positions.ndim != 2 or positions.shape != (len(quaternions), 3):
        raise InvalidPoseError(f"positions of poses {name} must be (n, 3): {positions.shape}")
    if quaternions.shape != (len(positions), 4):
        raise InvalidPoseError(f"quaternions of poses {name} must be (n, 4): {quaternions.shape}")
    X = np.empty((len(positions), 4, 4))
    row, status = poses_from_quaternions_kernel(positions, quaternions, X)
    if status != kernels.VALID:
        value = np.concatenate([positions[row], quaternions[row]])
        raise refuse_pose(_row_name(name, row, len(positions)), status, value)
    return X


def quaternions_from_poses(X: Poses) -> NDArray[np.float64]:
    """Return unit quaternions ``(n, 4)`` in the order x, y, z, w with w >= 0."""
    batch = to_pose_array(X, "to convert").reshape(-1, 4, 4)
    result = np.empty((len(batch), 4))
    quaternions_from_poses_kernel(batch, result)
    return result


def rotation_from_rpy(rpy: ArrayLike) -> NDArray[np.float64]:
    """Return ``Rz(yaw) Ry(pitch) Rx(roll)``, the fixed-axis convention of URDF and REP-103."""
    angles = real_array(rpy, "roll, pitch and yaw must be three numbers", InvalidPoseError)
    if angles.shape != (3,) or not np.isfinite(angles).all():
        raise InvalidPoseError(
            f"roll, pitch and yaw must be three finite numbers, not {quoted(rpy)}"
        )
    roll, pitch, yaw = angles.tolist()
    sr, cr = sine_cosine(roll)
    sp, cp = sine_cosine(pitch)
    sy, cy = sine_cosine(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def pose_from_xyz_rpy(xyz: ArrayLike, rpy: ArrayLike = (0.0, 0.0, 0.0)) -> Poses:
    """Return the pose of a URDF ``origin``: position in m, roll, pitch and yaw in rad."""
    X = np.eye(4)
    X[:3, :3] = rotation_from_rpy(rpy)
    position = real_array(xyz, "xyz must be three numbers", InvalidPoseError)
    if position.shape != (3,):
        raise InvalidPoseError(f"xyz must be three numbers, not {quoted(xyz)}")
    X[:3, 3] = position
    return as_pose(X, f"from xyz={list(np.atleast_1d(xyz))} rpy={list(np.atleast_1d(rpy))}")
