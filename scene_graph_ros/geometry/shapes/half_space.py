"""Everything below a plane."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import InvalidShapeError
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.shapes.shape import PrimitiveShape
from scene_graph_ros.geometry.spatial.sums import length, product
from scene_graph_ros.geometry.tolerances import ZERO_DIRECTION

__all__ = ["HalfSpace"]


def _finite_vector(name: str, value: ArrayLike) -> NDArray[np.float64]:
    vector = real_array(
        value, f"HalfSpace: {name} must be three finite numbers", InvalidShapeError
    )
    if vector.shape != (3,) or not np.isfinite(vector).all():
        raise InvalidShapeError(f"HalfSpace: {name} must be three finite numbers, not {value!r}")
    return vector


@dataclass(frozen=True, slots=True)
class HalfSpace(PrimitiveShape):
    """The points with z <= 0; the outward normal is +z and the origin lies on the boundary."""

    kind: ClassVar[ShapeKind] = ShapeKind.HALF_SPACE

    def local_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return infinite corners: a rotated half space is bounded on no side."""
        return np.full(3, -math.inf), np.full(3, math.inf)

    def volume(self) -> float:
        """Return infinity."""
        return math.inf

    @staticmethod
    def make_pose(Hz_dir_F: ArrayLike, p_FB: ArrayLike) -> NDArray[np.float64]:
        """Return ``X_FH`` ``(4, 4)`` of a half space H with normal along ``Hz_dir_F`` through B.

        ``Hz_dir_F`` need not be a unit vector; ``p_FB`` is a point of the boundary, in m. The
        origin of H is the point of the boundary plane nearest to that of F. Raises
        InvalidShapeError if the direction is shorter than ZERO_DIRECTION.
        """
        direction = _finite_vector("Hz_dir_F", Hz_dir_F)
        point = _finite_vector("p_FB", p_FB)
        largest = np.abs(direction).max()
        reach = largest * length(direction / largest) if largest > 0.0 else 0.0
        if not reach >= ZERO_DIRECTION:
            raise InvalidShapeError(
                f"HalfSpace: Hz_dir_F must be longer than {ZERO_DIRECTION:g}, not {Hz_dir_F!r}"
            )
        z = direction / largest
        z /= length(z)
        # For +z this gives the identity.
        axis = np.eye(3)[0 if np.abs(z).argmax() == 1 else 1]
        x = np.cross(axis, z)
        x /= length(x)
        X_FH = np.eye(4)
        X_FH[:3, :3] = np.column_stack((x, np.cross(z, x), z))
        X_FH[:3, 3] = z * product(z, point)
        return X_FH
