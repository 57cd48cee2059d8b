"""Borders next to borders: where one body's face or side ends just beside the end of another's.

Features that face each other in parallel share a strip, or a corner, of as little as rounding, or
miss each other by that: a rim beside a hull's face that ends 1e-10 m above it.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import Case
from hard_corpus.bodies import extent, scattered_hull
from hard_corpus.sites import frame, place, pose, sites_of
from scene_graph_ros.geometry import Box, Convex, Cylinder

__all__ = ["border_cases"]

_BORDERS = {
    "Cylinder": ("side", "rim of face", "rim of side", "rim"),
    "Box": ("face", "edge of face", "vertex of face", "edge"),
    "Convex": ("face", "edge of face", "vertex of face", "edge", "vertex"),
}
_SEEDS = 40
"""Of sites of a body: angles around a cylinder, faces of a hull."""


def _prism(corners, height):
    """Return a hull with two faces of many corners."""
    angles = 2.0 * np.pi * np.arange(corners) / corners
    ring = 0.1 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ends = (-0.5 * height, 0.5 * height)
    return Convex(vertices=[[x, y, z] for x, y in ring for z in ends])


_HULLS = [
    *(scattered_hull(0.2, count, seed) for count, seed in ((6, 1), (20, 2), (60, 4), (150, 3))),
    _prism(7, 0.1),
    _prism(40, 0.05),
]


def _tiny(rng, most):
    """Return 0, or a number of either sign: any down to 1e-16, or just above rounding."""
    low, high = (-16.0, most) if rng.integers(2) else (-13.0, -7.0)
    size = float(10.0 ** rng.uniform(low, high))
    return float(rng.choice([0.0, size, -size, size]))


def _site(rng, shape):
    sites = [
        site
        for site in sites_of(shape, int(rng.integers(_SEEDS)))
        if site.feature in _BORDERS[shape.type_name]
    ]
    return sites[rng.integers(len(sites))]


def _round(rng):
    radius, length = rng.uniform(0.02, 0.3, 2)
    return Cylinder(float(radius), float(length))


def _other(rng):
    kind = rng.integers(5)
    if kind == 0:
        return _round(rng)
    if kind == 1:
        return Box(*map(float, rng.uniform(0.02, 0.3, 3)))
    return _HULLS[rng.integers(len(_HULLS))]


def border_cases(count, seed):
    """Return cases of a cylinder beside a cylinder, a box or a hull."""
    rng = np.random.default_rng(seed)
    found = []
    while len(found) < count:
        A, B = _round(rng), _other(rng)
        L = max(extent(A), extent(B))
        site_A, site_B = _site(rng, A), _site(rng, B)
        gap = L * float(10.0 ** rng.uniform(-6, -1)) * rng.choice([1.0, 1.0, 1.0, -1.0])
        roll = rng.choice([0.0, np.pi / 2, np.pi, _tiny(rng, -2), rng.uniform(0.0, 6.0)])
        X_AB = place(site_A, site_B, gap, roll)
        axes = frame(site_A)
        X_AB[:3, 3] += L * (_tiny(rng, -1) * axes[:, 0] + _tiny(rng, -1) * axes[:, 1])
        turn = _tiny(rng, -2) * axes[:, 0] + _tiny(rng, -2) * axes[:, 1]
        # About the site of A, which stays where it is.
        R = Rotation.from_rotvec(turn).as_matrix()
        X_AB = pose(R, site_A.point - R @ site_A.point) @ X_AB
        X_WA = pose(np.eye(3), np.zeros(3))
        if rng.integers(2):
            reach = 10.0 ** rng.uniform(0, 6)
            X_WA = pose(Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach, reach, 3))
        found.append(Case(f"borders {seed} case {len(found)}", A, B, X_WA, X_WA @ X_AB))
    return found
