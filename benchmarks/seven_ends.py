"""The ends of the motion of seven joints that optimizers are compared by."""

from __future__ import annotations

import numpy as np

__all__ = ["seven_ends"]


def seven_ends() -> tuple[np.ndarray, np.ndarray]:
    """Return a start and a goal (rad), each ``(7,)``."""
    start, goal = np.random.default_rng(0).uniform(-1.5, 1.5, (2, 7))
    return start, goal
