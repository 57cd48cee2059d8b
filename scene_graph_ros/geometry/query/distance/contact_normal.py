"""The normal where a mesh touches, or nearly: from all the triangles that meet at the contact.

Between points that (nearly) coincide no direction is left, and one triangle alone, say at its
corner, allows many that its neighbours do not. A separating direction is in the normal cones
of both sides: one along which the triangles at the contact and their partners are as far apart as
their points are near. Where the contact is on the convex hulls, that of the hulls is one.

Elsewhere the way there are small steps apart: moved away along a direction that is nearly right,
by a length below the size of the features, the two are nearest at a distance and along a normal
that their features fix to rounding, and that normal is the direction's projection on the cones (a
step of the proximal point algorithm: Rockafellar, "Monotone operators and the proximal point
algorithm", 1976). As nobody knows the size of the features, the steps get shorter.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import (
    inlined_kernel,
    kernel,
    lean_kernel,
    merged_kernel,
)
from scene_graph_ros.geometry.narrowphase.convex_distance import convex_distance
from scene_graph_ros.geometry.narrowphase.cores.kinds import TRIANGLE
from scene_graph_ros.geometry.narrowphase.cores.questions import placed_support
from scene_graph_ros.geometry.narrowphase.pair import Placed
from scene_graph_ros.geometry.query.distance.triangle_triangle import distance_triangle_triangle
from scene_graph_ros.geometry.query.point.flat_features import nearest_on_triangle
from scene_graph_ros.geometry.spatial.vectors import (
    add,
    any_orthogonal,
    axpy,
    cross,
    dot,
    load_vector,
    norm,
    rotate,
    scale,
    unit,
)
from scene_graph_ros.geometry.tolerances import COINCIDENCE, EPSILON, SAME_DIRECTION

__all__ = [
    "TOUCHING",
    "corners_of",
    "normal_of_triangles",
    "normal_to_core",
    "touching_point",
    "touching_triangles",
    "triangle_core",
]

TOUCHING = 4.0
"""In units of ``COINCIDENCE`` times the pair's size: an overlap no deeper than this is touching,
so that the way out is no plane's but that of the contact."""

FIRST_LIFT = 0.25
"""Of the pair's size: how far the first step moves the two apart."""

SHORTER = 1.0 / 16.0
"""Each step is that much shorter than the one before."""

STEPS = 8
"""The last step is 1e-9 of the pair's size: shorter ones would be measured to fewer digits than
smaller features need."""

BESIDE = 1e-3
"""Radians: how far a direction is turned to see whether it is the only one."""


@lean_kernel
def corners_of(vertices, triangles, t):
    """Return the corners of triangle t."""
    return (
        load_vector(vertices, triangles[t, 0]),
        load_vector(vertices, triangles[t, 1]),
        load_vector(vertices, triangles[t, 2]),
    )


@lean_kernel
def triangle_core(vertices, triangles, t):
    """Return triangle t as a core."""
    a, b, c = corners_of(vertices, triangles, t)
    return (TRIANGLE, -1, 0.0, (a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]))


@inlined_kernel
def _gap_to_core(at, triangles, count, n):
    """Return the gap of a core and the foremost of some triangles, along n."""
    surfaces, highest = at.surfaces, -math.inf
    for c in range(count):
        for corner in range(3):
            v = surfaces.triangles[triangles[c], corner]
            highest = max(highest, dot(n, load_vector(surfaces.vertices, v)))
    x, _ = placed_support(Placed(at.core, at.R, at.p), at.hulls, scale(-1.0, n))
    return dot(n, x) - highest


@merged_kernel
def _settled(at, triangles, count, distance, n, size):
    """Return (is found, n): a direction along which a core is ``distance`` from triangles."""
    surfaces, enough = at.surfaces, distance - COINCIDENCE * size
    gap = _gap_to_core(at, triangles, count, n)
    lift = FIRST_LIFT * size
    for _ in range(STEPS):
        if gap >= enough:
            break
        least, other = math.inf, n
        for c in range(count):
            triangle = triangle_core(surfaces.vertices, surfaces.triangles, triangles[c])
            near, _, _, m, _, _, _ = convex_distance(
                triangle, at.core, at.R, axpy(lift, n, at.p), at.hulls, least, 0.0
            )
            if near < least:
                least, other = near, scale(-1.0, m)
        between = _gap_to_core(at, triangles, count, other)
        if between > gap:
            gap, n = between, other
        lift *= SHORTER
    return gap >= distance - TOUCHING * COINCIDENCE * size, n


@lean_kernel
def _keep_those_at(surfaces, x, triangles, count, tolerance):
    """Move the triangles that x is on to the front, and return how many they are."""
    kept = 0
    for c in range(count):
        t = triangles[c]
        i, j, k = corners_of(surfaces.vertices, surfaces.triangles, t)
        _, square, _ = nearest_on_triangle(x, i, j, k, load_vector(surfaces.normals, t))
        if square <= tolerance * tolerance:
            triangles[c], triangles[kept] = triangles[kept], t
            kept += 1
    return kept


@merged_kernel
def normal_to_core(at, triangles, count, contact, size):
    """Return (n, unique) of a core without a radius at a mesh.

    ``triangles`` are the ``count`` ones that are nearest, ``contact`` is the answer of one of
    them: (distance, its point, unit normal out of the surface, whether that is the only one). If
    nothing separates all of them, as in a groove, it is about those that the point is on.
    """
    distance, x, n, unique = contact
    slack = TOUCHING * COINCIDENCE * size
    phi, _, _, m, is_unique, _, _ = convex_distance(
        at.hull, at.core, at.R, at.p, at.hulls, math.inf, 0.0
    )
    if phi >= distance - slack:
        return scale(-1.0, m), is_unique
    is_found, m = _settled(at, triangles, count, distance, n, size)
    if not is_found:
        kept = _keep_those_at(at.surfaces, x, triangles, count, slack)
        if kept < count:
            is_found, m = _settled(at, triangles, kept, distance, n, size)
    return m if is_found else n, unique


@lean_kernel
def _placed(triangle, R, p):
    a, b, c = triangle
    return add(rotate(R, a), p), add(rotate(R, b), p), add(rotate(R, c), p)


@inlined_kernel
def _gap_of_triangles(surfaces, R, p, pairs, count, n):
    """Return the gap of the first triangles of all pairs and the second ones, along n."""
    lowest, highest = math.inf, -math.inf
    for c in range(count):
        for corner in range(3):
            v = surfaces.triangles[pairs[c, 0], corner]
            lowest = min(lowest, dot(n, load_vector(surfaces.vertices, v)))
            v = surfaces.triangles[pairs[c, 1], corner]
            x = add(rotate(R, load_vector(surfaces.vertices, v)), p)
            highest = max(highest, dot(n, x))
    return lowest - highest


@kernel
def _lifted_triangles(surfaces, R, p, pairs, count, n, lift):
    """Return (distance, x, n) of the nearest of pairs of triangles, moved apart along n.

    The second ones are placed at R, p and moved by ``lift`` against n. x is on the first one.
    """
    p = axpy(-lift, n, p)
    least, nearest, normal = math.inf, p, n
    for c in range(count):
        t, s = pairs[c]
        distance, x, m = distance_triangle_triangle(
            corners_of(surfaces.vertices, surfaces.triangles, t),
            _placed(corners_of(surfaces.vertices, surfaces.triangles, s), R, p),
            load_vector(surfaces.normals, t),
            rotate(R, load_vector(surfaces.normals, s)),
        )
        if distance < least:
            least, nearest, normal = distance, x, m
    return least, nearest, normal


@kernel
def touching_point(surfaces, R, p, pairs, count, n, gap, size):
    """Return the point of the first surface where pairs of triangles touch that n separates.

    It is that of the step apart whose nearest points fit n and ``gap`` best: far apart, a point is
    known along its face to half the digits only, very near its direction is not.
    """
    point, least = p, math.inf
    lift = FIRST_LIFT * size
    for _ in range(STEPS):
        distance, x, m = _lifted_triangles(surfaces, R, p, pairs, count, n, lift)
        rest = norm(axpy(-distance, m, scale(lift + gap, n)))
        if rest < least:
            point, least = x, rest
        if rest <= EPSILON * size:
            break
        lift *= SHORTER
    return point


@kernel
def _settled_pairs(surfaces, R, p, pairs, count, distance, n, size):
    """Return (gap, n): a direction along which all pairs are ``distance`` apart, if any is."""
    gap = _gap_of_triangles(surfaces, R, p, pairs, count, n)
    lift = FIRST_LIFT * size
    for _ in range(STEPS):
        if gap >= distance - COINCIDENCE * size:
            break
        _, _, m = _lifted_triangles(surfaces, R, p, pairs, count, n, lift)
        between = _gap_of_triangles(surfaces, R, p, pairs, count, m)
        if between > gap:
            gap, n = between, m
        lift *= SHORTER
    return gap, n


@lean_kernel
def _keep_pairs_at(surfaces, R, p, x, y, pairs, count, tolerance):
    """Move the pairs that x and y are on to the front, and return how many they are."""
    kept = 0
    for c in range(count):
        t, s = pairs[c, 0], pairs[c, 1]
        i, j, k = corners_of(surfaces.vertices, surfaces.triangles, t)
        _, square, _ = nearest_on_triangle(x, i, j, k, load_vector(surfaces.normals, t))
        i, j, k = _placed(corners_of(surfaces.vertices, surfaces.triangles, s), R, p)
        n = rotate(R, load_vector(surfaces.normals, s))
        _, other, _ = nearest_on_triangle(y, i, j, k, n)
        if max(square, other) <= tolerance * tolerance:
            pairs[c, 0], pairs[c, 1] = pairs[kept, 0], pairs[kept, 1]
            pairs[kept, 0], pairs[kept, 1] = t, s
            kept += 1
    return kept


@kernel
def normal_of_triangles(surfaces, R, p, pairs, count, contact, size):
    """Return (kept, gap, n): a direction along which pairs of triangles are apart, and how far.

    ``pairs`` are the ``count`` ones that are nearest, ``contact`` is the answer of one of
    them: (distance, the first's point, unit normal out of the second). The second surface is
    placed at R, p in the frame of the first. If nothing separates all pairs, as in a groove, it
    is about the ``kept`` first ones, those that the nearest points are on, or about none.
    """
    distance, x, n = contact
    slack = TOUCHING * COINCIDENCE * size
    gap, m = _settled_pairs(surfaces, R, p, pairs, count, distance, n, size)
    if gap >= distance - slack:
        return count, gap, m
    kept = _keep_pairs_at(surfaces, R, p, x, axpy(-distance, n, x), pairs, count, slack)
    if 0 < kept < count:
        gap, m = _settled_pairs(surfaces, R, p, pairs, kept, distance, n, size)
        if gap >= distance - slack:
            return kept, gap, m
    return 0, distance, n


@lean_kernel
def _normals_of(surfaces, R, pair):
    """Return two directions out of the second triangle of a pair, one of each."""
    n = load_vector(surfaces.normals, pair[0])
    return rotate(R, load_vector(surfaces.normals, pair[1])), scale(-1.0, n)


@kernel
def _is_only_one(surfaces, R, p, pairs, count, n, gap, size):
    """Return whether no direction beside n separates pairs of triangles as well."""
    t = any_orthogonal(n)
    u = cross(n, t)
    lift = FIRST_LIFT * size
    for turn in (t, scale(-1.0, t), u, scale(-1.0, u)):
        for _ in range(STEPS):
            beside = unit(axpy(BESIDE, turn, n), n)
            _, _, m = _lifted_triangles(surfaces, R, p, pairs, count, beside, lift)
            between = _gap_of_triangles(surfaces, R, p, pairs, count, m)
            if between >= gap - COINCIDENCE * size and dot(m, n) < SAME_DIRECTION:
                return False
            lift *= SHORTER
        lift = FIRST_LIFT * size
    return True


@kernel
def touching_triangles(surfaces, R, p, pairs, count, size):
    """Return (is touching, distance, x, n, unique) of triangles that cut each other or nearly.

    Pairs of them touch if none overlaps by more than rounding; then x is a point of the first
    surface and n a direction out of the second in which they are ``distance`` apart.
    """
    slack = TOUCHING * COINCIDENCE * size
    highest, gap, n, first = -math.inf, -math.inf, (0.0, 0.0, 1.0), 0
    for c in range(count):
        own, direction = -math.inf, n
        for start in _normals_of(surfaces, R, pairs[c]):
            between, m = _settled_pairs(surfaces, R, p, pairs[c : c + 1], 1, 0.0, start, size)
            if between > own:
                own, direction = between, m
        if own < -slack:
            return False, own, p, direction, False
        if c == 0 or dot(direction, n) < SAME_DIRECTION:
            between = _gap_of_triangles(surfaces, R, p, pairs, count, direction)
            if between > highest:
                highest, gap, n, first = between, own, direction, c
    x = touching_point(surfaces, R, p, pairs[first:], 1, n, gap, size)
    kept, least, m = normal_of_triangles(surfaces, R, p, pairs, count, (0.0, x, n), size)
    if kept == 0:
        return True, gap, x, n, False
    x = touching_point(surfaces, R, p, pairs, kept, m, least, size)
    return True, least, x, m, _is_only_one(surfaces, R, p, pairs, kept, m, least, size)
