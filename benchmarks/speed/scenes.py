"""What the engines are asked about: shapes on frames, and many sets of poses for the frames."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from scene_graph_ros.geometry import Box, Capsule, Convex, Cylinder, Ellipsoid, Sphere

__all__ = [
    "WORLD",
    "Body",
    "Compliance",
    "Scene",
    "draw_hull",
    "draw_points",
    "draw_primitive",
    "random_rotations",
    "small_rotations",
    "volume",
]

WORLD = -1
"""The frame of what is anchored."""


class Body(NamedTuple):
    """A shape on a frame."""

    frame: int
    """Row of the frame, or WORLD."""
    shape: object
    X_FG: np.ndarray


class Compliance(NamedTuple):
    """How all shapes of a scene give way, for contact surfaces."""

    resolution_hint: float
    """Metres."""
    modulus: float
    """Pascals."""


@dataclass(frozen=True)
class Scene:
    """A seeded scene. The arrays are never written to."""

    key: str
    title: str
    bodies: list[Body]
    X_WF: np.ndarray
    """(m, f, 4, 4): m sets of poses of the f frames."""
    p_WQs: np.ndarray
    """(q, 3) points to ask about."""
    apart_X_WF: np.ndarray | None = None
    """(m, f, 4, 4): sets of poses in which nothing collides, where there are any."""
    excluded: frozenset[tuple[int, int]] = field(default_factory=frozenset)
    """Pairs of frames, the lower row first, whose bodies are never paired."""
    compliance: Compliance | None = None
    """Of all bodies; without it they have no contact surfaces."""

    @property
    def size(self) -> int:
        """The number of bodies."""
        return len(self.bodies)

    @property
    def frames(self) -> int:
        """The number of frames that move."""
        return self.X_WF.shape[1]

    @property
    def moving(self) -> list[Body]:
        """The bodies that move."""
        return [body for body in self.bodies if body.frame != WORLD]

    @property
    def anchored(self) -> list[Body]:
        """The bodies that never move."""
        return [body for body in self.bodies if body.frame == WORLD]

    def moving_poses(self, X_WF: np.ndarray) -> np.ndarray:
        """Return ``(n, 4, 4)`` poses of the bodies that move, for poses ``(f, 4, 4)``."""
        moving = self.moving
        X_FG = np.array([body.X_FG for body in moving])
        return X_WF[[body.frame for body in moving]] @ X_FG


def random_rotations(rng: np.random.Generator, n: int) -> np.ndarray:
    """Draw rotation matrices (n, 3, 3) evenly, from normal quaternions."""
    return _rotations(rng.normal(size=(n, 4)))


def small_rotations(rng: np.random.Generator, angle: float, n: int) -> np.ndarray:
    """Draw rotation matrices (n, 3, 3) by about ``angle`` (rad) about each axis."""
    q = np.ones((n, 4))
    q[:, :3] = rng.normal(scale=0.5 * angle, size=(n, 3))
    return _rotations(q)


def _rotations(q: np.ndarray) -> np.ndarray:
    """Return rotation matrices of quaternions (n, 4) of any length, x, y, z, w."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    v, w = q[:, :3], q[:, 3]
    cross = np.zeros((len(q), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2] = -v[:, 2], v[:, 1]
    cross[:, 1, 0], cross[:, 1, 2] = v[:, 2], -v[:, 0]
    cross[:, 2, 0], cross[:, 2, 1] = -v[:, 1], v[:, 0]
    return np.eye(3) + 2.0 * (w[:, None, None] * cross + cross @ cross)


def draw_hull(rng: np.random.Generator, vertices: int, a: float, b: float, c: float) -> Convex:
    """Return the hull of points on an ellipsoid, all of which are vertices."""
    directions = rng.normal(size=(vertices, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return Convex(vertices=directions * [a, b, c])


def draw_primitive(rng: np.random.Generator, kind: int, hull_vertices: int = 12) -> object:
    """Draw a shape of 10 to 30 cm, of the kind 0 to 5."""
    a, b, c = rng.uniform(0.1, 0.3, 3)
    match kind:
        case 0:
            return Sphere(a / 2)
        case 1:
            return Box(a, b, c)
        case 2:
            return Capsule(a / 3, b)
        case 3:
            return Cylinder(a / 2, b)
        case 4:
            return Ellipsoid(a / 2, b / 2, c / 2)
        case _:
            return draw_hull(rng, hull_vertices, a / 2, a / 2, a / 2)


def volume(shape: object) -> float:
    """Return the volume (m³); of a hull, that of the box around it, halved."""
    if isinstance(shape, Convex):
        vertices = np.asarray(shape.vertices)
        return 0.5 * float(np.prod(np.ptp(vertices, axis=0)))
    return shape.volume()  # type: ignore[attr-defined]


def draw_points(rng: np.random.Generator, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Draw 1000 points in a box."""
    return rng.uniform(low, high, (1000, 3))
