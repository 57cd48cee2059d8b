"""From polygons in the frames of bodies to contact surfaces in the world, with their integrals.

Pressure is linear on a face. So with corners x_i, pressures p_i and area A of a triangle

    integral of p   = A / 3 (p_0 + p_1 + p_2)
    integral of x p = A / 12 (sum_i x_i p_i + (sum_i x_i) (sum_i p_i)),

and force and moment of a surface are exact, as is dividing a polygon about its centroid. Where
the pressure is negative, in a margin, the face is cut at zero pressure before it is integrated.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.cutting.clip import clip_by_values
from scene_graph_ros.geometry.cutting.polygons import POLYGON_CORNERS
from scene_graph_ros.geometry.hydroelastic.clipping import AREA, CENTROID, FIELD, NORMAL
from scene_graph_ros.geometry.loans import RoomLender
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    axpy,
    cross,
    dot,
    load_rotation,
    load_translation,
    load_vector,
    rotate,
    scale,
    store_vector,
    subtract,
)

__all__ = [
    "BEGIN",
    "END",
    "FLIPPED",
    "FRAME",
    "ROW_M",
    "ROW_N",
    "SURFACE_WIDTH",
    "SurfaceMemory",
    "integrate_pressure",
    "new_surface_memory",
    "place_polygons",
    "pressed",
    "world_gradients",
]

ROW_M, ROW_N, FRAME, FLIPPED, BEGIN, END = 0, 1, 2, 3, 4, 5
"""Columns of a surface: its rows, the row in whose frame the polygons are, whether the first body
is N instead of M, and which polygons it has."""
SURFACE_WIDTH = 6

_LEAST, _MOST = 1 << 14, 1 << 23
"""Doubles of an answer between which its memory is kept: less is not cleared by the system each
time, and the memory of more is given back to it."""


@lean_kernel
def integrate_pressure(polygon, pressures, count, normal):
    """Return the integrals of p and of x p over a polygon; p is linear on it, x counts from 0.

    Args:
        polygon: (8, 3) corners, counter-clockwise about the unit vector ``normal``.
        pressures: (8,) at the corners.
        count: corners.
        normal: unit vector.

    """
    a = load_vector(polygon, 0)
    u = subtract(load_vector(polygon, 1), a)
    total, moment = 0.0, (0.0, 0.0, 0.0)
    for k in range(2, count):
        v = subtract(load_vector(polygon, k), a)
        part = 0.5 * dot(normal, cross(u, v)) / 12.0
        p, q, r = pressures[0], pressures[k - 1], pressures[k]
        together = p + q + r
        total += 4.0 * part * together
        # x = a + u s + v t: the corners count from a, which is put back below.
        moment = axpy(part * (q + together), u, moment)
        moment = axpy(part * (r + together), v, moment)
        u = v
    return total, axpy(total, a, moment)


@lean_kernel
def pressed(polygon, pressures, count, normal, part, part_pressures):
    """Return the integrals of max(p, 0) and of x max(p, 0) over a polygon.

    ``part`` (8, 3) and ``part_pressures`` (8,) are scratch; the rest as ``integrate_pressure``.
    """
    low, high = pressures[0], pressures[0]
    for k in range(1, count):
        low, high = min(low, pressures[k]), max(high, pressures[k])
    if high <= 0.0:
        return 0.0, (0.0, 0.0, 0.0)
    if low >= 0.0:
        return integrate_pressure(polygon, pressures, count, normal)
    kept = clip_by_values(polygon, count, pressures, part)
    # The same rule gives the pressures at the new corners: what is cut off ends at zero.
    k, previous = 0, count - 1
    for i in range(count):
        if pressures[i] * pressures[previous] < 0.0:
            part_pressures[k] = 0.0
            k += 1
        if pressures[i] >= 0.0:
            part_pressures[k] = pressures[i]
            k += 1
        previous = i
    return integrate_pressure(part, part_pressures, kept, normal)


class _Cut(NamedTuple):
    """The polygons that bodies cut out of each other."""

    margin: NDArray[np.float64]
    """``(n,)`` metres."""
    X_WG: NDArray[np.float64]
    """``(n, 4, 4)``."""
    surfaces: NDArray[np.int64]
    """``(s, 6)``: see ``ROW_M``."""
    polygons: NDArray[np.float64]
    """Rows as in ``clipping``, in the frame of one of the bodies."""
    labels: NDArray[np.int64]
    """Theirs: how many corners, and the elements of the first and the second body."""


class _Columns(NamedTuple):
    """Those of ``Patches`` but the first, for s surfaces with v vertices and f faces."""

    totals: NDArray[np.float64]
    """``(s, 10)``: area (m^2), centroid (m), force (N) and moment about the centroid (N m)."""
    vertex_start: NDArray[np.int64]
    face_start: NDArray[np.int64]
    vertices_W: NDArray[np.float64]
    """``(v, 3)`` metres."""
    pressure: NDArray[np.float64]
    """``(v,)`` pascals."""
    corners: NDArray[np.int64]
    """``(f, 3)`` of triangles, else the first ``(f, 1)``; they count from the surface's first."""
    normals_W: NDArray[np.float64]
    areas: NDArray[np.float64]
    centroids_W: NDArray[np.float64]
    pressures: NDArray[np.float64]
    elements: NDArray[np.int64]
    """``(f, 2)``: of M and N."""


class _Scratch(NamedTuple):
    """One polygon with the pressures at its corners, and a part of it."""

    polygon: NDArray[np.float64]
    pressures: NDArray[np.float64]
    part: NDArray[np.float64]
    part_pressures: NDArray[np.float64]


@inlined_kernel
def _place_vertex(columns, v, X_WF, x, p):
    R_WF, p_WF = X_WF
    store_vector(columns.vertices_W, v, add(p_WF, rotate(R_WF, x)))
    columns.pressure[v] = p


@inlined_kernel
def _place_face(columns, f, X_WF, n, area, centroid, pressure, elements):
    R_WF, p_WF = X_WF
    store_vector(columns.normals_W, f, rotate(R_WF, n))
    columns.areas[f], columns.pressures[f] = area, pressure
    store_vector(columns.centroids_W, f, add(p_WF, rotate(R_WF, centroid)))
    columns.elements[f, 0], columns.elements[f, 1] = elements


@inlined_kernel
def _load_polygon(cut, row, flipped, has_margin, scratch):
    """Load a polygon's corners and their pressures; return (count, elements, n, c, p at c)."""
    polygons, labels = cut.polygons, cut.labels
    count, first, second = labels[row, 0], labels[row, 1], labels[row, 2]
    n = (polygons[row, NORMAL], polygons[row, NORMAL + 1], polygons[row, NORMAL + 2])
    g = (polygons[row, FIELD], polygons[row, FIELD + 1], polygons[row, FIELD + 2])
    c = (polygons[row, CENTROID], polygons[row, CENTROID + 1], polygons[row, CENTROID + 2])
    if flipped:
        n = scale(-1.0, n)
        first, second = second, first
    for k in range(count):
        i = 3 * (count - 1 - k) if flipped else 3 * k
        x = (polygons[row, i], polygons[row, i + 1], polygons[row, i + 2])
        p = dot(g, x) + polygons[row, FIELD + 3]
        # Without a margin no body has a negative pressure: that is rounding.
        scratch.pressures[k] = p if has_margin else max(p, 0.0)
        store_vector(scratch.polygon, k, x)
    p = dot(g, c) + polygons[row, FIELD + 3]
    return count, (first, second), n, c, (p if has_margin else max(p, 0.0))


@inlined_kernel
def _place_fan(columns, scratch, at, X_WF, face):
    """Place the triangles between a polygon's centroid, which is a vertex of theirs, and sides.

    ``at`` is its first vertex, as it is counted in all and in its surface, and its first triangle.
    """
    (v, local, f), (count, elements, n, c, p) = at, face
    _place_vertex(columns, v + count, X_WF, c, p)
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        d = subtract(load_vector(scratch.polygon, k), c)
        e = subtract(load_vector(scratch.polygon, following), c)
        columns.corners[f, 0], columns.corners[f, 1] = local + count, local + k
        columns.corners[f, 2] = local + following
        area, middle = 0.5 * dot(n, cross(d, e)), axpy(1.0 / 3.0, add(d, e), c)
        pressure = (p + scratch.pressures[k] + scratch.pressures[following]) / 3.0
        _place_face(columns, f, X_WF, n, area, middle, pressure, elements)
        f += 1


@inlined_kernel
def _place_polygon(columns, scratch, at, X_WF, area, face, triangles):
    """Place vertices and faces of a polygon; return how many there are of each."""
    (v, local, f), (count, elements, n, c, p) = at, face
    for k in range(count):
        x = load_vector(scratch.polygon, k)
        _place_vertex(columns, v + k, X_WF, x, scratch.pressures[k])
    if triangles and count > 3:
        _place_fan(columns, scratch, at, X_WF, face)
        return count + 1, count
    for k in range(3 if triangles else 1):
        columns.corners[f, k] = local + k
    _place_face(columns, f, X_WF, n, area, c, p, elements)
    return count, 1


@lean_kernel
def _place(cut, triangles, columns, scratch):
    """Fill the columns of all surfaces."""
    surfaces, totals = cut.surfaces, columns.totals
    v, f = 0, 0
    for s in range(len(surfaces)):
        columns.vertex_start[s], columns.face_start[s] = v, f
        X_WF = (
            load_rotation(cut.X_WG, surfaces[s, FRAME]),
            load_translation(cut.X_WG, surfaces[s, FRAME]),
        )
        flipped = surfaces[s, FLIPPED] != 0
        margins = cut.margin[surfaces[s, ROW_M]], cut.margin[surfaces[s, ROW_N]]
        total_area, area_moment = 0.0, (0.0, 0.0, 0.0)
        force, moment = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for row in range(surfaces[s, BEGIN], surfaces[s, END]):
            face = _load_polygon(cut, row, flipped, max(margins[0], margins[1]) > 0.0, scratch)
            count, _, n, c, _ = face
            total, x_total = pressed(
                scratch.polygon, scratch.pressures, count, n, scratch.part, scratch.part_pressures
            )
            force = axpy(total, n, force)
            moment = add(moment, cross(x_total, n))
            area = cut.polygons[row, AREA]
            total_area += area
            area_moment = axpy(area, c, area_moment)
            at = v, v - columns.vertex_start[s], f
            vertices, faces = _place_polygon(columns, scratch, at, X_WF, area, face, triangles)
            v, f = v + vertices, f + faces
        centre = scale(1.0 / total_area, area_moment)
        moment = subtract(moment, cross(centre, force))
        R_WF, p_WF = X_WF
        totals[s, 0] = total_area
        for axis in range(3):
            totals[s, 1 + axis] = add(p_WF, rotate(R_WF, centre))[axis]
            totals[s, 4 + axis] = rotate(R_WF, force)[axis]
            totals[s, 7 + axis] = rotate(R_WF, moment)[axis]
    columns.vertex_start[len(surfaces)], columns.face_start[len(surfaces)] = v, f


@lean_kernel
def _sizes(surfaces, labels, triangles):
    """Return the numbers of vertices and faces of the surfaces."""
    v, f = 0, 0
    for s in range(len(surfaces)):
        for row in range(surfaces[s, BEGIN], surfaces[s, END]):
            count = labels[row, 0]
            is_fan = triangles and count > 3
            v += count + 1 if is_fan else count
            f += count if is_fan else 1
    return v, f


SurfaceMemory = RoomLender[tuple[NDArray[np.float64]]]
"""Memory of the columns of vertices and faces, all in one array."""


def new_surface_memory() -> SurfaceMemory:
    """Return memory that is lent again when nobody looks at the surfaces in it any more."""
    return RoomLender(lambda count, memory: (memory(count),), _LEAST, _MOST)


def _new_columns(s: int, v: int, f: int, triangles: bool, memory: SurfaceMemory) -> _Columns:
    """Return the columns of s surfaces with v vertices and f faces, with nothing in them."""
    widths = (3, 1), (3 if triangles else 1, 3, 1, 3, 1, 2)
    (room,) = memory.take(v * sum(widths[0]) + f * sum(widths[1]))
    parts, end = [], 0
    for rows, of_rows in zip((v, f), widths, strict=True):
        for width in of_rows:
            begin, end = end, end + rows * width
            parts.append(room[begin:end])
    vertices, pressure, corners, normals, areas, centroids, pressures, elements = parts
    return _Columns(
        np.empty((s, 10)),
        np.empty(s + 1, np.int64),
        np.empty(s + 1, np.int64),
        vertices.reshape(v, 3),
        pressure,
        corners.view(np.int64).reshape(f, widths[1][0]),
        normals.reshape(f, 3),
        areas,
        centroids.reshape(f, 3),
        pressures,
        elements.view(np.int64).reshape(f, 2),
    )


def place_polygons(
    margin: NDArray[np.float64],
    X_WG: NDArray[np.float64],
    surfaces: NDArray[np.int64],
    polygons: NDArray[np.float64],
    labels: NDArray[np.int64],
    triangles: bool,
    memory: SurfaceMemory,
) -> tuple[NDArray[Any], ...]:
    """Return the columns of ``Patches``.

    Args:
        margin: (n,) metres.
        X_WG: (n, 4, 4).
        surfaces: (s, 6) as in this module.
        polygons: rows as in ``clipping``.
        labels: theirs, as there.
        triangles: whether to divide them.
        memory: for the columns of vertices and faces.

    """
    v, f = _sizes(surfaces, labels, triangles)
    columns = _new_columns(len(surfaces), v, f, triangles, memory)
    scratch = _Scratch(
        np.empty((POLYGON_CORNERS, 3)),
        np.empty(POLYGON_CORNERS),
        np.empty((POLYGON_CORNERS, 3)),
        np.empty(POLYGON_CORNERS),
    )
    _place(_Cut(margin, X_WG, surfaces, polygons, labels), triangles, columns, scratch)
    return (surfaces[:, :2].copy(), *columns)


@lean_kernel
def world_gradients(gradients, elements, side, face_start, R_W, result):
    """Write the pressure gradients of one side of all faces, zero where it is rigid.

    Args:
        gradients: (E, 3) of the elements, in their frames.
        elements: (f, 2).
        side: 0 for M, 1 for N.
        face_start: (s + 1,).
        R_W: (s, 4, 4) poses of that side's bodies.
        result: (f, 3).

    """
    for s in range(len(face_start) - 1):
        R = load_rotation(R_W, s)
        for f in range(face_start[s], face_start[s + 1]):
            e = elements[f, side]
            g = (0.0, 0.0, 0.0)
            if e >= 0:
                g = rotate(R, load_vector(gradients, e))
            store_vector(result, f, g)
