"""Borders next to borders: where one body's face or side ends just beside the end of another's.

Features that face each other in parallel share a strip, or a corner, of as little as rounding, or
miss each other by that: a rim beside a hull's face that ends 1e-10 m above it. Or they are turned
by that little, so that all of two faces is nearly as near as the corner where they are nearest.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from hard_corpus.batches import Case
from hard_corpus.bodies import extent, scattered_hull
from hard_corpus.sites import frame, place, pose, Site, sites_of, unit
from scene_graph_ros.geometry import Box, Convex, Cylinder

__all__ = ["border_cases", "tent_cases"]

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


def _just_beside(rng, _):
    """Return a number of either sign, at most 1e-7 and just above rounding, at times 0."""
    size = 10.0 ** rng.uniform(-13.0, -7.0)
    return float(rng.choice([-size, size])) if rng.integers(8) else 0.0


def _tent(rng):
    """Return a hull of an apex above a base of 3 to 24 corners, which are its first ones."""
    corners = int(rng.integers(3, 25))
    angles = 2.0 * np.pi * (np.arange(corners) + rng.uniform(0.1, 0.9, corners)) / corners
    base = 0.1 * np.stack([np.cos(angles), np.sin(angles), np.zeros(corners)], axis=1)
    return Convex(vertices=[*base, [0.01, 0.02, 0.1]])


def _on_base(rng, tent):
    """Return a corner of a tent's base, or a point of an edge of it, as a site of the base."""
    base = np.asarray(tent.vertices)[:-1]
    k = rng.integers(len(base))
    a, b = base[k - 1], base[k]
    point = a + rng.choice([0.0, rng.uniform(0.1, 0.9)]) * (b - a)
    down = np.array([0.0, 0.0, -1.0])
    return Site("base", point, down, unit(b - a), np.zeros((3, 3)))


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
    return _cases(count, f"borders {seed}", (_round, _other, _site, _tiny), seed)


def tent_cases(count, seed):
    """Return cases of two hulls whose bases are parallel but for a little, and share as little."""
    return _cases(count, f"tents {seed}", (_tent, _tent, _on_base, _just_beside), seed)


def _cases(count, label, makers, seed):
    """Return cases of two bodies and the ``site`` of each, apart by numbers that are ``tiny``."""
    rng = np.random.default_rng(seed)
    first, second, site, tiny = makers
    found = []
    while len(found) < count:
        A, B = first(rng), second(rng)
        L = max(extent(A), extent(B))
        site_A, site_B = site(rng, A), site(rng, B)
        gap = L * float(10.0 ** rng.uniform(-6, -1)) * rng.choice([1.0, 1.0, 1.0, -1.0])
        roll = rng.choice([0.0, np.pi / 2, np.pi, tiny(rng, -2), rng.uniform(0.0, 6.0)])
        X_AB = place(site_A, site_B, gap, roll)
        axes = frame(site_A)
        X_AB[:3, 3] += L * (tiny(rng, -1) * axes[:, 0] + tiny(rng, -1) * axes[:, 1])
        turn = tiny(rng, -2) * axes[:, 0] + tiny(rng, -2) * axes[:, 1]
        # About the site of A, which stays where it is.
        R = Rotation.from_rotvec(turn).as_matrix()
        X_AB = pose(R, site_A.point - R @ site_A.point) @ X_AB
        X_WA = pose(np.eye(3), np.zeros(3))
        if rng.integers(2):
            reach = 10.0 ** rng.uniform(0, 6)
            X_WA = pose(Rotation.random(rng=rng).as_matrix(), rng.uniform(-reach, reach, 3))
        found.append(Case(f"{label} case {len(found)}", A, B, X_WA, X_WA @ X_AB))
    return found
