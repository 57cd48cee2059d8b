"""Bodies and placements at the edge of what doubles can tell."""

import mpmath as mp
import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import Case
from hard_corpus.bodies import corners
from hard_corpus.sites import pose
from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Sphere

__all__ = ["ANGLES", "THIN", "concentric_cases", "nearly_parallel_cases"]

ANGLES = [*(10.0**-e for e in range(3, 16)), 0.0]
"""Radians: tilts from a milliradian down to what a double next to 1 can still hold."""

THIN = {
    "needle": (Box(1e-4, 1e-4, 1.0), False),
    "plate": (Box(1.0, 1.0, 1e-4), False),
    "rod": (Cylinder(5e-5, 1.0), False),
    "disc": (Cylinder(0.5, 1e-4), False),
    "wire": (Capsule(5e-5, 1.0), False),
    "splinter": (Convex(vertices=corners(Box(1.0, 1e-4, 1e-4))), False),
    "sliver": (Convex(vertices=[[0, 0, 0], [1, 0, 0], [0.3, 1e-4, 0], [0.6, 0, 1e-4]]), False),
    "egg": (Ellipsoid(1e-3, 1e-3, 1.0), False),
    "lens": (Ellipsoid(1.0, 1.0, 1e-3), False),
    "blade": (Ellipsoid(1.0, 0.03, 1e-3), False),
}


def _tilted(axis, angle):
    return Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()


def _exact(value):
    """Return a number of the pose as mpmath sees it: the double itself, without rounding."""
    return mp.mpf(float(value))


def nearly_parallel_cases(gap, X_WA):
    """Return capsules, cylinders and boxes that are parallel but for an angle, ``gap`` apart.

    Each truth is the closed form for the very doubles of the pose. B's origin is on A's x axis
    (rods, side by side) or on its z axis (boxes, one on the other).
    """
    found = []
    for angle in ANGLES:
        found += _rods(angle, gap, X_WA) + _boxes(angle, gap, X_WA)
    return found


def _rods(angle, gap, X_WA):
    r, half, length = 0.05, 0.1, 0.2
    across, along = _tilted(0, angle), _tilted(1, angle)
    x = 2.0 * r + gap
    found = []
    for kind in (Capsule, Cylinder):
        A, B = kind(r, 1.5 * length), kind(r, length)
        # Turned about the common normal: the axes cross in the origins, x apart.
        found.append(
            (
                f"{kind.__name__} crossing at {angle}",
                A,
                B,
                pose(across, [x, 0, 0]),
                _exact(x) - 2 * _exact(r),
            )
        )
        # Tilted towards each other: the end at -z of B is nearest, x minus its reach along x.
        sine, cosine = _exact(along[0, 2]), _exact(along[0, 0])
        reach = half * abs(sine) + (r if kind is Capsule else r * cosine)
        start = _exact(x) - reach - _exact(r)
        found.append((f"{kind.__name__} leaning by {angle}", A, B, pose(along, [x, 0, 0]), start))
    return [
        Case(label, A, B, X_WA, X_WA @ X_AB, float(truth)) for label, A, B, X_AB, truth in found
    ]


def _boxes(angle, gap, X_WA):
    A, B = Box(0.2, 0.2, 0.1), Box(0.1, 0.12, 0.14)
    along = _tilted(1, angle)
    z = 0.05 + 0.07 + gap
    # The lower edge of B, half a width along -x and half a height down.
    reach = 0.05 * abs(_exact(along[2, 0])) + 0.07 * _exact(along[2, 2])
    found = [
        (f"faces leaning by {angle}", A, B, pose(along, [0.01, 0.02, z]), _exact(z) - 0.05 - reach)
    ]
    corner = Convex(vertices=corners(B))
    found.append((f"hull on face leaning by {angle}", A, corner, *found[0][3:]))
    if gap >= 0.0:
        # Edges along y that point at each other and cross over the origins.
        up = _tilted(1, np.pi / 4)
        E = Convex(vertices=corners(Box(0.1, 0.3, 0.1)) @ up.T)
        z = 2.0 * max(corners(E)[:, 2]) + gap
        truth = _exact(z) - 2 * _exact(max(corners(E)[:, 2]))
        found.append(
            (f"edges crossing at {angle}", E, E, pose(_tilted(2, angle), [0, 0, z]), truth)
        )
    return [
        Case(label, A, B, X_WA, X_WA @ X_AB, float(truth)) for label, A, B, X_AB, truth in found
    ]


def concentric_cases(X_WA):
    """Return bodies around one centre; the depth is the least sum of their half widths."""
    hull = Convex(vertices=corners(Box(0.2, 0.3, 0.4)))
    depths = [
        ("spheres", Sphere(0.3), Sphere(0.1), 0.4),
        ("capsules", Capsule(0.1, 0.3), Capsule(0.07, 0.2), 0.17),
        ("boxes", Box(0.2, 0.3, 0.4), Box(0.3, 0.1, 0.2), 0.2),
        ("hulls", hull, hull, 0.2),
        ("box and hull", Box(0.3, 0.1, 0.2), hull, 0.2),
        ("cylinders", Cylinder(0.1, 0.5), Cylinder(0.02, 0.4), 0.12),
        ("discs", Cylinder(0.3, 0.1), Cylinder(0.2, 0.04), 0.07),
        ("ellipsoids", Ellipsoid(0.3, 0.2, 0.1), Ellipsoid(0.1, 0.2, 0.05), 0.15),
        ("sphere and box", Sphere(0.05), Box(0.2, 0.3, 0.4), 0.15),
        ("sphere and cylinder", Sphere(0.05), Cylinder(0.1, 0.5), 0.15),
        ("capsule and cylinder", Capsule(0.05, 0.3), Cylinder(0.1, 0.5), 0.15),
        ("capsule and ellipsoid", Capsule(0.05, 0.3), Ellipsoid(0.3, 0.1, 0.4), 0.15),
        ("ellipsoid and box", Ellipsoid(0.3, 0.1, 0.4), Box(0.5, 0.3, 0.7), 0.25),
        ("cylinder and box", Cylinder(0.05, 0.5), Box(0.3, 0.4, 0.5), 0.2),
        ("cylinder and hull", Cylinder(0.05, 0.5), hull, 0.15),
    ]
    return [Case(label, A, B, X_WA, X_WA, -depth) for label, A, B, depth in depths]
