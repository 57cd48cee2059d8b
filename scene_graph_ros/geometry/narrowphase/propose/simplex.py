"""The point of a simplex of up to four points that is closest to the origin.

A row of ``S`` holds a point w = a - b of the Minkowski difference of A and B, then a, then b.
Barycentric weights are computed from edge vectors (never from differences of squared lengths), so
a small simplex far from the origin keeps its relative accuracy; the closest point inside a
triangle is taken along the triangle's normal.
"""

import math

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, scale, subtract, unit
from scene_graph_ros.geometry.tolerances import FLAT_SIMPLEX

__all__ = ["CONTAINS", "closest_on_simplex", "simplex_normal", "weighted_points"]

CONTAINS = 4
"""The count returned for a tetrahedron that contains the origin."""


@inlined_kernel
def _row(S, i):
    return (S[i, 0], S[i, 1], S[i, 2])


@inlined_kernel
def _on_segment(p, q):
    """Return (weight of p, weight of q, closest point)."""
    e = subtract(q, p)
    ee = dot(e, e)
    pe = -dot(p, e)
    if pe <= 0.0 or ee <= 0.0:
        return 1.0, 0.0, p
    qe = dot(q, e)
    if qe <= 0.0:
        return 0.0, 1.0, q
    # Start from the nearer end: the closest point then carries the smaller rounding error.
    if pe <= qe:
        t = pe / ee
        return 1.0 - t, t, axpy(t, e, p)
    t = qe / ee
    return t, 1.0 - t, axpy(-t, e, q)


@lean_kernel
def _on_border(p, q, r, out_p, out_q, out_r):
    """Return (three weights, closest point) on those edges whose opposite corner is ``out``."""
    best = math.inf
    weights = (1.0, 0.0, 0.0)
    closest = p
    if out_p:
        wq, wr, v = _on_segment(q, r)
        best = dot(v, v)
        weights = (0.0, wq, wr)
        closest = v
    if out_q:
        wp, wr, v = _on_segment(p, r)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (wp, 0.0, wr)
            closest = v
    if out_r:
        wp, wq, v = _on_segment(p, q)
        if dot(v, v) < best:
            weights = (wp, wq, 0.0)
            closest = v
    return weights, closest


@lean_kernel
def _on_triangle(p, q, r):
    """Return (three weights, closest point)."""
    e = subtract(q, p)
    f = subtract(r, p)
    n = cross(e, f)
    nn = dot(n, n)
    if is_rare(not nn > FLAT_SIMPLEX * FLAT_SIMPLEX * dot(e, e) * dot(f, f)):
        return _on_border(p, q, r, True, True, True)
    wq = -dot(cross(p, f), n) / nn
    wr = -dot(cross(e, p), n) / nn
    wp = 1.0 - wq - wr
    if wp >= 0.0 and wq >= 0.0 and wr >= 0.0:
        return (wp, wq, wr), scale(dot(n, p) / nn, n)
    return _on_border(p, q, r, wp < 0.0, wq < 0.0, wr < 0.0)


@inlined_kernel
def _outside_faces(a, b, c, p):
    """Tell for each corner of a tetrahedron whether the origin is beyond the opposite face."""
    e0 = subtract(a, p)
    e1 = subtract(b, p)
    e2 = subtract(c, p)
    c0 = cross(e1, e2)
    c1 = cross(e2, e0)
    c2 = cross(e0, e1)
    volume = dot(e0, c0)
    flat = FLAT_SIMPLEX * math.sqrt(dot(e0, e0) * dot(e1, e1) * dot(e2, e2))
    if is_rare(not abs(volume) > flat):
        return True, True, True, True
    w0 = -dot(p, c0) / volume
    w1 = -dot(p, c1) / volume
    w2 = -dot(p, c2) / volume
    return w0 < 0.0, w1 < 0.0, w2 < 0.0, 1.0 - w0 - w1 - w2 < 0.0


@lean_kernel
def _on_tetrahedron(a, b, c, p):
    """Return (is the origin inside, four weights, closest point)."""
    out0, out1, out2, out3 = _outside_faces(a, b, c, p)
    weights = (0.25, 0.25, 0.25, 0.25)
    closest = (0.0, 0.0, 0.0)
    if not (out0 or out1 or out2 or out3):
        return True, weights, closest
    best = math.inf
    if out0:
        w, v = _on_triangle(b, c, p)
        best = dot(v, v)
        weights = (0.0, w[0], w[1], w[2])
        closest = v
    if out1:
        w, v = _on_triangle(a, c, p)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (w[0], 0.0, w[1], w[2])
            closest = v
    if out2:
        w, v = _on_triangle(a, b, p)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (w[0], w[1], 0.0, w[2])
            closest = v
    if out3:
        w, v = _on_triangle(a, b, c)
        if dot(v, v) < best:
            weights = (w[0], w[1], w[2], 0.0)
            closest = v
    return False, weights, closest


@lean_kernel
def _compact(work, weights):
    """Keep the rows of positive weight, in order; return how many."""
    S, ids, lam = work
    count = 0
    for i in range(4):
        if weights[i] > 0.0:
            if count != i:
                for c in range(9):
                    S[count, c] = S[i, c]
                ids[count, 0] = ids[i, 0]
                ids[count, 1] = ids[i, 1]
            lam[count] = weights[i]
            count += 1
    return count


@lean_kernel
def closest_on_simplex(work, count):
    """Reduce a simplex to the face closest to the origin; return (its count, closest point).

    Rows that don't carry the closest point are dropped, ``lam`` gets the weights of the others.
    ``CONTAINS`` rows are returned only for a tetrahedron with the origin inside.
    """
    S = work.S
    if count == 1:
        work.lam[0] = 1.0
        return 1, _row(S, 0)
    p, q = _row(S, 0), _row(S, 1)
    if count == 2:
        wp, wq, v = _on_segment(p, q)
        return _compact(work, (wp, wq, 0.0, 0.0)), v
    r = _row(S, 2)
    if count == 3:
        w, v = _on_triangle(p, q, r)
        return _compact(work, (w[0], w[1], w[2], 0.0)), v
    inside, weights, v = _on_tetrahedron(p, q, r, _row(S, 3))
    if inside:
        return CONTAINS, v
    return _compact(work, weights), v


@lean_kernel
def weighted_points(simplex):
    """Return the points of A and B that the weights of a simplex stand for."""
    S, lam, count = simplex.S, simplex.lam, simplex.num_corners
    ax, ay, az, bx, by, bz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(count):
        ax += lam[i] * S[i, 3]
        ay += lam[i] * S[i, 4]
        az += lam[i] * S[i, 5]
        bx += lam[i] * S[i, 6]
        by += lam[i] * S[i, 7]
        bz += lam[i] * S[i, 8]
    return (ax, ay, az), (bx, by, bz)


@lean_kernel
def simplex_normal(simplex, v):
    """Return the unit direction of v, from the simplex where that is more accurate."""
    S, count = simplex.S, simplex.num_corners
    n = unit(v, (0.0, 0.0, 1.0))
    if count == 3:
        p = _row(S, 0)
        m = unit(cross(subtract(_row(S, 1), p), subtract(_row(S, 2), p)), n)
        n = m if dot(m, n) > 0.0 else scale(-1.0, m)
    return n
