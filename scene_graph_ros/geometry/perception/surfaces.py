"""Triangles of shapes, with normals and picture coordinates, for renderers that draw triangles.

Round shapes are profiles that are turned about the z axis. Coordinates are those of
``exact/parametrization``: docs/cameras.md lists them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scene_graph_ros.geometry.shapes.every_kind import every_kind
from scene_graph_ros.geometry.shapes.kinds import ShapeKind

__all__ = ["Patch", "patch_of_shape"]

_AROUND = 96
"""Faces once around; a sphere's outline is then right to 5e-4 of its radius."""
_QUARTER = 24
"""Faces from equator to pole."""

FloatArray = NDArray[np.float64]


class Patch(NamedTuple):
    """Triangles in the frame G of a shape."""

    vertices: FloatArray
    """(n, 3) metres."""
    triangles: NDArray[np.int64]
    """(m, 3)."""
    normals: FloatArray | None
    """(n, 3) units, out of the shape; None: those of the triangles."""
    uv: FloatArray | None
    """(n, 2) on the picture."""


def patch_of_shape(kind: int, size: FloatArray, reach: float, foot: FloatArray) -> Patch:
    """Return the surface of a shape of a kind, by its numbers as kernels read them.

    A half space is a square of half the side ``reach`` (m) about the point ``foot``, in G.
    """
    patch = _PATCHES[ShapeKind(kind)]
    assert patch is not None, kind
    return patch(size, reach, foot)


def _turned(
    rho: FloatArray, z: FloatArray, n_rho: FloatArray, n_z: FloatArray, v: FloatArray
) -> Patch:
    """Return a profile (k,) from below to above, with its normals, turned about the z axis."""
    u = np.linspace(0.0, 1.0, _AROUND + 1)
    angle = 2.0 * np.pi * (u - 0.5)
    c, s = np.cos(angle), np.sin(angle)

    def rows(radial: FloatArray, along: FloatArray) -> FloatArray:
        x, y = np.multiply.outer(radial, c), np.multiply.outer(radial, s)
        return np.stack([x, y, np.broadcast_to(along[:, None], x.shape)], axis=-1).reshape(-1, 3)

    k = len(rho)
    uv = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    at = np.arange(k - 1)[:, None] * (_AROUND + 1) + np.arange(_AROUND)
    low, high = at.reshape(-1), at.reshape(-1) + _AROUND + 1
    triangles = np.concatenate(
        [np.stack([low, low + 1, high + 1], axis=1), np.stack([low, high + 1, high], axis=1)]
    )
    return Patch(rows(rho, z), triangles, rows(n_rho, n_z), uv)


def _ellipsoid(axes: FloatArray) -> Patch:
    latitude = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 2 * _QUARTER + 1)
    rho, z = np.cos(latitude), np.sin(latitude)
    ball = _turned(rho, z, rho, z, np.linspace(0.0, 1.0, len(z)))
    normals = ball.vertices / axes
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return ball._replace(vertices=ball.vertices * axes, normals=normals)


def _capsule(radius: float, half: float) -> Patch:
    latitude = np.linspace(0.0, 0.5 * np.pi, _QUARTER + 1)
    latitude = np.concatenate([-latitude[::-1], latitude])
    ends = np.repeat([-half, half], _QUARTER + 1)
    n_rho, n_z = np.cos(latitude), np.sin(latitude)
    way = ends + radius * latitude
    v = 0.5 + 0.5 * way / (half + 0.5 * np.pi * radius)
    return _turned(radius * n_rho, ends + radius * n_z, n_rho, n_z, v)


def _cylinder(radius: float, half: float) -> Patch:
    ends = np.array([-half, half])
    side = _turned(np.full(2, radius), ends, np.ones(2), np.zeros(2), np.array([0.0, 1.0]))
    parts = [side]
    angle = np.linspace(0.0, 2.0 * np.pi, _AROUND + 1)[:-1]
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    disc = np.concatenate([np.zeros((1, 2)), rim])
    around = np.arange(_AROUND)
    fan = np.stack([np.zeros_like(around), 1 + around, 1 + (around + 1) % _AROUND], axis=1)
    for sign in (-1.0, 1.0):
        points = np.column_stack([radius * disc, np.full(len(disc), sign * half)])
        normals = np.tile((0.0, 0.0, sign), (len(disc), 1))
        uv = 0.5 + 0.5 * disc * (sign, 1.0)
        parts.append(Patch(points, fan if sign > 0.0 else fan[:, ::-1], normals, uv))
    return _joined(parts)


def _box(halves: FloatArray) -> Patch:
    """Return six faces, each with the whole picture upright, as seen from outside."""
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
    parts = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            out, up = np.zeros(3), np.zeros(3)
            out[axis], up[2 if axis < 2 else 1] = sign, 1.0
            right = np.cross(up, out)
            points = out + np.outer(2.0 * corners[:, 0] - 1.0, right)
            points = (points + np.outer(2.0 * corners[:, 1] - 1.0, up)) * halves
            triangles = np.array([(0, 1, 2), (0, 2, 3)])
            parts.append(Patch(points, triangles, np.tile(out, (4, 1)), corners))
    return _joined(parts)


def _square(reach: float, foot: FloatArray) -> Patch:
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) * reach + foot[:2]
    points = np.column_stack([corners, np.zeros(4)])
    # Pictures repeat themselves: near the middle, numbers keep their digits.
    uv = corners - np.floor(foot[:2])
    triangles = np.array([(0, 1, 2), (0, 2, 3)])
    return Patch(points, triangles, np.tile((0.0, 0.0, 1.0), (4, 1)), uv)


def _joined(parts: list[Patch]) -> Patch:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    pairs = zip(parts, starts[:-1], strict=True)
    return Patch(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles + start for part, start in pairs]),
        np.concatenate([part.normals for part in parts if part.normals is not None]),
        np.concatenate([part.uv for part in parts if part.uv is not None]),
    )


_PATCHES: dict[ShapeKind, Callable[[FloatArray, float, FloatArray], Patch] | None] = every_kind(
    "surfaces that pictures cover",
    {
        ShapeKind.SPHERE: lambda size, reach, foot: _ellipsoid(np.full(3, size[0])),
        ShapeKind.CAPSULE: lambda size, reach, foot: _capsule(size[0], size[1]),
        ShapeKind.BOX: lambda size, reach, foot: _box(size),
        ShapeKind.CYLINDER: lambda size, reach, foot: _cylinder(size[0], size[1]),
        ShapeKind.ELLIPSOID: lambda size, reach, foot: _ellipsoid(size),
        ShapeKind.HALF_SPACE: lambda size, reach, foot: _square(reach, foot),
        # These have triangles of their own.
        ShapeKind.CONVEX: None,
        ShapeKind.MESH: None,
    },
)
