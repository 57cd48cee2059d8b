"""All 35 pairs of the eight shapes, in contact at every combination of their features."""

import itertools

import numpy as np

from hard_corpus.batches import Case, relative
from hard_corpus.bodies import closed_mesh, dented_mesh, rescaled, scattered_hull
from hard_corpus.sites import are_shallowest, place, pose, sites_of, unit
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
    w, x, y, z = unit(rng.normal(size=4))
    R = np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )
    return pose(R, rng.uniform(-reach, reach, 3))


def pair_of(case):
    """Return which of the 35 pairs a case is, the same for both orders."""
    first, second = sorted((case.A, case.B), key=lambda shape: shape.kind)
    return f"{first.type_name}-{second.type_name}"


def grown(bodies, factor):
    """Return the bodies, ``factor`` times as large."""
    return {name: (rescaled(shape, factor), exact) for name, (shape, exact) in bodies.items()}


def _may_be_promised(case, sites):
    """Tell whether the depth of this overlap can be promised.

    With triangles that enclose a dent it is promised where they are entered through one face.
    """
    if not any(case.triangles):
        return True
    if all(case.triangles):
        return False
    # Of one body the triangles count, of the other the hull.
    return all(
        (site.feature == "face") == exact
        for site, exact in zip(sites, case.triangles, strict=True)
    )


def _promised(cases, sites, margin):
    """Return the overlaps of one pair of shapes whose depth is known, and promised."""
    kept = [k for k, case in enumerate(cases) if _may_be_promised(case, sites[k])]
    cases, sites = [cases[k] for k in kept], [sites[k] for k in kept]
    if not cases:
        return []
    first = cases[0]
    X_AB = np.array([relative(case.X_WA, case.X_WB) for case in cases])
    known = are_shallowest(first.A, first.B, sites, X_AB, -first.truth, DIRECTIONS, margin)
    return [case for case, is_known in zip(cases, known, strict=True) if is_known]


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
        cases, sites = [], []
        for site_A, site_B, roll in itertools.product(
            sites_of(A, 0, reach), sites_of(B, 1, reach), rolls
        ):
            label = f"{name_A} {site_A.feature} / {name_B} {site_B.feature} / roll {roll}"
            X_WA = random_pose(rng, reach)
            X_WB = X_WA @ place(site_A, site_B, distance, roll)
            nhat = -X_WA[:3, :3] @ site_A.normal
            exact = (exact_A, exact_B)
            cases.append(Case(label, A, B, X_WA, X_WB, distance, exact, nhat, site_A.point))
            sites.append((site_A, site_B))
        found += cases if distance >= 0.0 else _promised(cases, sites, margin)
    return found
