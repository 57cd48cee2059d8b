"""From a simplex of GJK or EPA to the exact contact: guess features, polish, check, switch.

A guess is accepted only with a certificate: the witness points lie on the cores, and their
difference is, up to rounding, the separation of both cores' support points along the normal. For
cores apart that proves the distance (it is an upper and a lower bound at once); for overlapping
ones it proves that the depth is stationary.
"""

import math

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.contact_of_features import contact_of_features
from scene_graph_ros.geometry.narrowphase.contact.slide import slide
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    clamp,
    corner_feature,
    feature_at,
    neighbor,
    placed_support,
    support,
)
from scene_graph_ros.geometry.narrowphase.features import NONE
from scene_graph_ros.geometry.narrowphase.pair import (
    A_SIDE,
    B_SIDE,
    body_A,
    body_B,
    Contact,
    Features,
)
from scene_graph_ros.geometry.spatial.vectors import axpy, dot, norm, scale, subtract
from scene_graph_ros.geometry.tolerances import EPSILON, POLISH_RESIDUAL

__all__ = [
    "AMPLIFIED",
    "contact",
    "refine",
    "refine_inlined",
    "separation",
    "separation_inlined",
]

MAX_SWITCHES = 8
"""A cylinder has three kinds of features and a box three; a path through them is this short."""


AMPLIFIED = 16.0
"""How much more than usual may be left of a contact when nothing better is found: a rim that is
seen foreshortened, or lines at a small angle, amplify rounding."""

FAR_APART = 0.5
"""Relative to the pair's size: cores further apart may be tiny beside their distance, so that what
other features are off by is hardly more than its rounding."""

FAR_RESIDUAL = 0.125
"""Of what may usually be left of a contact: where it is more, and the cores are far apart, the
features next to the contact's are tried, too."""

SLIDE_REACH = 1e-6
"""Relative to the pair's size: witnesses of right features miss each other by less, as a rim seen
along its axis to 1e-10 rad amplifies rounding; more says that the features are wrong."""


@inlined_kernel
def separation_inlined(pair, n):
    """Return the gap between A and B along n: a lower bound of their distance for every n."""
    a, _ = support(pair.core_A, pair.hulls, scale(-1.0, n))
    b, _ = placed_support(body_B(pair), pair.hulls, n)
    return dot(n, subtract(a, b))


@lean_kernel
def separation(pair, n):
    """Do the same as ``separation_inlined``, as a call."""
    return separation_inlined(pair, n)


@inlined_kernel
def contact_inlined(feature_A, feature_B, pair, n, a, b, size, simplex):
    """Return (contact, free a, free b) of two features near the normal n and the places a, b.

    The free points are those of the features before they are clamped to their extent.
    """
    features = Features(feature_A, feature_B, pair.core_A, pair.core_B, pair.R)
    n, stiffness, a_free, b_free = contact_of_features(features, n, a, b, size)
    distance = separation_inlined(pair, n)
    a = clamp(body_A(pair), feature_A, simplex, A_SIDE, a_free)
    b = clamp(body_B(pair), feature_B, simplex, B_SIDE, b_free)
    error = norm(axpy(-distance, n, subtract(a, b)))
    enough = EPSILON * size
    if is_rare(POLISH_RESIDUAL * enough < error <= SLIDE_REACH * size):
        a_free, b_free = slide(features, n, a_free, b_free, enough)
        q_A = clamp(body_A(pair), feature_A, simplex, A_SIDE, a_free)
        q_B = clamp(body_B(pair), feature_B, simplex, B_SIDE, b_free)
        rest = norm(axpy(-distance, n, subtract(q_A, q_B)))
        if rest < error:
            a, b, error = q_A, q_B, rest
    return Contact(n, a, b, distance, error, stiffness), a_free, b_free


@lean_kernel
def contact(feature_A, feature_B, pair, n, a, b, size, simplex):
    """Return the contact of two features, as ``contact_inlined`` does."""
    found, _, _ = contact_inlined(feature_A, feature_B, pair, n, a, b, size, simplex)
    return found


@lean_kernel
def _unproven(nearly, n, a, b, highest, allowed):
    """Return the answer of ``refine`` without a proof, from the contact nearest to one."""
    error = norm(axpy(-highest, n, subtract(a, b)))
    if nearly.error < error and nearly.distance >= highest - allowed:
        return False, nearly
    return False, Contact(n, a, b, highest, error, 0.0)


@inlined_kernel
def _guessed(pair, simplex, n, guess):
    """Return the features that a simplex spans, or for the next guess corners along n."""
    d = scale(-1.0, n)
    feature_A = feature_at(body_A(pair), simplex, A_SIDE, d)
    feature_B = feature_at(body_B(pair), simplex, B_SIDE, n)
    if guess > 0:
        feature_A = corner_feature(body_A(pair), pair.hulls, feature_A, d)
        feature_B = corner_feature(body_B(pair), pair.hulls, feature_B, n)
    return feature_A, feature_B


@inlined_kernel
def _is_back(following, now, before):
    """Return whether a feature is to be of the kind again that it was of before the last switch.

    An end of an edge, and the corner that it is, may differ by rounding.
    """
    return following[0] == before[0] and now[0] != before[0]


@inlined_kernel
def _are_back(next_A, next_B, feature_A, feature_B, before_A, before_B):
    return _is_back(next_A, feature_A, before_A) and _is_back(next_B, feature_B, before_B)


@inlined_kernel
def _alone(next_A, next_B, feature_A, feature_B, is_again):
    """Let one of two features switch, where both go to and fro: first A, and B after that."""
    if is_again:
        return feature_A, next_B
    return next_A, feature_B


@inlined_kernel
def _is_in_vain(next_A, next_B, feature_A, feature_B, before_A, before_B):
    """Return whether no feature switches, or one of them goes to and fro."""
    stays = next_A == feature_A and next_B == feature_B
    return stays or (next_A == before_A and next_B == before_B)


@inlined_kernel
def refine_inlined(pair, n, a, b, size, simplex, guesses):
    """Return (is proven, contact) of the contact near a simplex.

    n, a, b: the normal and the witness points known so far; without a proof a and b come back
    with that normal of all tried which separates the cores most, or as the contact that separates
    them as much and misses a proof by less. The contact's ``error`` bounds that of the distance
    (m) where the cores are apart. The first guess are the features that the simplex spans; with
    two ``guesses`` then the corners of polytopes that lie furthest along the normal.
    """
    hulls = pair.hulls
    allowed = POLISH_RESIDUAL * EPSILON * size
    start = best = n
    highest = -math.inf
    nearly = Contact(n, a, b, highest, math.inf, 0.0)
    for guess in range(guesses):
        feature_A, feature_B = _guessed(pair, simplex, n, guess)
        before_A, before_B = feature_A, feature_B
        is_again = False
        for _ in range(MAX_SWITCHES):
            if is_rare(feature_A[0] == NONE or feature_B[0] == NONE):
                break
            found, a_free, b_free = contact_inlined(
                feature_A, feature_B, pair, n, a, b, size, simplex
            )
            enough = allowed if found.distance <= FAR_APART * size else FAR_RESIDUAL * allowed
            if found.error <= enough and (found.distance >= 0.0 or not is_again):
                return True, found
            if highest == -math.inf:
                highest = separation(pair, start)
            m = found.n
            if found.error < nearly.error and not is_again:
                nearly = found
            if found.distance > highest and not is_again:
                best, highest = m, found.distance
            out = scale(-1.0, m)
            next_A = neighbor(body_A(pair), hulls, feature_A, a_free, out, allowed)
            next_B = neighbor(body_B(pair), hulls, feature_B, b_free, m, allowed)
            is_apart = found.distance >= 0.0
            if is_apart and _are_back(next_A, next_B, feature_A, feature_B, before_A, before_B):
                # From here on nothing counts but both bounds: of depths, another may be less.
                next_A, next_B = _alone(next_A, next_B, feature_A, feature_B, is_again)
                is_again = True
            elif _is_in_vain(next_A, next_B, feature_A, feature_B, before_A, before_B):
                break
            before_A, before_B = feature_A, feature_B
            feature_A, feature_B = next_A, next_B
    if nearly.error <= AMPLIFIED * allowed:
        return True, nearly
    if highest == -math.inf:
        highest = separation(pair, start)
    return _unproven(nearly, best, a, b, highest, allowed)


@lean_kernel
def refine(pair, n, a, b, size, simplex, guesses):
    """Do the same as ``refine_inlined``, as a call."""
    return refine_inlined(pair, n, a, b, size, simplex, guesses)
