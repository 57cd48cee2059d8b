"""Points nearest to an edge of a small hull, four of them in step.

A step leads from the corner most likely to be nearest to the edge from there to the corner that
lies furthest towards the point. Where no other lies further towards it than that edge, it is the
nearest; ``point_convex`` does the same, by the same arithmetic in the same order.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.compiled.lanes import FOUR, load_four, root, select, store_lanes
from scene_graph_ros.geometry.query.point.corner_scan import furthest_corner
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_segments
from scene_graph_ros.geometry.query.point.point_convex import FAR
from scene_graph_ros.geometry.spatial.vectors import dot, scale, subtract

__all__ = ["ask_about_edge", "edge_answer", "find_edges"]

_POINT, _CORNER, _NUMBER, _IS_FOUND = 0, 3 * FOUR, 6 * FOUR, 7 * FOUR
_GRADIENT, _NEAREST, _PHI = _POINT, _CORNER, _NUMBER
"""Answers take the place of the questions."""


@inlined_kernel
def _write(kept, at, v):
    kept[at], kept[at + FOUR], kept[at + 2 * FOUR] = v


@inlined_kernel
def ask_about_edge(kept, slot, p_GQ, corner, number):
    """Ask about a point and its likely corner, with its number among those of the hull.

    The numbers of four questions are ``kept``; the slot is that of one of them.
    """
    _write(kept, _POINT + slot, p_GQ)
    _write(kept, _CORNER + slot, corner)
    kept[_NUMBER + slot] = number


@inlined_kernel
def edge_answer(kept, slot):
    """Return (is_found, (phi, p_GN, grad_G, unique)) of a question; the rest is no answer."""
    nearest, gradient = _NEAREST + slot, _GRADIENT + slot
    answer = (
        kept[_PHI + slot],
        (kept[nearest], kept[nearest + FOUR], kept[nearest + 2 * FOUR]),
        (kept[gradient], kept[gradient + FOUR], kept[gradient + 2 * FOUR]),
        True,
    )
    return kept[_IS_FOUND + slot] != 0.0, answer


@inlined_kernel
def _load(kept, at):
    return load_four(kept, at), load_four(kept, at + FOUR), load_four(kept, at + 2 * FOUR)


@inlined_kernel
def _store(kept, at, v):
    store_lanes(kept, at, v[0])
    store_lanes(kept, at + FOUR, v[1])
    store_lanes(kept, at + 2 * FOUR, v[2])


@lean_kernel
def find_edges(kept, blocks, first, corners, size):
    """Answer four questions about a hull.

    The first of its ``corners`` is at the place ``first`` of the blocks, ``size`` is its extent.
    """
    p, p_A, a = _load(kept, _POINT), _load(kept, _CORNER), load_four(kept, _NUMBER)
    n = subtract(p, p_A)
    least = dot(n, n)
    height, c, p_C = furthest_corner(blocks, first, corners, n)
    is_edge = (least > size * size) & (c != a) & (height > dot(p_A, n))
    x, t = nearest_on_segments(p, p_A, p_C)
    n = subtract(p, x)
    square = dot(n, n)
    height, number, _ = furthest_corner(blocks, first, corners, n)
    is_end = t == 1.0
    is_last = (number == c) | (~is_end & (number == a)) | (is_end & (height <= dot(p_C, n)))
    phi = root(square)
    is_found = is_edge & (square < least) & is_last & (phi > FAR * size)
    _store(kept, _NEAREST, x)
    _store(kept, _GRADIENT, scale(1.0 / phi, n))
    store_lanes(kept, _PHI, phi)
    store_lanes(kept, _IS_FOUND, select(is_found, 1.0, 0.0))
