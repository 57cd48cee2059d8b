"""Arrays that are lent, and lent again when nobody looks at them any more.

New memory of some megabytes is cleared by the system, page by page, which takes longer than
writing it. A caller that asks again and again, and drops earlier answers, is spared that.

A loan is over when the array that was lent is gone: it and every view of it, for each of them
refers to that very array. NumPy lets a view refer to the array at the end of a chain of views,
but not past one of another class (``PyArray_SetBaseObject``); so a loan is a view of a
``Block``. Weak references tell when it is gone, on every interpreter.
"""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any, Generic, TypeVar
import weakref

import numpy as np
from numpy.typing import NDArray

__all__ = ["Block", "Lender", "Loan", "RoomLender"]

Arrays = TypeVar("Arrays", bound=tuple[NDArray[Any], ...])

_KEPT = 2
"""The last array is often dropped only after the next one has come."""
_WASTE = 2
"""How many times as large as needed kept memory may be."""


class Block(np.ndarray):
    """Memory to lend. Nobody but the loan refers to it."""


def _nothing() -> None:
    """Return the callback of a weak reference whose array is gone."""


class Loan:
    """A block that is lent as a plain array. One thread at a time."""

    __slots__ = ("_block", "_lent")

    def __init__(self, block: NDArray[Any]) -> None:
        """Take a block, or a view of one, that nobody else refers to."""
        self._block = block
        self._lent: Callable[[], NDArray[Any] | None] = _nothing

    def is_over(self) -> bool:
        """Tell whether nobody looks at the array that was lent."""
        return self._lent() is None

    def lend(self) -> NDArray[Any]:
        """Return an array, as the last borrower left it. The loan before must be over."""
        array = self._block.view(np.ndarray)
        self._lent = weakref.ref(array)
        return array


class Lender:
    """Lends arrays of one shape. Any thread may ask."""

    __slots__ = ("_loans", "_lock", "_shape")

    def __init__(self, shape: tuple[int, ...]) -> None:
        """Take the shape of all arrays; they hold float64."""
        self._shape = shape
        self._loans: list[Loan] = []
        self._lock = threading.RLock()

    def take(self, begin: Callable[..., object], *given: object) -> NDArray[np.float64]:
        """Return an array as its last borrower left it, or a new one, to which ``begin`` writes.

        It gets the array and what is ``given``. A new one is lent again only if ``begin`` has
        ended: an interruption leaves none behind in which there is nothing yet.
        """
        with self._lock:
            for loan in self._loans:
                if loan.is_over():
                    return loan.lend()
            loan = Loan(Block(self._shape))
            result = loan.lend()
            begin(result, *given)
            self._loans = [*self._loans[1 - _KEPT :], loan]
            return result


class RoomLender(Generic[Arrays]):
    """Lends arrays with room for a number of rows that differs from time to time.

    Any thread may ask.
    """

    __slots__ = ("_known", "_least", "_lock", "_most", "_new")

    def __init__(
        self, new: Callable[[int, type[np.ndarray[Any, Any]]], Arrays], least: int, most: int
    ) -> None:
        """Take the maker of arrays, and the numbers of rows between which memory is kept.

        ``new`` makes arrays of a class with room for a number of rows.
        """
        self._new, self._least, self._most = new, least, most
        self._known: list[tuple[int, tuple[Loan, ...]]] = []
        """For how many rows there is room in each."""
        self._lock = threading.RLock()

    def take(self, count: int) -> Arrays:
        """Return arrays with room for ``count`` rows or more, of memory that nobody looks at."""
        if not self._least <= count <= self._most:
            return self._new(count, np.ndarray)
        with self._lock:
            used = self._free(count)
            if used is None:
                used = count, tuple(Loan(array) for array in self._new(count, Block))
            # What was lent last is let go last, so that memory of another size makes room first.
            others = [known for known in self._known if known is not used]
            self._known = [*others[1 - _KEPT :], used]
            return tuple(loan.lend() for loan in used[1])  # type: ignore[return-value]

    def _free(self, count: int) -> tuple[int, tuple[Loan, ...]] | None:
        for known in self._known:
            room, loans = known
            if count <= room <= _WASTE * count and all(loan.is_over() for loan in loans):
                return known
        return None
