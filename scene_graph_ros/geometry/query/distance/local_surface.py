"""The shape of a surface around one point of it, to first order: how its point follows its normal.

In each of two principal directions, a point of the surface moves by ``w`` when its normal turns
by ``s``: (r, 1) where the radius of curvature is r, (0, 1) across an edge and (L, 0) along an
edge or in a face, L being any length. A surface has no such description at a kink: where a face
ends at its edge, a cap at its side.
"""

import math

from scene_graph_ros.geometry.compiled.dispatch import by_kind
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.features import curved_support, SMOOTH
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.point.point_mesh import border_feature, nearest_triangle
from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind
from scene_graph_ros.geometry.spatial.vectors import (
    any_orthogonal,
    axpy,
    cross,
    dot,
    load_rotation,
    load_vector,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import KINK

__all__ = ["local_surfaces"]

# Every description is (is smooth, first direction, w0, s0, w1, s1); the second is m x first.


@lean_kernel
def _vertex(m, is_smooth):
    return is_smooth, any_orthogonal(m), 0.0, 1.0, 0.0, 1.0


@lean_kernel
def _edge(m, e, size, is_smooth):
    return is_smooth, unit(axpy(-dot(e, m), m, e), any_orthogonal(m)), size, 0.0, 0.0, 1.0


@lean_kernel
def _face(m, size, is_smooth):
    return is_smooth, any_orthogonal(m), size, 0.0, size, 0.0


@lean_kernel
def _round(m, radius):
    return True, any_orthogonal(m), radius, 1.0, radius, 1.0


@lean_kernel
def _capsule(size, p, m):
    z = p[2] - size[0] * m[2]
    if size[1] - abs(z) <= KINK * size[1]:
        # On a cap; the side begins where the normal is at a right angle to the axis.
        _, t, w0, s0, w1, s1 = _round(m, size[0])
        return abs(m[2]) > KINK, t, w0, s0, w1, s1
    return True, (0.0, 0.0, 1.0), size[1], 0.0, size[0], 1.0


@lean_kernel
def _box(size, p, m):
    count, free, is_smooth = 0, 0, True
    for k in range(3):
        if abs(m[k]) <= KINK:
            count += 1
            is_smooth = is_smooth and size[k] - abs(p[k]) > KINK * size[k]
            free = k
    if count == 0:
        return _vertex(m, True)
    largest = max(size[0], size[1], size[2])
    if count == 2:
        return _face(m, largest, is_smooth)
    e = (
        1.0 if free == 0 else 0.0,
        1.0 if free == 1 else 0.0,
        1.0 if free == 2 else 0.0,
    )
    return _edge(m, e, largest, is_smooth)


@lean_kernel
def _cylinder(size, p, m):
    radial = math.sqrt(m[0] * m[0] + m[1] * m[1])
    if abs(m[2]) <= KINK:
        is_smooth = size[1] - abs(p[2]) > KINK * size[1]
        return is_smooth, (0.0, 0.0, 1.0), size[1], 0.0, size[0], 1.0
    if radial <= KINK:
        reach = math.sqrt(p[0] * p[0] + p[1] * p[1])
        return _face(m, size[0], size[0] - reach > KINK * size[0])
    # A rim: along it the radius is seen foreshortened, across it is an edge.
    t = (-m[1] / radial, m[0] / radial, 0.0)
    return True, t, size[0] / radial, 1.0, 0.0, 1.0


@lean_kernel
def _half_angle(x, y):
    """Return cosine and sine of half the angle of (x, y), by roots alone.

    Those are rounded alike on every processor, which libraries' sines are not.
    """
    length = math.sqrt(x * x + y * y)
    if length == 0.0:
        return 1.0, 0.0
    larger = math.sqrt(0.5 * (1.0 + abs(x) / length))
    smaller = 0.5 * abs(y) / (length * larger)
    c, s = (larger, smaller) if x >= 0.0 else (smaller, larger)
    return c, math.copysign(s, y)


@inlined_kernel
def _ellipsoid(core, m):
    t = any_orthogonal(m)
    u = cross(m, t)
    _, tt, tu, uu = curved_support(
        (SMOOTH, ORIGIN, ORIGIN, 0.0, 0.0, 0.0), core, IDENTITY, m, t, u
    )
    c, s = _half_angle(tt - uu, 2.0 * tu)
    first = axpy(s, u, scale(c, t))
    w0 = c * c * tt + 2.0 * c * s * tu + s * s * uu
    return True, first, w0, 1.0, tt + uu - w0, 1.0


@inlined_kernel
def _hull(hulls, k, size, p, m):
    first, last = hulls.vertex_start[k], hulls.vertex_start[k + 1]
    highest = -math.inf
    for v in range(first, last):
        highest = max(highest, dot(load_vector(hulls.vertices, v), m))
    count, a, b = 0, first, first
    for v in range(first, last):
        if highest - dot(load_vector(hulls.vertices, v), m) <= KINK * size:
            a, b = b, v
            count += 1
    if count == 1:
        return _vertex(m, True)
    if count == 2:
        start, end = load_vector(hulls.vertices, a), load_vector(hulls.vertices, b)
        e = subtract(end, start)
        length = norm(e)
        s = dot(e, subtract(p, start)) / length
        is_smooth = KINK * size < s < length - KINK * size
        return _edge(m, scale(1.0 / length, e), size, is_smooth)
    is_smooth = False
    for f in range(hulls.face_start[k], hulls.face_start[k + 1]):
        if 1.0 - dot(load_vector(hulls.face_normals, f), m) <= KINK * KINK:
            is_smooth = True
            start, end = hulls.face_vertex_start[f], hulls.face_vertex_start[f + 1]
            before = load_vector(hulls.vertices, hulls.face_vertices[end - 1])
            for slot in range(start, end):
                corner = load_vector(hulls.vertices, hulls.face_vertices[slot])
                e = subtract(corner, before)
                inside = dot(cross(m, e), subtract(p, before))
                is_smooth = is_smooth and inside > KINK * size * norm(e)
                before = corner
    return _face(m, size, is_smooth)


@inlined_kernel
def _mesh(surfaces, k, size, p, m):
    _, triangle, _, _ = nearest_triangle(surfaces, k, p, math.inf, KINK * size, size, 0.0)
    n = load_vector(surfaces.normals, triangle)
    a = load_vector(surfaces.vertices, surfaces.triangles[triangle, 0])
    b = load_vector(surfaces.vertices, surfaces.triangles[triangle, 1])
    c = load_vector(surfaces.vertices, surfaces.triangles[triangle, 2])
    along = 1.0 - abs(dot(n, m)) <= KINK * KINK
    feature = border_feature(p, a, b, c, KINK * size)
    if feature == 0:
        is_smooth = along and abs(dot(n, subtract(p, a))) <= KINK * size
        return _face(m, size, is_smooth)
    if feature > 3:
        corner = load_vector(
            surfaces.vertex_pseudonormals, surfaces.triangles[triangle, feature - 4]
        )
        if 1.0 - dot(corner, n) <= KINK * KINK:
            return _face(m, size, along)
        return _vertex(m, not along)
    pseudonormals = surfaces.edge_pseudonormals
    mean = (
        pseudonormals[triangle, feature - 1, 0],
        pseudonormals[triangle, feature - 1, 1],
        pseudonormals[triangle, feature - 1, 2],
    )
    if 1.0 - dot(mean, n) <= KINK * KINK:
        return _face(m, size, along)
    other = axpy(2.0 * dot(mean, n), mean, scale(-1.0, n))
    e = subtract(b, a) if feature == 1 else (subtract(c, b) if feature == 2 else subtract(a, c))
    is_smooth = not along and 1.0 - abs(dot(other, m)) > KINK * KINK
    return _edge(m, scale(1.0 / norm(e), e), size, is_smooth)


@inlined_kernel
def _sphere_of_row(size, m):
    return _round(m, size[0])


@inlined_kernel
def _ellipsoid_of_row(table, i, m):
    return _ellipsoid(core_of(table, i), m)


@inlined_kernel
def _half_space_of_row(m):
    return _face(m, 1.0, True)


@inlined_kernel
def _hull_of_row(table, i, p, m):
    return _hull(table.hulls, table.hull[i], table.scale[i], p, m)


@inlined_kernel
def _mesh_of_row(table, i, p, m):
    if table.exact[i]:
        return _mesh(table.surfaces, table.surface[i], table.scale[i], p, m)
    return _hull_of_row(table, i, p, m)


@inlined_kernel
def _size(table, i):
    return load_vector(table.size, i)


@by_kind(
    inlined_kernel,
    ["table.kind[i]"],
    every_kind(
        "surfaces around a point",
        {
            ShapeKind.SPHERE: _sphere_of_row,
            ShapeKind.CAPSULE: _capsule,
            ShapeKind.BOX: _box,
            ShapeKind.CYLINDER: _cylinder,
            ShapeKind.ELLIPSOID: _ellipsoid_of_row,
            ShapeKind.HALF_SPACE: _half_space_of_row,
            ShapeKind.CONVEX: _hull_of_row,
            ShapeKind.MESH: _mesh_of_row,
        },
    ),
    given={"size": _size},
)
def _local_surface(table, i, p, m):
    """Return the description of row i's surface at its point p with the outward normal m."""


@lean_kernel
def local_surfaces(table, X_WG, rows, p_GCs, m_Ws, is_smooth, first_W, turns):
    """Describe the surfaces of rows (k,) at points (k, 3) in G with outward normals (k, 3) in W.

    Writes ``is_smooth`` (k,), the first principal direction ``first_W`` (k, 3) and ``turns``
    (k, 4): w0, s0, w1, s1. The second direction is m x first.
    """
    for k in range(rows.shape[0]):
        R_WG = load_rotation(X_WG, rows[k])
        m = rotate_inverse(R_WG, load_vector(m_Ws, k))
        smooth, first, w0, s0, w1, s1 = _local_surface(table, rows[k], load_vector(p_GCs, k), m)
        first = rotate(R_WG, first)
        is_smooth[k] = smooth
        first_W[k, 0], first_W[k, 1], first_W[k, 2] = first
        turns[k, 0], turns[k, 1], turns[k, 2], turns[k, 3] = w0, s0, w1, s1
