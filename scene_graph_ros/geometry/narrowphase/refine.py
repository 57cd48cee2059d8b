"""From a simplex of GJK or EPA to the exact contact: guess features, polish, check, switch.

A guess is accepted only with a certificate: the witness points lie on the cores, and their
difference is, up to rounding, the separation of both cores' support points along the normal. For
cores apart that proves the distance (it is an upper and a lower bound at once); for overlapping
ones it proves that the depth is stationary.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.narrowphase.cores.questions import (
    clamp,
    corner_feature,
    feature_at,
    neighbor,
    placed_support,
    support,
)
from scene_graph_ros.geometry.narrowphase.features import NONE
from scene_graph_ros.geometry.narrowphase.polish import contact_of_features
from scene_graph_ros.geometry.narrowphase.slide import slide
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

SLIDE_REACH = 1e-6
"""Relative to the pair's size: witnesses of right features miss each other by less, as a rim seen
along its axis to 1e-10 rad amplifies rounding; more says that the features are wrong."""


@inlined_kernel
def separation_inlined(core_A, core_B, R, p, hulls, n):
    """Return the gap between A and B along n: a lower bound of their distance for every n."""
    a, _ = support(core_A, hulls, scale(-1.0, n), -1)
    b, _ = placed_support(core_B, hulls, R, p, n, -1)
    return dot(n, subtract(a, b))


@lean_kernel
def separation(core_A, core_B, R, p, hulls, n):
    """Do the same as ``separation_inlined``, as a call."""
    return separation_inlined(core_A, core_B, R, p, hulls, n)


@inlined_kernel
def contact_inlined(
    feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
):
    """Return (n, stiffness, free a, free b, a, b, distance, error) of two features' contact.

    The free points are those of the features before they are clamped to their extent.
    """
    n, stiffness, a_free, b_free = contact_of_features(
        feature_A, feature_B, core_A, core_B, R, n, a, b, size
    )
    distance = separation_inlined(core_A, core_B, R, p, hulls, n)
    a = clamp(core_A, IDENTITY, ORIGIN, feature_A, S, ids, count, 3, a_free)
    b = clamp(core_B, R, p, feature_B, S, ids, count, 6, b_free)
    error = norm(axpy(-distance, n, subtract(a, b)))
    enough = EPSILON * size
    if POLISH_RESIDUAL * enough < error <= SLIDE_REACH * size:
        a_free, b_free = slide(feature_A, feature_B, core_A, core_B, R, n, a_free, b_free, enough)
        q_A = clamp(core_A, IDENTITY, ORIGIN, feature_A, S, ids, count, 3, a_free)
        q_B = clamp(core_B, R, p, feature_B, S, ids, count, 6, b_free)
        rest = norm(axpy(-distance, n, subtract(q_A, q_B)))
        if rest < error:
            a, b, error = q_A, q_B, rest
    return n, stiffness, a_free, b_free, a, b, distance, error


@lean_kernel
def contact(feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count):
    """Do the same as ``contact_inlined``, as a call."""
    return contact_inlined(
        feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
    )


@lean_kernel
def _unproven(nearly, n, a, b, highest, allowed):
    """Return what ``refine`` does without a proof, from the contact that came nearest to one."""
    error = norm(axpy(-highest, n, subtract(a, b)))
    if nearly[4] < error and nearly[3] >= highest - allowed:
        return False, nearly[0], nearly[1], nearly[2], nearly[3], nearly[4], nearly[5]
    return False, n, a, b, highest, error, 0.0


@inlined_kernel
def refine_inlined(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses):
    """Return (is proven, n, a, b, distance, error, stiffness) of the contact near a simplex.

    n, a, b: the normal and the witness points known so far; without a proof a and b come back
    with that normal of all tried which separates the cores most, or as the contact that separates
    them as much and misses a proof by less. ``error`` bounds the distance's error (m) where the
    cores are apart; ``stiffness`` is that of ``polish``. The first guess are the features that
    the simplex spans; with two ``guesses`` then the corners of polytopes that lie furthest along
    the normal.
    """
    d = scale(-1.0, n)
    allowed = POLISH_RESIDUAL * EPSILON * size
    start = best = n
    highest = -math.inf
    nearly = (n, a, b, highest, math.inf, 0.0)
    for guess in range(guesses):
        feature_A = feature_at(core_A, IDENTITY, ORIGIN, S, ids, lam, count, 3, d)
        feature_B = feature_at(core_B, R, p, S, ids, lam, count, 6, n)
        if guess > 0:
            feature_A = corner_feature(core_A, hulls, IDENTITY, ORIGIN, feature_A, d)
            feature_B = corner_feature(core_B, hulls, R, p, feature_B, n)
        before_A, before_B = feature_A, feature_B
        for _ in range(MAX_SWITCHES):
            if feature_A[0] == NONE or feature_B[0] == NONE:
                break
            m, stiffness, a_free, b_free, q_A, q_B, distance, error = contact_inlined(
                feature_A, feature_B, core_A, core_B, R, p, hulls, n, a, b, size, S, ids, count
            )
            if error <= allowed:
                return True, m, q_A, q_B, distance, error, stiffness
            if highest == -math.inf:
                highest = separation(core_A, core_B, R, p, hulls, start)
            if error < nearly[4]:
                nearly = (m, q_A, q_B, distance, error, stiffness)
            if distance > highest:
                best, highest = m, distance
            next_A = neighbor(
                core_A, hulls, IDENTITY, ORIGIN, feature_A, a_free, scale(-1.0, m), allowed
            )
            next_B = neighbor(core_B, hulls, R, p, feature_B, b_free, m, allowed)
            is_same = next_A == feature_A and next_B == feature_B
            if is_same or (next_A == before_A and next_B == before_B):  # to and fro
                break
            before_A, before_B = feature_A, feature_B
            feature_A, feature_B = next_A, next_B
    if nearly[4] <= AMPLIFIED * allowed:
        return True, nearly[0], nearly[1], nearly[2], nearly[3], nearly[4], nearly[5]
    if highest == -math.inf:
        highest = separation(core_A, core_B, R, p, hulls, start)
    return _unproven(nearly, best, a, b, highest, allowed)


@lean_kernel
def refine(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses):
    """Do the same as ``refine_inlined``, as a call."""
    return refine_inlined(core_A, core_B, R, p, hulls, n, a, b, size, S, ids, lam, count, guesses)
