"""Multi-start over directions: contacts of overlapping cores, refined from many of them.

A depth is a minimum over all directions, and many may nearly tie: all around the axis of a
cylinder, or on both sides of a sliver. Then EPA runs out of corners before it has told them
apart. The directions in which cores have edges, faces and sides are few, and next to the best of
them is the least depth. Of a hull's faces the best one is enough: deep inside of something round,
a hull is least deep behind that face. Where something small is deep inside of an ellipsoid, all
around an axis of that ties nearly, and the small body decides.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.refine import separation
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    has_oblique_planes,
    has_plane_across,
    is_curved,
    is_listed,
    placed_support,
    plane_count,
    plane_of,
    side,
)
from scene_graph_ros.geometry.narrowphase.features import NONE
from scene_graph_ros.geometry.narrowphase.mechanism import Mechanism
from scene_graph_ros.geometry.narrowphase.multistart.all_features import contact_of_all_features
from scene_graph_ros.geometry.narrowphase.pair import body_B, Placed, Simplex, swapped
from scene_graph_ros.geometry.narrowphase.propose.gjk import store_support
from scene_graph_ros.geometry.spatial.elementary import sine_cosine
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    column,
    cross,
    dot,
    rotate,
    scale,
    subtract,
)
from scene_graph_ros.geometry.tolerances import EPSILON, SAME_DIRECTION, TIE

__all__ = ["contact_from_many_starts", "separation_of_faces"]

_ALL_FEATURES = int(Mechanism.ALL_FEATURES)
_RESTARTS = int(Mechanism.RESTARTS)

AXES = 6
"""Both directions of the axes of a core's frame."""

AROUND = 16
"""Directions around a cylinder's axis."""

STARTS = 2 * (AXES + AROUND) + 4
"""The contact given, its opposite, the directions of both cores, and the best face of each."""

TURNS = 3 * (AROUND - 1)
"""Of the best direction, about the three axes of a core's frame."""

GOLDEN = 0.6180339887498949
SECTIONS = 16
"""Golden sections of two steps around an axis: to a few 1e-4 rad, where Newton's method begins."""

NEARBY = 0.02
"""Relative to the pair's size: a direction that separates by so much less than the best one known
is not polished. Between two of those around an axis, a depth varies by less."""


@lean_kernel
def _best_face(pair, n):
    """Return (is given, the direction into A at its plane that is the least deep in B).

    Of A's planes that are not across its frame's axes.
    """
    core_A, hulls = pair.core_A, pair.hulls
    highest, best = -math.inf, n
    if has_oblique_planes(core_A, hulls):
        for k in range(plane_count(core_A, hulls)):
            out, offset = plane_of(core_A, hulls, k)
            b, _ = placed_support(body_B(pair), hulls, scale(-1.0, out))
            along = dot(out, b) - offset
            if along > highest:
                highest, best = along, scale(-1.0, out)
    return highest > -math.inf, best


@lean_kernel
def _best_face_of_either(pair, n, is_B):
    """Do the same for A or for B; the direction is out of B into A."""
    if not is_B:
        return _best_face(pair, n)
    is_given, m = _best_face(swapped(pair), n)
    return is_given, scale(-1.0, rotate(pair.R, m))


@lean_kernel
def separation_of_faces(pair, n):
    """Return the largest separation along normals of cores' faces but n, less those of hulls.

    Two of them may be so close to each other that EPA takes them for one minimum, next to n or
    where another direction is as deep. -inf where there are none but n.
    """
    core_A, core_B, R, hulls = pair.core_A, pair.core_B, pair.R, pair.hulls
    highest = -math.inf
    for k in range(6):
        core = core_A if k < 3 else core_B
        axis = column(IDENTITY if k < 3 else R, k % 3)
        if has_plane_across(core, k % 3):
            for m in (axis, scale(-1.0, axis)):
                if dot(m, n) < SAME_DIRECTION:
                    highest = max(highest, separation(pair, m))
    for k in range(2):
        core = core_B if k == 1 else core_A
        if has_oblique_planes(core, hulls) and not is_listed(core):
            _, m = _best_face_of_either(pair, n, k == 1)
            if dot(m, n) < SAME_DIRECTION:
                highest = max(highest, separation(pair, m))
    return highest


@lean_kernel
def _direction(core, R, index):
    """Return (is given, a direction to start from) of those that belong to one core."""
    if index < AXES:
        axis = column(R, index // 2)
        return True, axis if index % 2 == 0 else scale(-1.0, axis)
    angle = 2.0 * math.pi * (index - AXES) / AROUND
    s, c = sine_cosine(angle)
    n = axpy(s, column(R, 1), scale(c, column(R, 0)))
    return side(Placed(core, R, ORIGIN))[0] != NONE, n


@lean_kernel
def _start(pair, n, k):
    """Return (is given, m) of the start k > 0: other directions than n, the best one known."""
    each = AXES + AROUND
    if k == 1:
        return True, scale(-1.0, n)
    if k < each + 2:
        return _direction(pair.core_A, IDENTITY, k - 2)
    if k < 2 * each + 2:
        return _direction(pair.core_B, pair.R, k - each - 2)
    return _best_face_of_either(pair, n, k == 2 * each + 3)


@lean_kernel
def _turned(n, axis, steps):
    """Return n turned about an axis by as many steps, of which AROUND are a full turn."""
    angle = 2.0 * math.pi * steps / AROUND
    along = scale(dot(axis, n), axis)
    across = subtract(n, along)
    s, c = sine_cosine(angle)
    return axpy(s, cross(axis, across), axpy(c, across, along))


@lean_kernel
def _best_turn(pair, n, axis, steps):
    """Return the turn within a step of that by ``steps`` that separates most, by golden sections.

    No step of Newton's method goes far around an axis about which separations tie nearly: it
    leaves a ridge. From here it has none to go.
    """
    low, high = steps - 1.0, steps + 1.0
    left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_left = separation(pair, _turned(n, axis, left))
    at_right = separation(pair, _turned(n, axis, right))
    for _ in range(SECTIONS):
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - GOLDEN * (high - low)
            at_left = separation(pair, _turned(n, axis, left))
        else:
            low, left, at_left = left, right, at_right
            right = low + GOLDEN * (high - low)
            at_right = separation(pair, _turned(n, axis, right))
    return _turned(n, axis, left if at_left > at_right else right)


@lean_kernel
def _turn(pair, n, k, enough):
    """Return (is given, m) of a turn of n about an axis of a curved core's frame.

    It is given where it separates by ``enough``, and no less than the turns beside it.
    """
    core, R = (pair.core_A, IDENTITY) if k < TURNS else (pair.core_B, pair.R)
    if not is_curved(core):
        return False, n
    axis = column(R, (k % TURNS) // (AROUND - 1))
    steps = float(k % (AROUND - 1) + 1)
    along = separation(pair, _turned(n, axis, steps))
    if not along >= enough:
        return False, n
    before = separation(pair, _turned(n, axis, steps - 1.0))
    if not along >= max(before, separation(pair, _turned(n, axis, steps + 1.0))):
        return False, n
    return True, _best_turn(pair, n, axis, steps)


@lean_kernel
def contact_from_many_starts(pair, n, a, b, size, simplex):
    """Return the answer of ``contact_of_all_features``, of the best of many starts.

    The first start is the contact given; of equal ones, the first that is proven is kept.
    """
    S = simplex.S
    decided_by = _ALL_FEATURES
    proven, best, x, y, highest = False, n, a, b, separation(pair, n)
    for k in range(STARTS + 2 * TURNS):
        m = n
        if k > 0:
            enough = highest - NEARBY * size
            if k < STARTS:
                is_given, m = _start(pair, n, k)
                is_given = is_given and separation(pair, m) >= enough
            else:
                is_given, m = _turn(pair, best, k - STARTS, enough)
            if not is_given:
                continue
            simplex = Simplex(simplex.S, simplex.ids, simplex.lam, 1)
            store_support(pair, m, simplex, 0)
            a, b = (S[0, 3], S[0, 4], S[0, 5]), (S[0, 6], S[0, 7], S[0, 8])
            simplex.lam[0] = 1.0
        is_contact, m, q_A, q_B, distance, how = contact_of_all_features(
            pair, m, a, b, size, simplex
        )
        if is_contact and distance > highest - (0.0 if proven else TIE * EPSILON * size):
            proven, best, x, y, highest = True, m, q_A, q_B, distance
            decided_by = _RESTARTS if k > 0 and how == _ALL_FEATURES else how
    return proven, best, x, y, highest, decided_by
