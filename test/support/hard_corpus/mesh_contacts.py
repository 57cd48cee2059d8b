"""Pairs with meshes that are measured by their triangles: where they touch, and what holds there.

A normal of such a mesh separates the bodies as a whole only where they touch on their hulls. What
holds everywhere, as long as the nearest points are no further inside than rounding: the other
body, if convex, is on one side of the plane through its witness, and so are the triangles that
the mesh's witness is on.
"""

import functools

import numpy as np
from scipy.spatial import ConvexHull

from hard_corpus.batches import relative, size
from hard_corpus.bodies import closed_mesh, dented_mesh, scattered_points, support
from hard_corpus.sites import Site, unit
from scene_graph_ros.geometry import HalfSpace, Mesh

__all__ = ["TRIANGLE_MESHES", "one_sidedness", "triangle_sites"]

_ON_IT = 1e-14
"""Relative to a mesh's size: a witness this near a triangle is on it."""

_TOUCHING = 1e-12
"""Relative to the pair's size: by which a distance may be off; nearer bodies may touch."""


def _bumpy(count, seed):
    """Return a closed mesh of points at random distances from its middle: ridges, pits, bumps."""
    points = scattered_points(count, seed)
    faces = ConvexHull(points).simplices
    a, b, c = (points[faces[:, k]] for k in range(3))
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    faces = np.where(inwards[:, None], faces[:, ::-1], faces)
    radii = np.random.default_rng(seed).uniform(0.05, 0.1, (count, 1))
    return Mesh(vertices=points * radii, faces=faces)


def _stairs():
    """Return a closed mesh of two steps: right angles, one of them hollow, and coplanar faces."""
    outline = np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], float)
    front = np.c_[outline[:, 0], np.zeros(6), outline[:, 1]]
    cap = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    faces = [*cap, *[(c + 6, b + 6, a + 6) for a, b, c in cap]]
    sides = [(k, (k + 1) % 6) for k in range(6)]
    faces += [t for a, b in sides for t in ((b, a, a + 6), (b, a + 6, b + 6))]
    return Mesh(
        vertices=0.1 * (np.r_[front, front + np.array([0.0, 2.0, 0.0])] - 1.0), faces=faces
    )


TRIANGLE_MESHES = [
    dented_mesh(0.2, 24),
    closed_mesh(0.2, 30, 9),
    _bumpy(40, 3),
    _bumpy(150, 4),
    _stairs(),
]


@functools.cache
def _surface(mesh):
    """Return the corners (t, 3, 3) of a mesh's triangles and their unit normals."""
    points = np.asarray(mesh.vertices) * np.asarray(mesh.scale)
    corners = points[np.asarray(mesh.faces)]
    a, b, c = corners.transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    return corners, normals / np.linalg.norm(normals, axis=1)[:, None]


def triangle_sites(mesh, rng):
    """Return a face, and an edge and a vertex at which the mesh is convex, on its hull or not."""
    corners, normals = _surface(mesh)
    faces = np.asarray(mesh.faces)
    t = rng.integers(0, len(faces))
    a, b, _ = corners[t]
    inner = rng.dirichlet([1.0, 1.0, 1.0]) @ corners[t]
    nothing = np.zeros((3, 3))
    found = [Site("face", inner, normals[t], unit(b - a), nothing)]
    for s in rng.permutation(len(faces)):
        shared = [v for v in faces[t] if v in faces[s]]
        if len(shared) == 2 and normals[s] @ (corners[s].sum(0) - corners[t].sum(0)) > 1e-9:
            ends = (np.asarray(mesh.vertices) * np.asarray(mesh.scale))[shared]
            share = rng.choice([0.0, 1.0, rng.uniform()])
            n = unit(share * normals[t] + (1.0 - share) * normals[s])
            point = ends[0] + rng.uniform(0.1, 0.9) * (ends[1] - ends[0])
            found.append(Site("edge", point, n, unit(ends[1] - ends[0]), nothing))
            break
    v = faces[t][0]
    around = np.any(faces == v, axis=1)
    n = unit(rng.dirichlet(np.ones(np.count_nonzero(around))) @ normals[around])
    if np.max((corners[around] - a).reshape(-1, 3) @ n) <= 1e-16:
        tangent = np.eye(3)[np.argmin(abs(n))]
        found.append(Site("vertex", a, n, unit(tangent - (tangent @ n) * n), nothing))
    return found


def _distances_to_triangles(corners, normals, x):
    """Return the (t,) distances of a point."""
    a, b, c = corners.transpose(1, 0, 2)
    within = np.ones(len(a), bool)
    best = np.full(len(a), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        within &= np.einsum("ij,ij->i", np.cross(side, x - start), normals) >= 0.0
        s = np.einsum("ij,ij->i", x - start, side) / np.einsum("ij,ij->i", side, side)
        rest = x - start - np.clip(s, 0.0, 1.0)[:, None] * side
        best = np.minimum(best, np.linalg.norm(rest, axis=1))
    return np.where(within, abs(np.einsum("ij,ij->i", x - a, normals)), best)


def _reach(shape, triangles, x, n, is_touching):
    """Return how far a body reaches beyond the plane through its point x, along n.

    Where the bodies touch, that says something about x only if the mesh is convex there.
    """
    if isinstance(shape, HalfSpace):
        return 0.0
    if not triangles:
        return support(shape, n) - n @ x
    corners, normals = _surface(shape)
    extent = np.max(np.ptp(corners.reshape(-1, 3), axis=0))
    is_on = _distances_to_triangles(corners, normals, x) <= _ON_IT * extent
    ways = (corners[is_on] - x).reshape(-1, 3)
    if is_touching and np.max(ways @ normals[is_on].T, initial=0.0) > 1e-12 * extent:
        return 0.0
    return np.max(ways @ n, initial=0.0)


def one_sidedness(case, answers, k):
    """Return how far A and B reach beyond the planes through their witnesses (m), (2,)."""
    n_W = answers.nhat_BA_W[k]
    X_AB = relative(case.X_WA, case.X_WB)
    n_A = case.X_WA[:3, :3].T @ n_W
    is_touching = answers.distance[k] <= _TOUCHING * size(case)
    first, second = case.triangles
    return np.array(
        [
            _reach(case.A, first, answers.p_ACa[k], -n_A, is_touching),
            _reach(case.B, second, answers.p_BCb[k], X_AB[:3, :3].T @ n_A, is_touching),
        ]
    )
