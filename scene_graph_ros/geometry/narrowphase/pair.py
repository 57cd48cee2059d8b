"""The values that the narrow phase hands around: placed cores, simplices and contacts.

All of a pair is in the frame of its first core, which is at the identity there. Points and vectors
are tuples of three numbers (m), rotations tuples of nine, row by row.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.compiled.kernel import inlined_kernel
from scene_graph_ros.geometry.narrowphase.cores.kinds import IDENTITY, ORIGIN
from scene_graph_ros.geometry.spatial.vectors import rotate_inverse, scale, transpose

__all__ = [
    "A_SIDE",
    "B_SIDE",
    "Contact",
    "Features",
    "Pair",
    "Placed",
    "Simplex",
    "Vector",
    "Workspace",
    "at_origin",
    "body_A",
    "body_B",
    "swapped",
]

Vector = tuple[float, float, float]

A_SIDE = 3
B_SIDE = 6
"""The first column of A's and of B's points in the rows of a simplex."""


class Placed(NamedTuple):
    """A core at the pose (R, p); see ``cores.kinds`` for the kinds of cores."""

    core: Any
    R: Any
    p: Vector


class Pair(NamedTuple):
    """Two cores in A's frame, B at the pose (R, p), and the array of blocks of all hulls."""

    core_A: Any
    core_B: Any
    R: Any
    p: Vector
    hulls: NDArray[np.float64]


class Workspace(NamedTuple):
    """Arrays that a pair is worked on with.

    ``S`` (rows, 9) holds corners of the Minkowski difference C = {a - b}, each a - b, a and b;
    ``ids`` (rows, 2) which support points of A and B they are, ``lam`` (4,) weights. Of ``S``,
    proofs use more rows than a simplex has.
    """

    S: NDArray[np.float64]
    ids: NDArray[np.int64]
    lam: NDArray[np.float64]


class Simplex(NamedTuple):
    """The first ``num_corners`` rows of a ``Workspace``."""

    S: NDArray[np.float64]
    ids: NDArray[np.int64]
    lam: NDArray[np.float64]
    num_corners: int


class Features(NamedTuple):
    """Two features that touch (see ``features``), and the cores that a SMOOTH one is of.

    R is the rotation of B.
    """

    A: Any
    B: Any
    core_A: Any
    core_B: Any
    R: Any


class Contact(NamedTuple):
    """Unit normal n out of B into A, witnesses a and b, and the separation along n.

    ``error`` is how far a - b misses n times the distance (m). ``stiffness`` is the smallest
    eigenvalue of the negated second derivative of the separation by n (m): infinite where the
    features leave the normal no freedom.
    """

    n: Vector
    a: Vector
    b: Vector
    distance: float
    error: float
    stiffness: float


@inlined_kernel
def at_origin(core):
    """Return the core placed at the identity."""
    return Placed(core, IDENTITY, ORIGIN)


@inlined_kernel
def body_A(pair):
    """Return A, placed at the identity."""
    return Placed(pair.core_A, IDENTITY, ORIGIN)


@inlined_kernel
def body_B(pair):
    """Return B, placed in A's frame."""
    return Placed(pair.core_B, pair.R, pair.p)


@inlined_kernel
def swapped(pair):
    """Return the pair with B as its first core, in B's frame."""
    q = scale(-1.0, rotate_inverse(pair.R, pair.p))
    return Pair(pair.core_B, pair.core_A, transpose(pair.R), q, pair.hulls)
