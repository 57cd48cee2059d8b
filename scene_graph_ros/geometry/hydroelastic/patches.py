"""The faces of many contact surfaces in arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.hydroelastic.placing import world_gradients

__all__ = ["ElementFields", "Patches"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_PER_VERTEX = ("vertices_W", "pressure")
_PER_FACE = ("corners", "normals_W", "areas", "centroids_W", "face_pressure", "elements")


class ElementFields(NamedTuple):
    """The numbers that faces are asked of their elements, in the frames of the bodies."""

    gradients: FloatArray
    """(E, 3) Pa/m, 0 for triangles."""
    planes: FloatArray
    """(E, 16) that bound the elements; see ``ElementTable``."""


class Patches:
    """The faces of s surfaces, one after the other; vertices belong to one polygon each."""

    rows: IntArray
    """(s, 2) rows (M, N)."""
    totals: FloatArray
    """(s, 10): area, centroid, force on M, its moment about the centroid, in W."""
    vertex_start: IntArray
    """(s + 1,)."""
    face_start: IntArray
    """(s + 1,)."""
    vertices_W: FloatArray
    """(v, 3) metres."""
    pressure: FloatArray
    """(v,) pascals."""
    corners: IntArray
    """(f, 3) the vertices of triangles or, of polygons, (f, 1) the first one of each; its others
    follow, up to the next polygon's. Counted from 0 for each surface."""
    normals_W: FloatArray
    """(f, 3)."""
    areas: FloatArray
    """(f,)."""
    centroids_W: FloatArray
    """(f, 3)."""
    face_pressure: FloatArray
    """(f,) at the centroids."""
    elements: IntArray
    """(f, 2) elements of M and N, -1 of a rigid half space."""
    narrow: FloatArray
    """(s,) metres: faces narrower than this were dropped, and sides that are shorter."""

    NAMES = ("rows", "totals", "vertex_start", "face_start", *_PER_VERTEX, *_PER_FACE)

    def __init__(
        self,
        arrays: tuple[NDArray[Any], ...],
        fields: ElementFields,
        X_W: FloatArray,
        narrow: FloatArray,
    ) -> None:
        """Take the arrays in the order of NAMES, all new.

        Args:
            arrays: as above.
            fields: of all elements.
            X_W: (s, 2, 4, 4) poses of M and N.
            narrow: (s,) as above.

        """
        self._arrays = arrays
        self._fields = fields
        self._X_W = X_W
        self.narrow = narrow
        self._gradients_W: dict[int, FloatArray] = {}
        for name, array in zip(self.NAMES, arrays, strict=True):
            setattr(self, name, _read_only(array))

    def gradients(self, side: int) -> FloatArray:
        """Return the pressure gradients (f, 3) of M (0) or N (1) at all faces, 0 where rigid."""
        result = self._gradients_W.get(side)
        if result is None:
            result = np.empty((len(self.areas), 3))
            starts, elements = self._arrays[3], self._arrays[-1]
            X_W = np.ascontiguousarray(self._X_W[:, side])
            world_gradients(self._fields.gradients, elements, side, starts, X_W, result)
            result = self._gradients_W[side] = _read_only(result)
        return result

    def planes(self, surface: int, faces: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the planes that bound the elements of some of a surface's faces, in W.

        Args:
            surface: its row.
            faces: (e,) rows, counted from 0 for each surface.

        Returns:
            unit normals (e, 2, 4, 3) into the elements of M and N, 0 where there is no plane, and
            offsets (e, 2, 4): ``normal . x + offset`` is the height (m) of x above a plane.

        """
        elements = self._arrays[-1][self.face_start[surface] + faces]
        found = np.where(elements[:, :, None] < 0, 0.0, self._fields.planes[elements])
        normals_G = found[..., :12].reshape(-1, 2, 3, 4)
        R_W, p_W = self._X_W[surface, :, :3, :3], self._X_W[surface, :, :3, 3]
        normals_W = np.einsum("bij,ebjk->ebki", R_W, normals_G)
        offsets = found[..., 12:] - np.einsum("ebki,bi->ebk", normals_W, p_W)
        return normals_W, offsets

    def __reduce__(self) -> tuple[Any, ...]:
        """Leave out the fields of elements that have no face."""
        elements = self._arrays[-1]
        used, index = np.unique(elements, return_inverse=True)
        kept = ElementFields(*(of_all[np.maximum(used, 0)] for of_all in self._fields))
        compact = np.where(elements < 0, -1, index.reshape(elements.shape))
        return Patches, ((*self._arrays[:-1], compact), kept, self._X_W, self.narrow)

    def select(self, surfaces: IntArray) -> Patches:
        """Return some of the surfaces, in the order given."""
        arrays: dict[str, NDArray[Any]] = dict(zip(self.NAMES, self._arrays, strict=True))
        result = {name: arrays[name][surfaces] for name in ("rows", "totals")}
        for start, names in (("vertex_start", _PER_VERTEX), ("face_start", _PER_FACE)):
            first, lengths = arrays[start][surfaces], np.diff(arrays[start])[surfaces]
            result[start] = np.concatenate([[0], np.cumsum(lengths)])
            offsets = np.repeat(first - result[start][:-1], lengths)
            rows = offsets + np.arange(result[start][-1])
            result |= {name: arrays[name][rows] for name in names}
        ordered = tuple(result[name] for name in self.NAMES)
        return Patches(ordered, self._fields, self._X_W[surfaces], self.narrow[surfaces])


def _read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return a view that nobody can write to; kernels read the array itself."""
    view = array.view()
    view.flags.writeable = False
    return view
