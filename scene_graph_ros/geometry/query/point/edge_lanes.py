"""Points nearest to an edge of a small hull, four of them in step.

A step leads from the corner most likely to be nearest to the edge from there to the corner that
lies furthest towards the point. Where no other lies further towards it than that edge, it is the
nearest; ``point_convex`` does the same, by the same arithmetic in the same order.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.compiled.lanes import (
    all_of,
    as_lanes,
    FOUR,
    load_number,
    root,
    select,
    store_number,
)
from scene_graph_ros.geometry.query.point.corner_scan import furthest_corner
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_segments
from scene_graph_ros.geometry.query.point.lane_memory import LANES
from scene_graph_ros.geometry.query.point.point_convex import FAR
from scene_graph_ros.geometry.spatial.vectors import dot, rotate, rotate_inverse, scale, subtract

__all__ = ["answer_on_edges"]


@inlined_kernel
def _load(numbers, at, four):
    a, b, c, d = four
    return as_lanes(
        (
            load_number(numbers, at + a),
            load_number(numbers, at + b),
            load_number(numbers, at + c),
            load_number(numbers, at + d),
        )
    )


@inlined_kernel
def _load_triple(numbers, at, four):
    x, y = _load(numbers, at, four), _load(numbers, at + LANES, four)
    return x, y, _load(numbers, at + 2 * LANES, four)


@inlined_kernel
def _store(numbers, at, four, lanes):
    for k in range(FOUR):
        store_number(numbers, at + four[k], lanes[k])


@inlined_kernel
def _store_triple(numbers, at, four, v):
    _store(numbers, at, four, v[0])
    _store(numbers, at + LANES, four, v[1])
    _store(numbers, at + 2 * LANES, four, v[2])


@inlined_kernel
def _nearest_edges(p, p_A, a, blocks, first, corners, size):
    """Return (phi, p_GN, grad_G, is_found) of four points and a hull; the rest is no answer.

    Each begins at its likely corner, ``p_A``, which has the number ``a``. The first of the hull's
    ``corners`` is at the place ``first`` of the blocks, ``size`` is its extent.
    """
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
    return phi, x, scale(1.0 / phi, n), is_found


@inlined_kernel
def answer_on_edges(asked, four, numbers, blocks, first, corners, size):
    """Answer four lanes, whose likely corners are kept; return whether all have their answers."""
    answers, at = asked.answers, asked.first
    p_WQ = _load_triple(asked.points, 0, four)
    p_GQ = rotate_inverse(asked.R_WG, subtract(p_WQ, asked.p_WG))
    p_A, a = _load_triple(answers, at + LANES, four), _load(numbers, 0, four)
    phi, p_GN, grad_G, is_found = _nearest_edges(p_GQ, p_A, a, blocks, first, corners, size)
    _store(answers, at, four, phi)
    _store_triple(answers, at + LANES, four, p_GN)
    _store_triple(answers, at + 4 * LANES, four, rotate(asked.R_WG, grad_G))
    _store(answers, at + 7 * LANES, four, select(is_found, 1.0, 0.0))
    return all_of(is_found)
