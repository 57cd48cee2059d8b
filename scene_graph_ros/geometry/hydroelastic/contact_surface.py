"""Contact surfaces: the results of queries about pressure.

Between two bodies M and N, ``id_M < id_N``, the contact surface is where their pressures are
equal, or where the one that is rigid ends. Faces are flat and pressure is linear on each, so that
areas, forces and moments are exact for the surface as it is. Vertices are not shared: each
polygon has its own. To merge those of neighbours would take longer than to find them, and where
fields of coarse meshes meet, neighbours need not have equal corners.
"""

from __future__ import annotations

from collections.abc import Mapping
import functools
import itertools
from typing import Any, overload, TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scene_graph_ros.geometry.errors import QueryArgumentError
from scene_graph_ros.geometry.hydroelastic.force_derivatives import (
    force_derivatives,
    normal_rates,
)
from scene_graph_ros.geometry.hydroelastic.patches import Patches
from scene_graph_ros.geometry.hydroelastic.rims import rim_derivatives
from scene_graph_ros.geometry.model.ids import GeometryId
from scene_graph_ros.geometry.query.representation import ContactRepresentation
from scene_graph_ros.geometry.query.results import ResultTable
from scene_graph_ros.geometry.real_arrays import real_array

if TYPE_CHECKING:
    from scene_graph_ros.geometry.model.state import GeometryState

__all__ = ["ContactSurface", "ContactSurfaces"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Material = Mapping[str, Any]


class ContactSurface:
    """One contact surface: a view of a row of ``ContactSurfaces``, all of it read-only."""

    __slots__ = ("_row", "_table")

    def __init__(self, table: ContactSurfaces, row: int) -> None:
        """Look at a row of a table."""
        self._table = table
        self._row = row

    def _vertices(self) -> slice:
        start = self._table.vertex_start
        return slice(start[self._row], start[self._row + 1])

    def _faces(self) -> slice:
        start = self._table.face_start
        return slice(start[self._row], start[self._row + 1])

    @property
    def id_M(self) -> GeometryId:
        """The geometry with the smaller id; faces' normals point into it."""
        return GeometryId(int(self._table.id_M[self._row]))

    @property
    def id_N(self) -> GeometryId:
        """The geometry with the larger id."""
        return GeometryId(int(self._table.id_N[self._row]))

    @property
    def representation(self) -> ContactRepresentation:
        """Whether ``faces`` are triangles or polygons."""
        return self._table.representation

    @property
    def num_faces(self) -> int:
        """How many faces there are."""
        return int(self._table.num_faces[self._row])

    @property
    def num_vertices(self) -> int:
        """How many vertices there are."""
        return int(self._table.num_vertices[self._row])

    @property
    def vertices_W(self) -> FloatArray:
        """(v, 3) metres."""
        return self._table.vertices_W[self._vertices()]

    @property
    def pressure(self) -> FloatArray:
        """(v,) pascals at the vertices; negative only in a margin, where nothing touches yet."""
        return self._table.pressure[self._vertices()]

    @property
    def faces(self) -> IntArray | tuple[IntArray, ...]:
        """The vertices of each face, counter-clockwise about its normal.

        Triangles: an array (f, 3). Polygons: a tuple of f arrays, of three to eight rows each;
        the same in compressed rows is ``face_vertex_start``.
        """
        if self.representation is ContactRepresentation.TRIANGLE:
            return self._table.corners[self._faces()]
        starts = self.face_vertex_start.tolist()
        return tuple(np.arange(begin, end) for begin, end in itertools.pairwise(starts))

    @property
    def face_vertex_start(self) -> IntArray:
        """(f + 1,): polygon i has the vertices from entry i up to entry i + 1, in their order.

        Raises QueryArgumentError for triangles, which share the centroid of their polygon.
        """
        if self.representation is ContactRepresentation.TRIANGLE:
            raise QueryArgumentError("face_vertex_start is of representation 'polygon' only")
        return np.append(self._table.corners[self._faces(), 0], self.num_vertices)

    @property
    def face_normals_W(self) -> FloatArray:
        """(f, 3) unit vectors out of N into M."""
        return self._table.face_normals_W[self._faces()]

    @property
    def face_areas(self) -> FloatArray:
        """(f,) square metres, each above zero."""
        return self._table.face_areas[self._faces()]

    @property
    def face_centroids_W(self) -> FloatArray:
        """(f, 3) metres."""
        return self._table.face_centroids_W[self._faces()]

    @property
    def face_pressures(self) -> FloatArray:
        """(f,) pascals at the centroids."""
        return self._table.face_pressures[self._faces()]

    @property
    def grad_pressure_M_W(self) -> FloatArray | None:
        """(f, 3) Pa/m: the gradient of M's pressure at each face; None where M is rigid."""
        if not self._table.is_compliant_M[self._row]:
            return None
        return self._table.grad_pressure_M_W[self._faces()]

    @property
    def grad_pressure_N_W(self) -> FloatArray | None:
        """(f, 3) Pa/m: the gradient of N's pressure at each face; None where N is rigid."""
        if not self._table.is_compliant_N[self._row]:
            return None
        return self._table.grad_pressure_N_W[self._faces()]

    @property
    def total_area(self) -> float:
        """Square metres."""
        return float(self._table.total_area[self._row])

    @property
    def centroid_W(self) -> FloatArray:
        """(3,) metres: the centroid of the surface's area."""
        return self._table.centroid_W[self._row]

    @property
    def material_M(self) -> Material:
        """M's properties of the group "material" by name: dissipation, friction, stiffness."""
        return self._table.materials[int(self._table.id_M[self._row])]

    @property
    def material_N(self) -> Material:
        """N's properties of the group "material" by name."""
        return self._table.materials[int(self._table.id_N[self._row])]

    def force_and_moment(self, p_WP: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return force (3,) N and moment (3,) Nm about point P of the pressure on M, in W.

        On N acts the opposite. Exact for the linear pressure of each face; where it is
        negative, in a margin, it counts as zero. Raises QueryArgumentError if ``p_WP`` is not
        three finite numbers.
        """
        point = _checked_point(p_WP)
        force = self._table.force_W[self._row].copy()
        moment = self._table.moment_W[self._row] + np.cross(self.centroid_W - point, force)
        return force, moment

    def force_and_moment_derivatives(self, p_WP: ArrayLike) -> FloatArray:
        """Return ``(6, 6)``: how [moment about P, Nm; force, N] on M change as M moves, in W.

        By M's twist relative to N, [angular velocity; velocity of its point at P], rad/s and m/s,
        with N and P at rest. Exact for the surface as it is, also where it ends with pressure
        because faces were left out that a pressure falls along. At some poses the force has a kink
        or a jump and no derivative: where a face lies in a face of the other body's mesh or an
        edge in two of them, and where a pressure falls along a face just as steeply as is
        accepted. There it is that of the faces there are. Moments and forces are those of
        `force_and_moment`. Raises as it.
        """
        vertices, pressure = self.vertices_W, self.pressure
        polygons = [(vertices[face], pressure[face]) for face in self.faces]
        gradients = self.grad_pressure_M_W, self.grad_pressure_N_W
        normals, point = self.face_normals_W, _checked_point(p_WP)
        rates = normal_rates(normals, gradients)
        inside = force_derivatives(polygons, normals, gradients, rates, point)
        patches = self._table._patches
        planes = functools.partial(patches.planes, self._row)
        narrow = float(patches.narrow[self._row])
        return inside + rim_derivatives(polygons, normals, rates, planes, narrow, point)

    def __repr__(self) -> str:
        return (
            f"<ContactSurface of {self.id_M!r} and {self.id_N!r}: {self.num_faces} faces,"
            f" {self.total_area:.6g} m^2>"
        )


def _checked_point(p_WP: ArrayLike) -> FloatArray:
    """Return a point ``(3,)``. Raises QueryArgumentError."""
    point = real_array(p_WP, "p_WP must be three numbers", QueryArgumentError)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise QueryArgumentError(f"p_WP must be three finite numbers: {p_WP!r}")
    return point


class ContactSurfaces(ResultTable[ContactSurface]):
    """Contact surfaces, sorted by (id_M, id_N), none of them empty.

    Columns, one row per surface: ``id_M``, ``id_N``, ``total_area`` (m^2), ``centroid_W`` (m),
    ``force_W`` (N, on M) and ``moment_W`` (Nm, on M about the centroid), ``is_compliant_M`` and
    ``is_compliant_N``, ``num_faces``, ``num_vertices``. The faces and vertices of all surfaces
    stand in arrays one after the other; surface s has vertices ``vertex_start[s]`` up to
    ``vertex_start[s + 1]`` and faces by ``face_start``.
    """

    __slots__ = ("_patches", "materials", "representation")
    record_type = ContactSurface
    _ids = ("id_M", "id_N")

    representation: ContactRepresentation
    """Whether faces are triangles or polygons."""
    materials: Mapping[int, Material]
    """By integer id: the properties of the group "material" of every geometry that is in it."""

    def __init__(
        self,
        columns: Mapping[str, NDArray[Any]],
        patches: Patches,
        representation: ContactRepresentation,
        materials: Mapping[int, Material],
        state: GeometryState | None = None,
    ) -> None:
        """Take the columns, and the faces of as many surfaces; ``state`` knows names."""
        super().__init__(columns, state)
        self._patches = patches
        self.representation = representation
        self.materials = materials

    @property
    def vertex_start(self) -> IntArray:
        """(s + 1,)."""
        return self._patches.vertex_start

    @property
    def face_start(self) -> IntArray:
        """(s + 1,)."""
        return self._patches.face_start

    @property
    def vertices_W(self) -> FloatArray:
        """(v, 3) metres."""
        return self._patches.vertices_W

    @property
    def pressure(self) -> FloatArray:
        """(v,) pascals."""
        return self._patches.pressure

    @property
    def corners(self) -> IntArray:
        """(f, 3) the vertices of triangles or, of polygons, (f, 1) the first one of each.

        They count from 0 in each surface.
        """
        return self._patches.corners

    @property
    def face_normals_W(self) -> FloatArray:
        """(f, 3) out of N into M."""
        return self._patches.normals_W

    @property
    def face_areas(self) -> FloatArray:
        """(f,) square metres."""
        return self._patches.areas

    @property
    def face_centroids_W(self) -> FloatArray:
        """(f, 3) metres."""
        return self._patches.centroids_W

    @property
    def face_pressures(self) -> FloatArray:
        """(f,) pascals at the centroids."""
        return self._patches.face_pressure

    @property
    def grad_pressure_M_W(self) -> FloatArray:
        """(f, 3) Pa/m, zero where M is rigid; computed when it is first asked for."""
        return self._patches.gradients(0)

    @property
    def grad_pressure_N_W(self) -> FloatArray:
        """(f, 3) Pa/m, zero where N is rigid; computed when it is first asked for."""
        return self._patches.gradients(1)

    @overload
    def __getitem__(self, index: int) -> ContactSurface: ...

    @overload
    def __getitem__(self, index: slice) -> ContactSurfaces: ...

    def __getitem__(self, index: int | slice) -> ContactSurface | ContactSurfaces:
        if isinstance(index, slice):
            rows = np.arange(len(self))[index]
            return ContactSurfaces(
                {name: column[index] for name, column in self.columns.items()},
                self._patches.select(rows),
                self.representation,
                self.materials,
                self._state,
            )
        return ContactSurface(self, range(len(self))[index])

    def __reduce__(self) -> tuple[Any, ...]:
        materials = {key: dict(value) for key, value in self.materials.items()}
        return ContactSurfaces, (
            dict(self.columns), self._patches, self.representation, materials
        )  # fmt: skip
