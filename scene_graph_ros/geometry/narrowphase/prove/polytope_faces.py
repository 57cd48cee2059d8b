"""Places in a workspace for the faces of a small polytope, eight of them beside each other.

P is the polytope, Q another core in whose frame everything is. Of each face there are six numbers:
its unit normal d out of P, and Q's support point against it.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import LANES, load_number, store_lanes
from scene_graph_ros.geometry.tables.hull_blocks import SCAN_LIMIT

__all__ = [
    "FIRST_FACE",
    "LAST",
    "NUMBERS_OF_FACES",
    "normal_at",
    "place_of_face",
    "point_at",
    "store_faces",
]

FIRST_FACE = 40
"""The row of the workspace where faces begin; before it is a stack of directions on an arc."""

LAST = FIRST_FACE - 1
"""The row before the faces."""

_ROW = 9
_GROUP = 6 * LANES
_POINT = 3 * LANES
"""Where the points of eight faces are, after their normals; lane beside lane."""

_MAX_FACES = 2 * SCAN_LIMIT - 4
"""A hull that is scanned has no more (Euler)."""

NUMBERS_OF_FACES = _ROW * FIRST_FACE + _GROUP * -(-_MAX_FACES // LANES)
"""That a workspace must have room for, from its first row on."""


@inlined_kernel
def place_of_face(f):
    """Return the index of the first number of the face f."""
    return _ROW * FIRST_FACE + _GROUP * (f // LANES) + f % LANES


@inlined_kernel
def _triple(S, at):
    return load_number(S, at), load_number(S, at + LANES), load_number(S, at + 2 * LANES)


@inlined_kernel
def normal_at(S, place):
    """Return the normal of the face at a place."""
    return _triple(S, place)


@inlined_kernel
def point_at(S, place):
    """Return Q's support point against the face at a place."""
    return _triple(S, place + _POINT)


@inlined_kernel
def store_faces(S, first, d, q):
    """Write normals and points of eight faces, from the one numbered ``first`` on."""
    at = place_of_face(first)
    for k in range(3):
        store_lanes(S, at + LANES * k, d[k])
        store_lanes(S, at + _POINT + LANES * k, q[k])
