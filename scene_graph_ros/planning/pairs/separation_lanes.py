"""How far pairs of bodies are apart at least, by boxes and balls around them, eight in step."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    as_lanes,
    larger,
    load_number,
    magnitude,
    root,
    select,
    smaller,
    with_sign,
)
from scene_graph_ros.geometry.spatial.vectors import dot

__all__ = ["COVER", "between_boxes", "new_covers", "place_cover", "pose_in_cover", "separations"]

COVER = 20
"""Numbers that are known of a body: its box's axes in W, which are its own, one after the other,
half its edges, its centre in W, its ball's radius, the body's origin in W, and one to spare. The
centre is that of both."""

_ROUNDING = 1e-14
"""Of the lengths that are subtracted: what rounding may add to a distance."""

_TINY = 1e-150
"""Metres: the squares of smaller lengths have no digits left."""


def new_covers(
    lower: NDArray[np.float64], upper: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return covers ``(COVER b,)`` of bodies that are nowhere yet, from boxes' corners and radii.

    Nothing is known of half spaces, whose radii are infinite.
    """
    covers = np.zeros((len(radii), COVER))
    known = np.isfinite(radii)
    covers[known, 9:12] = 0.5 * (upper[known] - lower[known])
    covers[known, 15] = radii[known]
    return covers.reshape(-1)


@inlined_kernel
def place_cover(places, b, k, covers):
    """Write where a body is in configuration k."""
    X, center, at = places.X_WG[b], places.centers[b], COVER * b
    for i in range(3):
        for row in range(3):
            covers[at + 3 * i + row] = X[4 * row + i, k]
        covers[at + 12 + i] = center[i, k]
        covers[at + 16 + i] = X[4 * i + 3, k]


@inlined_kernel
def pose_in_cover(covers, at):
    """Return the rotation and the place of the body whose cover begins there."""
    rotation = (
        load_number(covers, at),
        load_number(covers, at + 3),
        load_number(covers, at + 6),
        load_number(covers, at + 1),
        load_number(covers, at + 4),
        load_number(covers, at + 7),
        load_number(covers, at + 2),
        load_number(covers, at + 5),
        load_number(covers, at + 8),
    )
    place = (
        load_number(covers, at + 16),
        load_number(covers, at + 17),
        load_number(covers, at + 18),
    )
    return rotation, place


@inlined_kernel
def _of_eight(covers, at, i):
    """Return the i-th number that is known of each of eight bodies, whose covers begin there."""
    return as_lanes(
        (
            load_number(covers, at[0] + i),
            load_number(covers, at[1] + i),
            load_number(covers, at[2] + i),
            load_number(covers, at[3] + i),
            load_number(covers, at[4] + i),
            load_number(covers, at[5] + i),
            load_number(covers, at[6] + i),
            load_number(covers, at[7] + i),
        )
    )


@inlined_kernel
def _three_of_eight(covers, at, i):
    return (
        _of_eight(covers, at, i),
        _of_eight(covers, at, i + 1),
        _of_eight(covers, at, i + 2),
    )


@inlined_kernel
def _along_face(far, own, half, cosines, radius):
    """Return a body's distance from a face: it is within ``half`` of its centre, and a ball."""
    extent = own + smaller(dot(half, cosines), radius)
    return far - extent - _ROUNDING * (far + extent)


@inlined_kernel
def _from_centre(apart, half, rotation, other_half, radius, size):
    """Return a body's distance from the nearest point of a box to its centre, -inf inside.

    ``apart``: where the body's centre is, in the box's frame; ``rotation``: the body's axes there,
    ``half`` and ``radius``: how far it reaches; ``size``: how long all that is, for rounding.
    """
    x = with_sign(larger(magnitude(apart[0]) - other_half[0], 0.0), apart[0])
    y = with_sign(larger(magnitude(apart[1]) - other_half[1], 0.0), apart[1])
    z = with_sign(larger(magnitude(apart[2]) - other_half[2], 0.0), apart[2])
    beyond = (x, y, z)
    length = root(dot(beyond, beyond))
    along = (
        magnitude(dot(rotation[0], beyond)),
        magnitude(dot(rotation[1], beyond)),
        magnitude(dot(rotation[2], beyond)),
    )
    extent = smaller(dot(half, along) / larger(length, _TINY), radius)
    apart = length - extent - _ROUNDING * (size + extent)
    return select(length > _TINY, apart, -math.inf)


@inlined_kernel
def separations(covers, at_A, at_B):
    """Return lower bounds of the signed distances of eight pairs.

    The largest along the faces' normals of both boxes (Gottschalk and others, *OBBTree*, 1996,
    section 5, without the axes of two edges), and from each centre to the other's box. ``at_A``
    and ``at_B`` are where the covers of the pairs' bodies begin. Never more than the truth.
    """
    a0, a1, a2 = (
        _three_of_eight(covers, at_A, 0),
        _three_of_eight(covers, at_A, 3),
        _three_of_eight(covers, at_A, 6),
    )
    b0, b1, b2 = (
        _three_of_eight(covers, at_B, 0),
        _three_of_eight(covers, at_B, 3),
        _three_of_eight(covers, at_B, 6),
    )
    half_A, half_B = _three_of_eight(covers, at_A, 9), _three_of_eight(covers, at_B, 9)
    p_WA, p_WB = _three_of_eight(covers, at_A, 12), _three_of_eight(covers, at_B, 12)
    radius_A, radius_B = _of_eight(covers, at_A, 15), _of_eight(covers, at_B, 15)
    return between_boxes(
        ((a0, a1, a2), half_A, p_WA, radius_A), ((b0, b1, b2), half_B, p_WB, radius_B)
    )


@inlined_kernel
def between_boxes(A, B):
    """Return lower bounds of the distances of eight pairs; see ``separations``.

    A and B are the axes in W of a box, half its edges, its centre in W and the radius of a ball
    around the same centre. Axes and centres are lanes; the others may be numbers.
    """
    (a0, a1, a2), half_A, p_WA, radius_A = A
    (b0, b1, b2), half_B, p_WB, radius_B = B
    p = (p_WA[0] - p_WB[0], p_WA[1] - p_WB[1], p_WA[2] - p_WB[2])
    r0 = (dot(a0, b0), dot(a0, b1), dot(a0, b2))
    r1 = (dot(a1, b0), dot(a1, b1), dot(a1, b2))
    r2 = (dot(a2, b0), dot(a2, b1), dot(a2, b2))
    c0 = (r0[0], r1[0], r2[0])
    c1 = (r0[1], r1[1], r2[1])
    c2 = (r0[2], r1[2], r2[2])
    p_A = (dot(p, a0), dot(p, a1), dot(p, a2))
    p_B = (dot(p, b0), dot(p, b1), dot(p, b2))
    size = magnitude(p[0]) + magnitude(p[1]) + magnitude(p[2])
    best = larger(
        _from_centre(p_B, half_A, (r0, r1, r2), half_B, radius_A, size),
        _from_centre(p_A, half_B, (c0, c1, c2), half_A, radius_B, size),
    )
    m0 = (magnitude(r0[0]), magnitude(r0[1]), magnitude(r0[2]))
    m1 = (magnitude(r1[0]), magnitude(r1[1]), magnitude(r1[2]))
    m2 = (magnitude(r2[0]), magnitude(r2[1]), magnitude(r2[2]))
    n0, n1, n2 = (m0[0], m1[0], m2[0]), (m0[1], m1[1], m2[1]), (m0[2], m1[2], m2[2])
    best = larger(_along_face(magnitude(p_A[0]), half_A[0], half_B, m0, radius_B), best)
    best = larger(_along_face(magnitude(p_A[1]), half_A[1], half_B, m1, radius_B), best)
    best = larger(_along_face(magnitude(p_A[2]), half_A[2], half_B, m2, radius_B), best)
    best = larger(_along_face(magnitude(p_B[0]), half_B[0], half_A, n0, radius_A), best)
    best = larger(_along_face(magnitude(p_B[1]), half_B[1], half_A, n1, radius_A), best)
    return larger(_along_face(magnitude(p_B[2]), half_B[2], half_A, n2, radius_A), best)
