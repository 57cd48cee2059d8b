"""Branch and bound over the sphere of directions: a proof that a depth is the least of all.

The depth of A and B along a unit vector x out of B into A is D(x) = h(x), with the support
function h of C = {b - a}. Every point w of C proves that D(x) >= w . x, so that D >= d for all x
with w . x >= d |x|. The right side minus the left is a convex function of x, so a bound for the
corners of a cone holds for all of it. The cones are cells of a cube around the sphere, one side of
which faces along the normal n of a stationary depth d. A cell that neither its parent's point nor
the support point along its own middle covers is cut into four.

Around n itself D is as small as d, and a bound from below is the curvature of A
and B there (``growth``). Cells are looked at the large ones first: where the depth is less, that
is found before small cells beside such a region are looked at, eight at a time.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    any_of,
    as_lanes,
    bits_of,
    every,
    LANES,
    load_number,
    lowest_bit,
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
from scene_graph_ros.geometry.tables.vertex_scan import lane_of_largest
from scene_graph_ros.geometry.tolerances import EPSILON, INNER_BALL_SPARE, TIE

__all__ = ["NUMBERS_OF_COVER", "cover"]

MAX_ROUNDS = 40
"""Of eight cells: ten are usual. GJK and EPA take longer than this many."""

_SIDE, _S, _Q, _HALF, _W = (LANES * k for k in range(5))
"""Where numbers of a block's cells are: the side of the cube, the cell's middle and half width
there, and the point, of three coordinates, that did not cover all of it."""

_BLOCK = 7 * LANES
_WAITING = MAX_ROUNDS * _BLOCK
"""Where the list of places of cells that are not covered begins; before it are the blocks."""

NUMBERS_OF_COVER = _WAITING + MAX_ROUNDS * LANES
"""That there must be room for."""

_OF_FIRST = (1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0)
_QUARTER_S = (-1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0)
_QUARTER_Q = (-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0)
"""Lanes: positive of the first of two cells' quarters, and where these are around its middle."""


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
def _roots():
    """Return (side, s, q, half, w) of the six sides of the cube, and two cells without a width."""
    nothing = every(0.0)
    side = as_lanes((0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.0, 0.0))
    half = as_lanes((1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0))
    return side, nothing, nothing, half, (nothing, nothing, nothing)


@inlined_kernel
def _keep(S, block, cells, is_open, tail):
    """Write a block of cells, and where those are that wait to be cut; return the list's end."""
    side, s, q, half, w = cells
    at = _BLOCK * block
    store_lanes(S, at + _SIDE, side)
    store_lanes(S, at + _S, s)
    store_lanes(S, at + _Q, q)
    store_lanes(S, at + _HALF, half)
    for k in range(3):
        store_lanes(S, at + _W + LANES * k, w[k])
    bits = bits_of(is_open)
    while bits != 0:
        store_number(S, tail, float(at + lowest_bit(bits)))
        bits &= bits - 1
        tail += 1
    return tail


@inlined_kernel
def _of_two(S, one, other, at):
    """Return lanes of a number of two cells, each four times."""
    return select(as_lanes(_OF_FIRST) > 0.0, load_number(S, one + at), load_number(S, other + at))


@inlined_kernel
def _quarters(S, head, tail):
    """Return the quarters of the next two cells of the list; of one, some without a width."""
    one = int(load_number(S, head))
    other = int(load_number(S, min(head + 1, tail - 1)))
    half = 0.5 * _of_two(S, one, other, _HALF)
    s = _of_two(S, one, other, _S) + half * as_lanes(_QUARTER_S)
    q = _of_two(S, one, other, _Q) + half * as_lanes(_QUARTER_Q)
    w = (
        _of_two(S, one, other, _W),
        _of_two(S, one, other, _W + LANES),
        _of_two(S, one, other, _W + 2 * LANES),
    )
    if one == other:
        half = select(as_lanes(_OF_FIRST) > 0.0, half, every(0.0))
    return _of_two(S, one, other, _SIDE), s, q, half, w


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
    cells = _roots()
    head = tail = _WAITING
    for block in range(MAX_ROUNDS):
        side, s, q, half, w = cells
        far_s, far_q = magnitude(s) + half, magnitude(q) + half
        is_near = (side == 0.0) & (far_s * far_s + far_q * far_q <= reach * reach)
        is_done = (half == 0.0) | is_near | _are_covered(w, side, s, q, half, square)
        if not all_of(is_done):
            x = _directions(side, s, q)
            w = _points(turned, x)
            depths = dot(w, x) / root(dot(x, x))
            is_beside = (side == 0.0) & (s * s + q * q <= reach * reach)
            depths = select(is_done | is_beside, every(math.inf), depths)
            if any_of(depths < more):
                k = lane_of_largest(select(depths < more, -depths, every(-math.inf)))
                return LESS if depths[k] < less else UNDECIDED, (x[0][k], x[1][k], x[2][k])
            is_open = ~(is_done | _are_covered(w, side, s, q, half, square))
            tail = _keep(S, block, (side, s, q, half, w), is_open, tail)
        if head >= tail:
            return NONE_LESS, ORIGIN
        cells = _quarters(S, head, tail)
        head = min(head + 2, tail)
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
