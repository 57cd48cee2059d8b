"""Use the memory of an answer again once nobody looks at it any more; see ``loans``."""

from __future__ import annotations

import threading

from scene_graph_ros.geometry.loans import Block, Loan
from scene_graph_ros.geometry.query.point.answers import Answers, LARGE, new_answers

__all__ = ["AnswerMemory"]

_MOST = 1 << 20
"""Answers, of 57 bytes each. The memory of more is given back to the system."""
_KEPT = 2
"""The last answer is often dropped only after the next one has come."""
_WASTE = 2
"""How many times as large as needed kept memory may be."""


class AnswerMemory:
    """Hands out memory for answers, and remembers what it handed out. Any thread may ask."""

    __slots__ = ("_known", "_lock")

    def __init__(self) -> None:
        self._known: list[tuple[int, tuple[Loan, ...]]] = []
        """For how many answers there is room in each."""
        self._lock = threading.Lock()

    def take(self, count: int) -> Answers:
        """Return flat columns for ``count`` answers, of memory that nobody looks at.

        What is smaller than ``LARGE`` comes from the heap, which is not cleared each time.
        """
        if not LARGE <= count <= _MOST:
            return new_answers(count)
        with self._lock:
            loans = self._free(count)
            if loans is None:
                loans = tuple(Loan(column) for column in new_answers(count, Block))
                self._known = [*self._known[1 - _KEPT :], (count, loans)]
            phi, p_GN, grad_W, unique = (loan.lend() for loan in loans)
            return phi[:count], p_GN[: 3 * count], grad_W[: 3 * count], unique[:count]

    def _free(self, count: int) -> tuple[Loan, ...] | None:
        for room, loans in self._known:
            if count <= room <= _WASTE * count and all(loan.is_over() for loan in loans):
                return loans
        return None
