"""Random polygons whose areas are known: walks around triangles that lie in them."""

import numpy as np
from scipy.spatial import Delaunay

__all__ = ["placed", "polygon_of_triangles", "star"]


def star(rng, corners):
    """Return a star-shaped polygon (n, 2), counter-clockwise."""
    # No two are half a turn apart: it goes around the origin once.
    angles = 2.0 * np.pi * (np.arange(corners) + rng.uniform(0.0, 0.8, corners)) / corners
    radii = rng.uniform(0.2, 1.0, corners)
    return radii[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def polygon_of_triangles(rng, count, *, on_lattice=False):
    """Return (points (n, 2), area): a walk around triangles, counter-clockwise.

    Triangles of a triangulation are added one by one, each across one side of one before. So the
    polygon has notches and corners on straight sides, and where it comes back to itself, slits,
    holes bridged to the outline, and corners and sides that it passes twice. Some corners are
    doubled, some sides cut in two, and spikes of no width go out of some corners.
    """
    points = _corners(rng, 2 * count, on_lattice=on_lattice)
    mesh = Delaunay(points, qhull_options="QJ" if on_lattice else "Qbb Qc Qz")
    corners = points[mesh.simplices]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    first = int(areas.argmax())
    walk, area, taken = [int(i) for i in mesh.simplices[first]], areas[first], {first}
    sides = {frozenset(np.delete(mesh.simplices[first], k).tolist()): first for k in range(3)}
    while len(taken) < count:
        k = int(rng.integers(len(walk)))
        a, b = walk[k], walk[(k + 1) % len(walk)]
        one = sides.get(frozenset((a, b)))
        if one is None:
            continue
        apex = [m for m in range(3) if mesh.simplices[one][m] not in (a, b)]
        beyond = int(mesh.neighbors[one][apex[0]])
        del sides[frozenset((a, b))]
        if beyond in taken or beyond < 0 or areas[beyond] < 1e-9:
            if not sides:
                break
            continue
        taken.add(beyond)
        area += areas[beyond]
        new = next(int(i) for i in mesh.simplices[beyond] if i not in (a, b))
        walk.insert(k + 1, new)
        for side in ((a, new), (new, b)):
            sides[frozenset(side)] = beyond
    return _decorated(rng, points[walk]), float(area)


def _corners(rng, count, *, on_lattice):
    """Return points (n, 2) that are not on one line, at most ``count`` of them."""
    while True:
        points = rng.normal(size=(count, 2))
        if not on_lattice:
            return points
        points = np.unique(np.round(2.0 * points), axis=0)
        if len(points) > 3 and np.linalg.matrix_rank(points - points[0]) == 2:
            return points


def _decorated(rng, points):
    """Return a polygon with doubled corners, corners in the middle of sides, and spikes."""
    result = []
    for k, p in enumerate(points):
        result.append(p)
        how = rng.integers(12)
        following = points[(k + 1) % len(points)]
        if how == 0:
            result.append(p)
        elif how == 1:
            result.append(0.5 * p + 0.5 * following)
        elif how == 2:
            # Along the side and back: it stays in the plane, and encloses nothing.
            result += [0.25 * p + 0.75 * following, 0.5 * p + 0.5 * following]
    return np.roll(np.array(result), int(rng.integers(len(result))), axis=0)


def placed(rng, points):
    """Return a polygon (n, 3) somewhere in space, and how it was scaled."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    scale = 10.0 ** rng.uniform(-3.0, 3.0)
    return scale * (points @ axes[:, :2].T + rng.normal(size=3)), scale
