"""Configurations whose signed distance is known by construction.

Two convex bodies whose supporting planes at two points face each other, the points on a common
normal and a distance apart, are exactly that far apart: the planes separate them, and the points
attain the distance. Pushed into each other by a depth, they overlap by exactly that if no other
direction offers a shorter way out. That is searched for, and such a configuration is thrown away:
the search decides which configurations count, never what their answer is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import itertools
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.accuracy.bodies import (
    draw,
    edge_directions,
    face_normals,
    FEATURES,
    pit,
    Site,
    site,
    support,
)
from scene_graph_ros.geometry import HalfSpace, Mesh

__all__ = [
    "KnownPair",
    "KnownPoint",
    "align",
    "has_shorter_way_out",
    "known_pairs",
    "known_points",
]

_TRIES = 40
"""For one combination of features, before it counts as impossible (an edge pushed along itself
into an edge always has a shorter way out)."""

_PARALLEL = 1e-9
"""Square metres: edges of 20 cm whose product is shorter are parallel."""

_DIRECTIONS = 1200
_SLACK = 1e-14
"""Metres: a way out shorter by less is rounding."""


@dataclass(frozen=True)
class KnownPair:
    """Two shapes in world poses, and their signed distance (m) and normal out of B into A."""

    shape_A: Any
    X_WA: np.ndarray
    shape_B: Any
    X_WB: np.ndarray
    distance: float
    nhat_BA_W: np.ndarray
    features: str


@dataclass(frozen=True)
class KnownPoint:
    """A shape in a world pose, a point Q, and its signed distance (m) and gradient."""

    shape: Any
    X_WG: np.ndarray
    p_WQ: np.ndarray
    distance: float
    grad_W: np.ndarray
    features: str


def _pose(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = R, p
    return X


def _random_pose(rng: np.random.Generator) -> np.ndarray:
    R = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    return _pose(R, rng.uniform(-0.5, 0.5, 3))


def align(site_A: Site, site_B: Site, distance: float, twist: float) -> np.ndarray:
    """Return X_AB with the sites facing each other at a distance (m, negative: overlapping).

    ``twist`` (rad) is the angle between the sites' tangents about the common normal.
    """
    n = site_A.normal
    frame_A = np.column_stack([site_A.tangent, np.cross(n, site_A.tangent), n])
    m = site_B.normal
    frame_B = np.column_stack([site_B.tangent, -np.cross(m, site_B.tangent), -m])
    c, s = np.cos(twist), np.sin(twist)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    R_AB = frame_A @ turn @ frame_B.T
    return _pose(R_AB, site_A.point + distance * n - R_AB @ site_B.point)


def _sphere_directions(count: int) -> np.ndarray:
    """Return (count, 3) unit vectors spread evenly, on a spiral."""
    k = np.arange(count) + 0.5
    z = 1.0 - 2.0 * k / count
    angle = np.pi * (1.0 + np.sqrt(5.0)) * k
    return np.column_stack(
        [np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z]
    )


_GLOBAL = _sphere_directions(_DIRECTIONS)
_ANGLES = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)


def _around(n: np.ndarray, step: float) -> np.ndarray:
    """Return (k * 16, 3) unit vectors, ``step`` rad off each of the k directions n."""
    other = np.where(np.abs(n[:, :1]) < 0.6, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    u = np.cross(n, other)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(n, u)
    ring = u[:, None] * np.cos(_ANGLES)[:, None] + v[:, None] * np.sin(_ANGLES)[:, None]
    turned = np.cos(step) * n[:, None] + np.sin(step) * ring
    return turned.reshape(-1, 3)


def has_shorter_way_out(
    separation: Any, nhat: np.ndarray, depth: float, candidates: np.ndarray | None = None
) -> bool:
    """Tell whether bodies that overlap by ``depth`` along nhat (3,) overlap by less along another.

    ``separation`` maps directions (k, 3) to the gap along them, negative where they overlap. All
    directions are sampled, the best ones and nhat itself are improved by a pattern search; unit
    vectors ``candidates`` (n, 3), where the answer has a kink, are tried first.
    """
    if (
        candidates is not None
        and len(candidates)
        and separation(candidates).max() > _SLACK - depth
    ):
        return True
    values = separation(_GLOBAL)
    near = np.concatenate([_around(nhat[None], step) for step in (0.3, 0.1, 0.03, 0.01, 1e-3)])
    if max(values.max(), separation(near).max()) > _SLACK - depth:
        return True
    best = _GLOBAL[np.argsort(values)[-6:]]
    step = 0.05
    for _ in range(10):
        trial = np.concatenate([best[:, None], _around(best, step).reshape(len(best), -1, 3)], 1)
        values = separation(trial.reshape(-1, 3)).reshape(len(best), -1)
        if values.max() > _SLACK - depth:
            return True
        best = trial[np.arange(len(best)), values.argmax(axis=1)]
        step *= 0.6
    return False


def _is_deeper_elsewhere(
    shape_A: Any, shape_B: Any, X_AB: np.ndarray, n_A: np.ndarray, depth: float
) -> bool:
    """Tell whether A, whose outward normal at the contact is n_A, leaves B by less than depth."""
    if isinstance(shape_A, HalfSpace) or isinstance(shape_B, HalfSpace):
        return False
    R, p = X_AB[:3, :3], X_AB[:3, 3]

    def separation(n: np.ndarray) -> np.ndarray:
        return -(n @ p) - support(shape_A, -n) - support(shape_B, n @ R)

    return has_shorter_way_out(separation, -n_A, depth, _ways_out(shape_A, shape_B, R))


def _ways_out(shape_A: Any, shape_B: Any, R_AB: np.ndarray) -> np.ndarray:
    """Return the unit vectors (n, 3) in A that are ways out of B: for polytopes, all of them.

    The Minkowski difference of two polytopes has the faces of both, and one for each pair of
    their edges.
    """
    across = np.cross(edge_directions(shape_A)[:, None], edge_directions(shape_B)[None] @ R_AB.T)
    across = across.reshape(-1, 3)
    lengths = np.linalg.norm(across, axis=1)
    across = across[lengths > _PARALLEL] / lengths[lengths > _PARALLEL, None]
    return np.concatenate(
        [-face_normals(shape_A), face_normals(shape_B) @ R_AB.T, across, -across]
    )


def _twists(rng: np.random.Generator) -> float:
    """Return any angle, or every third time one that makes straight features parallel."""
    if rng.random() < 1.0 / 3.0:
        return float(rng.choice([0.0, 0.5 * np.pi]))
    return float(rng.uniform(0.0, 2.0 * np.pi))


def _one_pair(
    kinds: tuple[str, str], features: tuple[str, str], distance: float, rng: np.random.Generator
) -> KnownPair | None:
    for _ in range(_TRIES if distance < 0.0 else 1):
        A, B = (draw(kind, rng) for kind in kinds)
        site_A, site_B = (site(s, f, rng) for s, f in zip((A, B), features, strict=True))
        X_AB = align(site_A, site_B, distance, _twists(rng))
        if distance < 0.0 and _is_deeper_elsewhere(A, B, X_AB, site_A.normal, -distance):
            continue
        X_WA = _random_pose(rng)
        nhat = -X_WA[:3, :3] @ site_A.normal
        return KnownPair(A, X_WA, B, X_WA @ X_AB, distance, nhat, "-".join(features))
    return None


def _in_turn(makers: list[Any], count: int) -> Iterator[Any]:
    """Yield ``count`` results of the makers, asked in turn; one that gives None is left out."""
    made = 0
    while makers and made < count:
        for maker in list(makers):
            result = maker()
            if result is None:
                makers.remove(maker)
                continue
            yield result
            made += 1
            if made == count:
                return


def known_pairs(
    kind_A: str, kind_B: str, distance: float, count: int, rng: np.random.Generator
) -> list[KnownPair]:
    """Return ``count`` configurations of two kinds of shape at a signed distance (m).

    Combinations of features take turns, and so do both orders of the shapes.
    """
    orders = [(kind_A, kind_B), (kind_B, kind_A)]
    makers = [
        lambda k=kinds, f=features: _one_pair(k, f, distance, rng)
        for kinds in orders
        for features in itertools.product(FEATURES[kinds[0]], FEATURES[kinds[1]])
    ]
    return list(_in_turn(makers, count))


def _pit_is_near(shape: Any, p: np.ndarray, depth: float) -> bool:
    """Tell whether a mesh's pit may be nearer to the point p inside than ``depth``.

    The largest height above the planes of the pit's tetrahedron is a lower bound of the distance.
    """
    if not isinstance(shape, Mesh):
        return False
    hole = pit(shape)
    heights = []
    for k in range(4):
        a, b, c = np.delete(hole, k, axis=0)
        n = np.cross(b - a, c - a)
        n /= np.linalg.norm(n) * np.sign(n @ (a - hole[k]))
        heights.append(n @ (p - a))
    return max(heights) <= depth


def _is_nearer_elsewhere(shape: Any, p: np.ndarray, n: np.ndarray, depth: float) -> bool:
    """Tell whether the point p inside is nearer than ``depth`` to other than its own surface."""
    if isinstance(shape, HalfSpace):
        return False
    return _pit_is_near(shape, p, depth) or has_shorter_way_out(
        lambda d: d @ p - support(shape, d), n, depth, face_normals(shape)
    )


def _one_point(
    kind: str, feature: str, distance: float, rng: np.random.Generator
) -> KnownPoint | None:
    for _ in range(_TRIES if distance < 0.0 else 1):
        shape = draw(kind, rng)
        place = site(shape, feature, rng)
        p = place.point + distance * place.normal
        if distance < 0.0 and _is_nearer_elsewhere(shape, p, place.normal, -distance):
            continue
        X_WG = _random_pose(rng)
        R, t = X_WG[:3, :3], X_WG[:3, 3]
        return KnownPoint(shape, X_WG, R @ p + t, distance, R @ place.normal, feature)
    return None


def known_points(
    kind: str, distance: float, count: int, rng: np.random.Generator
) -> list[KnownPoint]:
    """Return ``count`` points at a signed distance (m) from a kind of shape, from all features."""
    makers = [lambda f=f: _one_point(kind, f, distance, rng) for f in FEATURES[kind]]
    return list(_in_turn(makers, count))
