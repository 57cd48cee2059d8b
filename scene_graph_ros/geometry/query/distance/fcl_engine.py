"""Pairs answered by FCL (python-fcl) instead of this package's kernels, for comparison.

Users of MoveIt know it: ``fcl.collide`` with its contact of greatest depth answers for
penetration, ``fcl.distance`` with its nearest points for signed distances. Nothing is corrected:
docs/accuracy.md shows how far off these answers are. FCL has no tolerances to choose, promises no
bound, and does not say where a normal is a choice; where shapes touch and it gives none, z is
taken and called so. It has no distances to half spaces, and no depth for a mesh that is measured
by its triangles. A failed check inside FCL ends the process, for python-fcl passes on no C++
exceptions.
"""

from __future__ import annotations

from collections.abc import Callable
import importlib
import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import EngineError, UnsupportedPairError
from scene_graph_ros.geometry.model.derived import derived
from scene_graph_ros.geometry.model.proximity import shape_table
from scene_graph_ros.geometry.model.roles import Role
from scene_graph_ros.geometry.model.snapshot import Snapshot
from scene_graph_ros.geometry.model.state import GeometryState
from scene_graph_ros.geometry.query.distance.driver import FIRST_PENETRATION, WITHIN
from scene_graph_ros.geometry.query.distance.solved_pairs import (
    BOTH,
    DECIDED_BY,
    GAP,
    LOCAL_AT,
    NHAT_BA_W,
    NO_FAILURE,
    PHI,
    ROW_A,
    ROW_B,
    SolvedPairs,
    UNIQUE,
)
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.tables.table_arrays import ShapeTable
from scene_graph_ros.geometry.tolerances import OSCULATION

__all__ = ["solve_pairs_with_fcl"]

Vector = NDArray[np.float64]

_MAX_CONTACTS = 1000
"""Contacts asked for, the deepest of which counts; box against box gives up to eight."""

_MIN_FACES = 4
"""Of a solid hull."""


class _NoAnswer(Exception):  # noqa: N818 - a reason, turned into an error that names the pair
    """Why FCL has no answer."""


class _Bodies:
    """The geometries of a table as FCL's objects, made when first asked about.

    They hold poses, so one thread at a time may use them.
    """

    def __init__(self, table: ShapeTable) -> None:
        self._fcl: Any = importlib.import_module("fcl")
        self._table = table
        self._objects: dict[int, Any] = {}
        self.lock = threading.RLock()  # A thread that is interrupted may come once more.

    def place(self, row: int, X: Vector) -> None:
        """Move a geometry to the pose X (4, 4). Raises _NoAnswer if FCL does not take it."""
        transform = self._fcl.Transform(X[:3, :3], X[:3, 3])
        if row in self._objects:
            self._objects[row].setTransform(transform)
        else:
            self._objects[row] = self._fcl.CollisionObject(self._shape(row), transform)

    def deepest_contact(self, i: int, j: int) -> Any | None:
        """Return FCL's contact of greatest depth, whose normal points from i to j, or None."""
        request = self._fcl.CollisionRequest(num_max_contacts=_MAX_CONTACTS, enable_contact=True)
        result = self._fcl.CollisionResult()
        self._fcl.collide(self._objects[i], self._objects[j], request, result)
        return max(result.contacts, key=lambda contact: contact.penetration_depth, default=None)

    def touch(self, i: int, j: int) -> bool:
        """Tell whether the two meet."""
        return self._fcl.collide(self._objects[i], self._objects[j]) > 0

    def distance(self, i: int, j: int) -> tuple[float, Vector, Vector]:
        """Return the signed distance (m) and the nearest points of i and j in W."""
        request = self._fcl.DistanceRequest(
            enable_nearest_points=True, enable_signed_distance=True
        )
        result = self._fcl.DistanceResult()
        phi = self._fcl.distance(self._objects[i], self._objects[j], request, result)
        return phi, *result.nearest_points

    def is_half_space(self, row: int) -> bool:
        """Tell whether the geometry is a half space."""
        return self._table.kind[row] == ShapeKind.HALF_SPACE

    def is_measured_by_triangles(self, row: int) -> bool:
        """Tell whether the geometry is a mesh that does not stand for its hull."""
        return bool(self._table.exact[row])

    def size(self, i: int, j: int) -> float:
        """Return the larger of two sizes in metres."""
        return max(self._table.scale[i], self._table.scale[j])

    def _shape(self, row: int) -> Any:
        fcl, kind = self._fcl, ShapeKind(self._table.kind[row])
        x, y, z = self._table.size[row].tolist()
        match kind:
            case ShapeKind.SPHERE:
                return fcl.Sphere(x)
            case ShapeKind.CAPSULE:
                return fcl.Capsule(x, 2.0 * y)
            case ShapeKind.BOX:
                return fcl.Box(2.0 * x, 2.0 * y, 2.0 * z)
            case ShapeKind.CYLINDER:
                return fcl.Cylinder(x, 2.0 * y)
            case ShapeKind.ELLIPSOID:
                return fcl.Ellipsoid(x, y, z)
            case ShapeKind.HALF_SPACE:
                return fcl.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)
        return self._triangles(row) if self._table.exact[row] else self._hull(row)

    def _hull(self, row: int) -> Any:
        hulls, k = self._table.hulls, self._table.hull[row]
        first, last = hulls.vertex_start[k : k + 2]
        faces = range(*hulls.face_start[k : k + 2])
        if len(faces) < _MIN_FACES:
            raise _NoAnswer("it takes no hulls without volume")
        corners: list[int] = []
        for face in faces:
            polygon = hulls.face_vertices[slice(*hulls.face_vertex_start[face : face + 2])] - first
            corners += [len(polygon), *polygon.tolist()]
        return self._fcl.Convex(hulls.vertices[first:last], len(faces), corners)

    def _triangles(self, row: int) -> Any:
        surfaces, k = self._table.surfaces, self._table.surface[row]
        first, last = surfaces.vertex_start[k : k + 2]
        triangles = surfaces.triangles[slice(*surfaces.triangle_start[k : k + 2])] - first
        model = self._fcl.BVHModel()
        model.beginModel(last - first, len(triangles))
        model.addSubModel(surfaces.vertices[first:last], triangles)
        model.endModel()
        return model


Contact = tuple[float, Vector, Vector, Vector, bool]
"""(phi, p_WCa, p_WCb, nhat_BA_W, whether the normal is one)."""


def _contact(bodies: _Bodies, i: int, j: int) -> Contact | None:
    """Return FCL's contact, or None where it sees no overlap."""
    contact = bodies.deepest_contact(i, j)
    if contact is None:
        return None
    half = 0.5 * contact.penetration_depth * contact.normal
    return (
        -contact.penetration_depth,
        contact.pos + half,
        contact.pos - half,
        -contact.normal,
        True,
    )


def _nearest(bodies: _Bodies, i: int, j: int) -> Contact:
    phi, p_WCa, p_WCb = bodies.distance(i, j)
    way = p_WCa - p_WCb
    length = float(np.linalg.norm(way))
    if not np.isfinite(phi + length):
        raise EngineError(f"engine 'fcl' gave the distance {phi!r} and the points {p_WCa, p_WCb}")
    if length > 0.0:
        return phi, p_WCa, p_WCb, np.copysign(1.0 / length, phi) * way, True
    contact = _contact(bodies, i, j)
    nhat = np.array([0.0, 0.0, 1.0]) if contact is None else contact[3]
    return phi, p_WCa, p_WCb, nhat, contact is not None


@derived(Role.PROXIMITY)
def _bodies(state: GeometryState) -> _Bodies:
    return _Bodies(shape_table(state))


def solve_pairs_with_fcl(
    snapshot: Snapshot,
    pairs: NDArray[np.int64],
    max_distance: float,
    keep: int,
    describe: Callable[[int], str],
    query: str,
) -> SolvedPairs:
    """Do the same as ``distance.driver.solve_pairs``, by asking FCL about one pair after another.

    ``describe`` names a row, ``query`` is the question's name, for messages. The gap is nan: FCL
    gives no certificate.

    Raises:
        UnsupportedPairError: FCL has no answer for a pair.
        EngineError: its answer is not finite.

    """
    bodies = _bodies(snapshot.state)
    found: list[tuple[int, int, Contact]] = []
    failed = NO_FAILURE
    with bodies.lock:
        placed: set[int] = set()
        for k, (i, j) in enumerate(pairs.tolist()):
            if bodies.is_half_space(i) and bodies.is_half_space(j):
                failed = k
                break
            try:
                for row in {i, j} - placed:
                    bodies.place(row, snapshot.X_WG[row])
                placed |= {i, j}
                answer = _answer(bodies, i, j, keep)
            except _NoAnswer as error:
                raise UnsupportedPairError(
                    f"{query}: engine 'fcl' has no answer for {describe(i)} against"
                    f" {describe(j)}: {error}. Ask with engine='native'."
                ) from None
            if answer is None or not _is_kept(answer[0], max_distance, keep, bodies.size(i, j)):
                continue
            found.append((i, j, answer))
            if keep == FIRST_PENETRATION:
                break
    return _solved(found, snapshot.X_WG, failed)


def _is_kept(phi: float, max_distance: float, keep: int, size: float) -> bool:
    return phi <= max_distance if keep == WITHIN else phi < -OSCULATION * size


def _answer(bodies: _Bodies, i: int, j: int, keep: int) -> Contact | None:
    is_triangles = bodies.is_measured_by_triangles(i) or bodies.is_measured_by_triangles(j)
    if is_triangles and keep == FIRST_PENETRATION:
        zero = np.zeros(3)
        return (-np.inf, zero, zero, zero, False) if bodies.touch(i, j) else None
    if is_triangles:
        raise _NoAnswer("it gives no depth for a mesh that is measured by its triangles")
    if keep != WITHIN:
        return _contact(bodies, i, j)
    if bodies.is_half_space(i) or bodies.is_half_space(j):
        raise _NoAnswer("it has no distance to a half space")
    return _nearest(bodies, i, j)


def _solved(found: list[tuple[int, int, Contact]], X_WG: Vector, failed: int) -> SolvedPairs:
    rows = np.array([(i, j) for i, j, _ in found], dtype=np.int64).reshape(-1, 2)
    contacts = [contact for *_, contact in found]
    phi = np.array([contact[0] for contact in contacts], dtype=np.float64)
    p_WCa, p_WCb, nhat = (
        np.array([contact[k] for contact in contacts], dtype=np.float64).reshape(-1, 3)
        for k in (1, 2, 3)
    )
    unique = np.array([contact[4] for contact in contacts], dtype=np.float64)
    locals_ = []
    for side, points in enumerate((p_WCa, p_WCb)):
        X = X_WG[rows[:, side]]
        locals_.append(np.einsum("kji,kj->ki", X[:, :3, :3], points - X[:, :3, 3]))
    columns = {
        PHI: phi, GAP: np.full(len(found), np.nan), UNIQUE: unique,
        DECIDED_BY: np.zeros(len(found)), NHAT_BA_W: nhat,
        ROW_A: rows[:, 0], ROW_B: rows[:, 1], LOCAL_AT[BOTH]: np.stack([*locals_, p_WCa, p_WCb]),
    }  # fmt: skip
    numbers = np.concatenate([columns[start].ravel() for start in sorted(columns)])
    return SolvedPairs(numbers, len(found), len(found), failed)
