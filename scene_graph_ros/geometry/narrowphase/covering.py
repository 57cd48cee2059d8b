"""Is a depth the least of all? The sphere of directions, covered by proofs that it is.

The depth of A and B along a unit vector x out of B into A is D(x) = h(x), with the support
function h of C = {b - a}. Every point w of C proves that D(x) >= w . x, so that D >= d for all x
with w . x >= d |x|. The right side minus the left is a convex function of x, so what holds for the
corners of a cone holds for all of it. The cones are cells of a cube around the sphere, one side of
which faces along the normal n of a stationary depth d. A cell that neither its parent's point nor
the support point along its own middle covers is cut into four.

Around n itself D is as small as d, and what proves that it is no smaller is the curvature of A
and B there (``growth``). Cells are looked at the large ones first: where the depth is less, that
is found before small cells beside such a region are looked at.
"""

from scene_graph_ros.geometry.jit import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores import ORIGIN, placed_support
from scene_graph_ros.geometry.narrowphase.growth import growth, known_reach
from scene_graph_ros.geometry.narrowphase.other_depths import LESS, NONE_LESS, UNDECIDED
from scene_graph_ros.geometry.spatial.vectors import (
    dot,
    norm,
    orthogonal_pair,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, INNER_BALL_SPARE, TIE

__all__ = ["look_everywhere"]

MAX_CELLS = 256
"""Cells that are looked at: 50 to 100 are usual. GJK and EPA take longer than this many."""

BESIDE = 0.5
"""Of the square of the reach of what is known: cells whose middle is nearer to n are cut at once,
as the point of C there, where D is hardly larger than d, covers next to nothing."""


@lean_kernel
def _corner_frame(n, R, p):
    """Return (F, F R, F p) with the rotation F to a frame whose first axis is n."""
    t, u = orthogonal_pair(n)
    F = (n[0], n[1], n[2], t[0], t[1], t[2], u[0], u[1], u[2])
    x = rotate(F, (R[0], R[3], R[6]))
    y = rotate(F, (R[1], R[4], R[7]))
    z = rotate(F, (R[2], R[5], R[8]))
    return F, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), rotate(F, p)


@lean_kernel
def _on_side(side, x):
    """Return a vector's coordinates (out of a side of the cube, along it, along it)."""
    out = x[0] if side < 2 else (x[1] if side < 4 else x[2])
    return (
        -out if side & 1 else out,
        x[1] if side < 2 else x[0],
        x[2] if side < 4 else x[1],
    )


@lean_kernel
def _direction(side, s, q):
    """Return the vector with the coordinates (1, s, q) on a side of the cube."""
    out = -1.0 if side & 1 else 1.0
    if side < 2:
        return (out, s, q)
    if side < 4:
        return (s, out, q)
    return (s, q, out)


@inlined_kernel
def _is_covered(w, side, s, q, half, square):
    """Return whether w . x >= d |x| for all x of a cell; ``square`` is that of d > 0."""
    w = _on_side(side, w)
    a, b = s - half, s + half
    c, d = q - half, q + half
    middle = w[0] + s * w[1] + q * w[2]
    ds, dq = half * w[1], half * w[2]
    if middle <= abs(ds) + abs(dq):
        return False
    aa, bb, cc, dd = 1.0 + a * a, 1.0 + b * b, c * c, d * d
    w00, w01, w10, w11 = middle - ds - dq, middle - ds + dq, middle + ds - dq, middle + ds + dq
    return (
        w00 * w00 >= square * (aa + cc)
        and w01 * w01 >= square * (aa + dd)
        and w10 * w10 >= square * (bb + cc)
        and w11 * w11 >= square * (bb + dd)
    )


@inlined_kernel
def _store(S, row, side, s, q, half, w):
    """Write a cell and the point that did not cover all of it."""
    S[row, 0], S[row, 1], S[row, 2], S[row, 3] = side, s, q, half
    S[row, 4], S[row, 5], S[row, 6] = w[0], w[1], w[2]


@inlined_kernel
def _cover(core_A, core_B, F, R, p, hulls, reach, more, less, S):
    """Return (status, x): a direction x of the frame F along which it is less than ``less``.

    All is in F. Proven is that it is at least ``more`` everywhere but within the reach of n.
    """
    rows = S.shape[0]
    square = more * more
    for side in range(6):
        _store(S, side, side, 0.0, 0.0, 1.0, ORIGIN)
    head, tail = 0, 6
    for _ in range(MAX_CELLS):
        if head == tail:
            return NONE_LESS, ORIGIN
        row = head % rows
        head += 1
        side, s, q, half = int(S[row, 0]), S[row, 1], S[row, 2], S[row, 3]
        w = (S[row, 4], S[row, 5], S[row, 6])
        far_s, far_q = abs(s) + half, abs(q) + half
        if side == 0 and far_s * far_s + far_q * far_q <= reach * reach:
            continue
        if _is_covered(w, side, s, q, half, square):
            continue
        if side > 0 or s * s + q * q > BESIDE * reach * reach:
            x = _direction(side, s, q)
            b, _ = placed_support(core_B, hulls, R, p, x, -1)
            a, _ = placed_support(core_A, hulls, F, ORIGIN, scale(-1.0, x), -1)
            w = subtract(b, a)
            along, length = dot(w, x), norm(x)
            if along < more * length and (side > 0 or s * s + q * q > reach * reach):
                return LESS if along < less * length else UNDECIDED, x
            if _is_covered(w, side, s, q, half, square):
                continue
        if tail - head + 4 > rows:
            break
        half *= 0.5
        _store(S, tail % rows, side, s - half, q - half, half, w)
        _store(S, (tail + 1) % rows, side, s - half, q + half, half, w)
        _store(S, (tail + 2) % rows, side, s + half, q - half, half, w)
        _store(S, (tail + 3) % rows, side, s + half, q + half, half, w)
        tail += 4
    return UNDECIDED, ORIGIN


@inlined_kernel
def look_everywhere(core_A, core_B, R, p, hulls, a, b, n, depth, size, S):
    """Look for a direction out of B into A along which cores are less deep than ``depth`` > 0.

    a, b, n: the witnesses and the normal of a stationary depth. Returns (status, direction).
    ``NONE_LESS``: everywhere else it is deeper. ``LESS``: it is less deep along that unit vector.
    ``UNDECIDED``: it is not known. Cores are as in ``lifted_contact``; ``S`` is overwritten.
    """
    F, R, p = _corner_frame(n, R, p)
    less = depth - TIE * EPSILON * size
    more = depth + INNER_BALL_SPARE * size
    reach = known_reach(
        growth(core_A, hulls, F, ORIGIN, rotate(F, a), (-1.0, 0.0, 0.0), size),
        growth(core_B, hulls, R, p, rotate(F, b), (1.0, 0.0, 0.0), size),
        more,
    )
    if reach == 0.0:
        return UNDECIDED, n
    status, x = _cover(core_A, core_B, F, R, p, hulls, reach, more, less, S)
    return status, unit(rotate_inverse(F, x), n)
