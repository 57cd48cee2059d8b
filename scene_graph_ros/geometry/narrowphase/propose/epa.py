"""Depth of two overlapping cores by the expanding polytope algorithm (EPA).

A polytope inside C = {a - b} grows at the face nearest to the origin. That face's distance is a
lower bound of the depth, the extent of C along any face's normal an upper one. The distances are
signed, so the origin may start outside the polytope, as it does by rounding when A and B touch.
"""

import math
from typing import NamedTuple

from scene_graph_ros.geometry.compiled.kernel import kernel, lean_kernel
from scene_graph_ros.geometry.compiled.stack_arrays import stack_array
from scene_graph_ros.geometry.narrowphase.contact.refine import refine, separation
from scene_graph_ros.geometry.narrowphase.cores.kinds import ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import feature_at
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.pair import (
    A_SIDE,
    B_SIDE,
    body_A,
    body_B,
    Simplex,
)
from scene_graph_ros.geometry.narrowphase.propose.gjk import store_support
from scene_graph_ros.geometry.narrowphase.propose.minima import (
    best_minimum,
    COLUMNS,
    DEPTH,
    FALLBACK,
    has_features,
    MAX_MINIMA,
    nearby_minimum,
    note_features,
    STIFFNESS,
    store_minimum,
)
from scene_graph_ros.geometry.narrowphase.propose.polytope import (
    add_corner,
    close_face,
    corners_of,
    distance_of,
    empty_polytope,
    is_closed,
    nearest_face,
    new_polytope,
    normal_of,
    Polytope,
    start_tetrahedron,
)
from scene_graph_ros.geometry.narrowphase.propose.simplex import (
    closest_on_simplex,
    weighted_points,
)
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, norm, scale, subtract
from scene_graph_ros.geometry.tolerances import (
    EPSILON,
    FLAT_MINIMUM,
    GJK_ROUNDING,
    NEAR_CONTACT,
    POLISH_RESIDUAL,
    SAME_DIRECTION,
    TIE,
)

__all__ = ["COARSE_GAP", "FINE_GAP", "LARGE", "MEDIUM", "epa", "epa_with_room"]

_OPEN = int(Mechanism.OPEN)
_EPA = int(Mechanism.EPA)
_NO_CORNERS = (-1, -1, -1)
_BASINS = int(Mechanism.BASINS)

SMALL = 96
"""Corners of the first polytope: enough for primitives, and it stays in the machine's stack."""

MEDIUM = 256
"""Corners of the second polytope of smooth cores: what is still open then nearly ties all along a
valley, and no number of corners tells it apart."""

LARGE = 1024
"""Corners of the second polytope for hulls, whose many faces may nearly tie."""

BASIN_COSINE = 0.9800665778412416
"""A polished direction further than this from where it started belongs to another face."""

COARSE_GAP = 1e-2
"""Share of the depth: the gap at which a face is polished between smooth cores. From there on it
is taken to have no other minimum (``settle_gap``)."""

FINE_GAP = 1e-3
"""The same for hulls, many faces of which may nearly tie, and for a face whose polish led far."""


_S, _ids, _faces, _planes, _stack, _ring = (
    stack_array(part.shape, part.dtype) for part in empty_polytope(SMALL)
)
_minima = stack_array((FALLBACK + 1, COLUMNS))


class SmallFace(NamedTuple):
    """A face whose gap is small enough to be refined.

    n is the direction out of B into A that it proposes, ``extent`` the depth along it (m).
    """

    n: tuple[float, float, float]
    extent: float
    is_fine: bool


@lean_kernel
def _equals_corner(S, corner):
    for i in range(corner):
        if S[i, 0] == S[corner, 0] and S[i, 1] == S[corner, 1] and S[i, 2] == S[corner, 2]:
            return True
    return False


@lean_kernel
def _load_face(polytope, corners, work):
    """Copy a face to ``work``, reduce it to the part nearest to the origin; return (count, v)."""
    for k in range(3):
        row = corners[k]
        for c in range(9):
            work.S[k, c] = polytope.S[row, c]
        work.ids[k, 0] = polytope.ids[row, 0]
        work.ids[k, 1] = polytope.ids[row, 1]
    return closest_on_simplex(work, 3)


@lean_kernel
def _load_nearest(polytope, face_count, f, rounding, work):
    """Load face f, or one in its plane, namely that over the origin; return its count, and which.

    A facet of C is often cut into many faces, all at the same distance.
    """
    faces, planes = polytope.faces, polytope.planes
    n = normal_of(planes, f)
    count, v = _load_face(polytope, corners_of(faces, f), work)
    distance = distance_of(planes, f)
    nearest = math.sqrt(dot(v, v))
    best = f
    last = f
    if nearest > abs(distance) + rounding:
        for g in range(face_count):
            if g == f or distance_of(planes, g) > distance + rounding:
                continue
            if dot(n, normal_of(planes, g)) > SAME_DIRECTION:
                count, v = _load_face(polytope, corners_of(faces, g), work)
                last = g
                length = math.sqrt(dot(v, v))
                if length < nearest:
                    nearest = length
                    best = g
    if last != best:
        count, _ = _load_face(polytope, corners_of(faces, best), work)
    return count, best


@lean_kernel
def _is_tied(pair, size, tolerance, polytope, face_count, minima, found, best):
    """Return whether another direction gives the same depth, to ``tolerance`` or rounding."""
    planes = polytope.planes
    n = (minima[best, 0], minima[best, 1], minima[best, 2])
    tie = minima[best, DEPTH] + max(TIE * EPSILON * size, tolerance)
    same = BASIN_COSINE if tolerance > 0.0 else SAME_DIRECTION
    if minima[best, STIFFNESS] < FLAT_MINIMUM * size:
        return True
    for i in range(found):
        if i != best and minima[i, DEPTH] <= tie:
            m = (minima[i, 0], minima[i, 1], minima[i, 2])
            if dot(n, m) < same:
                return True
    for f in range(face_count):
        if distance_of(planes, f) > tie or is_closed(polytope, f):
            continue
        m = scale(-1.0, normal_of(planes, f))
        if dot(n, m) < same and -separation(pair, m) <= tie:
            return True
    return False


@lean_kernel
def _settle(pair, size, face, simplex, minima, found):
    """Find the minimum that the region of a face belongs to; return (its row, minima found).

    The row is -1 where the face has to be divided further: one that leads far away is believed
    when it ``is_fine``. A proposal of a core's face is believed in its own direction only:
    around a face is a rim, and beside that it may be less deep.
    """
    n, extent, is_fine = face
    near = nearby_minimum(minima, found, n, BASIN_COSINE)
    is_higher = near >= 0 and minima[near, DEPTH] <= extent
    feature_A = feature_at(body_A(pair), simplex, A_SIDE, scale(-1.0, n))
    feature_B = feature_at(body_B(pair), simplex, B_SIDE, n)
    # Two minima may be close to each other, but not with the same features.
    is_known = is_higher and has_features(minima, near, feature_A, feature_B)
    if is_known and minima[near, STIFFNESS] < math.inf:
        return near, found
    if is_known:
        m = (minima[near, 0], minima[near, 1], minima[near, 2])
        return near if dot(m, n) > SAME_DIRECTION else -1, found
    a, b = weighted_points(simplex)
    proven, least = refine(pair, n, a, b, size, simplex, 2)
    if not proven or least.stiffness < -FLAT_MINIMUM * size:
        return -1, found
    row = nearby_minimum(minima, found, least.n, SAME_DIRECTION)
    if row < 0:
        row = found
        found += 1
        store_minimum(minima, row, least.n, least.a, least.b, -least.distance, least.stiffness)
    note_features(minima, row, feature_A, feature_B)
    if least.stiffness < math.inf:
        is_near = dot(least.n, n) > BASIN_COSINE or (is_fine and -least.distance <= extent)
    else:
        is_near = dot(least.n, n) > SAME_DIRECTION
    return row if is_near else -1, found


@lean_kernel
def _polish_fallback(pair, size, n, a, b, extent, simplex, minima):
    """Polish the witnesses of a face that is exact where they aren't those of its extent."""
    if norm(axpy(extent, n, subtract(a, b))) <= POLISH_RESIDUAL * EPSILON * size:
        return
    proven, exact = refine(pair, n, a, b, size, simplex, 2)
    if proven and -exact.distance <= extent + TIE * EPSILON * size:
        store_minimum(minima, FALLBACK, exact.n, exact.a, exact.b, -exact.distance, math.inf)


@lean_kernel
def _corners_over_origin(polytope, face_count, f, depth, corners, size, work):
    """Return the corners of the face over the origin in the plane of f, if f is the fallback."""
    if distance_of(polytope.planes, f) > depth:
        return corners
    _, g = _load_nearest(polytope, face_count, f, TIE * EPSILON * size, work)
    return corners_of(polytope.faces, g)


@lean_kernel
def _best_with_witnesses(size, polytope, corners, minima, found, work):
    """Return the best row; the fallback's witnesses are those of the face with ``corners``."""
    best = best_minimum(minima, found, TIE * EPSILON * size)
    if best == FALLBACK and corners[0] >= 0:
        count, _ = _load_face(polytope, corners, work)
        a, b = weighted_points(Simplex(work.S, work.ids, work.lam, count))
        for c in range(3):
            minima[FALLBACK, 3 + c] = a[c]
            minima[FALLBACK, 6 + c] = b[c]
    return best


@lean_kernel
def _grow(pair, size, settle_gap, tolerance, polytope, minima, work):
    """Run EPA's loop; return (decided by, lower bound, best row, rows of faces, minima found)."""
    faces, planes = polytope.faces, polytope.planes
    face_count = start_tetrahedron(polytope)
    rounding = GJK_ROUNDING * EPSILON * size
    depth, settled = math.inf, math.inf
    lower = -math.inf
    found = 0
    decided_by = _OPEN
    corners = _NO_CORNERS
    for corner in range(4, polytope.S.shape[0]):
        f, distance = nearest_face(planes, face_count)
        if distance == math.inf:
            break
        lower = max(lower, distance)
        if is_closed(polytope, f) or settled <= distance or found == MAX_MINIMA:
            decided_by = _BASINS if found > 0 else _EPA
            break
        n = scale(-1.0, normal_of(planes, f))
        w = store_support(pair, n, polytope, corner)
        extent = -dot(n, w)
        gap = extent - distance
        # The least distance must be known to be positive before the rest is left open.
        enough = max(rounding, tolerance) if distance > rounding else rounding
        reach = max(abs(extent), NEAR_CONTACT * size)
        is_small = settle_gap > 0.0 and gap <= settle_gap * reach
        if extent < depth:
            depth = extent
            store_minimum(minima, FALLBACK, n, ORIGIN, ORIGIN, extent, math.inf)
            corners = corners_of(faces, f)
        count = 0
        if is_small or gap <= enough:
            count, _ = _load_nearest(polytope, face_count, f, TIE * EPSILON * size, work)
        simplex = Simplex(work.S, work.ids, work.lam, count)
        if gap <= enough:
            a, b = weighted_points(simplex)
            store_minimum(minima, FALLBACK, n, a, b, extent, math.inf)
            corners = _NO_CORNERS
            if gap <= rounding:
                _polish_fallback(pair, size, n, a, b, extent, simplex, minima)
            decided_by = _EPA
            break
        if is_small:
            face = SmallFace(n, extent, gap <= FINE_GAP * reach)
            row, found = _settle(pair, size, face, simplex, minima, found)
            best = best_minimum(minima, found, math.inf)
            settled = minima[best, DEPTH] if found > 0 else settled
            if row >= 0:
                close_face(polytope, f, max(distance, minima[row, DEPTH]))
                continue
        if _equals_corner(polytope.S, corner):
            close_face(polytope, f, extent)
            corners = _corners_over_origin(polytope, face_count, f, depth, corners, size, work)
            continue
        face_count = add_corner(polytope, face_count, f, corner, rounding)
        if face_count < 0:
            face_count = 0
            break
    best = _best_with_witnesses(size, polytope, corners, minima, found, work)
    return decided_by, lower, best, face_count, found


@lean_kernel
def _grow_to_depth(pair, size, settle_gap, tolerance, polytope, work):
    """Return the answer of ``epa``, in a polytope."""
    minima = _minima()
    for k in range(4):
        for c in range(9):
            polytope.S[k, c] = work.S[k, c]
        polytope.ids[k, 0] = work.ids[k, 0]
        polytope.ids[k, 1] = work.ids[k, 1]
    minima[FALLBACK, DEPTH] = math.inf
    decided_by, lower, best, face_count, found = _grow(
        pair, size, settle_gap, tolerance, polytope, minima, work
    )
    tied = _is_tied(pair, size, tolerance, polytope, face_count, minima, found, best)
    return (
        decided_by,
        (minima[best, 0], minima[best, 1], minima[best, 2]),
        (minima[best, 3], minima[best, 4], minima[best, 5]),
        (minima[best, 6], minima[best, 7], minima[best, 8]),
        minima[best, DEPTH],
        lower,
        not tied,
    )


@lean_kernel
def epa(pair, size, settle_gap, tolerance, work):
    """Grow the tetrahedron in rows 0 to 3 of ``work`` until the depth is known.

    Returns (decided by, n, a, b, depth, lower bound, unique): the unit direction n of least depth
    (out of B into A), the witness points, the extent of C along n, which bounds the depth from
    above, and the bound from below. ``settle_gap``, relative to the depth, tells when a face is
    small enough to be polished (0 for polytopes, whose faces are exact). The loop ends when the
    bounds are within ``tolerance`` (m) of each other, or of rounding. ``OPEN``: the
    room for SMALL corners was exhausted, or rounding broke the surface; the bounds hold
    all the same. ``work`` is overwritten.
    """
    polytope = Polytope(_S(), _ids(), _faces(), _planes(), _stack(), _ring())
    return _grow_to_depth(pair, size, settle_gap, tolerance, polytope, work)


@kernel
def epa_with_room(pair, size, settle_gap, tolerance, corners, work):
    """Do the same as ``epa`` with room for so many corners, in memory that is asked for."""
    return _grow_to_depth(pair, size, settle_gap, tolerance, new_polytope(corners), work)
