"""Polytopes of random rows that are asked of several systems."""

from __future__ import annotations

import numpy as np

__all__ = ["half_redundant", "polytope"]

_COMBINED = 3
"""Rows that a redundant one is made of."""

_BEYOND = 0.05
"""How far a redundant row is beyond what the others imply, relative to their sides."""


def polytope(rng: np.random.Generator, n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a box and random planes about it; few are redundant in many dimensions."""
    A = np.concatenate([np.eye(n), -np.eye(n), rng.normal(size=(m - 2 * n, n))])
    A /= np.linalg.norm(A, axis=1)[:, None]
    return A, np.concatenate([np.ones(2 * n), 0.5 + 0.7 * rng.random(m - 2 * n)])


def half_redundant(rng: np.random.Generator, n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Return m rows in a random order, half of them redundant.

    The others touch the unit ball, so that each is needed; a redundant one is a sum of three of
    these, times what is not negative, and is a little beyond them.
    """
    needed = m - m // 2
    A = np.concatenate([np.eye(n), -np.eye(n), rng.normal(size=(max(needed - 2 * n, 0), n))])
    A /= np.linalg.norm(A, axis=1)[:, None]
    rows = [A]
    sides = [np.ones(len(A))]
    while sum(map(len, rows)) < m:
        chosen = rng.choice(len(A), _COMBINED, replace=False)
        weights = rng.random(_COMBINED)
        row = weights @ A[chosen]
        length = float(np.linalg.norm(row))
        if length < 1e-3:
            continue
        rows.append(row[None] / length)
        sides.append(np.array([weights.sum() / length * (1.0 + _BEYOND)]))
    order = rng.permutation(m)
    return np.concatenate(rows)[order], np.concatenate(sides)[order]
