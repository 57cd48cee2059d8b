"""How the force and the moment of a contact surface change at a rim with pressure.

A surface ends with pressure where the face on the other side of an edge was left out, because a
pressure falls along it. While M moves, such an edge stays in two planes: that of its face, which
moves along its normal n at a rate ``k . w``, with the velocity w of M's points, and a plane with
unit normal m that bounds an element of M, which moves at ``m . w``, or of N, which is at rest.
With t along the edge and nu = t x n out of the face, the edge's velocity is
``(k . w) n + (h . w) nu`` with

    h = (m - (n . m) k) / (nu . m)  of M,    h = -(n . m) k / (nu . m)  of N,

and beside the integral over the faces there is one over the rim, the last term of Flanders'
formula for moving surfaces ("Differentiation under the integral sign", 1973):

    integral of p v x t dl = integral of p ((h . w) n - (k . w) nu) dl.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.hydroelastic.force_derivatives import with_moment

__all__ = ["rim_derivatives"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Planes = Callable[[IntArray], tuple[FloatArray, FloatArray]]

_GAUSS = 0.5 / math.sqrt(3.0)
"""Distance of both points of Gauss' rule from the middle of the interval, of length 1."""
_DRIFT = 4.0
"""Relative to the width too narrow to keep: how far middles of a common edge may be apart. Each
face's corners may have moved by one width, and a face as narrow between them may be dropped."""


class _Rim(NamedTuple):
    """e edges that one face has alone, where it has pressure."""

    face: IntArray
    """(e,)."""
    ends: FloatArray
    """(e, 2, 3) metres, counter-clockwise about the face's normal."""
    pressures: FloatArray
    """(e, 2) pascals, none negative."""


def rim_derivatives(
    polygons: Sequence[tuple[FloatArray, FloatArray]],
    normals: FloatArray,
    rates: FloatArray,
    planes: Planes,
    narrow: float,
    p_WP: FloatArray,
) -> FloatArray:
    """Return the rim's part ``(6, 6)`` in the derivatives of [moment about P; force] on M.

    Args:
        polygons: corners ``(k, 3)`` and pressures ``(k,)`` of each face.
        normals: of the faces ``(f, 3)``, into M.
        rates: ``k`` of the faces ``(f, 3)``, as in this module.
        planes: of faces ``(e,)`` the planes that bound their elements of M and N: unit normals
            ``(e, 2, 4, 3)``, 0 where there is none, and offsets ``(e, 2, 4)``.
        narrow: metres, the width of faces that are too narrow to keep.
        p_WP: ``(3,)``.

    """
    rim = _find_rim(polygons, _DRIFT * narrow)
    if len(rim.face) == 0:
        return np.zeros((6, 6))
    n, k = normals[rim.face], rates[rim.face]
    along = rim.ends[:, 1] - rim.ends[:, 0]
    lengths = np.linalg.norm(along, axis=1)
    nu = np.cross(along / lengths[:, None], n)
    m, is_of_M = _bounding_planes(rim.ends, n, *planes(rim.face))
    slope = np.einsum("ei,ei->e", n, m)[:, None] * k
    h = (np.where(is_of_M[:, None], m, 0.0) - slope) / np.einsum("ei,ei->e", nu, m)[:, None]
    result = np.zeros((6, 6))
    for t in (0.5 - _GAUSS, 0.5 + _GAUSS):  # exact up to the third power, as in r x p v x t
        r = rim.ends[:, 0] + t * along - p_WP
        weights = 0.5 * lengths * (rim.pressures[:, 0] * (1.0 - t) + rim.pressures[:, 1] * t)
        along_n = with_moment(r, n)[..., None] * with_moment(r, h)[:, None]
        along_nu = with_moment(r, nu)[..., None] * with_moment(r, k)[:, None]
        result += np.einsum("e,eij->ij", weights, along_n - along_nu)
    return result


def _find_rim(polygons: Sequence[tuple[FloatArray, FloatArray]], drift: float) -> _Rim:
    """Find the edges whose middle is no other edge's, up to ``drift`` (m), where p is positive."""
    from scipy.spatial import cKDTree

    lengths = np.array([len(corners) for corners, _ in polygons])
    face, following = np.repeat(np.arange(len(polygons)), lengths), np.arange(1, lengths.sum() + 1)
    following[np.cumsum(lengths) - 1] -= lengths
    begins, p = (np.concatenate(of_all) for of_all in zip(*polygons, strict=True))
    ends, q = begins[following], p[following]
    is_alone = np.maximum(p, q) > 0.0
    is_alone[cKDTree(0.5 * (begins + ends)).query_pairs(drift, output_type="ndarray")] = False
    begins, ends, p, q = begins[is_alone], ends[is_alone], p[is_alone], q[is_alone]
    # Pressure is linear along an edge, and only its positive part counts.
    turns = p * q < 0.0
    zero = begins + np.where(turns, p / np.where(turns, p - q, 1.0), 0.0)[:, None] * (
        ends - begins
    )
    first = np.where((p < 0.0)[:, None], zero, begins)
    second = np.where((q < 0.0)[:, None], zero, ends)
    pressures = np.maximum(np.stack([p, q], axis=1), 0.0)
    return _Rim(face[is_alone], np.stack([first, second], axis=1), pressures)


def _bounding_planes(
    ends: FloatArray, n: FloatArray, normals: FloatArray, offsets: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Find for each edge the plane in which it is, by distances within the plane of its face.

    Returns:
        its unit normal (e, 3), and whether it moves with M (e,).

    """
    heights = np.abs(np.einsum("ebki,eji->ebkj", normals, ends) + offsets[..., None]).max(axis=-1)
    upright = np.einsum("ebki,ei->ebk", normals, n)
    across = np.linalg.norm(normals - upright[..., None] * n[:, None, None, :], axis=-1)
    distances = np.full(heights.shape, np.inf)
    np.divide(heights, across, out=distances, where=across > 0.0)
    best = distances.reshape(len(ends), -1).argmin(axis=1)
    rows = np.arange(len(ends))
    return normals.reshape(len(ends), -1, 3)[rows, best], best < normals.shape[2]
