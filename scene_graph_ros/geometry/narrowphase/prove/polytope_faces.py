"""Rows of a workspace for the faces of a small polytope.

P is the polytope, Q another core in whose frame everything is.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores.questions import edge_of, support
from scene_graph_ros.geometry.spatial.vectors import dot, scale, subtract
from scene_graph_ros.geometry.tables.hull_blocks import SCAN_LIMIT

__all__ = [
    "BELOW",
    "BELOW_CENTRE",
    "DEPTH",
    "FIRST_FACE",
    "LAST",
    "MAX_FACES",
    "edge_rows",
    "fill",
]

FIRST_FACE = 36
"""The row of the workspace where faces begin; before it is a stack of directions on an arc."""

LAST = FIRST_FACE - 1
"""The row before the faces."""

MAX_FACES = 2 * SCAN_LIMIT - 4
"""A hull that is scanned has no more (Euler)."""

DEPTH = 6
BELOW = 7
BELOW_CENTRE = 8
"""Columns of a row: the direction, Q's support point against it, D (infinite: not visited), and
how far Q's witness and Q's centre are below the face."""


@inlined_kernel
def edge_rows(placed, hulls, k):
    """Return (row of one face, row of the other, a point of the edge they share) of edge k."""
    one, other, v = edge_of(placed, hulls, k)
    return FIRST_FACE + one, FIRST_FACE + other, v


@inlined_kernel
def fill(core_Q, hulls, v, S, row):
    """Find the support point of Q for the row of a face that v is a point of, unless known."""
    if S[row, DEPTH] == math.inf:
        d = (S[row, 0], S[row, 1], S[row, 2])
        q, _ = support(core_Q, hulls, scale(-1.0, d))
        for c in range(3):
            S[row, 3 + c] = q[c]
        S[row, DEPTH] = dot(subtract(v, q), d)
