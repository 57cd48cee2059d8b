"""Depths in 50 digits: where rays cross surfaces, by the equations of the surfaces alone.

Nothing is taken from the renderer, and nothing is fast. A ray is ``o + t d`` in the frame G of a
shape, where d is 1 deep along the camera's axis, so that t is the depth.
"""

from __future__ import annotations

from typing import Any

import mpmath as mp
import numpy as np

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, HalfSpace, Sphere
from scene_graph_ros.geometry.meshes.sources import hull_of, load_surface
from scene_graph_ros.geometry.perception import CameraIntrinsics, ClippingRange

__all__ = ["DIGITS", "true_depth"]

DIGITS = 50

_NEAR_MISS = 1e-6
"""Part of a triangle's size: rays that miss it by more in doubles are left out."""

Vector = list[Any]


def true_depth(
    shape: Any,
    X_WG: np.ndarray,
    X_WC: np.ndarray,
    lens: CameraIntrinsics,
    pixel: tuple[int, int],
    clipping: ClippingRange,
) -> Any:
    """Return the depth (mpf) at which the ray of ``pixel`` (u, v) first meets a shape, or None.

    Depths nearer than the clipping don't count; farther ones do.
    """
    (u, v), R = pixel, mp.matrix(X_WG[:3, :3].tolist())
    with mp.workdps(DIGITS):
        x = (u - mp.mpf(lens.cx)) / mp.mpf(lens.fx)
        y = (v - mp.mpf(lens.cy)) / mp.mpf(lens.fy)
        d_W = mp.matrix(X_WC[:3, :3].tolist()) * mp.matrix([x, y, 1])
        offset = mp.matrix([mp.mpf(X_WC[i, 3]) - mp.mpf(X_WG[i, 3]) for i in range(3)])
        d, o = mp.lu_solve(R, d_W), mp.lu_solve(R, offset)
        near = mp.mpf(clipping.near)
        return min((t for t in _crossings(shape, list(o), list(d)) if t >= near), default=None)


def _crossings(shape: Any, o: Vector, d: Vector) -> list[Any]:
    """Return all depths at which a ray crosses a shape's surface."""
    match shape:
        case Sphere():
            return _ball(o, d, mp.mpf(shape.radius))
        case Ellipsoid():
            sizes = [mp.mpf(s) for s in (shape.a, shape.b, shape.c)]
            o, d = ([x / s for x, s in zip(v, sizes, strict=True)] for v in (o, d))
            return _ball(o, d, mp.mpf(1))
        case HalfSpace():
            return [-o[2] / d[2]] if d[2] else []
        case Box():
            return _box(o, d, [mp.mpf(size) / 2 for size in shape.size])
        case Capsule() | Cylinder():
            return _round(shape, o, d, mp.mpf(shape.radius), mp.mpf(shape.length) / 2)
    return _triangles(shape, o, d)


def _of_quadratic(a: Any, b: Any, c: Any) -> list[Any]:
    """Return the roots of a t^2 + 2 b t + c, none if they are not real."""
    if a == 0 or b * b < a * c:
        return []
    root = mp.sqrt(b * b - a * c)
    return [(-b - root) / a, (-b + root) / a]


def _dot(a: Vector, b: Vector) -> Any:
    return sum(x * y for x, y in zip(a, b, strict=True))


def _ball(o: Vector, d: Vector, radius: Any) -> list[Any]:
    return _of_quadratic(_dot(d, d), _dot(o, d), _dot(o, o) - radius**2)


def _box(o: Vector, d: Vector, half: Vector) -> list[Any]:
    found = []
    for axis in range(3):
        rest = [i for i in range(3) if i != axis]
        for side in (-1, 1):
            if d[axis] == 0:
                continue
            t = (side * half[axis] - o[axis]) / d[axis]
            if all(abs(o[i] + t * d[i]) <= half[i] for i in rest):
                found.append(t)
    return found


def _round(shape: Capsule | Cylinder, o: Vector, d: Vector, radius: Any, half: Any) -> list[Any]:
    """Return crossings of the tube about z, and of what ends it at z = -half and half."""
    tube = _of_quadratic(_dot(d[:2], d[:2]), _dot(o[:2], d[:2]), _dot(o[:2], o[:2]) - radius**2)
    found = [t for t in tube if abs(o[2] + t * d[2]) <= half]
    for end in (-half, half):
        if isinstance(shape, Capsule):
            center = [o[0], o[1], o[2] - end]
            ends = _ball(center, d, radius)
            found += [t for t in ends if (center[2] + t * d[2]) * end >= 0]
        elif d[2] != 0:
            t = (end - o[2]) / d[2]
            if (o[0] + t * d[0]) ** 2 + (o[1] + t * d[1]) ** 2 <= radius**2:
                found.append(t)
    return found


def _triangles(shape: Any, o: Vector, d: Vector) -> list[Any]:
    if isinstance(shape, Convex):
        hull = hull_of(shape)
        fans = [(f[0], f[k], f[k + 1]) for f in hull.faces for k in range(1, len(f) - 1)]
        triangles = np.asarray(hull.vertices)[np.array(fans)]
    else:
        vertices, faces = load_surface(shape)
        triangles = np.asarray(vertices)[faces]
    found = []
    for triangle in _near(triangles, *(np.array([float(x) for x in v]) for v in (o, d))):
        a, b, c = ([mp.mpf(float(x)) for x in corner] for corner in triangle)
        sides = mp.matrix([[b[i] - a[i], c[i] - a[i], -d[i]] for i in range(3)])
        if mp.det(sides) == 0:
            continue
        x = mp.lu_solve(sides, mp.matrix([o[i] - a[i] for i in range(3)]))
        if x[0] >= 0 and x[1] >= 0 and x[0] + x[1] <= 1:
            found.append(x[2])
    return found


def _near(triangles: np.ndarray, o: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return those of the triangles (n, 3, 3) that a ray meets, or nearly does."""
    centers = triangles.mean(axis=1)
    square = ((triangles - centers[:, None]) ** 2).sum(axis=2).max(axis=1)
    away = np.cross(centers - o, d / np.linalg.norm(d))
    triangles = triangles[(away**2).sum(axis=1) <= 1.001 * square]
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    sides = np.stack([b - a, c - a, np.broadcast_to(-d, a.shape)], axis=-1)
    # Such a triangle is seen edge-on, or has no area: decided with all digits.
    size = np.abs(sides).max(axis=(1, 2), initial=0.0)
    is_flat = np.abs(np.linalg.det(sides)) < 1e-12 * size**3
    sides[is_flat] = np.eye(3)
    x = np.linalg.solve(sides, (o - a)[..., None])[..., 0]
    meets = (x[:, :2] > -_NEAR_MISS).all(axis=1) & (x[:, 0] + x[:, 1] < 1.0 + _NEAR_MISS)
    return triangles[is_flat | meets]
