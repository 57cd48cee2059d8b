"""Ends threads of the node before the interpreter does.

They are daemons, so that a program which forgets to destroy its node can end. But a daemon that
waits in the middleware when the interpreter goes is unwound through code that does not allow it,
and the process aborts. So they are stopped at exit: after the work that they are at, as ordinary
threads are.
"""

from __future__ import annotations

import atexit
from collections.abc import Callable
from typing import Any, TypeVar
import weakref

__all__ = ["stop_at_exit"]

T = TypeVar("T")

_stops: weakref.WeakKeyDictionary[Any, Callable[[Any], None]] = weakref.WeakKeyDictionary()


def stop_at_exit(owner: T, stop: Callable[[T], None]) -> None:
    """Call ``stop(owner)`` when the interpreter ends, if ``owner`` is there until then."""
    _stops[owner] = stop


@atexit.register
def _stop_all() -> None:
    for owner, stop in list(_stops.items()):
        stop(owner)
