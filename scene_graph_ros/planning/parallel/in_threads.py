"""Work on many rows, shared out among threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from scene_graph_ros.geometry.query.arguments import checked_threads

__all__ = ["in_threads"]

_BLOCK = 64
"""Rows that a thread takes at a time."""


def in_threads(work: Callable[[slice], None], count: int, threads: int) -> None:
    """Do the work on all of ``count`` rows in blocks; kernels hold no lock."""
    if checked_threads(threads) == 1 or count <= _BLOCK:
        work(slice(0, count))
        return
    parts = (slice(first, min(first + _BLOCK, count)) for first in range(0, count, _BLOCK))
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(work, parts))
