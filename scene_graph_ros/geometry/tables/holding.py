"""Named tuples of arrays that are handed to a kernel as one array; see ``held_tuples``."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any

import numpy as np

from scene_graph_ros.geometry.compiled.held_tuples import borrower, compiled_type, write_down

__all__ = ["Holding"]


class Holding:
    """How tuples of one type are held."""

    def __init__(self, name: str, example: Callable[[], Any]) -> None:
        """Take the tuples' name for messages, and a factory of one of any size."""
        self._name = name
        self._kind = functools.cache(lambda: compiled_type(example()))
        self._laid_out: set[Any] = set()
        self.borrowed = borrower(self._kind)
        """Returns, in a lean kernel, the tuple whose places it is given."""

    def places(self, value: Any) -> Any:
        """Return the addresses of a tuple's arrays: right as long as the tuple lives.

        Raises:
            TypeError: an array has another type, order or number of axes, or is read-only.

        """
        layout = _layout(value)
        if layout not in self._laid_out:
            kind = compiled_type(value)  # takes some milliseconds
            if kind != self._kind():
                raise TypeError(f"not {self._name}: {kind}")
            self._laid_out.add(layout)
        plain = _plain(value)
        places = write_down(plain)
        return value if places is plain else places


def _plain(value: Any) -> Any:
    """Return a tuple without names, which is laid out alike.

    Kernels are kept by type: of one without names another version of this package can read.
    """
    return tuple(map(_plain, value)) if isinstance(value, tuple) else value


def _layout(value: Any) -> Any:
    """Return the properties of a value that its type in compiled code depends on."""
    if isinstance(value, tuple):
        return (type(value), *map(_layout, value))
    if isinstance(value, np.ndarray):
        return (value.dtype, value.ndim, value.flags.num)
    return type(value)
