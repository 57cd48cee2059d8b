"""Branch and bound over the sphere of directions: a proof that a depth is the least of all.

The depth of A and B along a unit vector x out of B into A is D(x) = h(x), with the support
function h of C = {b - a}. Every point w of C proves that D(x) >= w . x, so that D >= d for all x
with w . x >= d |x|. The right side minus the left is a convex function of x, so what holds for the
corners of a cone holds for all of it. The cones are cells of a cube around the sphere, one side of
which faces along the normal n of a stationary depth d. A cell that neither its parent's point nor
the support point along its own middle covers is cut into four.

Around n itself D is as small as d, and what proves that it is no smaller is the curvature of A
and B there (``growth``). Cells are looked at the large ones first: where the depth is less, that
is found before small cells beside such a region are looked at, eight at a time.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    every,
    LANES,
    load_lanes,
    load_number,
    magnitude,
    root,
    select,
    store_lanes,
    store_number,
)
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import lane_support, placed_growth
from scene_graph_ros.geometry.narrowphase.pair import Placed
from scene_graph_ros.geometry.narrowphase.prove.critical_directions import (
    LESS,
    NONE_LESS,
    UNDECIDED,
)
from scene_graph_ros.geometry.narrowphase.prove.growth import known_reach
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    dot,
    orthogonal_pair,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)
from scene_graph_ros.geometry.tolerances import EPSILON, INNER_BALL_SPARE, TIE

__all__ = ["cover"]

MAX_ROUNDS = 40
"""Of eight cells: 10 to 20 are usual. GJK and EPA take longer than this many."""

QUEUE = 15
"""Blocks of eight cells that wait at most; they are kept in a circle."""

_SIDE, _S, _Q, _HALF, _W = (LANES * k for k in range(5))
"""Where numbers of a block's cells are: the side of the cube, the cell's middle and half width
there, and the point, of three coordinates, that did not cover all of a larger cell."""

_BLOCK = 7 * LANES


@lean_kernel
def _corner_frame(n, R, p):
    """Return (F, F R, F p) with the rotation F to a frame whose first axis is n."""
    t, u = orthogonal_pair(n)
    F = (n[0], n[1], n[2], t[0], t[1], t[2], u[0], u[1], u[2])
    x = rotate(F, (R[0], R[3], R[6]))
    y = rotate(F, (R[1], R[4], R[7]))
    z = rotate(F, (R[2], R[5], R[8]))
    return F, (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]), rotate(F, p)


@inlined_kernel
def _on_side(side, x):
    """Return vectors' coordinates (out of a side of the cube, along it, along it)."""
    out = select(side < 2.0, x[0], select(side < 4.0, x[1], x[2]))
    is_opposite = (side == 1.0) | (side == 3.0) | (side == 5.0)
    return (
        select(is_opposite, -out, out),
        select(side < 2.0, x[1], x[0]),
        select(side < 4.0, x[2], x[1]),
    )


@inlined_kernel
def _directions(side, s, q):
    """Return the vectors with the coordinates (1, s, q) on sides of the cube."""
    is_opposite = (side == 1.0) | (side == 3.0) | (side == 5.0)
    out = select(is_opposite, every(-1.0), every(1.0))
    return (
        select(side < 2.0, out, s),
        select(side < 2.0, s, select(side < 4.0, out, q)),
        select(side < 4.0, q, out),
    )


@inlined_kernel
def _are_covered(w, side, s, q, half, square):
    """Return in which cells w . x >= d |x| for all x; ``square`` is that of d > 0."""
    w = _on_side(side, w)
    a, b = s - half, s + half
    c, d = q - half, q + half
    middle = w[0] + s * w[1] + q * w[2]
    ds, dq = half * w[1], half * w[2]
    aa, bb, cc, dd = 1.0 + a * a, 1.0 + b * b, c * c, d * d
    w00, w01, w10, w11 = middle - ds - dq, middle - ds + dq, middle + ds - dq, middle + ds + dq
    return (
        (middle > magnitude(ds) + magnitude(dq))
        & (w00 * w00 >= square * (aa + cc))
        & (w01 * w01 >= square * (aa + dd))
        & (w10 * w10 >= square * (bb + cc))
        & (w11 * w11 >= square * (bb + dd))
    )


@inlined_kernel
def _place(cell):
    """Return where the numbers of a cell are, by the order in which it came into the queue."""
    return _BLOCK * ((cell // LANES) % QUEUE) + cell % LANES


@inlined_kernel
def _enqueue(S, cell, side, s, q, half, w):
    """Write a cell and the point that did not cover all of it."""
    at = _place(cell)
    store_number(S, at + _SIDE, side)
    store_number(S, at + _S, s)
    store_number(S, at + _Q, q)
    store_number(S, at + _HALF, half)
    store_number(S, at + _W, w[0])
    store_number(S, at + _W + LANES, w[1])
    store_number(S, at + _W + 2 * LANES, w[2])


@inlined_kernel
def _load_triple(S, at):
    return load_lanes(S, at), load_lanes(S, at + LANES), load_lanes(S, at + 2 * LANES)


@inlined_kernel
def _store_triple(S, at, v):
    store_lanes(S, at, v[0])
    store_lanes(S, at + LANES, v[1])
    store_lanes(S, at + 2 * LANES, v[2])


@inlined_kernel
def _cut(S, at, tail):
    """Put the quarters of a block's cells that have a width into the queue; return its end."""
    for lane in range(LANES):
        place = at + lane
        half = load_number(S, place + _HALF)
        if half == 0.0:
            continue
        half *= 0.5
        side, s, q = load_number(S, place), load_number(S, place + _S), load_number(S, place + _Q)
        w = (
            load_number(S, place + _W),
            load_number(S, place + _W + LANES),
            load_number(S, place + _W + 2 * LANES),
        )
        _enqueue(S, tail, side, s - half, q - half, half, w)
        _enqueue(S, tail + 1, side, s - half, q + half, half, w)
        _enqueue(S, tail + 2, side, s + half, q - half, half, w)
        _enqueue(S, tail + 3, side, s + half, q + half, half, w)
        tail += 4
    return tail


@inlined_kernel
def _least(S, at, depths, x):
    """Return the least of depths, and its direction; room in a block of ``S`` is overwritten."""
    store_lanes(S, at, depths)
    _store_triple(S, at + _W, x)
    best = 0
    for lane in range(1, LANES):
        if load_number(S, at + lane) < load_number(S, at + best):
            best = lane
    place = at + best
    return load_number(S, place), (
        load_number(S, place + _W),
        load_number(S, place + _W + LANES),
        load_number(S, place + _W + 2 * LANES),
    )


@inlined_kernel
def _points(turned, x):
    """Return the points b - a of C that lie furthest along x, of placed cores and hulls."""
    A, B, hulls = turned
    b = add(rotate(B.R, lane_support(B.core, hulls, rotate_inverse(B.R, x))), B.p)
    a = rotate(A.R, lane_support(A.core, hulls, rotate_inverse(A.R, scale(-1.0, x))))
    return subtract(b, a)


@inlined_kernel
def _search(turned, reach, more, less, S):
    """Return (status, x): a direction x of the frame F along which it is less than ``less``.

    All is in F. Proven is that it is at least ``more`` everywhere but within the reach of n.
    """
    square = more * more
    for side in range(6):
        _enqueue(S, side, float(side), 0.0, 0.0, 1.0, ORIGIN)
    head, tail = 0, 6
    for _ in range(MAX_ROUNDS):
        if head >= tail:
            return NONE_LESS, ORIGIN
        for cell in range(tail, head + LANES):
            _enqueue(S, cell, 0.0, 0.0, 0.0, 0.0, ORIGIN)  # no cell
        at = _place(head)
        head += LANES
        tail = max(tail, head)
        side, s, q = load_lanes(S, at), load_lanes(S, at + _S), load_lanes(S, at + _Q)
        half, w = load_lanes(S, at + _HALF), _load_triple(S, at + _W)
        far_s, far_q = magnitude(s) + half, magnitude(q) + half
        is_near = (side == 0.0) & (far_s * far_s + far_q * far_q <= reach * reach)
        is_done = (half == 0.0) | is_near | _are_covered(w, side, s, q, half, square)
        if all_of(is_done):
            continue
        x = _directions(side, s, q)
        w = _points(turned, x)
        depths = dot(w, x) / root(dot(x, x))
        is_beside = (side == 0.0) & (s * s + q * q <= reach * reach)
        depths = select(is_done | is_beside, every(math.inf), depths)
        if any_of(depths < more):
            depth, best = _least(S, at, depths, x)
            return LESS if depth < less else UNDECIDED, best
        is_done = is_done | _are_covered(w, side, s, q, half, square)
        store_lanes(S, at + _HALF, select(is_done, every(0.0), half))
        _store_triple(S, at + _W, w)
        if tail - head + 5 * LANES > LANES * QUEUE:
            break
        tail = _cut(S, at, tail)
    return UNDECIDED, ORIGIN


@inlined_kernel
def cover(pair, a, b, n, depth, size, S):
    """Look for a direction out of B into A along which cores are less deep than ``depth`` > 0.

    a, b, n: the witnesses and the normal of a stationary depth. Returns (status, direction).
    ``NONE_LESS``: everywhere else it is deeper. ``LESS``: it is less deep along that unit vector.
    ``UNDECIDED``: it is not known. Cores are as in ``lifted_contact``; ``S`` is overwritten.
    """
    F, R, p = _corner_frame(n, pair.R, pair.p)
    A, B, hulls = Placed(pair.core_A, F, ORIGIN), Placed(pair.core_B, R, p), pair.hulls
    less = depth - TIE * EPSILON * size
    more = depth + INNER_BALL_SPARE * size
    reach = known_reach(
        placed_growth(A, hulls, rotate(F, a), (-1.0, 0.0, 0.0), size),
        placed_growth(B, hulls, rotate(F, b), (1.0, 0.0, 0.0), size),
        more,
    )
    if reach == 0.0:
        return UNDECIDED, n
    status, x = _search((A, B, hulls), reach, more, less, S)
    return status, unit(rotate_inverse(F, x), n)
