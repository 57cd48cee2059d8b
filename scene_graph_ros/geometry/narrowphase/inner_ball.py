"""The largest ball inside of a core that touches its surface at a known point.

Where A and B overlap by the depth d along n, the balls in A and B that touch the surfaces at the
two witnesses have their centres on one line. With radii r and s, the Minkowski difference
C = {a - b} contains a ball of radius r + s around a point r + s - d from the origin; so no
direction offers a way out shorter than d as soon as r + s >= d. That proves a depth to be the
least of all, with no search for others.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    HULL,
    IDENTITY,
    ORIGIN,
)
from scene_graph_ros.geometry.spatial.vectors import (
    cross,
    dot,
    norm,
    rotate_inverse,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tables.hull_blocks import face_range, FACE_STRIDE
from scene_graph_ros.geometry.tolerances import INNER_BALL_SPARE, PARALLEL, SAME_DIRECTION

__all__ = ["inner_radius", "is_least_depth"]


@lean_kernel
def _ball_in_hull(hulls, hull, q, m):
    radius, spare = math.inf, 0.0
    is_on_face = False
    first, last = face_range(hulls, hull)
    for f in range(first, last, FACE_STRIDE):
        n = (hulls[f], hulls[f + 1], hulls[f + 2])
        cosine = dot(n, m)
        if cosine > SAME_DIRECTION and norm(cross(n, m)) <= PARALLEL:
            is_on_face = True
            continue
        spare = hulls[f + 3] - dot(n, q)
        if spare < radius * (1.0 - cosine):
            radius = spare / (1.0 - cosine)
    return radius if is_on_face else 0.0


@lean_kernel
def _ball_in_box(h, q, m):
    x, y, z = abs(m[0]), abs(m[1]), abs(m[2])
    spare_x, spare_y, spare_z = h[0] - abs(q[0]), h[1] - abs(q[1]), h[2] - abs(q[2])
    if x + y <= PARALLEL:
        return min(h[2], spare_x, spare_y)
    if x + z <= PARALLEL:
        return min(h[1], spare_x, spare_z)
    if y + z <= PARALLEL:
        return min(h[0], spare_y, spare_z)
    return 0.0


@lean_kernel
def _ball_in_cylinder(h, q, m):
    if abs(m[2]) <= PARALLEL:
        return min(h[0], h[1] - abs(q[2]))
    if abs(m[0]) + abs(m[1]) <= PARALLEL:
        return min(h[1], h[0] - math.sqrt(q[0] * q[0] + q[1] * q[1]))
    return 0.0


@lean_kernel
def inner_radius(core, R, p, hulls, q, m):
    """Return the radius (m) of the largest ball in a core that touches its surface at q.

    m is the core's unit outward normal at q. 0 where the surface has an edge or a corner.
    """
    kind, h = core[0], core[3]
    m = rotate_inverse(R, m)
    if kind == ELLIPSOID:
        # q is the point of the surface nearest to x = q (1 + t / axes^2), t >= -least axis^2.
        least = min(h[0], h[1], h[2])
        return least * least / norm((h[0] * m[0], h[1] * m[1], h[2] * m[2]))
    q = rotate_inverse(R, subtract(q, p))
    if kind == BOX:
        return _ball_in_box(h, q, m)
    if kind == CYLINDER:
        return _ball_in_cylinder(h, q, m)
    if kind == HULL:
        return _ball_in_hull(hulls, core[1], q, m)
    return 0.0


@lean_kernel
def is_least_depth(core_A, core_B, R, p, hulls, a, b, n, depth, size):
    """Tell whether inner balls prove that no direction but n has a depth as small.

    a, b, n, depth: witnesses and unit normal out of B into A of cores that overlap (m).
    """
    needed = depth + INNER_BALL_SPARE * size
    found = inner_radius(core_A, IDENTITY, ORIGIN, hulls, a, scale(-1.0, n))
    return found > needed or found + inner_radius(core_B, R, p, hulls, b, n) > needed
