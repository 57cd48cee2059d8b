"""Random solids of convex bodies, with the truth about sides and distances; and files of them.

A body is inside of its planes, so that sides need no mesh. The boundary of a solid is what is left
of the bodies' faces when they are cut along all other bodies' planes and the pieces with the same
side in front and behind are thrown away.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

__all__ = [
    "Body",
    "Solid",
    "boundary",
    "convex_body",
    "distances",
    "inside",
    "lattice_body",
    "moved",
    "pocketed_solid",
    "random_solid",
    "rotation",
    "sharpness",
    "solid_of_bodies",
    "with_motes",
    "with_specks",
    "written",
]

SHARPEST = 30.0
"""The largest ``sharpness`` of a pocket."""

STEP = 1e-8
"""Relative to the size: how far before and behind a piece sides are asked for."""


class Body(NamedTuple):
    """A convex polyhedron."""

    vertices: np.ndarray
    faces: np.ndarray
    """(m, 3), outwards."""
    normals: np.ndarray
    offsets: np.ndarray


class Solid(NamedTuple):
    """Bodies that are united, and which of them are written inside out."""

    bodies: list[Body]
    is_turned: list[bool]
    hollow: list[bool]
    """Which of them are cavities by the rule of docs/meshes.md."""
    size: float
    has_common_edges: bool


def convex_body(points):
    """Return the hull of points; each face is a fan of its corners."""
    hull = ConvexHull(points)
    planes = []
    for n, d in zip(hull.equations[:, :3], hull.equations[:, 3], strict=True):
        if not any(n @ m > 1 - 1e-9 and abs(d - e) < 1e-9 * np.ptp(points) for m, e in planes):
            planes.append((n, d))
    faces, normals, offsets = [], [], []
    for n, _ in planes:
        heights = points @ n
        on = np.flatnonzero(heights > heights.max() - 1e-9 * np.ptp(points))
        middle = points[on].mean(axis=0)
        u = points[on[0]] - middle
        u -= (u @ n) * n
        angle = np.arctan2((points[on] - middle) @ np.cross(n, u), (points[on] - middle) @ u)
        ring = on[np.argsort(angle)]
        faces += [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]
        normals.append(n)
        offsets.append(heights[on].mean())
    return Body(points, np.array(faces), np.array(normals), np.array(offsets))


def moved(body, R, scale, origin):
    """Return a body moved by origin, turned and scaled, with the same triangles.

    Planes that are found anew, far from a small body, would be off by rounding, and a triangle
    may then be of two faces.
    """
    vertices = (body.vertices + origin) @ R.T * scale
    normals = body.normals @ R.T
    return Body(vertices, body.faces, normals, (vertices @ normals.T).max(axis=0))


def shape_points(rng):
    """Return the corners of a box, a prism (a cylinder) or a random hull, of size 1 or so."""
    kind = rng.integers(4)
    if kind <= 1:
        half = rng.uniform(0.3, 0.7, 3)
        return np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    if kind == 2:
        n = int(rng.integers(3, 17))
        angle = 2.0 * np.pi * (np.arange(n) + rng.uniform()) / n
        ring = rng.uniform(0.3, 0.6) * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        half = rng.uniform(0.3, 0.8)
        return np.vstack([np.column_stack([ring, np.full(n, s * half)]) for s in (-1, 1)])
    points = rng.normal(size=(int(rng.integers(4, 13)), 3))
    points *= 0.6 / np.linalg.norm(points, axis=1)[:, None]
    return points[np.unique(ConvexHull(points).simplices)]


def rotation(rng):
    """Return a random rotation."""
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return axes * np.sign(np.linalg.det(axes))


def onto(n):
    """Return a rotation whose third column is n."""
    u = np.cross(np.eye(3)[np.abs(n).argmin()], n)
    u /= np.linalg.norm(u)
    return np.column_stack([u, np.cross(n, u), n])


def beside(rng, body, points):
    """Return points moved so that they touch a body: a face on a face, an edge or a corner."""
    face = rng.integers(len(body.normals))
    n, d = body.normals[face], body.offsets[face]
    on = body.vertices[np.abs(body.vertices @ n - d) < 1e-9]
    own = convex_body(points)
    m = own.normals[rng.integers(len(own.normals))]
    axes = onto(-n) @ rotation_about_z(rng) @ onto(m).T
    placed = points @ axes.T
    placed -= (placed @ n).min() * n
    how = rng.integers(3)
    if how == 0:
        target = rng.dirichlet(np.ones(len(on))) @ on
        return placed + target - own_middle(placed, n)
    if how == 1:
        lowest = placed[np.abs(placed @ n) < 1e-9]
        return placed + on[rng.integers(len(on))] - lowest[rng.integers(len(lowest))]
    return placed @ rotation(rng).T + (rng.dirichlet(np.ones(len(on))) @ on)


def own_middle(points, n):
    """Return the middle of the points in their lowest plane."""
    return points[np.abs(points @ n) < 1e-9].mean(axis=0)


def rotation_about_z(rng):
    """Return a rotation about z by any angle, or by none."""
    angle = rng.choice([0.0, rng.uniform(0, 2 * np.pi)])
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def lattice_body(rng):
    """Return a box with corners on a lattice, so that boxes have faces and edges in common."""
    lower = rng.integers(0, 4, 3)
    upper = lower + rng.integers(1, 4, 3)
    axes = list(zip(lower, upper, strict=True))
    corners = [(x, y, z) for x in axes[0] for y in axes[1] for z in axes[2]]
    return np.array(corners, dtype=float) / 3.0


def nested_points(rng, outer, share):
    """Return a small shape inside of a body, away from its faces."""
    middle = outer.vertices.mean(axis=0)
    room = (outer.offsets - outer.normals @ middle).min()
    return middle + share * room * (shape_points(rng) @ rotation(rng).T)


def random_solid(rng):
    """Return a solid of two to six bodies in one of the ways in which they can meet."""
    how = rng.choice(["lattice", "beside", "over", "nested", "hollow", "sizes"])
    count = int(rng.integers(2, 6))
    if how == "lattice":
        bodies = [convex_body(lattice_body(rng)) for _ in range(count)]
    else:
        bodies = [convex_body(shape_points(rng) @ rotation(rng).T)]
    turned = [False] * len(bodies)
    while len(bodies) < count:
        last = bodies[int(rng.integers(len(bodies)))]
        points = shape_points(rng) @ rotation(rng).T
        if how == "over":
            points = points + rng.uniform(-0.7, 0.7, 3)
        elif how == "beside":
            points = beside(rng, last, points)
        elif how in ("nested", "hollow"):
            points = nested_points(rng, bodies[-1], rng.uniform(0.4, 0.9))
        else:
            corner = last.vertices[rng.integers(len(last.vertices))]
            small = moved(convex_body(points), np.eye(3), 10.0 ** rng.uniform(-6, 0), 0.0)
            bodies.append(moved(small, np.eye(3), 1.0, corner))
        if how != "sizes":
            bodies.append(convex_body(points))
        turned.append(bool(how == "hollow" and rng.random() < 0.6))
    if how == "hollow" and rng.random() < 0.5:
        bar = shape_points(rng) * np.array([0.1, 0.1, 4.0])
        bodies.append(convex_body(bar @ rotation(rng).T))
        turned.append(False)
    R, scale, origin = rotation(rng), 10.0 ** rng.uniform(-3, 3), rng.normal(size=3)
    bodies = [moved(body, R, scale, origin) for body in bodies]
    return solid_of_bodies(bodies, turned, has_common_edges=how == "lattice")


def sharpness(body):
    """Return by how much more than its planes a corner of a body moves, when they move alike.

    A corner of planes n that all move by one moves by the x of which each n . x is one; of those
    that move three are enough.
    """
    worst = 1.0
    for corner in body.vertices:
        on = np.abs(body.normals @ corner - body.offsets) < 1e-9 * np.ptp(body.vertices)
        for three in itertools.combinations(body.normals[on], min(3, np.count_nonzero(on))):
            worst = max(worst, float(np.linalg.norm(np.linalg.pinv(np.array(three)).sum(axis=1))))
    return worst


def pocket(rng, outer):
    """Return a hull in a body that has a face, an edge or a corner on one of the body's faces.

    No corner is as sharp as a needle: needles would be told from rounding by luck.
    """
    while True:
        found = pocket_of_any_form(rng, outer)
        if sharpness(found) < SHARPEST:
            return found


def pocket_of_any_form(rng, outer):
    """Return the hull of points of a face, or of one of its corners, and of points inside."""
    face = rng.integers(len(outer.normals))
    on = outer.vertices[np.abs(outer.vertices @ outer.normals[face] - outer.offsets[face]) < 1e-9]
    mouth = rng.dirichlet(np.ones(len(on)), int(rng.integers(1, 6))) @ on
    if rng.random() < 0.3:
        mouth[0] = on[0]
    middle = outer.vertices.mean(axis=0)
    weights = rng.dirichlet(np.ones(len(outer.vertices)), int(rng.integers(3, 7)))
    deep = middle + rng.uniform(0.2, 0.9) * (weights @ outer.vertices - middle)
    points = np.vstack([mouth, deep])
    return convex_body(points[np.unique(ConvexHull(points).simplices)])


def pocketed_solid(rng):
    """Return a solid of a body with cavities that are flush with its faces, and bodies beside it.

    Cavities may overlap, and bodies be on the body's faces; or there are bodies in cavities, flush
    with these, and cavities in those or over both, and so on.
    """
    is_lattice = rng.random() < 0.4
    if is_lattice:
        corners = [(x, y, z) for x in (0, 5) for y in (0, 5) for z in (0, 5)]
        bodies = [convex_body(np.array(corners, dtype=float) / 3.0)]
    else:
        bodies = [convex_body(shape_points(rng) @ rotation(rng).T)]
    turned = [False]
    # In the last one before, in any one before, or all in the first one.
    nesting = "first" if is_lattice else rng.choice(["last", "any", "first"], p=[0.2, 0.4, 0.4])
    for _ in range(int(rng.integers(1, 5 if nesting == "any" else 4))):
        last = len(bodies) - 1
        within = {"first": 0, "last": last, "any": int(rng.integers(last + 1))}[nesting]
        bodies.append(
            convex_body(lattice_body(rng)) if is_lattice else pocket(rng, bodies[within])
        )
        turned.append(not turned[within])
    if not is_lattice and rng.random() < 0.4:
        bodies.append(convex_body(beside(rng, bodies[0], shape_points(rng) @ rotation(rng).T)))
        turned.append(False)
    R, scale, origin = rotation(rng), 10.0 ** rng.uniform(-3, 3), rng.normal(size=3)
    bodies = [moved(body, R, scale, origin) for body in bodies]
    return solid_of_bodies(bodies, turned, has_common_edges=is_lattice)


def solid_of_bodies(bodies, turned, *, has_common_edges=False):
    """Return bodies as a solid; cavities are found by the rule."""
    points = np.vstack([body.vertices for body in bodies])
    size = float(np.ptp(points, axis=0).max())
    volumes = [ConvexHull(body.vertices).volume for body in bodies]
    hollow = []
    for i, body in enumerate(bodies):
        around = [
            k
            for k, other in enumerate(bodies)
            if k != i
            and volumes[k] > volumes[i]
            and (body.vertices @ other.normals.T <= other.offsets + 1e-12 * size).all()
        ]
        nearest = min(around, key=volumes.__getitem__, default=i)
        hollow.append(len(around) % 2 == 1 and turned[nearest] != turned[i])
    return Solid(bodies, turned, hollow, size, has_common_edges)


def with_specks(rng, solid):
    """Return a solid with some bodies more that are less than 1e-12 of it, and how many."""
    corners = np.vstack([body.vertices for body in solid.bodies])
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    specks = []
    for _ in range(int(rng.integers(3))):
        shape = convex_body(shape_points(rng) @ rotation(rng).T)
        # The largest shapes are of size 3, and their corners must not be rounded together.
        small = shape.vertices * solid.size * 10.0 ** rng.uniform(-13.0, -12.5)
        specks.append(shape._replace(vertices=small + rng.uniform(lower, upper)))
    turned = solid.is_turned + [False] * len(specks)
    return solid._replace(bodies=solid.bodies + specks, is_turned=turned), len(specks)


def with_motes(rng, solid):
    """Return a solid with bodies of some 1e-12 to 1e-10 of its size in its hull, and these.

    They are too small to be cut along other bodies, and large enough to be kept: each has a ball
    of 1e-12 of the size in it, or more.
    """
    corners = np.vstack([body.vertices for body in solid.bodies])
    motes = []
    for _ in range(int(rng.integers(1, 4))):
        shape = convex_body(shape_points(rng) @ rotation(rng).T)
        middle = shape.vertices.mean(axis=0)
        thickness = (shape.offsets - shape.normals @ middle).min()
        small = shape.vertices * solid.size * 10.0 ** rng.uniform(-12.0, -10.5) / thickness
        at = small + rng.dirichlet(np.ones(len(corners))) @ corners
        motes.append(shape._replace(vertices=at, offsets=(at @ shape.normals.T).max(axis=0)))
    turned = solid.is_turned + [False] * len(motes)
    common = solid.has_common_edges
    return solid_of_bodies(solid.bodies + motes, turned, has_common_edges=common), motes


def inside(solid, points):
    """Tell of (n, 3) points whether they are in the solid."""
    total = np.zeros(len(points), dtype=int)
    for body, is_hollow in zip(solid.bodies, solid.hollow, strict=True):
        within = np.ones(len(points), dtype=bool)
        for n, d in zip(body.normals, body.offsets, strict=True):
            within &= points @ n < d
        total += np.where(is_hollow, -1, 1) * within
    return total >= 1


def boundary(solid):
    """Return triangles (k, 3, 3) that are the boundary of a solid, none of its inside."""
    pieces, normals = [], []
    for body in solid.bodies:
        for face in body.faces:
            corners = body.vertices[face]
            n = np.cross(corners[1] - corners[0], corners[2] - corners[0])
            n /= np.linalg.norm(n)
            parts = [corners]
            for other in solid.bodies:
                if other is not body:
                    parts = cut_along(parts, other, solid.size)
            pieces += parts
            normals += [n] * len(parts)
    middles = np.array([p.mean(axis=0) for p in pieces])
    step = STEP * solid.size * np.array(normals)
    is_boundary = inside(solid, middles + step) != inside(solid, middles - step)
    kept = [p for p, keep in zip(pieces, is_boundary, strict=True) if keep]
    return np.array([[p[0], p[k], p[k + 1]] for p in kept for k in range(1, len(p) - 1)])


def cut_along(polygons, body, size):
    """Return convex polygons cut along the planes of a body that they reach into."""
    outside = []
    for polygon in polygons:
        rest = polygon
        pieces = []
        for n, d in zip(body.normals, body.offsets, strict=True):
            h = rest @ n - d
            h[np.abs(h) < 1e-12 * size] = 0.0
            if h.max() <= 0.0:
                continue
            if h.min() >= 0.0:
                pieces, rest = [polygon], None
                break
            pieces.append(part_above(rest, h))
            rest = part_above(rest, -h)
        outside += pieces if rest is None else [*pieces, rest]
    return outside


def part_above(polygon, heights):
    """Return the part of a convex polygon where heights are not negative."""
    result = []
    for k in range(len(polygon)):
        j = (k + 1) % len(polygon)
        if heights[k] >= 0.0:
            result.append(polygon[k])
        if heights[k] * heights[j] < 0.0:
            share = heights[k] / (heights[k] - heights[j])
            result.append(polygon[k] + share * (polygon[j] - polygon[k]))
    return np.array(result)


def distances(triangles, points):
    """Return the distance of each of (n, 3) points from the nearest of (k, 3, 3) triangles."""
    a, b, c = (triangles[:, k] for k in range(3))
    n = np.cross(b - a, c - a)
    size = np.linalg.norm(n, axis=1)
    a, b, c, n = (x[size > 0.0] for x in (a, b, c, n / np.where(size > 0, size, 1.0)[:, None]))
    best = np.full((len(points), len(a)), np.inf)
    within = np.ones(best.shape, dtype=bool)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        arm = points[:, None] - start
        square = np.einsum("kj,kj->k", side, side)
        t = np.clip(np.einsum("nkj,kj->nk", arm, side) / np.where(square > 0, square, 1.0), 0, 1)
        away = arm - t[:, :, None] * side
        best = np.minimum(best, np.sqrt(np.einsum("nkj,nkj->nk", away, away)))
        within &= np.einsum("nkj,kj->nk", arm, np.cross(n, side)) >= 0.0
    height = np.abs(np.einsum("nkj,kj->nk", points[:, None] - a, n))
    return np.where(within, height, best).min(axis=1)


def written(rng, solid, *, single=False):
    """Return vertices and triangles as some program might write them to one mesh."""
    is_oriented = any(solid.is_turned) or rng.random() < 0.5
    flip = rng.random() < 0.5
    points, faces, start = [], [], 0
    for body, is_turned in zip(solid.bodies, solid.is_turned, strict=True):
        rows = body.faces[:, ::-1] if is_turned != flip else body.faces
        if not is_oriented:
            half_of_them = rng.permutation(len(rows))[::2]
            rows = rows.copy()
            rows[half_of_them] = rows[half_of_them, ::-1]
        faces.append(rows + start)
        points.append(body.vertices)
        start += len(body.vertices)
    points, faces = np.vstack(points), np.vstack(faces)
    faces = rng.permutation(faces)
    faces = np.array([np.roll(f, rng.integers(3)) for f in faces])
    if single:
        points = points.astype(np.float32).astype(np.float64)
    # Turned at random, triangles with all edges in common do not tell whose they are.
    layout = rng.integers(3) if is_oriented or not solid.has_common_edges else 2
    if layout == 0:
        points, inverse = np.unique(points, axis=0, return_inverse=True)
        faces = inverse.reshape(-1)[faces]
    elif layout == 1:
        points, faces = points[faces].reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)
    order = rng.permutation(len(points))
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return points[order], place[faces]
