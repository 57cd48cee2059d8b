"""Where a corner touches a rim or an ellipsoid, as a normal to begin with.

The nearest point of those is in closed form, or but for a root. Newton's method for the normal
then has next to nothing to do, and its answer is as well conditioned as without.
"""

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel, lean_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY
from scene_graph_ros.geometry.narrowphase.features import RIM, SMOOTH, VERTEX
from scene_graph_ros.geometry.narrowphase.point_ellipsoid import point_ellipsoid
from scene_graph_ros.geometry.spatial.vectors import (
    axpy,
    dot,
    norm,
    rotate,
    rotate_inverse,
    scale,
    subtract,
    unit,
)

__all__ = ["first_normal"]

SAME_SIDE = 0.7
"""Cosine: a direction further from the one known than this belongs to another contact."""

NEAR_RIM = 1e-3
"""Relative to the pair's size: the direction from a rim to a corner that is nearer is rounding."""


@lean_kernel
def _from_rim(rim, vertex, n, size):
    """Return the unit vector to a corner from the point of a rim nearest to it, or n."""
    e = rim[2]
    q = subtract(vertex[1], rim[1])
    radial = unit(axpy(-dot(q, e), e, q), n)
    m = axpy(-rim[3], radial, q)
    out = unit(m, n)
    return out if dot(out, n) > SAME_SIDE and norm(m) >= NEAR_RIM * size else n


@lean_kernel
def _from_ellipsoid(smooth, core, R, vertex, n):
    """Return the outward normal of an ellipsoid where it is nearest to a corner, or n."""
    q = rotate_inverse(R, subtract(vertex[1], smooth[1]))
    distance, _, gradient, _ = point_ellipsoid((core[3][0], core[3][1], core[3][2]), q)
    m = rotate(R, gradient)
    return m if distance > 0.0 and dot(m, n) > SAME_SIDE else n


@inlined_kernel
def first_normal(features, n, size):
    """Return a unit vector near the normal n of two features, where a corner tells it better.

    Only of corners outside: inside, the nearest one need not be where n leads.
    """
    feature_A, feature_B = features.A, features.B
    out = scale(-1.0, n)
    if feature_A[0] == VERTEX and feature_B[0] == RIM:
        return _from_rim(feature_B, feature_A, n, size)
    if feature_A[0] == RIM and feature_B[0] == VERTEX:
        return scale(-1.0, _from_rim(feature_A, feature_B, out, size))
    if feature_A[0] == VERTEX and feature_B[0] == SMOOTH:
        return _from_ellipsoid(feature_B, features.core_B, features.R, feature_A, n)
    if feature_A[0] == SMOOTH and feature_B[0] == VERTEX:
        m = _from_ellipsoid(feature_A, features.core_A, IDENTITY, feature_B, out)
        return scale(-1.0, m)
    return n
