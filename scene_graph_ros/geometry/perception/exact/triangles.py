"""Triangles in front of a camera, without gaps between them.

For each ray, the corners are sheared so that the ray is the z axis: ``(X - x Z, Y - y Z)``. It
meets a triangle where 0 is in the sheared one, which the signs of three products of two by two
tell (S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013). The
difference of two rounded products never has the wrong sign, and where it is 0 the edge belongs to
both triangles: so no ray slips between triangles that share corners, at an edge or at a corner.
No triangle is clipped; depths are compared ray by ray.
"""

import numpy as np

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_lanes, select
from scene_graph_ros.geometry.compiled.places import LAST_PLACE
from scene_graph_ros.geometry.compiled.vector_width import use_widest_vectors
from scene_graph_ros.geometry.perception.exact.bodies import element
from scene_graph_ros.geometry.perception.exact.screen import keep_nearest, pixels
from scene_graph_ros.geometry.spatial.vectors import cross, dot, rotate, subtract

__all__ = ["CORNER", "draw_triangles"]

CORNER = 5
"""Numbers that are kept of a corner: X, Y, Z in the camera's frame, and the pixel (u, v)."""

_ROUNDING = 1e-14
"""Of coordinates: more than rounding moves the point where a side meets a plane."""


@inlined_kernel
def _place_corners(sensor, bodies, first, count, R_SG, p_SG, corners):
    """Write the corners of a mesh as the camera sees them; those not ahead have no pixel."""
    near = sensor.clipping[0]
    fx, fy = sensor.focal
    cx, cy = sensor.center
    for k in range(count):
        at = (first + k) & LAST_PLACE
        p_GV = (bodies.vertices[at, 0], bodies.vertices[at, 1], bodies.vertices[at, 2])
        p = rotate(R_SG, p_GV)
        x, y, z = p[0] + p_SG[0], p[1] + p_SG[1], p[2] + p_SG[2]
        corners[k, 0], corners[k, 1], corners[k, 2] = x, y, z
        if z >= near:
            corners[k, 3], corners[k, 4] = fx * (x / z) + cx, fy * (y / z) + cy
        else:
            corners[k, 3], corners[k, 4] = np.nan, np.nan


@inlined_kernel
def _corner(corners, k):
    k &= LAST_PLACE
    return (corners[k, 0], corners[k, 1], corners[k, 2])


@lean_kernel
def _cut_box(sensor, a, b, c):
    """Return the pixels that can see a triangle that crosses the near plane."""
    near = sensor.clipping[0]
    fx, fy = sensor.focal
    cx, cy = sensor.center
    u_low, u_high, v_low, v_high = np.inf, -np.inf, np.inf, -np.inf
    for side in range(3):
        p, q = ((a, b), (b, c), (c, a))[side]
        if p[2] >= near:
            u, v = fx * (p[0] / p[2]) + cx, fy * (p[1] / p[2]) + cy
            u_low, u_high = min(u_low, u), max(u_high, u)
            v_low, v_high = min(v_low, v), max(v_high, v)
        if (p[2] >= near) != (q[2] >= near):
            share = (near - p[2]) / (q[2] - p[2])
            x, y = p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])
            # What rounding moves this point by is as large as the coordinates, not as the point.
            slack = _ROUNDING * (abs(p[0]) + abs(q[0]) + abs(p[1]) + abs(q[1]))
            u, du = fx * (x / near) + cx, 1.0 + fx * (slack / near)
            v, dv = fy * (y / near) + cy, 1.0 + fy * (slack / near)
            u_low, u_high = min(u_low, u - du), max(u_high, u + du)
            v_low, v_high = min(v_low, v - dv), max(v_high, v + dv)
    u0, u1 = pixels(sensor, 0, u_low, u_high)
    v0, v1 = pixels(sensor, 1, v_low, v_high)
    return u0, u1, v0, v1


@inlined_kernel
def _triangle_box(sensor, corners, i, j, k):
    """Return (u0, u1, v0, v1), the pixels that can see a triangle."""
    i, j, k = i & LAST_PLACE, j & LAST_PLACE, k & LAST_PLACE
    near = sensor.clipping[0]
    if corners[i, 2] >= near and corners[j, 2] >= near and corners[k, 2] >= near:
        ua, ub, uc = corners[i, 3], corners[j, 3], corners[k, 3]
        u0, u1 = pixels(sensor, 0, min(ua, min(ub, uc)), max(ua, max(ub, uc)))
        if u0 > u1:
            return 1, 0, 1, 0
        va, vb, vc = corners[i, 4], corners[j, 4], corners[k, 4]
        v0, v1 = pixels(sensor, 1, min(va, min(vb, vc)), max(va, max(vb, vc)))
        return u0, u1, v0, v1
    if corners[i, 2] < near and corners[j, 2] < near and corners[k, 2] < near:
        return 1, 0, 1, 0
    return _cut_box(sensor, _corner(corners, i), _corner(corners, j), _corner(corners, k))


@inlined_kernel
def _draw(sensor, screen, a, b, c, box, row, number):
    """Draw one triangle into the pixels of its box."""
    near, far = sensor.clipping
    n = cross(subtract(b, a), subtract(c, a))
    height = dot(n, a)
    nearest, farthest = min(a[2], min(b[2], c[2])), max(a[2], max(b[2], c[2]))
    stride = screen.depth.shape[1]
    for v in range(box[2], box[3] + 1):
        y = sensor.y[v & LAST_PLACE]
        ay, by, cy = a[1] - y * a[2], b[1] - y * b[2], c[1] - y * c[2]
        slope = n[1] * y + n[2]
        for u in range(box[0], box[1] + 1, LANES):
            x = load_lanes(sensor.x, u)
            ax, bx, cx = a[0] - x * a[2], b[0] - x * b[2], c[0] - x * c[2]
            ab, bc, ca = ax * by - ay * bx, bx * cy - by * cx, cx * ay - cy * ax
            is_hit = ((ab >= 0.0) & (bc >= 0.0) & (ca >= 0.0)) | (
                (ab <= 0.0) & (bc <= 0.0) & (ca <= 0.0)
            )
            incidence = n[0] * x + slope
            depth = height / incidence
            # Seen from its side, a triangle's plane says little: its corners limit the depth.
            depth = select(depth < nearest, nearest, depth)
            depth = select(depth > farthest, farthest, depth)
            is_hit = is_hit & (depth >= near) & (depth <= far) & ~(incidence == 0.0)
            keep_nearest(screen, v * stride + u, is_hit, depth, row, number)


@lean_kernel
def draw_triangles(sensor, screen, bodies, row, R_SG, p_SG, corners):
    """Draw the mesh of a body; ``corners`` is memory for CORNER numbers of each vertex."""
    use_widest_vectors()
    mesh = bodies.mesh[row] & LAST_PLACE
    first = bodies.vertex_start[mesh]
    count = bodies.vertex_start[mesh + 1] - first
    _place_corners(sensor, bodies, first, count, R_SG, p_SG, corners)
    start, end = bodies.triangle_start[mesh], bodies.triangle_start[mesh + 1]
    for triangle in range(start, end):
        at = triangle & LAST_PLACE
        i, j, k = bodies.triangles[at, 0], bodies.triangles[at, 1], bodies.triangles[at, 2]
        box = _triangle_box(sensor, corners, i, j, k)
        if box[0] <= box[1] and box[2] <= box[3]:
            a, b, c = _corner(corners, i), _corner(corners, j), _corner(corners, k)
            _draw(sensor, screen, a, b, c, box, row, element(row, triangle - start))
