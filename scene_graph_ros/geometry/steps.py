"""Work in Python that takes long is done in steps, between which others may go before.

The core knows nothing of threads that wait for the interpreter; the caller that starts the work
chooses its callback between steps.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["between_steps", "calling_between_steps", "is_in_steps"]


def _nothing() -> None:
    """Go on at once."""


_callback: ContextVar[Callable[[], None]] = ContextVar("between steps", default=_nothing)


def between_steps() -> None:
    """Call the callback of this thread's work between its steps; without one, do nothing.

    To be called where nothing is held that another thread may wait for.
    """
    _callback.get()()


def is_in_steps() -> bool:
    """Tell whether this thread does work whose starter wants something done between its steps."""
    return _callback.get() is not _nothing


@contextmanager
def calling_between_steps(callback: Callable[[], None]) -> Iterator[None]:
    """Have this thread call ``callback`` between the steps of its work meanwhile."""
    token = _callback.set(callback)
    try:
        yield
    finally:
        _callback.reset(token)
