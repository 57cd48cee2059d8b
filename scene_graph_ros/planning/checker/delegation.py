"""Methods of an object that one of its parts answers, or another method of it."""

from __future__ import annotations

from collections.abc import Callable
import functools
from typing import Any, Concatenate, ParamSpec, TypeVar

__all__ = ["Delegation", "synonym"]

P = ParamSpec("P")
R = TypeVar("R")


class Delegation:
    """Makes methods of an object from those of a part: signature and docstring are the part's."""

    def __init__(self, part: str) -> None:
        """Call the attribute ``part`` of the object."""
        self._part = part

    def __call__(
        self, method: Callable[Concatenate[Any, P], R]
    ) -> Callable[Concatenate[Any, P], R]:
        """Return the method of the object that calls ``method`` of its part."""
        part = self._part

        @functools.wraps(method, updated=())
        def call(self: Any, *args: P.args, **kwargs: P.kwargs) -> R:
            return method(getattr(self, part), *args, **kwargs)

        return call


def synonym(method: Callable[Concatenate[Any, P], R]) -> Callable[Concatenate[Any, P], R]:
    """Return a method by another name, which calls what a derived class has for ``method``."""
    name = method.__name__

    @functools.wraps(method, updated=())
    def call(self: Any, *args: P.args, **kwargs: P.kwargs) -> R:
        result: R = getattr(self, name)(*args, **kwargs)
        return result

    return call
