"""Attributes that are made when they are first read, by whichever thread that is."""

from __future__ import annotations

from collections.abc import Callable
import threading
from typing import Any, Generic, overload, TypeVar

__all__ = ["made_once"]

T = TypeVar("T")


class made_once(Generic[T]):  # noqa: N801 - stands where a decorator does
    """Make an attribute once; other threads that read it meanwhile wait for it.

    `functools.cached_property` makes it once for each of them since Python 3.12: writes into one
    of these objects are missing in the other.
    """

    def __init__(self, make: Callable[[Any], T]) -> None:
        self._make = make
        self.__doc__ = make.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        """Take the name under which instances keep the value."""
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> made_once[T]: ...

    @overload
    def __get__(self, instance: Any, owner: type | None = None) -> T: ...

    def __get__(self, instance: Any, owner: type | None = None) -> made_once[T] | T:
        """Make it; once it is there, instances have it themselves and this is not called."""
        if instance is None:
            return self
        made = instance.__dict__
        with made.setdefault(f"making {self._name}", threading.RLock()):
            if self._name not in made:
                made[self._name] = self._make(instance)
            value: T = made[self._name]
            return value
