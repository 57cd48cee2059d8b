"""What searches among the elements of a grid have in common: measuring one, and directions.

PAIR_DISTANCE tells the distance of an element, as of a convex shape, and along which direction:
what the shape is in front of, along that, is no nearer (compare Gilbert and Foo, *Computing the
Distance Between General Convex Objects*, 1990, on separating directions of the pair before).
"""

import math
from typing import NamedTuple

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores.questions import support
from scene_graph_ros.geometry.narrowphase.pair import Vector
from scene_graph_ros.geometry.query.distance.dispatch import core_of
from scene_graph_ros.geometry.query.distance.pair_entry import PAIR_DISTANCE
from scene_graph_ros.geometry.query.elements.element_places import measure_of
from scene_graph_ros.geometry.query.elements.nearest import just_above, NONE
from scene_graph_ros.geometry.spatial.vectors import add, dot, rotate, rotate_inverse, subtract

__all__ = [
    "CELLS",
    "PLANES",
    "SLACK",
    "Found",
    "least_cell",
    "measured",
    "nothing_yet",
    "plane_of",
    "put",
]

CELLS = 64
"""Elements, or pairs of them, that are bounded together."""
PLANES = 4
"""Directions that are kept: the last ones."""
SLACK = 4e-14
"""Of the lengths of a pair: nearer than this by rounding alone is not nearer."""
_UNIT = 1e-9
"""How far the square of a unit vector may be from one."""

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
_pair_distance = PAIR_DISTANCE.call


class Found(NamedTuple):
    """The nearest element so far."""

    phi: float
    p_Fa: Vector
    p_Fb: Vector
    nhat: Vector
    gap: float
    element: int
    worth: float
    """What is not nearer than this is not looked at."""


@inlined_kernel
def nothing_yet(max_distance):
    """Return that no element is found that is as near as ``max_distance``."""
    best, zero = just_above(max_distance), (0.0, 0.0, 0.0)
    return Found(best, zero, zero, (0.0, 0.0, 1.0), math.inf, NONE, best)


@inlined_kernel
def measured(places, row, j, X_FB, p_FA, found, element, length, tolerance):
    """Return (the nearest element so far, the direction out of B) after a look at one.

    It is the shape of ``row`` at p_FA, beside that of row j; ``length`` is what the rounding
    errors of the pair are relative to, but for its distance.
    """
    R_FB, p_FB = X_FB
    X_FA, X_AB = (_IDENTITY, (0.0, 0.0, 0.0)), (R_FB, subtract(p_FB, p_FA))
    arguments = places, row, j, X_FA, X_AB, max(found.phi, 0.0), tolerance
    phi, a, b, nhat, gap = _pair_distance(measure_of(places), arguments)
    if phi < found.phi and gap < math.inf:
        reach = abs(phi) if phi < math.inf else 0.0
        worth = phi - SLACK * (length + reach)
        found = Found(phi, add(a, p_FA), add(b, p_FA), nhat, gap, element, worth)
    return found, nhat


@inlined_kernel
def plane_of(table, j, R_FB, nhat):
    """Return (is one, (x, y, z, h)): the shape of row j is where m . x >= h, m being -nhat."""
    square = dot(nhat, nhat)
    if not abs(square - 1.0) <= _UNIT:
        return False, (0.0, 0.0, 1.0, -math.inf)
    core = core_of(table, j)
    x, _ = support(core, table.hulls.blocks, rotate_inverse(R_FB, nhat))
    h = -dot(nhat, rotate(R_FB, x)) - core[2]
    return True, (-nhat[0], -nhat[1], -nhat[2], h)


@inlined_kernel
def put(planes, kept, plane, fixed):
    """Keep a plane; ``kept`` is how many there are, and which is replaced next.

    The first ``fixed`` of them stay.
    """
    at = kept[1]
    for k in range(4):
        planes[at, k] = plane[k]
    kept[0], kept[1] = max(kept[0], at + 1), fixed + (at + 1 - fixed) % PLANES


@inlined_kernel
def least_cell(cells):
    """Return the place of the least of all bounds."""
    best, least = 0, cells[0]
    for k in range(1, CELLS):
        if cells[k] < least:
            best, least = k, cells[k]
    return best
