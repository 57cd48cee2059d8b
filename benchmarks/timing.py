"""The least processor time of some runs: what a call takes where nothing else is in its way."""

from __future__ import annotations

from collections.abc import Callable
import math
import time
from typing import Any

__all__ = ["least_time", "microseconds"]


def least_time(act: Callable[[], Any], runs: int) -> tuple[float, Any]:
    """Return the least time of some runs, s, and what the last returned."""
    best, value = math.inf, None
    for _ in range(runs):
        begin = time.process_time()
        value = act()
        best = min(best, time.process_time() - begin)
    return best, value


def microseconds(act: Callable[[], Any], count: int, runs: int) -> float:
    """Return the least time per unit of work, us, of some runs after one that warms up."""
    act()
    return least_time(act, runs)[0] / count * 1e6
