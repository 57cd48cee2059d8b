"""A solid as data: vertices, tetrahedra and derived quantities."""

from __future__ import annotations

from functools import cached_property
import itertools
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import MeshError
from scene_graph_ros.geometry.meshes.mesh_points import (
    check_vertices,
    checked_element,
    checked_points,
)

__all__ = ["VolumeMesh"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# The faces of a positively oriented tetrahedron (0, 1, 2, 3), counter-clockwise seen from outside.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
# Half of all orders of the corners, the others being these backwards, and whether each is even.
_PATHS = np.array([p for p in itertools.permutations(range(4)) if p[0] < p[3]])
_PARITY = np.array([np.linalg.det(np.eye(4)[path]) for path in _PATHS]).round()
_EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])


class VolumeMesh:
    """Vertices in a frame M, in metres, and tetrahedra with positive volume.

    The tetrahedra are conforming: each triangular face belongs to one tetrahedron (then it is part
    of the boundary) or to two that lie on its two sides. All arrays are read-only.
    """

    __slots__ = ("__dict__", "_tetrahedra", "_vertices")

    def __init__(self, vertices: ArrayLike, tetrahedra: ArrayLike) -> None:
        """Take ``(v, 3)`` positions and ``(t, 4)`` indices, t > 0, and check them.

        A tetrahedron (a, b, c, d) is positive when d is on the side of the triangle a, b, c from
        which it is seen counter-clockwise turned over: ``cross(b - a, c - a) . (d - a) > 0``.

        Raises:
            MeshError: an array is empty or of another shape or type, a coordinate not finite or
                beyond MAX_COORDINATE, an index out of range, a vertex not used, a volume not
                positive, or a face shared by more than two tetrahedra, or by two that overlap.

        """
        points, corners = _checked(vertices, tetrahedra)
        self._take(points, corners)
        _require_positive(self)
        _require_used(self)
        _require_conforming(self)

    @classmethod
    def trusted(cls, vertices: FloatArray, tetrahedra: IntArray) -> VolumeMesh:
        """Return a mesh of arrays that are known to be right, unchecked and not copied."""
        mesh = object.__new__(cls)
        mesh._take(vertices, tetrahedra)
        return mesh

    def _take(self, vertices: FloatArray, tetrahedra: IntArray) -> None:
        self._vertices, self._tetrahedra = vertices.view(), tetrahedra.view()
        self._vertices.flags.writeable = False
        self._tetrahedra.flags.writeable = False

    @property
    def vertices(self) -> FloatArray:
        """(v, 3) metres."""
        return self._vertices

    @property
    def tetrahedra(self) -> IntArray:
        """(t, 4) indices into ``vertices``."""
        return self._tetrahedra

    @property
    def num_vertices(self) -> int:
        """The number of vertices."""
        return len(self._vertices)

    @property
    def num_tetrahedra(self) -> int:
        """The number of tetrahedra."""
        return len(self._tetrahedra)

    def volumes(self) -> FloatArray:
        """Return (t,) cubic metres.

        Each is the product of three edges that form a path through the corners; the path of the
        shortest edges is taken, so that a thin tetrahedron keeps its digits and its sign.
        """
        corners = self._vertices[self._tetrahedra]
        steps = corners[:, _PATHS[:, 1:]] - corners[:, _PATHS[:, :-1]]
        lengths = np.linalg.norm(steps, axis=3)
        scale = lengths.max(axis=(1, 2), keepdims=True)
        best = np.prod(lengths / np.where(scale > 0.0, scale, 1.0), axis=2).argmin(axis=1)
        e1, e2, e3 = (steps[np.arange(len(best)), best, k] for k in range(3))
        return _PARITY[best] * np.einsum("ij,ij->i", e1, np.cross(e2, e3)) / 6.0

    @property
    def volume(self) -> float:
        """Cubic metres of all tetrahedra."""
        return float(self.volumes().sum())

    def qualities(self) -> FloatArray:
        """Return (t,) how regular each tetrahedron is: 1 for a regular one, 0 for a flat one.

        It is ``6 sqrt(2) V / l^3`` with the volume V and the root mean square l of its edges
        (Parthasarathy et al. 1994, the measure gamma).
        """
        ends = self._vertices[self._tetrahedra[:, _EDGES]]
        edges = ends[:, :, 1] - ends[:, :, 0]
        square = np.einsum("ijk,ijk->i", edges, edges) / len(_EDGES)
        return 6.0 * np.sqrt(2.0) * self.volumes() / (square * np.sqrt(square))

    @cached_property
    def _boundary(self) -> IntArray:
        faces = self._tetrahedra[:, _FACES].reshape(-1, 3)
        order, starts = _groups(np.sort(faces, axis=1))
        single = order[starts[:-1][np.diff(starts) == 1]]
        result = faces[np.sort(single)]
        result.flags.writeable = False
        return result

    def boundary_triangles(self) -> IntArray:
        """Return (b, 3) the faces of one tetrahedron alone, counter-clockwise from outside."""
        return self._boundary

    @cached_property
    def _on_boundary(self) -> NDArray[np.bool_]:
        result = np.zeros(len(self._vertices), dtype=np.bool_)
        result[self._boundary] = True
        result.flags.writeable = False
        return result

    def is_on_boundary(self) -> NDArray[np.bool_]:
        """Return (v,) whether a boundary triangle uses the vertex."""
        return self._on_boundary

    def calc_barycentric(self, p_MQ: ArrayLike, tetrahedron: int) -> FloatArray:
        """Return the barycentric weights ``(4,)`` of a point Q; at least 0 where it is inside.

        They add up to 1. ``(m, 4)`` of points ``(m, 3)``. Raises MeshError for a tetrahedron that
        is not there, and for points that are not finite.
        """
        points = checked_points(p_MQ, "calc_barycentric")
        t = checked_element(tetrahedron, self.num_tetrahedra, "calc_barycentric: tetrahedron")
        corners = self._vertices[self._tetrahedra[t]]
        arms = corners - points[..., np.newaxis, :]
        volume = 6.0 * float(self.volumes()[t])
        faces = np.moveaxis(arms[..., _FACES, :], -2, 0)
        parts = np.sum(np.cross(faces[0], faces[1]) * faces[2], axis=-1)
        return np.asarray(parts / volume, dtype=np.float64)

    def bounding_box(self) -> tuple[FloatArray, FloatArray]:
        """Return the lower and the upper corner ``(3,)`` of the box around all vertices."""
        return self._vertices.min(axis=0), self._vertices.max(axis=0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, VolumeMesh):
            return NotImplemented
        return np.array_equal(self._vertices, other._vertices) and np.array_equal(
            self._tetrahedra, other._tetrahedra
        )

    def __hash__(self) -> int:
        return hash((self._vertices.tobytes(), self._tetrahedra.tobytes()))

    def __repr__(self) -> str:
        return f"VolumeMesh(vertices=<{self.num_vertices}>, tetrahedra=<{self.num_tetrahedra}>)"


def _checked(vertices: Any, tetrahedra: Any) -> tuple[FloatArray, IntArray]:
    points = _copied(vertices, np.float64, 3, "vertices")
    corners = _copied(tetrahedra, np.int64, 4, "tetrahedra")
    check_vertices(points, "VolumeMesh")
    wrong = ((corners < 0) | (corners >= len(points))).any(axis=1)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise MeshError(
            f"VolumeMesh: tetrahedron {row} refers to vertices {corners[row].tolist()}, "
            f"there are {len(points)}"
        )
    return points, corners


def _copied(array: Any, dtype: Any, width: int, label: str) -> np.ndarray:
    """Return a C-contiguous ``(n, width)`` copy with n > 0."""
    try:
        result = np.array(np.asarray(array).astype(dtype, casting="same_kind"), order="C")
    except (TypeError, ValueError) as error:
        kind = np.dtype(dtype).name
        raise MeshError(f"VolumeMesh: {label} must be (n, {width}) {kind}: {error}") from error
    if result.ndim != 2 or result.shape[1] != width or not len(result):
        raise MeshError(f"VolumeMesh: {label} must be (n, {width}) with n > 0, not {result.shape}")
    return result


def _groups(keys: IntArray) -> tuple[IntArray, IntArray]:
    """Return the order that sorts (n, 3) rows, and where runs of equal ones start (and end)."""
    order = np.lexsort(keys.T[::-1])
    ordered = keys[order]
    is_first = np.ones(len(order) + 1, dtype=bool)
    is_first[1:-1] = (ordered[1:] != ordered[:-1]).any(axis=1)
    return order, np.flatnonzero(is_first)


def _require_positive(mesh: VolumeMesh) -> None:
    volumes = mesh.volumes()
    wrong = ~(volumes > 0.0)
    if wrong.any():
        row = int(np.flatnonzero(wrong)[0])
        raise MeshError(
            f"VolumeMesh: tetrahedron {row}, vertices {mesh.tetrahedra[row].tolist()}, has volume"
            f" {volumes[row]:g}, not above 0; {int(wrong.sum())} of {len(volumes)} are so"
        )


def _require_used(mesh: VolumeMesh) -> None:
    used = np.zeros(mesh.num_vertices, dtype=bool)
    used[mesh.tetrahedra] = True
    if not used.all():
        row = int(np.flatnonzero(~used)[0])
        raise MeshError(f"VolumeMesh: vertex {row} belongs to no tetrahedron")


def _require_conforming(mesh: VolumeMesh) -> None:
    faces = mesh.tetrahedra[:, _FACES].reshape(-1, 3)
    order, starts = _groups(np.sort(faces, axis=1))
    counts = np.diff(starts)
    if (counts > 2).any():
        face = faces[order[starts[:-1][counts > 2][0]]]
        raise MeshError(
            f"VolumeMesh: the face of vertices {sorted(face.tolist())} belongs to"
            f" {int(counts.max())} tetrahedra, not to one or two"
        )
    first = starts[:-1][counts == 2]
    one, other = faces[order[first]], faces[order[first + 1]]
    if _same_turn(one, other).any():
        face = one[int(np.flatnonzero(_same_turn(one, other))[0])]
        raise MeshError(
            f"VolumeMesh: the two tetrahedra at the face of vertices {sorted(face.tolist())} are"
            " on the same side of it"
        )


def _same_turn(one: IntArray, other: IntArray) -> NDArray[np.bool_]:
    """Return a mask of pairs of rows, of the same three entries, that run the same way round."""
    turned = np.zeros(len(one), dtype=bool)
    for k in range(3):
        turned |= (one == np.roll(other, k, axis=1)).all(axis=1)
    return turned
