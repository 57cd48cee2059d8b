"""Which triangles belong together where more than two meet at an edge.

They are paired around it: first those of one part, as far as parts are known, then those beside
each other that bound one wedge of the solid. Where wedges are nested, by the winding numbers of
the sectors between triangles: the wedge that began last ends first, so that no pair passes through
another one. Parts with a pair of triangles around one edge are one part around all others.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.meshes.solids.half_edges import Edges, edges_of, mates_of
from scene_graph_ros.geometry.meshes.solids.walk import walk_parts
from scene_graph_ros.geometry.spatial.elementary import arc_tangents
from scene_graph_ros.geometry.spatial.sums import length, product

__all__ = ["is_nested_in_itself", "pair_around", "with_pairs_apart"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

_ONE_PLANE = 1e-6
"""Radians: triangles around an edge that are nearer to each other are in one plane."""

_NEARLY_ONE = 1e-4
"""Radians: the same of triangles so short that the rounding of their corners tells no more."""

_UP = (0.5403, 0.2918, 0.7892)
"""A direction that is along hardly any plane."""


class _Pairs(NamedTuple):
    """Pairs of half edges around an edge."""

    one: IntArray
    """(k,): where wedges begin."""
    other: IntArray
    """(k,): where they end."""
    flat: int
    """How many pairs are in one plane, so that they bound nothing."""


def with_pairs_apart(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Return oriented triangles (m, 3) with vertices of their own where only edges of two join.

    The same surface, in which no edge has more than two triangles and no vertex more than one fan,
    unless triangles go through each other at an edge.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = edges_of(triangles)
    mate = mates_of(edges)
    if (mate < 0).any():
        label, turned, _ = walk_parts(mate, edges.start)
        is_closed = np.zeros(len(triangles), dtype=bool)
        pair_around(vertices, triangles, edges, mate, is_closed, label, turned)
    half = np.flatnonzero(mate >= 0)
    across = mate[half]
    # Corner h is where half edge h begins, and its mate ends there.
    ends = 3 * (across // 3) + (across % 3 + 1) % 3
    n = len(mate)
    graph = coo_array((np.ones(len(half)), (half, ends)), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    first = np.unique(label, return_index=True)[1]
    return vertices[edges.start[first]], label.astype(np.int64).reshape(-1, 3)


def pair_around(
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    mate: IntArray,
    is_closed: BoolArray,
    label: IntArray,
    turned: BoolArray,
    gap: float = 0.0,
) -> bool:
    """Pair half edges of open parts around edges that have an even number of them; tell if any.

    ``label`` (m,) is the part of each triangle, as far as it is known by edges of two, and
    ``turned`` (m,) whether it runs the other way than the part's first one. What is nearer to
    another plane than ``gap``, metres, may be in it.
    """
    around = []
    for e in np.flatnonzero(edges.counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half = half[(mate[half] < 0) & ~is_closed[half // 3]]
        if len(half) > 1 and len(half) % 2 == 0:
            around.append(half)
    if not around:
        return False
    begins = (edges.start > edges.end) != np.repeat(_against(label, turned), 3)
    is_oriented = _run_alike(edges, around, begins)

    def paired(half: IntArray, of: IntArray) -> tuple[IntArray, IntArray]:
        found = _pairs(vertices, triangles, edges, half, of, begins, gap)
        if found.flat:
            # Cavities that touch are wedges of what is around them.
            other = _pairs(vertices, triangles, edges, half, of, ~begins, gap)
            found = min(found, other, key=lambda each: each.flat)
        return found.one, found.other

    oriented = [half for half in around if is_oriented[half[0] // 3]]
    _pair_oriented(oriented, label, begins, mate, paired)
    for half in around:
        if is_oriented[half[0] // 3]:
            continue
        half = _without_own_pairs(half, begins[half], label, mate)
        if not len(half):
            continue
        half, gaps, _ = _around(vertices, triangles, edges, half, label[half // 3], None, gap)
        one = np.arange(_tighter(gaps), len(half), 2)
        other = (one + 1) % len(half)
        mate[half[one]], mate[half[other]] = half[other], half[one]
    return True


class _Bodies:
    """Parts (n,), those of which triangles were paired as one body, and the edges of each."""

    def __init__(self, label: IntArray, around: list[IntArray]) -> None:
        self._label = label
        self._first = list(range(int(label.max()) + 1))
        self._edges: dict[int, list[int]] = defaultdict(list)
        for k, half in enumerate(around):
            for part in np.unique(label[half // 3]).tolist():
                self._edges[part].append(k)

    def of(self, half: IntArray) -> IntArray:
        """Return for half edges (k,) the lowest part of each one's body."""
        return np.array(
            [self._root(part) for part in self._label[half // 3].tolist()], dtype=np.int64
        )

    def join(self, half: int, other: int) -> list[int]:
        """Take the bodies of two half edges as one; return the edges that both may be at."""
        low, high = sorted(self.of(np.array([half, other])).tolist())
        if low == high:
            return []
        self._first[high] = low
        fewer, more = sorted((self._edges[low], self._edges.pop(high)), key=len)
        self._edges[low] = more + fewer
        return fewer

    def _root(self, part: int) -> int:
        first = self._first
        while first[part] != part:
            first[part] = part = first[first[part]]
        return part


def _pair_oriented(
    around: list[IntArray],
    label: IntArray,
    begins: BoolArray,
    mate: IntArray,
    paired: Callable[[IntArray, IntArray], tuple[IntArray, IntArray]],
) -> None:
    """Pair the half edges (k,) around each edge, of which ``begins`` tells where wedges begin.

    A body that has as many beginnings as ends around an edge has pairs of its own there. Where
    there are others, faces on each other may go with either body: pairs around one edge tell which
    around the next. ``paired`` returns pairs of half edges around an edge, given their bodies.
    """
    bodies = _Bodies(label, around)
    left = list(around)
    waiting = deque(range(len(around)))

    def pair(half: IntArray) -> None:
        one, other = half[:1], half[1:]
        if len(half) > 2:
            one, other = paired(half, bodies.of(half))
        mate[one], mate[other] = other, one
        for both in zip(one.tolist(), other.tolist(), strict=True):
            waiting.extend(bodies.join(*both))

    def pair_known() -> None:
        while waiting:
            k = waiting.popleft()
            of = bodies.of(left[k])
            for body in np.unique(of).tolist():
                own = left[k][of == body]
                if 2 * np.count_nonzero(begins[own]) == len(own):
                    pair(own)
                    left[k] = left[k][of != body]
                    of = of[of != body]
            if len(left[k]) == 2:
                pair(left[k])
                left[k] = left[k][:0]

    pair_known()
    for k in range(len(around)):
        if len(left[k]):
            pair(left[k])
            left[k] = left[k][:0]
            pair_known()


def _against(label: IntArray, turned: BoolArray) -> BoolArray:
    """Return a mask of triangles (m,): those that run against most of their part."""
    share = np.bincount(label, turned) / np.bincount(label)
    return turned != (share > 0.5)[label]


def _run_alike(edges: Edges, around: list[IntArray], begins: BoolArray) -> BoolArray:
    """Tell of triangles (m,) whether the bodies that they are joined with say what is inside.

    They do where each of the edges ``around`` is run through as often one way as the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, row = len(edges.order) // 3, edges.rows()
    triangle = np.arange(3 * m) // 3
    graph = coo_array((np.ones(3 * m), (triangle, m + row)), shape=(m + len(edges.counts),) * 2)
    body = connected_components(graph, directed=False)[1][:m]
    is_alike = np.ones(int(body.max()) + 1, dtype=bool)
    for half in around:
        is_alike[body[half[0] // 3]] &= 2 * np.count_nonzero(begins[half]) == len(half)
    return np.asarray(is_alike[body])


def _without_own_pairs(
    half: IntArray, begins: BoolArray, label: IntArray, mate: IntArray
) -> IntArray:
    """Pair those half edges (k,) that are the only two of their part; return the others."""
    of = label[half // 3]
    is_paired = np.zeros(len(half), dtype=bool)
    for part in np.unique(of):
        rows = np.flatnonzero(of == part)
        if len(rows) == 2 and begins[rows[0]] != begins[rows[1]]:
            one, other = half[rows]
            mate[one], mate[other] = other, one
            is_paired[rows] = True
    return half[~is_paired]


def is_nested_in_itself(vertices: FloatArray, triangles: IntArray) -> bool:
    """Tell whether oriented closed triangles (m, 3) wind twice around a sector at an edge."""
    edges = edges_of(triangles)
    begins = edges.start > edges.end
    for e in np.flatnonzero(edges.counts > 2):
        half = edges.order[edges.first[e] : edges.first[e + 1]]
        half, _, _ = _around(vertices, triangles, edges, half, np.zeros(len(half), int), begins)
        if (begins[half] == np.roll(begins[half], 1)).any():
            return True
    return False


def _around(
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    half: IntArray,
    body: IntArray,
    begins: BoolArray | None,
    gap: float = 0.0,
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return the half edges (k,) of an edge counter-clockwise around it, gaps behind, and planes.

    Of those in one plane the solid's wedges end before others begin. Several that begin there, or
    end, are nested as their bodies (k,) say, the lowest outside, at all edges alike. ``begins``
    (3 m,) tells of half edges where wedges begin; without it, the bodies' order is that of sheets
    on one another.
    """
    angles, arms, stack = _angles(vertices, triangles, edges, half)
    order = np.argsort(angles, kind="stable")
    gaps = np.diff(np.append(angles[order], angles[order[0]] + 2.0 * np.pi))
    # From the widest gap on, so that no plane is cut in two.
    widest = int(gaps.argmax()) + 1
    order, gaps = np.roll(order, -widest), np.roll(gaps, -widest)
    half, body, stack, arms = half[order], body[order], stack[order], arms[order]
    shorter = np.maximum(np.minimum(arms[:-1], arms[1:]), gap / _NEARLY_ONE)
    one_plane = np.maximum(_ONE_PLANE, gap / np.where(shorter > 0.0, shorter, 1.0))
    plane = np.concatenate([[0], np.cumsum(gaps[:-1] > one_plane)])
    ends_first = [] if begins is None else [begins[half]]
    way = stack if begins is None else np.where(begins[half], 1, -1)
    keys = [way * half, way * body, *ends_first, plane]
    order = np.lexsort(keys)
    return half[order], gaps, plane[order]


def _pairs(
    vertices: FloatArray,
    triangles: IntArray,
    edges: Edges,
    half: IntArray,
    body: IntArray,
    begins: BoolArray,
    gap: float,
) -> _Pairs:
    """Return the pairs of half edges (k,), given the body of each, that bound a wedge."""
    half, _, plane = _around(vertices, triangles, edges, half, body, begins, gap)
    one, other = _wedges(begins[half])
    return _Pairs(half[one], half[other], int(np.count_nonzero(plane[one] == plane[other])))


def _wedges(begins: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the beginnings and ends of wedges, (k / 2,) rows each, of half edges (k,)."""
    sectors = np.cumsum(np.where(begins, 1, -1))
    first = int(sectors.argmin()) + 1  # behind a sector of the lowest winding number
    pairs, open_ones = [], []
    for k in range(first, first + len(begins)):
        row = k % len(begins)
        if begins[row]:
            open_ones.append(row)
        else:
            pairs.append((open_ones.pop(), row))
    one, other = np.array(pairs).T
    return one, other


def _angles(
    vertices: FloatArray, triangles: IntArray, edges: Edges, half: IntArray
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the angles (k,) of triangles around their common edge, from the lower vertex.

    And how far (k,) their third corners are from it, and whether sheets on each are behind one
    another there in the order in which they are along _UP, 1, or the other way round, -1.
    """
    low = np.minimum(edges.start[half[0]], edges.end[half[0]])
    high = np.maximum(edges.start[half[0]], edges.end[half[0]])
    axis = vertices[high] - vertices[low]
    if not axis.any():
        axis = np.ones(3)  # of equal vertices any direction is as good
    axis /= length(axis)
    across = np.eye(3)[np.abs(axis).argmin()]
    u = np.cross(axis, across)
    u /= length(u)
    corner = triangles[half // 3, (half % 3 + 2) % 3]
    arms = vertices[corner] - vertices[low]
    x, y = product(arms, u), product(arms, np.cross(axis, u))
    angles: FloatArray = arc_tangents(y, x)
    return (
        angles,
        np.sqrt(x * x + y * y),
        np.where(product(np.cross(axis, arms), np.array(_UP)) > 0.0, 1, -1),
    )


def _tighter(gaps: FloatArray) -> int:
    """Return 0 or 1: from which on pairs of half edges are nearer to each other.

    Pairs in one plane bound nothing: they are avoided.
    """
    is_flat = gaps <= _ONE_PLANE
    if is_flat[::2].any() != is_flat[1::2].any():
        return 1 if is_flat[::2].any() else 0
    return 0 if gaps[::2].sum() <= gaps[1::2].sum() else 1
