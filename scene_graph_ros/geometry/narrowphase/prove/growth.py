"""How fast the extent of a core grows around the normal of a contact, bounded from below.

The support function h of a core with a witness q and the outward unit normal m there is

    h(m + y) >= q . (m + y) + y G y    for all y orthogonal to m with |y| <= reach.

G = 0 is right for every core; it is larger the less the surface bends, and depends on the reach.
It is the sum of two forms. One is of round parts: there h is |M x| with a matrix M, which has
the semi-axes of an ellipsoid, or the radius of a cylinder across its axis. With e = M m / |M m|,
q is M e, and with f = M y - (e . M y) e

    |M x| - e . M x = |f|^2 / (|M x| + e . M x)    at x = m + y,

a quadratic form over a denominator that is bounded within the reach. The other is of flat parts:
where q is inside of a line or a face orthogonal to m, at least k from its border, h grows by
k |y| >= k |y|^2 / reach for y along it.

Frames: the rows of R are m (or -m), t and u in the core's frame; t and u are y's coordinates.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel

__all__ = ["known_reach"]

WIDEST = 1.5
"""The first reach that is tried: beyond the corners of a square of half width 1."""

NARROWER = 0.8
"""Each reach that is tried over the one before."""

MAX_TRIALS = 16
"""Down to a reach of 0.05, two degrees of direction."""


@inlined_kernel
def _form(known, reach):
    """Return (tt, tu, uu) of G within a reach."""
    length, slope, tt, tu, uu, kt, ku, kk = known
    longest = length + reach * slope
    total = longest + math.sqrt(longest * longest + reach * reach * (tt + uu))
    bend = 1.0 / total if total > 0.0 else 0.0
    flat = 1.0 / reach
    return bend * tt + flat * kt, bend * tu + flat * ku, bend * uu + flat * kk


@inlined_kernel
def known_reach(growth_A, growth_B, depth):
    """Return the reach within which a sum of two extents exceeds ``depth`` |m + y|; 0 for none.

    Both are those of a contact: at m, the sum is the depth, and it is stationary. |m + y| is at
    most 1 + |y|^2 / 2, so it is enough that G exceeds half the depth along every y.
    """
    reach = WIDEST
    for _ in range(MAX_TRIALS):
        a, b, c = _form(growth_A, reach)
        d, e, f = _form(growth_B, reach)
        tt, tu, uu = a + d - 0.5 * depth, b + e, c + f - 0.5 * depth
        if tt > 0.0 and uu > 0.0 and tt * uu > tu * tu:
            return reach
        reach *= NARROWER
    return 0.0
