"""Turned boxes of which answers follow from their making, and how far given answers are off."""

from __future__ import annotations

from dataclasses import dataclass
import functools
import itertools
import math
from typing import Any, NamedTuple

import numpy as np

__all__ = ["DECISIONS", "DIMENSIONS_OF", "QUESTIONS", "Box", "Case", "box_of", "error_of"]

GAPS = 10.0 ** -np.arange(1.0, 16.0, 2.0)
"""Of the size: by what facing rows miss each other, or overlap."""

DECISIONS = ("emptiness", "intersection", "containment", "redundancy")

QUESTIONS = (
    *DECISIONS,
    "Chebyshev centre",
    "projection",
    "bounding box",
    "vertices",
    "volume",
    "inscribed ellipsoid",
    "circumscribed ellipsoid",
    "scaling to touch",
    "region among obstacles",
    "shortest path",
)

DIMENSIONS_OF = {"vertices": (2, 3, 7)}
"""Where not all dimensions are asked for: 14 have 16 384 corners."""

_CENTER = (0.3, -0.2, 0.5)
_BEYOND = (0.1, 0.2, 0.05)
"""Of the size, and again for further coordinates: how far beyond a corner points and balls are."""
_INNER_POINTS = 200


class Case(NamedTuple):
    """Rows ``(m, n)`` and right sides of one or two polyhedra, the truth, and what decides it."""

    rows: tuple[np.ndarray, np.ndarray]
    other: tuple[np.ndarray, np.ndarray] | None
    truth: Any
    gap: float


@dataclass(frozen=True)
class Box:
    """``|Q (x - center)| <= half`` in n dimensions, and its size in metres."""

    Q: np.ndarray
    center: np.ndarray
    half: np.ndarray
    size: float

    @property
    def n(self) -> int:
        """The number of dimensions."""
        return len(self.half)

    @property
    def rows(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``A (2 n, n)`` and ``b (2 n,)``."""
        A = np.concatenate([self.Q, -self.Q])
        return A, A @ self.center + np.tile(self.half, 2)

    @functools.cached_property
    def corners(self) -> np.ndarray:
        """All corners ``(2^n, n)``."""
        signs = np.array(list(itertools.product((-1.0, 1.0), repeat=self.n)))
        return self.center + (signs * self.half) @ self.Q

    @functools.cached_property
    def hull_points(self) -> np.ndarray:
        """Points whose smallest ellipsoid is the one around all corners.

        Corners with such signs that the columns of signs are orthogonal and add up to nothing
        (John 1948), and points between them.
        """
        order = 1 << self.n.bit_length()
        signs = np.ones((1, 1))
        while len(signs) < order:
            signs = np.block([[signs, signs], [signs, -signs]])
        inner = np.random.default_rng(5).uniform(-1.0, 1.0, (_INNER_POINTS, self.n))
        of_unit = np.concatenate([signs[:, 1 : self.n + 1], inner])
        return self.center + (of_unit * self.half) @ self.Q

    @property
    def far(self) -> np.ndarray:
        """A point beyond a corner."""
        return self.center + (self.half + self.beyond) @ self.Q

    @property
    def beyond(self) -> np.ndarray:
        """How far that is beyond each face at the corner."""
        return self.size * np.resize(_BEYOND, self.n)

    @functools.cached_property
    def walls(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Rows of a box beyond each face, ten times as wide as this one's size."""
        found = []
        for k, sign in itertools.product(range(self.n), (1.0, -1.0)):
            A, reach = self.rows[0], np.full(2 * self.n, 10.0 * self.size)
            near = k + self.n if sign > 0.0 else k
            reach[near] = -self.half[k]
            found.append((A, A @ self.center + reach))
        return found

    @functools.cached_property
    def stations(self) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray]:
        """Two points 8 sizes apart, and rows of a slab 3 away from their line: sides of 5."""
        A, reach = self.rows[0], np.full(2 * self.n, self.size)
        # It begins 3 sizes above the straight way's middle, and is as thick as the box.
        reach[self.n - 1] = 3.0 * self.size + self.half[-1]
        reach[-1] = -3.0 * self.size
        away = 4.0 * self.size * self.Q[0]
        return self.center - away, (A, reach + A @ self.center), self.center + away

    @functools.cached_property
    def cases(self) -> dict[str, list[Case]]:
        """What is decided, by question.

        Rows that face each other are each other's negatives: the truth is that of two numbers.
        """
        A, b = self.rows
        found: dict[str, list[Case]] = {name: [] for name in DECISIONS}
        for gap, sign in itertools.product(GAPS, (1.0, -1.0)):
            g = sign * gap * self.size
            cut = b.copy()
            cut[self.n] = -b[0] + g
            found["emptiness"].append(Case((A, cut), None, sign < 0.0, gap))
            beside = b + 10.0 * self.size
            beside[self.n] = -b[0] + g
            found["intersection"].append(Case((A, b), (A, beside), sign > 0.0, gap))
            around = b + self.size
            around[0] = b[0] + g
            found["containment"].append(Case((A, b), (A, around), sign > 0.0, gap))
            more = np.append(A, A[:1], axis=0), np.append(b, b[0] + g)
            needless = {2 * self.n} if sign > 0.0 else {0}
            found["redundancy"].append(Case(more, None, needless, gap))
        return found


def box_of(size: float, width: float, dimension: int = 3) -> Box:
    """Return a box that is turned by a fixed random turn, and thin along its last axis."""
    Q, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(dimension, dimension)))
    half = np.full(dimension, 0.6)
    half[0], half[-1] = 1.0, width
    return Box(Q, size * np.resize(_CENTER, dimension), size * half, size)


def error_of(question: str, box: Box, answer: Any) -> float:
    """Return how far an answer is from the truth of the construction, beside its size.

    Of decisions the largest gap beside the size that was told wrongly, 0 if none was.
    """
    A, b = box.rows
    beyond = float(np.linalg.norm(box.beyond))
    log_volume = float(np.log(box.half).sum())
    if question in DECISIONS:
        cases = box.cases[question]
        return max(c.gap if a != c.truth else 0.0 for c, a in zip(cases, answer, strict=True))
    if question == "Chebyshev centre":
        return abs(float((b - A @ answer).min()) / float(box.half.min()) - 1.0)
    if question == "projection":
        return abs(answer / beyond - 1.0)
    if question == "bounding box":
        reach = np.abs(box.Q.T) @ box.half
        truth = np.concatenate([box.center - reach, box.center + reach])
        return float(np.abs(answer - truth).max()) / box.size
    if question == "vertices":
        apart = np.linalg.norm(box.corners[:, None] - answer[None], axis=2)
        return float(max(apart.min(axis=0).max(), apart.min(axis=1).max())) / box.size
    if question == "volume":
        return abs(answer / (2.0**box.n * float(np.prod(box.half))) - 1.0)
    if question == "inscribed ellipsoid":
        return abs(answer - log_volume)
    if question == "circumscribed ellipsoid":
        return abs(answer - log_volume - 0.5 * box.n * math.log(box.n))
    if question == "scaling to touch":
        return abs(answer / (beyond / (0.01 * box.size)) - 1.0)
    if question == "region among obstacles":
        return _farthest_face(A, b, answer, box)
    return abs(answer / (10.0 * box.size) - 1.0)


def _farthest_face(A: np.ndarray, b: np.ndarray, answer: Any, box: Box) -> float:
    """Return how far the nearest face of a region is from a face of the box, at most."""
    lengths = np.linalg.norm(answer[0], axis=1)
    normals, reach = answer[0] / lengths[:, None], answer[1] / lengths
    reach = reach - normals @ box.center
    off = [
        (box.size * np.linalg.norm(normals - a, axis=1) + np.abs(reach - (side - a @ box.center)))
        for a, side in zip(A, b, strict=True)
    ]
    return max(float(each.min()) for each in off) / box.size
