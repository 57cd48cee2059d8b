"""Public functions that take arrays, read off their annotations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import importlib
import inspect
from typing import Any

__all__ = ["array_arguments"]


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


def array_arguments(*modules: str) -> set[tuple[str, str]]:
    """Return functions of what modules make public, with the names of arguments for arrays."""
    found = set()
    for module in map(importlib.import_module, modules):
        for public in module.__all__:
            for name, function in _functions(getattr(module, public), public):
                for each in inspect.signature(function).parameters.values():
                    if "ArrayLike" in str(each.annotation):
                        found.add((name, each.name))
    return found
