"""Answers about pairs as kernels write them, and their columns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "BOTH",
    "DECIDED_BY",
    "GAP",
    "LOCAL",
    "LOCAL_AT",
    "NHAT_BA_W",
    "NO_FAILURE",
    "NUMBERS_OF",
    "PHI",
    "ROW_A",
    "ROW_B",
    "UNIQUE",
    "WORLD",
    "WORLD_AT",
    "SolvedPairs",
]

PHI, GAP, UNIQUE, DECIDED_BY, ROW_A, ROW_B, NHAT_BA_W = 0, 1, 2, 3, 4, 5, 6
"""Where each column starts, times the number of pairs that there is room for; then come points."""

LOCAL, WORLD, BOTH = 1, 2, 3
"""Points that are written down: the witnesses in their geometries' frames, in W, or both."""
LOCAL_AT, WORLD_AT = (0, 9, 0, 9), (0, 0, 9, 15)
"""By points: where those in the frames and those in W start, like columns; 0 where none do."""
NUMBERS_OF = (9, 15, 15, 21)
"""By points: how many numbers a pair has."""

NO_FAILURE = -1


class SolvedPairs:
    """The k pairs that were kept of those asked about, in their order.

    A column is made when it is asked for, of one array that has them all: so many arrays take
    longer to make than a few answers.
    """

    __slots__ = ("_numbers", "_points", "_room", "count", "failed")

    def __init__(
        self,
        numbers: NDArray[np.float64],
        room: int,
        count: int,
        failed: int = NO_FAILURE,
        points: int = BOTH,
    ) -> None:
        """Take ``NUMBERS_OF[points]`` * room numbers, column after column."""
        self._numbers = numbers
        self._room = room
        self._points = points
        self.count = count
        self.failed = failed
        """The index of the first pair that has no answer, or NO_FAILURE."""

    def __len__(self) -> int:
        return self.count

    def _column(self, start: int) -> NDArray[np.float64]:
        first = start * self._room
        return self._numbers[first : first + self.count]

    def _vectors(self, start: int) -> NDArray[np.float64]:
        first = start * self._room
        return self._numbers[first : first + 3 * self.count].reshape(-1, 3)

    def _witness(self, starts: tuple[int, ...], after: int) -> NDArray[np.float64]:
        start = starts[self._points]
        assert start, "these points were not asked for"
        return self._vectors(start + after)

    @property
    def rows_A(self) -> NDArray[np.int64]:
        """(k,) rows of A; a new array."""
        return self._column(ROW_A).astype(np.int64)

    @property
    def rows_B(self) -> NDArray[np.int64]:
        """(k,) rows of B; a new array."""
        return self._column(ROW_B).astype(np.int64)

    @property
    def rows(self) -> NDArray[np.int64]:
        """(k, 2) rows of A and B; a new array."""
        return np.stack([self.rows_A, self.rows_B], axis=1)

    @property
    def distance(self) -> NDArray[np.float64]:
        """(k,) metres."""
        return self._column(PHI)

    @property
    def p_ACa(self) -> NDArray[np.float64]:
        """(k, 3) metres: the witness on A, in A's geometry frame."""
        return self._witness(LOCAL_AT, 0)

    @property
    def p_BCb(self) -> NDArray[np.float64]:
        """(k, 3) metres: the witness on B, in B's geometry frame."""
        return self._witness(LOCAL_AT, 3)

    @property
    def p_WCa(self) -> NDArray[np.float64]:
        """(k, 3) metres: the witness on A, in W."""
        return self._witness(WORLD_AT, 0)

    @property
    def p_WCb(self) -> NDArray[np.float64]:
        """(k, 3) metres: the witness on B, in W."""
        return self._witness(WORLD_AT, 3)

    @property
    def nhat_BA_W(self) -> NDArray[np.float64]:
        """(k, 3) unit normals out of B into A."""
        return self._vectors(NHAT_BA_W)

    @property
    def is_unique(self) -> NDArray[np.bool_]:
        """(k,) whether the normal is no choice among several; a new array."""
        return self._column(UNIQUE) != 0.0

    @property
    def gap(self) -> NDArray[np.float64]:
        """(k,) metres: the certificate."""
        return self._column(GAP)

    @property
    def decided_by(self) -> NDArray[np.uint8]:
        """(k,) integers of ``Mechanism``; a new array."""
        return self._column(DECIDED_BY).astype(np.uint8)
