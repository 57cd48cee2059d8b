"""Use the memory of an answer again once nobody looks at it any more.

The system clears each page of memory before it hands it out, which takes longer than writing an
answer of many megabytes. Who asks again and again, and drops the last answer, is spared that.
"""

from __future__ import annotations

import sys
import threading

from scene_graph_ros.geometry.query.point.answers import Answers, LARGE, new_answers

__all__ = ["AnswerMemory"]

_MOST = 1 << 20
"""Answers, of 57 bytes each. The memory of more is given back to the system."""
_KEPT = 2
"""The last answer is often dropped only after the next one has come."""
_WASTE = 2
"""How many times as large as needed kept memory may be."""


def _references(answers: Answers) -> int:
    """Return how many refer to one's memory at most: each view does, also a view of a view."""
    return max(sys.getrefcount(column.base) for column in answers)


_UNSHARED = _references(new_answers(LARGE))
"""What it returns where nobody has a view."""


class AnswerMemory:
    """Hands out memory for answers, and remembers what it handed out. Any thread may ask."""

    __slots__ = ("_known", "_lock")

    def __init__(self) -> None:
        self._known: list[Answers] = []
        self._lock = threading.Lock()

    def take(self, count: int) -> Answers:
        """Return flat columns for ``count`` answers, of memory that nobody looks at.

        What is smaller than ``LARGE`` comes from the heap, which is not cleared each time.
        """
        if not LARGE <= count <= _MOST:
            return new_answers(count)
        with self._lock:
            chosen = self._free(count)
            if chosen is None:
                chosen = new_answers(count)
                self._known = [*self._known[1 - _KEPT :], chosen]
            phi, p_GN, grad_W, unique = chosen
            return phi[:count], p_GN[: 3 * count], grad_W[: 3 * count], unique[:count]

    def _free(self, count: int) -> Answers | None:
        for answers in self._known:
            room = len(answers[0])
            if count <= room <= _WASTE * count and _references(answers) == _UNSHARED:
                return answers
        return None
