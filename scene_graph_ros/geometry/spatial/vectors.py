"""Three-vectors and rotations for kernels.

A vector is a tuple of three floats and a rotation a tuple of nine, row by row, so that compiled
code keeps them in registers and allocates nothing. Poses come in as rows of ``(n, 4, 4)`` arrays.
"""

import math

from scene_graph_ros.geometry.compiled.expectations import is_rare
from scene_graph_ros.geometry.compiled.kernel import kernel

__all__ = [
    "add",
    "any_orthogonal",
    "axpy",
    "column",
    "cross",
    "dot",
    "load_rotation",
    "load_translation",
    "load_vector",
    "norm",
    "orthogonal_pair",
    "relative_pose",
    "rotate",
    "rotate_inverse",
    "scale",
    "store_vector",
    "subtract",
    "transpose",
    "unit",
]


LEAST_SQUARE, LARGEST_SQUARE = 1e-200, 1e200
"""Outside of them, squares of components may under- or overflow."""


@kernel
def add(a, b):
    """Return a + b."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@kernel
def subtract(a, b):
    """Return a - b."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def scale(s, a):
    """Return s a."""
    return (s * a[0], s * a[1], s * a[2])


@kernel
def axpy(s, a, b):
    """Return s a + b."""
    return (s * a[0] + b[0], s * a[1] + b[1], s * a[2] + b[2])


@kernel
def dot(a, b):
    """Return a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def cross(a, b):
    """Return a x b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@kernel
def norm(a):
    """Return the Euclidean length of a."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@kernel
def unit(a, fallback):
    """Return a / |a|, or ``fallback`` where a is zero or too small to have a direction."""
    square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    if is_rare(not LEAST_SQUARE < square < LARGEST_SQUARE):
        largest = max(abs(a[0]), abs(a[1]), abs(a[2]))
        if not largest > 0.0:
            return fallback
        a = (a[0] / largest, a[1] / largest, a[2] / largest)
        square = a[0] * a[0] + a[1] * a[1] + a[2] * a[2]
    length = math.sqrt(square)
    return (a[0] / length, a[1] / length, a[2] / length)


@kernel
def any_orthogonal(a):
    """Return a unit vector orthogonal to the unit vector a, chosen by a's smallest component."""
    ax, ay, az = abs(a[0]), abs(a[1]), abs(a[2])
    if ax <= ay and ax <= az:
        return unit((0.0, -a[2], a[1]), (0.0, 0.0, 1.0))
    if ay <= az:
        return unit((a[2], 0.0, -a[0]), (1.0, 0.0, 0.0))
    return unit((-a[1], a[0], 0.0), (1.0, 0.0, 0.0))


@kernel
def orthogonal_pair(n):
    """Return unit vectors t and u = n x t orthogonal to the unit vector n.

    Tom Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017.
    """
    sign = math.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    return (
        (1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]),
        (b, sign + n[1] * n[1] * a, -n[1]),
    )


@kernel
def rotate(R, v):
    """Return R v."""
    return (
        R[0] * v[0] + R[1] * v[1] + R[2] * v[2],
        R[3] * v[0] + R[4] * v[1] + R[5] * v[2],
        R[6] * v[0] + R[7] * v[1] + R[8] * v[2],
    )


@kernel
def rotate_inverse(R, v):
    """Return R^T v."""
    return (
        R[0] * v[0] + R[3] * v[1] + R[6] * v[2],
        R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
        R[2] * v[0] + R[5] * v[1] + R[8] * v[2],
    )


@kernel
def transpose(R):
    """Return R^T."""
    return (R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8])


@kernel
def column(R, i):
    """Return column i of R."""
    return (R[i], R[i + 3], R[i + 6])


@kernel
def load_vector(rows, i):
    """Read row i of an (n, 3) array."""
    return (rows[i, 0], rows[i, 1], rows[i, 2])


@kernel
def store_vector(rows, i, v):
    """Write v into row i of an (n, 3) array."""
    rows[i, 0] = v[0]
    rows[i, 1] = v[1]
    rows[i, 2] = v[2]


@kernel
def load_rotation(X, i):
    """Read the rotation of row i of an (n, 4, 4) array."""
    return (
        X[i, 0, 0],
        X[i, 0, 1],
        X[i, 0, 2],
        X[i, 1, 0],
        X[i, 1, 1],
        X[i, 1, 2],
        X[i, 2, 0],
        X[i, 2, 1],
        X[i, 2, 2],
    )


@kernel
def load_translation(X, i):
    """Read the translation of row i of an (n, 4, 4) array."""
    return (X[i, 0, 3], X[i, 1, 3], X[i, 2, 3])


@kernel
def relative_pose(R_WA, p_WA, R_WB, p_WB):
    """Return (R_AB, p_AB); positions are subtracted first, so distance from W's origin is free."""
    x = column(R_WB, 0)
    y = column(R_WB, 1)
    z = column(R_WB, 2)
    rx = rotate_inverse(R_WA, x)
    ry = rotate_inverse(R_WA, y)
    rz = rotate_inverse(R_WA, z)
    R_AB = (rx[0], ry[0], rz[0], rx[1], ry[1], rz[1], rx[2], ry[2], rz[2])
    return R_AB, rotate_inverse(R_WA, subtract(p_WB, p_WA))
