"""The mesh files of robots' wheels, and what their triangles mean by winding numbers alone."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from winding_truth import is_inside, raw_parts, RawParts, solid_angles, without_pairs

__all__ = ["Comparison", "compared_sides", "robot_meshes", "truth"]

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

OPEN = 0.25
"""Of a turn: open parts that wind around a point by less leave it where closed ones have it."""

GAP = 1e-6
"""Relative to the size: gaps that are closed (``repair_tolerance``)."""

BESIDE = 1e-3
"""Of the way from a corner to its triangle's middle: a point of that corner."""

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


def sample_points(rng, vertices, triangles, pairs):
    """Return points in the box of a mesh, and beside its triangles, on both sides."""
    count = int(np.clip(pairs // len(triangles), 10, 120))
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
    size = max((upper - lower).max() for lower, upper in boxes)
    for i, part in enumerate(parts.triangles):
        # Flush with a face, or out of it by no more than a gap that is closed, is inside.
        a, b, c = (parts.vertices[part[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        areas = np.linalg.norm(normals, axis=1)
        step = min(GAP * size, volumes[i] / (12.0 * areas.sum()))
        inwards = step * normals / np.maximum(areas, 1e-300)[:, None]
        middles = (a + b + c) / 3.0 - inwards
        # A corner may be all that reaches out.
        beside = [middles + (1.0 - BESIDE) * (corner - inwards - middles) for corner in (a, b, c)]
        some = slice(None, None, 1 + len(middles) // 60)
        around = [
            k
            for k, other in enumerate(parts.triangles)
            if volumes[k] > volumes[i]
            and (boxes[k][0] <= boxes[i][0] + GAP * size).all()
            and (boxes[k][1] >= boxes[i][1] - GAP * size).all()
            and (solid_angles(middles[some], parts.vertices, other) > 0.5).all()
            and (solid_angles(np.concatenate(beside)[some], parts.vertices, other) > 0.5).all()
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
    """Return of points whether they are inside, and whether that is known, by the definition.

    Closed parts wind around points by whole numbers. Others are sheets, or are to be repaired:
    where they all together wind by more than OPEN, the definition does not say enough, unless the
    file's triangles as written wind around all points by whole numbers, and the report is of a
    solid in which none of them was turned.
    """
    parts = raw_parts(vertices, triangles)
    if parts.is_whole:
        return is_inside(points, parts, hollow_parts(parts)), np.ones(len(points), dtype=bool)
    # Parts that touch at edges are told by edges of two, once doubled triangles are gone.
    single, doubled = without_pairs(vertices, triangles)
    if not len(single):
        # All are doubled: whether they bound anything is a guess.
        return np.zeros(len(points), dtype=bool), np.zeros(len(points), dtype=bool)
    parts = raw_parts(vertices, single)
    numbers = [solid_angles(points, parts.vertices, part) for part in parts.triangles]
    # A part that runs both ways, once its doubled triangles are gone, winds around points by -1.
    is_closed = [
        bool(is_clear(number) and number.min() > -0.5 and not has_hole(parts.vertices, part))
        for number, part in zip(numbers, parts.triangles, strict=True)
    ]
    is_turned = any(repair.kind == "triangles turned" for repair in report.repairs)
    if not all(is_closed) and report.is_closed and not is_turned:
        whole = solid_angles(points, vertices, triangles)
        a, b, c = (vertices[triangles[:, k]] - vertices[triangles[0, 0]] for k in range(3))
        whole *= np.sign(np.einsum("ij,ij->", a, np.cross(b, c)))
        if is_clear(whole) and whole.min() > -0.5:
            return whole > 0.5, np.ones(len(points), dtype=bool)
    closed = RawParts(
        parts.vertices,
        [part for part, keep in zip(parts.triangles, is_closed, strict=True) if keep],
        [way for way, keep in zip(parts.ways, is_closed, strict=True) if keep],
        is_whole=True,
    )
    wanted = is_inside(points, closed, hollow_parts(closed))
    rest = np.zeros(len(points))
    if not all(is_closed):
        rest = solid_angles(points, vertices, doubled, is_absolute=True)
    for number, keep in zip(numbers, is_closed, strict=True):
        rest += 0.0 if keep else np.abs(number)
    is_known = rest < OPEN
    if 0 in parts.ways:
        # What a part means whose triangles run both ways is a guess where these say otherwise.
        is_known &= (np.abs(solid_angles(points, vertices, triangles)) > 0.5) == wanted
    return wanted, is_known


def is_clear(numbers):
    """Tell whether winding numbers are whole, so that what winds is closed."""
    return np.abs(numbers - np.round(numbers)).max() < 0.02


class Comparison(NamedTuple):
    """Sides of points as a mesh's surface and as the definition has them."""

    wrong: np.ndarray
    """(k, 3): points with another side than by definition."""
    compared: int
    """How many points have a side by definition."""
    inside: int
    """How many of these are inside."""


def compared_sides(rng, surface, vertices, triangles, signed_distance, pairs=PAIRS):
    """Compare sides at points in and around a mesh, as many as ``pairs`` allow."""
    points = sample_points(rng, vertices, triangles, pairs)
    wanted, is_known = truth(vertices, triangles, points, surface.report)
    phi = signed_distance(points)
    size = float(np.ptp(vertices[triangles].reshape(-1, 3), axis=0).max())
    wrong = is_known & ((phi < 0.0) != wanted) & (np.abs(phi) > 2e-6 * size)
    return Comparison(points[wrong], int(is_known.sum()), int((wanted & is_known).sum()))
