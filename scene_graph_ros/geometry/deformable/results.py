"""The result tables of deformable contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType
from typing import overload

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.errors import UnknownIdError
from scene_graph_ros.geometry.model.ids import GeometryId

__all__ = ["ContactParticipation", "DeformableContact", "DeformableContactSurface"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class ContactParticipation:
    """Which vertices of a deformable geometry take part in its contacts.

    A vertex takes part if it is a corner of a tetrahedron with a contact point. A solver that
    treats contact apart from the rest wants these first: that is the permutation.
    """

    def __init__(self, takes_part: NDArray[np.bool_]) -> None:
        """Take ``(v,)`` whether each vertex does."""
        takes_part.flags.writeable = False
        self._takes_part = takes_part

    @property
    def takes_part(self) -> NDArray[np.bool_]:
        """(v,) whether each vertex takes part."""
        return self._takes_part

    @property
    def num_vertices(self) -> int:
        """The number of vertices of the geometry."""
        return len(self._takes_part)

    @property
    def num_vertices_in_contact(self) -> int:
        """The number of those that take part."""
        return len(self.vertices)

    @cached_property
    def vertices(self) -> IntArray:
        """(k,) the vertices that take part, ascending."""
        return _frozen(np.flatnonzero(self._takes_part))

    @cached_property
    def permutation(self) -> IntArray:
        """(v,) the new index of each vertex: those that take part first, both in old order."""
        order = np.concatenate([self.vertices, np.flatnonzero(~self._takes_part)])
        result = np.empty(len(order), np.int64)
        result[order] = np.arange(len(order))
        return _frozen(result)

    def __repr__(self) -> str:
        return f"ContactParticipation({self.num_vertices_in_contact} of {self.num_vertices})"


@dataclass(frozen=True, eq=False, kw_only=True)
class DeformableContactSurface:
    """Where a deformable geometry A meets a geometry B, as f convex polygons.

    A is always deformable. If B is, too, ``id_A < id_B``. Each polygon is in one tetrahedron of A
    (and of a deformable B); neighbouring polygons share no corners. The centroid of a polygon is
    a *contact point*. All arrays are read-only and in the world frame W.
    """

    id_A: GeometryId
    id_B: GeometryId
    vertices_W: FloatArray
    """(n, 3) metres: the corners of all polygons."""
    face_starts: IntArray
    """(f + 1,): polygon i has the corners ``vertices_W[face_starts[i]:face_starts[i + 1]]``,
    counter-clockwise about its normal."""
    contact_points_W: FloatArray
    """(f, 3) metres: the polygons' centroids."""
    face_areas: FloatArray
    """(f,) square metres."""
    nhats_BA_W: FloatArray
    """(f, 3) unit vectors out of B into A: the outward normal of a rigid B."""
    signed_distances: FloatArray
    """(f,) metres, at most 0: the field of A at each contact point, about minus its distance from
    A's surface. Between deformable geometries it is that of B as well."""
    tetrahedra_A: IntArray
    """(f,) the tetrahedron of A's reference mesh that has the contact point."""
    vertex_indices_A: IntArray
    """(f, 4) its corners."""
    barycentric_coordinates_A: FloatArray
    """(f, 4) the contact point is this combination of the corners' positions."""
    tetrahedra_B: IntArray | None = None
    """(f,) the same for a deformable B, None for a rigid one."""
    vertex_indices_B: IntArray | None = None
    """(f, 4) or None."""
    barycentric_coordinates_B: FloatArray | None = None
    """(f, 4) or None."""

    def __post_init__(self) -> None:
        for array in vars(self).values():
            if isinstance(array, np.ndarray):
                array.flags.writeable = False

    @property
    def is_B_deformable(self) -> bool:
        """Whether both geometries are deformable."""
        return self.tetrahedra_B is not None

    @property
    def num_contact_points(self) -> int:
        """The number of polygons."""
        return len(self.face_areas)

    @property
    def total_area(self) -> float:
        """Square metres."""
        return float(self.face_areas.sum())

    @cached_property
    def R_WCs(self) -> FloatArray:
        """(f, 3, 3) a frame C at each contact point, its z-axis against nhat: into B.

        Its other axes are those of W, turned the shortest way (Duff et al., "Building an
        orthonormal basis, revisited", 2017).
        """
        z = -self.nhats_BA_W
        sign = np.copysign(1.0, z[:, 2])
        a = -1.0 / (sign + z[:, 2])
        b = z[:, 0] * z[:, 1] * a
        x = np.stack([1.0 + sign * z[:, 0] ** 2 * a, sign * b, -sign * z[:, 0]], axis=1)
        y = np.stack([b, sign + z[:, 1] ** 2 * a, -z[:, 1]], axis=1)
        return _frozen(np.stack([x, y, z], axis=2))

    def polygon(self, face: int) -> FloatArray:
        """Return the corners ``(m, 3)`` of a face, in m."""
        face = range(self.num_contact_points)[face]
        return self.vertices_W[self.face_starts[face] : self.face_starts[face + 1]]

    def __repr__(self) -> str:
        return (
            f"DeformableContactSurface({self.id_A!r}, {self.id_B!r},"
            f" {self.num_contact_points} contact points)"
        )


class DeformableContact(Sequence[DeformableContactSurface]):
    """All surfaces of contact with a deformable geometry, sorted by ``(id_A, id_B)``.

    Pairs that do not meet have no surface.
    """

    def __init__(
        self,
        surfaces: Sequence[DeformableContactSurface],
        participation: Mapping[GeometryId, ContactParticipation],
    ) -> None:
        """Take sorted surfaces, and the participation of every deformable geometry."""
        self._surfaces = tuple(surfaces)
        self._participation = MappingProxyType(dict(participation))

    @property
    def participation(self) -> Mapping[GeometryId, ContactParticipation]:
        """By id, of each deformable geometry with the proximity role, in contact or not."""
        return self._participation

    def contact_participation(self, geometry_id: GeometryId) -> ContactParticipation:
        """Return the participation in contact of a geometry's vertices.

        Raises UnknownIdError if it was no deformable geometry with the proximity role.
        """
        if geometry_id not in self._participation:
            raise UnknownIdError(
                f"no deformable geometry with the proximity role has the id {geometry_id!r}"
            )
        return self._participation[geometry_id]

    @overload
    def __getitem__(self, index: int) -> DeformableContactSurface: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[DeformableContactSurface, ...]: ...

    def __getitem__(
        self, index: int | slice
    ) -> DeformableContactSurface | tuple[DeformableContactSurface, ...]:
        return self._surfaces[index]

    def __len__(self) -> int:
        return len(self._surfaces)

    def __iter__(self) -> Iterator[DeformableContactSurface]:
        return iter(self._surfaces)

    def __repr__(self) -> str:
        return f"<DeformableContact: {len(self)} surfaces>"


def _frozen(array: NDArray[np.generic]) -> NDArray:
    array.flags.writeable = False
    return array
