"""All 35 pairs of the eight shapes, in contact at every combination of their features."""

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import Case, relative
from hard_corpus.bodies import closed_mesh, dented_mesh, rescaled, scattered_hull
from hard_corpus.sites import is_shallowest, place, pose, sites_of
from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Sphere

__all__ = ["BODIES", "DIRECTIONS", "SIZE", "constructed", "grown", "pair_of", "random_pose"]

SIZE = 0.2
"""Metres: the largest extent of every body."""

BODIES = {
    "sphere": (Sphere(1 / 10), False),
    "capsule": (Capsule(1 / 15, 1 / 15), False),
    "box": (Box(1 / 5, 1 / 6, 1 / 7), False),
    "cylinder": (Cylinder(1 / 11, 1 / 5), False),
    "ellipsoid": (Ellipsoid(1 / 10, 1 / 12, 1 / 15), False),
    "half_space": (HalfSpace(), False),
    "convex": (scattered_hull(SIZE, 30), False),
    "mesh": (closed_mesh(SIZE, 24), False),
    "mesh triangles": (dented_mesh(SIZE, 24), True),
}
"""Name: (shape, measured by its triangles)."""

DIRECTIONS = np.random.default_rng(0).normal(size=(300, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1)[:, None]


def random_pose(rng, reach=1.0):
    """Return a pose with a uniform rotation, up to ``reach`` metres from the origin per axis."""
    return pose(Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach, reach, 3))


def pair_of(case):
    """Return which of the 35 pairs a case is, the same for both orders."""
    first, second = sorted((case.A, case.B), key=lambda shape: shape.kind)
    return f"{first.type_name}-{second.type_name}"


def grown(bodies, factor):
    """Return the bodies, ``factor`` times as large."""
    return {name: (rescaled(shape, factor), exact) for name, (shape, exact) in bodies.items()}


def _is_promised(case, site_A, site_B, depth, margin):
    """Tell whether the depth of this overlap is known, and promised.

    With triangles that enclose a dent it is promised where they are entered through one face.
    """
    faces = [site.feature == "face" for site in (site_A, site_B)]
    if any(case.triangles):
        (through,) = [face for face, exact in zip(faces, case.triangles, strict=True) if exact][:1]
        if (
            all(case.triangles)
            or not through
            or any(faces[k] for k in (0, 1) if not case.triangles[k])
        ):
            return False
    X_AB = relative(case.X_WA, case.X_WB)
    return is_shallowest(case.A, case.B, site_A, site_B, X_AB, depth, DIRECTIONS, margin)


def constructed(
    distance, *, bodies=BODIES, others=None, rolls=(0.0, 0.7), seed=1, reach=1.0, margin=1.5
):
    """Return cases for all bodies, features and orders at this signed distance.

    Of overlaps, those are left out whose shortest way out is another one.

    Args:
        distance: metres.
        bodies: name: (shape, measured by triangles).
        others: what they meet; ``bodies`` if None.
        rolls: rotations of B about the common normal; 0 makes edges and axes parallel.
        seed: of the generic world poses.
        reach: metres, of their positions.
        margin: how many times deeper an overlap may become along its normal before another
            normal nearby is better; thin bodies have such normals also far away.

    """
    others = bodies if others is None else others
    key = (distance, tuple(bodies.items()), tuple(others.items()), rolls, seed, reach, margin)
    if key not in _remembered:
        _remembered[key] = _contacts(*key)
    return list(_remembered[key])


_remembered = {}


def _contacts(distance, bodies, others, rolls, seed, reach, margin):
    rng = np.random.default_rng(seed)
    found = []
    for (name_A, (A, exact_A)), (name_B, (B, exact_B)) in itertools.product(bodies, others):
        if isinstance(A, HalfSpace) and isinstance(B, HalfSpace):
            continue
        for site_A, site_B, roll in itertools.product(
            sites_of(A, 0, reach), sites_of(B, 1, reach), rolls
        ):
            label = f"{name_A} {site_A.feature} / {name_B} {site_B.feature} / roll {roll}"
            X_WA = random_pose(rng, reach)
            X_WB = X_WA @ place(site_A, site_B, distance, roll)
            nhat = -X_WA[:3, :3] @ site_A.normal
            exact = (exact_A, exact_B)
            case = Case(label, A, B, X_WA, X_WB, distance, exact, nhat, site_A.point)
            if distance >= 0.0 or _is_promised(case, site_A, site_B, -distance, margin):
                found.append(case)
    return found
