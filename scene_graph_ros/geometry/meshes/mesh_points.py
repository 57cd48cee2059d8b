"""Points that a mesh is asked about."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.quoting import quoted
from scene_graph_ros.geometry.real_arrays import real_array
from scene_graph_ros.geometry.tolerances import MAX_COORDINATE

__all__ = ["check_vertices", "checked_element", "checked_points"]


def check_vertices(points: NDArray[np.float64], name: str) -> None:
    """Raise MeshError, naming the mesh, for vertices (v, 3) not finite or beyond MAX_COORDINATE.

    Products of nine of those within are finite.
    """
    wrong = ~(np.abs(points) <= MAX_COORDINATE).all(axis=1)
    if wrong.any():
        row = int(wrong.argmax())
        is_finite = np.isfinite(points[row]).all()
        reason = f"not within {MAX_COORDINATE:g} m" if is_finite else "not finite"
        raise MeshError(f"{name}: vertex {row} is {reason}: {points[row].tolist()}")


def checked_points(points: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return points ``(3,)`` or ``(m, 3)``. Raises MeshError for others, naming who asks."""
    rule = f"{name}: points must be finite numbers (3,) or (m, 3)"
    found = real_array(points, rule, MeshError)
    if found.ndim not in (1, 2) or found.shape[-1] != 3 or not np.isfinite(found).all():
        raise MeshError(f"{rule}, not {quoted(points)}")
    return found


def checked_element(index: object, count: int, name: str) -> int:
    """Return the number of a triangle or tetrahedron. Raises MeshError for one not there."""
    is_whole = isinstance(index, (int, np.integer)) and not isinstance(index, bool)
    if not is_whole or not 0 <= index < count:  # type: ignore[operator]
        raise MeshError(
            f"{name} must be a whole number from 0 to {count - 1}, not {quoted(index)}"
        )
    return int(index)  # type: ignore[call-overload]
