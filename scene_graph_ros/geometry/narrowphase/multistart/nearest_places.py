"""Nearest points of two corners, lines or rims that are apart, by Newton's method over places.

Over the normal, as in ``polish``, contacts stay well conditioned through touching, but not where
a rim is seen along its axis: there a normal says nothing about the place on the rim. Over the
places it is the other way round, so this remains to be tried for features that are apart.
"""

import math

from scene_graph_ros.geometry.compiled.kernel import lean_kernel
from scene_graph_ros.geometry.narrowphase.contact.slide import (
    back_on,
    solve_semidefinite,
    tangents,
)
from scene_graph_ros.geometry.narrowphase.features import LINE, RIM
from scene_graph_ros.geometry.spatial.vectors import axpy, cross, dot, subtract, unit
from scene_graph_ros.geometry.tolerances import EPSILON

__all__ = ["nearest_places"]

MAX_STEPS = 12
"""Newton's steps from places that are right to a thousandth: four; a rim may need some more."""

APART = 1e-6
"""Squared sine of an angle: of tangents that are closer to parallel, the difference is rounding
that would turn a normal."""


@lean_kernel
def _start(feature, core, R, x):
    """Return the point of a feature, on the axis of an inflated LINE, that is beside x."""
    if feature[0] == LINE:
        return axpy(dot(feature[2], subtract(x, feature[1])), feature[2], feature[1])
    return back_on(feature, core, R, x)


@lean_kernel
def _bend(feature, x, offset):
    """Return ``offset`` times the second derivative of a place x by its arc length (m / m)."""
    if feature[0] != RIM:
        return 0.0
    radial = subtract(x, feature[1])
    return -dot(offset, radial) / dot(radial, radial)


@lean_kernel
def _inflation(feature):
    return feature[3] if feature[0] == LINE else 0.0


@lean_kernel
def nearest_places(features, n, a, b, size):
    """Return (n, a, b) of VERTEX, LINE or RIM features, near the places a and b, that are apart.

    Nothing is clamped or proven: that is left to the caller.
    """
    feature_A, feature_B, core_A, core_B, R = features
    x = _start(feature_A, core_A, R, a)
    y = _start(feature_B, core_B, R, b)
    for _ in range(MAX_STEPS):
        offset = subtract(x, y)
        t, _unused = tangents(feature_A, n, x)
        u, _unused = tangents(feature_B, n, y)
        d, e = solve_semidefinite(
            dot(t, t) + _bend(feature_A, x, offset),
            -dot(t, u),
            dot(u, u) - _bend(feature_B, y, offset),
            -dot(t, offset),
            dot(u, offset),
        )
        x = back_on(feature_A, core_A, R, axpy(d, t, x))
        y = back_on(feature_B, core_B, R, axpy(e, u, y))
        if math.sqrt(d * d + e * e) <= EPSILON * size:
            break
    n = _normal(feature_A, feature_B, x, y, n)
    return n, axpy(-_inflation(feature_A), n, x), axpy(_inflation(feature_B), n, y)


@lean_kernel
def _normal(feature_A, feature_B, x, y, n):
    """Return the unit direction from y to x, at a right angle to lines and rims to rounding."""
    n = unit(subtract(x, y), n)
    t, _unused = tangents(feature_A, n, x)
    u, _unused = tangents(feature_B, n, y)
    if dot(t, t) > 0.0:
        n = axpy(-dot(n, t), t, n)
    w = axpy(-dot(t, u), t, u)
    if dot(w, w) > APART:
        n = axpy(-dot(n, w) / dot(w, w), w, n)
    return unit(n, cross(t, u))
