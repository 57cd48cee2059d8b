"""Distances of points and a convex hull by all of its faces: nothing of the project is asked."""

import numpy as np
from scipy.spatial import ConvexHull

__all__ = ["HullBody"]


class HullBody:
    """A convex hull in a link's frame L."""

    def __init__(self, vertices):
        hull = ConvexHull(vertices)
        self.normals, self.offsets = hull.equations[:, :3], hull.equations[:, 3]
        self.triangles = vertices[hull.simplices]
        corners = vertices[hull.vertices]
        self.lower, self.upper = corners.min(axis=0), corners.max(axis=0)
        self.center = 0.5 * (self.lower + self.upper)
        self.radius = np.linalg.norm(corners - self.center, axis=1).max()

    def near(self, X_WLs, points, reach, nearest=None):
        """Return (pose, point, gap) ``(k,)`` of points of W nearer than ``reach`` to the hull.

        ``X_WLs`` ``(n, 4, 4)`` are poses, ``nearest`` returns the points in a ball by its centre
        and radius; without it each is looked at. A gap is below zero inside.
        """
        centers = X_WLs[:, :3, :3] @ self.center + X_WLs[:, :3, 3]
        radius = self.radius + reach + 1e-6
        if nearest is None:
            square = (centers**2).sum(1)[:, np.newaxis] - 2.0 * centers @ points.T
            rows, picked = np.divmod(
                np.flatnonzero(square + (points**2).sum(1) <= radius**2), max(len(points), 1)
            )
        else:
            found = [nearest(center, radius) for center in centers]
            rows = np.repeat(np.arange(len(found)), [len(each) for each in found])
            picked = np.concatenate(found)
        R, p_WL = X_WLs[:, :3, :3], X_WLs[:, :3, 3]
        p_Ls = np.einsum("nji,nj->ni", R[rows], points[picked] - p_WL[rows])
        inside = ((p_Ls >= self.lower - reach) & (p_Ls <= self.upper + reach)).all(axis=1)
        rows, picked = rows[inside], picked[inside]
        gaps = self.gaps(p_Ls[inside], reach)
        is_near = gaps <= reach
        return rows[is_near], picked[is_near], gaps[is_near]

    def gaps(self, p_Ls, reach):
        """Return the distances ``(m,)`` of points of L, by planes inside and triangles outside.

        Those above ``reach`` are infinite.
        """
        result = (p_Ls @ self.normals.T + self.offsets).max(axis=1, initial=-np.inf)
        result[result > reach] = np.inf
        for row in np.flatnonzero((result > 0.0) & np.isfinite(result)):
            result[row] = triangle_distances(p_Ls[row], self.triangles).min()
        result[result > reach] = np.inf
        return result


def triangle_distances(p, triangles):
    """Return the distances ``(t,)`` of a point and triangles ``(t, 3, 3)``."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, np.newaxis]
    sides = [
        np.einsum("ti,ti->t", np.cross(normal, v - u), p - u) for u, v in ((a, b), (b, c), (c, a))
    ]
    height = np.abs(np.einsum("ti,ti->t", normal, p - a))
    edges = []
    for u, v in ((a, b), (b, c), (c, a)):
        along = np.einsum("ti,ti->t", p - u, v - u) / np.einsum("ti,ti->t", v - u, v - u)
        edges.append(
            np.linalg.norm(u + np.clip(along, 0.0, 1.0)[:, np.newaxis] * (v - u) - p, axis=1)
        )
    return np.where((np.array(sides) >= 0.0).all(axis=0), height, np.min(edges, axis=0))
