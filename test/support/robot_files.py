"""The mesh files of robots' wheels, and what their triangles mean by winding numbers alone."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from winding_truth import is_inside, raw_parts, solid_angles, without_pairs

__all__ = ["disagreements", "robot_meshes", "truth"]

PACKAGES = {
    "cmeel": "../cmeel.prefix/share/example-robot-data/robots",
    "pybullet_data": ".",
    "mani_skill": "assets",
    "robosuite": "models/assets",
    "rtbdata": ".",
}
"""Packages with meshes, as far as they are installed, and where in them these are."""

SUFFIXES = (".stl", ".dae", ".obj", ".ply", ".glb")
PAIRS = 400_000
"""Solid angles that are computed of one file."""

GAP = 1e-6
"""Relative to the size: gaps that are closed (``repair_tolerance``)."""

ALIKE = 0.9
"""The share of a part's triangles that must run alike for it to be a cavity."""


def robot_meshes():
    """Return the mesh files of the packages that are installed."""
    files = []
    for package, folder in PACKAGES.items():
        found = importlib.util.find_spec(package)
        if found is not None and found.origin is not None:
            root = Path(found.origin).parent / folder
            files += sorted(p for p in root.rglob("*") if p.suffix.lower() in SUFFIXES)
    return files


def sample_points(rng, vertices, triangles):
    """Return points in the box of a mesh, and beside its triangles, on both sides."""
    count = int(np.clip(PAIRS // len(triangles), 10, 120))
    corners = vertices[triangles]
    lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    size = (upper - lower).max()
    chosen = corners[rng.integers(len(corners), size=count)]
    n = np.cross(chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0])
    n /= np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None]
    weights = rng.dirichlet(np.ones(3), count)
    step = rng.choice([-1, 1], (count, 1)) * size * 10.0 ** rng.uniform(-5, -2, (count, 1))
    beside = np.einsum("nk,nkj->nj", weights, chosen) + step * n
    return np.vstack([rng.uniform(lower, upper, (count, 3)), beside])


def hollow_parts(parts):
    """Return the numbers of the parts that are cavities by the rule of docs/meshes.md."""
    if len(set(parts.ways)) < 2:
        return set()
    boxes = [
        (parts.vertices[t].min(axis=(0, 1)), parts.vertices[t].max(axis=(0, 1)))
        for t in parts.triangles
    ]
    volumes = []
    for t in parts.triangles:
        a, b, c = (parts.vertices[t[:, k]] - parts.vertices[t[0, 0]] for k in range(3))
        volumes.append(np.einsum("ij,ij->", a, np.cross(b, c)))
    result = set()
    for i, part in enumerate(parts.triangles):
        middles = parts.vertices[part].mean(axis=1)
        around = [
            k
            for k, other in enumerate(parts.triangles)
            if volumes[k] > volumes[i]
            and (boxes[k][0] <= boxes[i][0]).all()
            and (boxes[k][1] >= boxes[i][1]).all()
            and (
                solid_angles(middles[:: 1 + len(middles) // 60], parts.vertices, other) > 0.5
            ).all()
        ]
        nearest = min(around, key=volumes.__getitem__, default=i)
        if len(around) % 2 == 1 and parts.ways[nearest] * parts.ways[i] < 0:
            result.add(i)
    return result


def has_hole(vertices, triangles):
    """Tell whether a part has a hole that is larger than GAP times the length around it.

    The area vector of what closes a hole is that of its loop.
    """
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    shape = (len(vertices), len(vertices))
    net = coo_array((np.ones(len(start)), (start, end)), shape=shape).tocsr()
    start, end = ((net - net.T) > 0.0).nonzero()
    if not len(start):
        return False
    border = coo_array((np.ones(len(start)), (start, end)), shape=shape)
    loop = connected_components(border, directed=False)[1][start]
    _, first, loop = np.unique(loop, return_index=True, return_inverse=True)
    origin = vertices[start[first]][loop]
    area = 0.5 * np.cross(vertices[start] - origin, vertices[end] - origin)
    sums = np.stack([np.bincount(loop, area[:, k]) for k in range(3)], axis=1)
    size = np.ptp(vertices[triangles].reshape(-1, 3), axis=0).max()
    length = np.bincount(loop, np.linalg.norm(vertices[end] - vertices[start], axis=1))
    return (np.linalg.norm(sums, axis=1) > GAP * size * length).any()


def truth(vertices, triangles, points, report):
    """Return whether points are inside by the definition, or None where it says nothing.

    That is so for sheets, also where a hole is so small that they nearly wind around points; and
    where parts can't be told: where edges of more than two triangles, none doubled, leave parts
    that wind around points by fractions, and the file's triangles as written do so too, or some of
    them run against the others.
    """
    parts = raw_parts(vertices, triangles)
    if parts.is_whole:
        return is_inside(points, parts, hollow_parts(parts))
    # Parts that touch at edges are told by edges of two, once doubled triangles are gone.
    single = without_pairs(vertices, triangles)
    if not len(single):
        return None  # all are doubled: whether they bound anything is a guess
    parts = raw_parts(vertices, single)
    numbers = [solid_angles(points, parts.vertices, part) for part in parts.triangles]
    # A part that runs both ways, once its doubled triangles are gone, winds around points by -1.
    if all(is_clear(number) and number.min() > -0.5 for number in numbers):
        if any(has_hole(parts.vertices, part) for part in parts.triangles):
            return None
        return is_inside(points, parts, hollow_parts(parts))
    is_turned = any(repair.kind == "triangles turned" for repair in report.repairs)
    if is_turned or not report.is_closed:
        return None
    numbers = solid_angles(points, vertices, triangles)
    a, b, c = (vertices[triangles[:, k]] - vertices[triangles[0, 0]] for k in range(3))
    numbers *= np.sign(np.einsum("ij,ij->", a, np.cross(b, c)))
    return numbers > 0.5 if is_clear(numbers) and numbers.min() > -0.5 else None


def is_clear(numbers):
    """Tell whether winding numbers are whole, so that what winds is closed."""
    return np.abs(numbers - np.round(numbers)).max() < 0.02


def disagreements(rng, surface, vertices, triangles, signed_distance):
    """Return points (k, 3) with another side than by definition; None where that is unknown."""
    points = sample_points(rng, vertices, triangles)
    wanted = truth(vertices, triangles, points, surface.report)
    if wanted is None:
        return None
    phi = signed_distance(points)
    size = float(np.ptp(vertices[triangles].reshape(-1, 3), axis=0).max())
    return points[((phi < 0.0) != wanted) & (np.abs(phi) > 2e-6 * size)]
