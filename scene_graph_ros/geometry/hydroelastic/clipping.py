"""Contact polygons of pairs of elements: where they are, before anything is placed in the world.

Polygons go into a ``Work``, which kernels also work in.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.cutting.clip import (
    clip_by_half_space,
    clip_by_tetrahedron,
    drop_short_edges,
    measure,
    planes_that_cut,
    side_mask,
    slice_tetrahedron,
    snapped,
)
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    dot,
    load_vector,
    norm,
    rotate,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tolerances import EQUAL_FIELDS, PRESSURE_DIRECTION

__all__ = [
    "AREA",
    "BOX",
    "CENTROID",
    "COUNT",
    "FIELD",
    "FULL",
    "MOVED_WIDTH",
    "NORMAL",
    "SURFACES",
    "WIDTH",
    "Work",
    "add_cut_by_level",
    "add_triangle",
    "cut_by_plane",
    "cut_by_slab",
    "cut_triangle_by_slab",
    "meet_triangle",
    "move_element",
    "pressure_grows_along",
    "slice_by_level",
]

NORMAL, FIELD, AREA, CENTROID, WIDTH = 24, 27, 31, 32, 35
"""Where a row of polygons has what, and how long it is."""
COUNT, FULL, SURFACES = 0, 1, 2
"""Where ``Work.counts`` has what."""
MOVED_WIDTH = 38
"""What is kept of an element that was moved into another frame: x, y and z of its corners (12);
gradient and constant of its pressure, or plane of a triangle (4); centre and half extents of its
box (6); planes of a tetrahedron as in the table (16)."""
BOX, _PLANES = 16, 22


class Work(NamedTuple):
    """Contact polygons so far, and scratch arrays."""

    moved: NDArray[np.float64]
    """(MOVED_WIDTH,) an element that was moved into another frame."""
    buffer: NDArray[np.float64]
    """A ``polygon_buffer``: two polygons, the first of them what is to be cut."""
    heights: NDArray[np.float64]
    """(8,) those of a polygon's corners above a plane."""
    polygons: NDArray[np.float64]
    """(P, WIDTH) a row each: up to eight corners, the unit normal into the pair's first body, the
    pressure as gradient and constant, the area, the centroid."""
    labels: NDArray[np.int64]
    """(P, 3) number of corners, elements of the first and the second body (-1: of none)."""
    counts: NDArray[np.int64]
    """(3,) how many polygons there are, whether there was no room for one, surfaces."""


@lean_kernel
def move_element(elements, planes, e, is_triangle, R_AB, p_AB, moved):
    """Write element e of B, in A, into ``moved``."""
    low, high = (math.inf, math.inf, math.inf), (-math.inf, -math.inf, -math.inf)
    x = (0.0, 0.0, 0.0)
    for k in range(4):
        x = add(rotate(R_AB, (elements[e, k], elements[e, 4 + k], elements[e, 8 + k])), p_AB)
        moved[k], moved[4 + k], moved[8 + k] = x
        low = (min(low[0], x[0]), min(low[1], x[1]), min(low[2], x[2]))
        high = (max(high[0], x[0]), max(high[1], x[1]), max(high[2], x[2]))
    for axis in range(3):
        moved[BOX + axis] = 0.5 * (low[axis] + high[axis])
        moved[BOX + 3 + axis] = 0.5 * (high[axis] - low[axis])
    g = rotate(R_AB, (elements[e, 16], elements[e, 17], elements[e, 18]))
    moved[12], moved[13], moved[14] = g
    if is_triangle:
        moved[15] = -dot(g, x)
        return
    moved[15] = elements[e, 19] - dot(g, p_AB)
    for k in range(4):
        n = rotate(R_AB, (planes[e, k], planes[e, 4 + k], planes[e, 8 + k]))
        moved[_PLANES + k], moved[_PLANES + 4 + k], moved[_PLANES + 8 + k] = n
        moved[_PLANES + 12 + k] = planes[e, 12 + k] - dot(n, p_AB)


@lean_kernel
def _keep(polygon, count, normal, field, elements, narrow, work):
    """Add a polygon of two elements (first, second), unless it is narrower than ``narrow`` (m)."""
    polygons, labels, counts = work.polygons, work.labels, work.counts
    count = drop_short_edges(polygon, count, narrow)
    if count == 0:
        return
    area, centroid = measure(polygon, count, normal)
    around = 0.0
    x = load_vector(polygon, count - 1)
    for k in range(count):
        y = load_vector(polygon, k)
        d = subtract(y, x)
        around += math.sqrt(dot(d, d))
        x = y
    if not area > 0.5 * narrow * around:
        return
    row = counts[COUNT]
    if row == len(labels):
        counts[FULL] = 1
        return
    counts[COUNT] = row + 1
    for k in range(count):
        for axis in range(3):
            polygons[row, 3 * k + axis] = polygon[k, axis]
    for axis in range(3):
        polygons[row, NORMAL + axis] = normal[axis]
        polygons[row, CENTROID + axis] = centroid[axis]
    for k in range(4):
        polygons[row, FIELD + k] = field[k]
    polygons[row, AREA] = area
    labels[row, 0], labels[row, 1], labels[row, 2] = count, elements[0], elements[1]


@lean_kernel
def pressure_grows_along(n, n_squared, g):
    """Tell whether g is within the accepted angle of n, whose square is ``n_squared``."""
    along = dot(n, g)
    if along >= 0.0:
        return True
    limit = PRESSURE_DIRECTION * PRESSURE_DIRECTION
    return along * along <= limit * n_squared * dot(g, g)


@lean_kernel
def _lay_triangle(corners, polygon):
    """Write three corners, given as x, y and z of four, as rows of a polygon."""
    for k in range(3):
        for axis in range(3):
            polygon[k, axis] = corners[4 * axis + k]


@lean_kernel
def _values(corners, g, c):
    """Return g . x + c at four corners, given as their x, y and z."""
    return (
        g[0] * corners[0] + g[1] * corners[4] + g[2] * corners[8] + c,
        g[0] * corners[1] + g[1] * corners[5] + g[2] * corners[9] + c,
        g[0] * corners[2] + g[1] * corners[6] + g[2] * corners[10] + c,
        g[0] * corners[3] + g[1] * corners[7] + g[2] * corners[11] + c,
    )


@lean_kernel
def _excess(element, g, c):
    """Return the pressures at the corners of a tetrahedron, less the field g . x + c."""
    q = _values(element, g, c)
    return (element[12] - q[0], element[13] - q[1], element[14] - q[2], element[15] - q[3])


@lean_kernel
def _all_snapped(f, slack):
    return (
        snapped(f[0], slack), snapped(f[1], slack), snapped(f[2], slack), snapped(f[3], slack)
    )  # fmt: skip


@lean_kernel
def _lowest(f):
    return min(min(f[0], f[1]), min(f[2], f[3]))


@lean_kernel
def _highest(f):
    return max(max(f[0], f[1]), max(f[2], f[3]))


@inlined_kernel
def slice_by_level(elements, a, b, moved, slack, polygon):
    """Cut tetrahedron a where p_A = p_B, and mark the faces of b that cut it. In A.

    Most pairs of elements end here.

    Args:
        elements: those of the table.
        a: the element of A, the first body.
        b: the element of B.
        moved: the latter in A, as in ``pairs``.
        slack: metres.
        polygon: (8, 3) filled with the cut.

    Returns:
        (count, cutting): its corners and ``planes_that_cut``, -1 if nothing of it counts.

    """
    g_A = (elements[a, 16], elements[a, 17], elements[a, 18])
    g_B = (moved[12], moved[13], moved[14])
    n = subtract(g_A, g_B)
    f = _excess(elements[a], g_B, moved[15])
    # The sum of magnitudes is no shorter than n: nothing is lost before the exact test.
    loose = slack * (abs(n[0]) + abs(n[1]) + abs(n[2]))
    if _lowest(f) >= 0.0 or _highest(f) < -loose:
        return 0, -1
    q = _values(moved, g_A, elements[a, 19])
    h = (
        q[0] - elements[b, 12],
        q[1] - elements[b, 13],
        q[2] - elements[b, 14],
        q[3] - elements[b, 15],
    )
    tie = slack * norm(n)
    if _lowest(h) >= -tie or _highest(h) < -tie:
        return 0, -1
    f = _all_snapped(f, tie)
    mask = side_mask(f)
    if mask in (0, 15):
        return 0, -1
    count = slice_tetrahedron(elements[a], f, mask, polygon)
    return count, planes_that_cut(polygon, count, n, moved[_PLANES:], slack)


@lean_kernel
def add_cut_by_level(elements, a, b, count, cutting, slack, narrow, work):
    """Add the part of p_A = p_B inside two tetrahedra, in A.

    Args:
        elements: as for ``slice_by_level``.
        a: the same.
        b: the same.
        count: its answer, with
        cutting: which is not -1.
        slack: metres.
        narrow: metres.
        work: b is in ``moved``, the cut in the first half of ``buffer``.

    """
    moved, buffer = work.moved, work.buffer
    g_A = (elements[a, 16], elements[a, 17], elements[a, 18])
    g_B = (moved[12], moved[13], moved[14])
    n = subtract(g_A, g_B)
    squared, A_squared, B_squared = dot(n, n), dot(g_A, g_A), dot(g_B, g_B)
    if squared <= EQUAL_FIELDS * EQUAL_FIELDS * max(A_squared, B_squared):
        return
    if not pressure_grows_along(n, squared, g_A):
        return
    if not pressure_grows_along(scale(-1.0, n), squared, g_B):
        return
    side, count = clip_by_tetrahedron(
        buffer, count, n, moved[_PLANES:], cutting, slack, work.heights
    )
    if count == 0:
        return
    # The flatter field is the one that rounding of positions moves less.
    field = (g_A[0], g_A[1], g_A[2], elements[a, 19])
    if B_squared < A_squared:
        field = (g_B[0], g_B[1], g_B[2], moved[15])
    normal = scale(1.0 / math.sqrt(squared), n)
    _keep(buffer[side], count, normal, field, (a, b), narrow, work)


@inlined_kernel
def meet_triangle(elements, planes, a, moved, slack, polygon):
    """Mark the faces of tetrahedron a that cut a triangle, in the tetrahedron's frame A.

    Args:
        elements: those of the table.
        planes: those of the table.
        a: the element of A.
        moved: the triangle in A and, at 12, its plane: the outward unit normal and an offset.
        slack: metres.
        polygon: (8, 3) filled with the triangle.

    Returns:
        ``planes_that_cut``, -1 if nothing of it counts.

    """
    n = (moved[12], moved[13], moved[14])
    f = _values(elements[a], n, moved[15])
    if _lowest(f) >= -slack or _highest(f) < -slack:
        return -1
    _lay_triangle(moved, polygon)
    return planes_that_cut(polygon, 3, n, planes[a], slack)


@lean_kernel
def add_triangle(elements, planes, a, b, cutting, slack, narrow, work):
    """Add the part of rigid triangle b inside tetrahedron a, in A.

    The triangle is in ``moved`` and in the first half of ``buffer``, and ``cutting`` is the
    answer of ``meet_triangle`` about it, not -1. The rest is as for ``add_cut_by_level``.
    """
    moved, buffer = work.moved, work.buffer
    n = (moved[12], moved[13], moved[14])
    g = (elements[a, 16], elements[a, 17], elements[a, 18])
    if not pressure_grows_along(n, 1.0, g):
        return
    side, count = clip_by_tetrahedron(buffer, 3, n, planes[a], cutting, slack, work.heights)
    if count > 0:
        field = (g[0], g[1], g[2], elements[a, 19])
        _keep(buffer[side], count, n, field, (a, b), narrow, work)


@lean_kernel
def cut_by_plane(elements, a, plane, slack, narrow, work):
    """Add the cut of a tetrahedron with the boundary of a rigid half space.

    ``plane`` is (n, offset), n . x + offset = 0, in the tetrahedron's frame A; n is the outward
    unit normal of the half space.
    """
    n, offset = plane
    polygon = work.buffer[0]
    f = _all_snapped(_values(elements[a], n, offset), slack)
    mask = side_mask(f)
    if mask in (0, 15):
        return
    count = slice_tetrahedron(elements[a], f, mask, polygon)
    field = (elements[a, 16], elements[a, 17], elements[a, 18], elements[a, 19])
    _keep(polygon, count, n, field, (a, -1), narrow, work)


@lean_kernel
def cut_by_slab(elements, a, slab, field_B, plane, slack, narrow, work):
    """Add the part of p_A = p_B in a tetrahedron of A and a compliant half space B, in A.

    ``slab`` is the half space's element, ``field_B`` its pressure (g, c), g . x + c, and ``plane``
    is (n, offset): n its outward unit normal and n . x + offset <= 0 what it fills, its margin
    included. All in A.
    """
    (g_B, c_B), (n, offset), buffer = field_B, plane, work.buffer
    g_A = (elements[a, 16], elements[a, 17], elements[a, 18])
    f = _excess(elements[a], g_B, c_B)
    d = subtract(g_A, g_B)
    squared = dot(d, d)
    length = math.sqrt(squared)
    f = _all_snapped(f, slack * length)
    mask = side_mask(f)
    if mask in (0, 15):
        return
    A_squared, B_squared = dot(g_A, g_A), dot(g_B, g_B)
    if squared <= EQUAL_FIELDS * EQUAL_FIELDS * max(A_squared, B_squared):
        return
    if not pressure_grows_along(d, squared, g_A):
        return
    if not pressure_grows_along(scale(-1.0, d), squared, g_B):
        return
    normal = scale(1.0 / length, d)
    count = slice_tetrahedron(elements[a], f, mask, buffer[0])
    side, count = clip_by_half_space(
        buffer, 0, count, normal, scale(-1.0, n), -offset, slack, work.heights
    )
    if count == 0:
        return
    if A_squared < B_squared:
        field = (g_A[0], g_A[1], g_A[2], elements[a, 19])
    else:
        field = (g_B[0], g_B[1], g_B[2], c_B)
    _keep(buffer[side], count, normal, field, (a, slab), narrow, work)


@lean_kernel
def cut_triangle_by_slab(elements, t, slab, field, plane, slack, narrow, work):
    """Add the part of a rigid triangle in a compliant half space, in the triangle's frame B.

    ``slab`` is the half space's element, ``field`` its pressure, four numbers, and ``plane`` as
    for ``cut_by_slab``. The law of its pressure goes on below the slab. All in B; the half space
    is the first body.
    """
    (n, offset), buffer = plane, work.buffer
    normal = (elements[t, 16], elements[t, 17], elements[t, 18])
    if not pressure_grows_along(normal, 1.0, (field[0], field[1], field[2])):
        return
    _lay_triangle(elements[t], buffer[0])
    side, count = clip_by_half_space(
        buffer, 0, 3, normal, scale(-1.0, n), -offset, slack, work.heights
    )
    if count > 0:
        _keep(buffer[side], count, normal, field, (slab, t), narrow, work)
