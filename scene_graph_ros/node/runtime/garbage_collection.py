"""When Python looks for garbage: never while a scene is being made, nor in lasting objects.

The collector stops all threads for as long as it looks, a microsecond per object: for a third of a
second, again and again, while a scene of thousands of frames is read. So the node's process keeps
it off while it starts, which takes an eighth less time, and away from the objects of the start and
from those that large changes of the scene add. It still looks through all else; and objects
without references go at once, without it.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import gc

__all__ = ["at_rest", "keep_what_is_there", "look_at_all_again", "start_without"]

LARGE = 20_000
"""Objects that a change may leave to the collector: some 10 ms."""


def start_without() -> None:
    """Keep the collector off until `keep_what_is_there`; for a process of the node's."""
    gc.disable()


def keep_what_is_there() -> None:
    """Look for garbage once, and then never again in the rest; for a process of the node's."""
    gc.collect()
    gc.freeze()
    gc.enable()


def look_at_all_again() -> None:
    """Undo the former."""
    gc.unfreeze()


@contextmanager
def at_rest() -> Iterator[None]:
    """Keep the collector off meanwhile; many new objects at the end count as lasting.

    Nothing is changed in a process that has not begun so: it may be another program's.
    """
    if not gc.get_freeze_count():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        if gc.get_count()[0] > LARGE:
            gc.freeze()
        gc.enable()
