"""Named tuples of arrays that are handed to a kernel as one array; see ``held_tuples``."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any

from scene_graph_ros.geometry.compiled.held_tuples import borrower, compiled_type, write_down

__all__ = ["Holding"]


class Holding:
    """How tuples of one type are held."""

    def __init__(self, name: str, example: Callable[[], Any]) -> None:
        """Take the tuples' name for messages, and a factory of one of any size."""
        self._name = name
        self._kind = functools.cache(lambda: compiled_type(example()))
        self.borrowed = borrower(self._kind)
        """Returns, in a lean kernel, the tuple whose places it is given."""

    def places(self, value: Any) -> Any:
        """Return the addresses of a tuple's arrays: right as long as the tuple lives.

        Raises:
            TypeError: an array has another type, order or number of axes, or is read-only.

        """
        kind = compiled_type(value)
        if kind != self._kind():
            raise TypeError(f"not {self._name}: {kind}")
        plain = _plain(value)
        places = write_down(plain)
        return value if places is plain else places


def _plain(value: Any) -> Any:
    """Return a tuple without names, which is laid out alike.

    Kernels are kept by type: of one without names another version of this package can read.
    """
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value
