"""Spheres that cover a link or an obstacle: each triangle of its surface is inside of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.distance import cdist

from benchmarks.peer_shapes import hull_triangles
from scene_graph_ros.geometry import Box, Convex, Ellipsoid, Mesh

__all__ = ["cover", "covers_of"]

_TRIANGLES = 2000
"""Of a shape's surface, at least: these are shared out to spheres."""
_ROUNDS = 10
_STEPS, _FINE_STEPS = 60, 400
"""Towards the centre of a smallest ball, while shares change and at last."""
_DEEPEST = 0.2
"""m, from there inwards."""
_ELLIPSOID = 24
"""Steps of longitude of an ellipsoid's circumscribed mesh."""


def covers_of(shapes: Sequence[object], count: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return centres and radii of spheres around each shape, about ``count`` in all.

    A surface is covered by k spheres with radii like one over the root of k, so numbers go like
    the squares of the radii of single spheres: then all are about as large.
    """
    surfaces = [_surface(shape) for shape in shapes]
    squares = np.array([cover(surface, 1)[1].max() ** 2 for surface in surfaces])
    counts = np.maximum(np.rint(count * squares / squares.sum()), 1).astype(int)
    return [cover(surface, k) for surface, k in zip(surfaces, counts.tolist(), strict=True)]


def cover(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return centres ``(k, 3)`` and radii of up to so many spheres around triangles ``(t, 3, 3)``.

    These are the surface of a convex set. They are shared out as by Lloyd's algorithm, and each
    share gets a sphere around all of its corners: a sphere is convex, so the triangles are in it.
    Of the spheres from the smallest one (Badoiu and Clarkson, 2003) on inwards it is the one that
    stands out of the set least, as those about a link's axis do.
    """
    middles = triangles.mean(axis=1)
    centers, owner = middles[_spread(middles, count)], None
    for _ in range(_ROUNDS):
        away = [cdist(corner, centers) for corner in triangles.transpose(1, 0, 2)]
        before, owner = owner, np.maximum.reduce(away).argmin(axis=1)
        if np.array_equal(before, owner):
            break  # as it would stay
        shares = [owner == k for k in np.unique(owner)]
        centers = np.array([_smallest_ball(triangles[s].reshape(-1, 3), _STEPS) for s in shares])
    outwards = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    middle = middles.mean(axis=0)
    outwards[(outwards * (triangles[:, 0] - middle)).sum(axis=1) < 0.0] *= -1.0
    normals = outwards / np.linalg.norm(outwards, axis=1, keepdims=True)
    sides = (normals * triangles[:, 0]).sum(axis=1)
    found = [
        _least_standing_out(
            triangles[share].reshape(-1, 3), -outwards[share].sum(axis=0), normals, sides
        )
        for share in shares
    ]
    return np.array([center for center, _ in found]), np.array([radius for _, radius in found])


def _least_standing_out(
    points: np.ndarray, inwards: np.ndarray, normals: np.ndarray, sides: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return centre and radius of a ball around points that is outside of a set the least.

    The set is that of the points x with ``normals x <= sides``.
    """
    first = _smallest_ball(points, _FINE_STEPS)
    length = float(np.linalg.norm(inwards))
    way = inwards / length if length > 0.0 else inwards
    best = None
    for depth in np.append(0.0, np.geomspace(1e-3, _DEEPEST, 40)):
        center = first + depth * way
        radius = float(np.linalg.norm(points - center, axis=1).max())
        out = radius - float((sides - normals @ center).min())
        if best is None or out < best[0]:
            best = out, center, radius
    assert best is not None
    return best[1], best[2]


def _spread(points: np.ndarray, count: int) -> np.ndarray:
    """Return rows of points that are far from each other, each the farthest from those before."""
    rows, away = [0], np.linalg.norm(points - points[0], axis=1)
    while len(rows) < min(count, len(points)):
        rows.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[rows[-1]], axis=1))
    return np.array(rows)


def _smallest_ball(points: np.ndarray, steps: int) -> np.ndarray:
    """Return nearly the centre of the smallest ball around points ``(n, 3)``."""
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    x, y, z = points.T.copy()
    for step in range(2, steps):
        a, b, c = center.tolist()
        farthest = points[((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2).argmax()]
        center = center + (farthest - center) / step
    return np.asarray(center)


def _surface(shape: object) -> np.ndarray:
    """Return small triangles ``(t, 3, 3)`` of a shape's surface, or of one around it."""
    match shape:
        case Box():
            size = np.array([shape.width, shape.depth, shape.height])
            triangles = _CORNERS[_FACES] * 0.5 * size
        case Convex() | Mesh():
            vertices, faces = hull_triangles(shape)
            triangles = vertices[faces]
        case Ellipsoid():
            triangles = _around_sphere() * np.array([shape.a, shape.b, shape.c])
        case _:
            raise TypeError(f"{shape!r} is not covered")
    while len(triangles) < _TRIANGLES:
        triangles = _split(triangles)
    return triangles


def _split(triangles: np.ndarray) -> np.ndarray:
    """Return the halves of the larger half of some triangles, cut through their longest edges."""
    sides = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
    longest = sides.max(axis=1)
    is_cut = longest >= np.median(longest)
    rows = np.flatnonzero(is_cut)
    turned = np.stack(
        [triangles[row][np.roll(np.arange(3), -int(sides[row].argmax()))] for row in rows]
    )
    a, b, c = turned.transpose(1, 0, 2)
    middle = 0.5 * (a + b)
    halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
    return np.concatenate([triangles[~is_cut], *halves])


def _around_sphere() -> np.ndarray:
    """Return triangles around the ball of radius 1: of a mesh of it, blown up."""
    u = np.linspace(0.0, 2.0 * np.pi, _ELLIPSOID + 1)
    v = np.linspace(0.0, np.pi, _ELLIPSOID // 2 + 1)
    points = np.stack(
        [
            np.outer(np.cos(u), np.sin(v)),
            np.outer(np.sin(u), np.sin(v)),
            np.outer(np.ones_like(u), np.cos(v)),
        ],
        axis=2,
    )
    a, b, c, d = points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]
    triangles = np.concatenate(
        [np.stack(each, axis=2).reshape(-1, 3, 3) for each in ((a, b, c), (a, c, d))]
    )
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    kept = sizes > 1e-9
    away = np.abs((normals[kept] * triangles[kept, 0]).sum(axis=1)) / sizes[kept]
    return triangles[kept] / away.min()


_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FACES = np.array(
    [
        triangle
        for a, b, c, d in (
            (0, 1, 3, 2),
            (4, 5, 7, 6),
            (0, 1, 5, 4),
            (2, 3, 7, 6),
            (0, 2, 6, 4),
            (1, 3, 7, 5),
        )
        for triangle in ((a, b, c), (a, c, d))
    ]
)
