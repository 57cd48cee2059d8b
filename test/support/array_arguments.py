"""Public functions that take arrays, read off their annotations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import importlib
import inspect
import re
from typing import Any

__all__ = ["ARRAYS_OR_ANYTHING", "array_arguments"]


def _functions(value: Any, name: str) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Return a function, or the public methods of a class, with their names."""
    if not inspect.isclass(value):
        if callable(value):
            yield name, value
        return
    for key in dir(value):
        if key.startswith("_") and key != "__init__":
            continue
        part = inspect.getattr_static(value, key)
        function = getattr(part, "__func__", part)
        if inspect.isfunction(function):
            # Where it is written, so that what is inherited counts once.
            owner = next(base for base in value.__mro__ if key in vars(base))
            yield f"{owner.__name__}.{key}", function


ARRAYS = ("ArrayLike",)
ARRAYS_OR_ANYTHING = (*ARRAYS, "Any", "ndarray", "NDArray")


def array_arguments(*modules: str, words: tuple[str, ...] = ARRAYS) -> set[tuple[str, str]]:
    """Return functions of what modules make public, with the names of arguments for arrays.

    They are those whose annotation has one of the words.
    """
    found = set()
    for module in map(importlib.import_module, modules):
        for public in module.__all__:
            for name, function in _functions(getattr(module, public), public):
                for each in inspect.signature(function).parameters.values():
                    parts = re.split(r"\W+", str(each.annotation))
                    if not set(words).isdisjoint(parts):
                        found.add((name, each.name))
    return found
