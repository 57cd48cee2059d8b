"""A core of each kind, and the hulls it may be one of."""

from convex_bodies import rounded_hull
import numpy as np
from overlapping_pairs import OverlappingPair

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid
from scene_graph_ros.geometry.narrowphase.cores.kinds import POINT, TRIANGLE

__all__ = ["CORES", "NO_HULLS"]


def core_of(shape):
    """Return the core of a shape, and the hulls it may be one of."""
    pair = OverlappingPair(shape, shape, np.eye(4))
    return pair.cores[0], pair.hulls


NO_HULLS = np.zeros(8)
CORES = {
    "point": ((POINT, -1, 0.0, (0.1, -0.2, 0.3, *np.zeros(6))), NO_HULLS),
    "triangle": ((TRIANGLE, -1, 0.0, (0.1, 0.0, 0.2, -0.1, 0.3, 0.0, 0.0, -0.2, -0.1)), NO_HULLS),
    "segment": core_of(Capsule(0.05, 0.3)),
    "box": core_of(Box(0.2, 0.3, 0.14)),
    "cylinder": core_of(Cylinder(0.1, 0.25)),
    "ellipsoid": core_of(Ellipsoid(0.1, 0.13, 0.16)),
    "small hull": core_of(rounded_hull(0.3, 12)),
    "hull": core_of(rounded_hull(0.3, 30)),
}
