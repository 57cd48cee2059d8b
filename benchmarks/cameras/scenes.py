"""What the cameras of the comparison see: bodies before a camera at rest, which all move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from scene_graph_ros.geometry import Box, Capsule, Cylinder, Ellipsoid, Mesh, Sphere
from scene_graph_ros.geometry.perception import CameraIntrinsics, ClippingRange

__all__ = ["CLIPPING", "SCENES", "SETS", "CameraScene", "ball_mesh", "lens", "meshes", "mixed"]

CLIPPING = ClippingRange(0.1, 20.0)
SETS = 4
"""Sets of poses of each scene; every frame has another one than the frame before."""

_FOV_Y = np.radians(60.0)
_NEAREST, _FARTHEST = 1.2, 3.0
"""Metres between which the bodies' centres are, within the view."""
_STEP, _TURN = 0.005, 0.05
"""Metres and radians that bodies move from one set of poses to the next."""


@dataclass(frozen=True)
class CameraScene:
    """Bodies with a pose each; the camera is at the origin and looks along z."""

    key: str
    title: str
    shapes: list[Any]
    X_WGs: np.ndarray
    """(SETS, n, 4, 4)."""

    @property
    def is_of_meshes(self) -> bool:
        """Whether all that is seen are triangles."""
        return isinstance(self.shapes[0], Mesh)


def lens(width: int = 640, height: int = 480) -> CameraIntrinsics:
    """Return a lens with square pixels and its axis in the middle of the image."""
    return CameraIntrinsics.from_fov_y(width, height, float(_FOV_Y))


def _placed(key: str, title: str, shapes: list[Any], rng: np.random.Generator) -> CameraScene:
    """Scatter bodies over the view, and move them a little from set to set."""
    n = len(shapes)
    z = rng.uniform(_NEAREST, _FARTHEST, n)
    reach = np.tan(0.5 * _FOV_Y) * np.array([4.0 / 3.0, 1.0])
    X_WGs = np.tile(np.eye(4), (SETS, n, 1, 1))
    X_WGs[:, :, :2, 3] = rng.uniform(-0.9, 0.9, (n, 2)) * reach * z[:, None]
    X_WGs[:, :, 2, 3] = z
    X_WGs[:, :, :3, 3] += rng.uniform(-_STEP, _STEP, (SETS, n, 3))
    base = Rotation.random(n, random_state=rng)
    for X_WG in X_WGs:
        turn = Rotation.from_rotvec(rng.uniform(-_TURN, _TURN, (n, 3)))
        X_WG[:, :3, :3] = (turn * base).as_matrix()
    return CameraScene(key, title, shapes, X_WGs)


def mixed(count: int, seed: int) -> CameraScene:
    """Return spheres, boxes, capsules, cylinders and ellipsoids, smaller where there are more."""
    rng = np.random.default_rng((seed, count))
    shapes: list[Any] = []
    for k in range(count):
        r, s, t = (0.8 / np.cbrt(count) * rng.uniform(0.5, 1.0, 3)).tolist()
        kinds = (
            Sphere(r),
            Box(2.0 * r, 2.0 * s, 2.0 * t),
            Capsule(0.5 * r, 2.0 * s),
            Cylinder(r, 2.0 * s),
            Ellipsoid(r, s, t),
        )
        shapes.append(kinds[k % len(kinds)])
    return _placed(f"mixed-{count}", f"{count} shapes", shapes, rng)


def ball_mesh(level: int, radius: float) -> Mesh:
    """Return a bumpy ball of 20 * 4^level triangles."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=level)
    p = np.asarray(ball.vertices)
    bumps = 1.0 + 0.1 * np.sin(7.0 * p[:, :1]) * np.cos(5.0 * p[:, 1:2] + 3.0 * p[:, 2:])
    return Mesh(vertices=radius * bumps * p, faces=np.asarray(ball.faces))


def meshes(count: int, level: int, seed: int) -> CameraScene:
    """Return ``count`` bodies of the same bumpy mesh."""
    rng = np.random.default_rng((seed, count, level))
    shape = ball_mesh(level, 0.6 / np.cbrt(count))
    triangles = f"{count * 20 * 4**level:,}".replace(",", " ")
    noun = "mesh" if count == 1 else "meshes"
    title = f"{count} {noun}, {triangles} triangles"
    scene = _placed(f"meshes-{count}", title, [shape] * count, rng)
    if count == 1:
        # In the middle of the view, and as near as the nearest of many.
        scene.X_WGs[..., :3, 3] *= [0.1, 0.1, _NEAREST / _FARTHEST]
        scene.X_WGs[..., 2, 3] += 0.5 * _NEAREST
    return scene


SCENES: dict[str, Callable[[int], CameraScene]] = {
    "mixed-10": partial(mixed, 10),
    "mixed-50": partial(mixed, 50),
    "mixed-1000": partial(mixed, 1000),
    "meshes-1": partial(meshes, 1, 7),
    "meshes-200": partial(meshes, 200, 4),
}
"""By key, made from a seed."""
