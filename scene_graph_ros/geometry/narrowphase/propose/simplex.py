"""The point of a simplex of up to four points that is closest to the origin.

A row of ``S`` holds a point w = a - b of the Minkowski difference of A and B, then a, then b.
Barycentric weights are computed from edge vectors (never from differences of squared lengths), so
a small simplex far from the origin keeps its relative accuracy; the closest point inside a
triangle is taken along the triangle's normal.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.spatial.vectors import cross, dot, scale, unit
from scene_graph_ros.geometry.tolerances import FLAT_SIMPLEX

__all__ = ["CONTAINS", "closest_on_simplex", "simplex_normal", "weighted_points"]

CONTAINS = 4
"""The count returned for a tetrahedron that contains the origin."""


@lean_kernel
def _row(S, i):
    return (S[i, 0], S[i, 1], S[i, 2])


@lean_kernel
def _edge(S, i, j):
    return (S[j, 0] - S[i, 0], S[j, 1] - S[i, 1], S[j, 2] - S[i, 2])


@lean_kernel
def _on_segment(S, i, j):
    """Return (weight of i, weight of j, closest point)."""
    p = _row(S, i)
    e = _edge(S, i, j)
    ee = dot(e, e)
    pe = -dot(p, e)
    if pe <= 0.0 or ee <= 0.0:
        return 1.0, 0.0, p
    q = _row(S, j)
    qe = dot(q, e)
    if qe <= 0.0:
        return 0.0, 1.0, q
    # Start from the nearer end: the closest point then carries the smaller rounding error.
    if pe <= qe:
        t = pe / ee
        return 1.0 - t, t, (p[0] + t * e[0], p[1] + t * e[1], p[2] + t * e[2])
    t = qe / ee
    return t, 1.0 - t, (q[0] - t * e[0], q[1] - t * e[1], q[2] - t * e[2])


@lean_kernel
def _on_border(S, i, j, k, out_i, out_j, out_k):
    """Return (three weights, closest point) on those edges whose opposite corner is ``out``."""
    best = math.inf
    weights = (1.0, 0.0, 0.0)
    closest = _row(S, i)
    if out_i:
        wj, wk, v = _on_segment(S, j, k)
        best = dot(v, v)
        weights = (0.0, wj, wk)
        closest = v
    if out_j:
        wi, wk, v = _on_segment(S, i, k)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (wi, 0.0, wk)
            closest = v
    if out_k:
        wi, wj, v = _on_segment(S, i, j)
        if dot(v, v) < best:
            weights = (wi, wj, 0.0)
            closest = v
    return weights, closest


@lean_kernel
def _on_triangle(S, i, j, k):
    """Return (three weights, closest point)."""
    p = _row(S, i)
    e = _edge(S, i, j)
    f = _edge(S, i, k)
    n = cross(e, f)
    nn = dot(n, n)
    if not nn > FLAT_SIMPLEX * FLAT_SIMPLEX * dot(e, e) * dot(f, f):
        return _on_border(S, i, j, k, True, True, True)
    wj = -dot(cross(p, f), n) / nn
    wk = -dot(cross(e, p), n) / nn
    wi = 1.0 - wj - wk
    if wi >= 0.0 and wj >= 0.0 and wk >= 0.0:
        return (wi, wj, wk), scale(dot(n, p) / nn, n)
    return _on_border(S, i, j, k, wi < 0.0, wj < 0.0, wk < 0.0)


@lean_kernel
def _outside_faces(S):
    """Tell for each corner of a tetrahedron whether the origin is beyond the opposite face."""
    p = _row(S, 3)
    e0 = _edge(S, 3, 0)
    e1 = _edge(S, 3, 1)
    e2 = _edge(S, 3, 2)
    c0 = cross(e1, e2)
    c1 = cross(e2, e0)
    c2 = cross(e0, e1)
    volume = dot(e0, c0)
    flat = FLAT_SIMPLEX * math.sqrt(dot(e0, e0) * dot(e1, e1) * dot(e2, e2))
    if not abs(volume) > flat:
        return True, True, True, True
    w0 = -dot(p, c0) / volume
    w1 = -dot(p, c1) / volume
    w2 = -dot(p, c2) / volume
    return w0 < 0.0, w1 < 0.0, w2 < 0.0, 1.0 - w0 - w1 - w2 < 0.0


@lean_kernel
def _on_tetrahedron(S):
    """Return (is the origin inside, four weights, closest point)."""
    out0, out1, out2, out3 = _outside_faces(S)
    weights = (0.25, 0.25, 0.25, 0.25)
    closest = (0.0, 0.0, 0.0)
    if not (out0 or out1 or out2 or out3):
        return True, weights, closest
    best = math.inf
    if out0:
        w, v = _on_triangle(S, 1, 2, 3)
        best = dot(v, v)
        weights = (0.0, w[0], w[1], w[2])
        closest = v
    if out1:
        w, v = _on_triangle(S, 0, 2, 3)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (w[0], 0.0, w[1], w[2])
            closest = v
    if out2:
        w, v = _on_triangle(S, 0, 1, 3)
        vv = dot(v, v)
        if vv < best:
            best = vv
            weights = (w[0], w[1], 0.0, w[2])
            closest = v
    if out3:
        w, v = _on_triangle(S, 0, 1, 2)
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
    if count == 2:
        wi, wj, v = _on_segment(S, 0, 1)
        return _compact(work, (wi, wj, 0.0, 0.0)), v
    if count == 3:
        w, v = _on_triangle(S, 0, 1, 2)
        return _compact(work, (w[0], w[1], w[2], 0.0)), v
    inside, weights, v = _on_tetrahedron(S)
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
        e = (S[1, 0] - S[0, 0], S[1, 1] - S[0, 1], S[1, 2] - S[0, 2])
        f = (S[2, 0] - S[0, 0], S[2, 1] - S[0, 1], S[2, 2] - S[0, 2])
        m = unit(cross(e, f), n)
        n = m if dot(m, n) > 0.0 else scale(-1.0, m)
    return n
