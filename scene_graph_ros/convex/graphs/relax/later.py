"""Parts of an answer that are made when they are first asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Generic, TypeVar

__all__ = ["Later", "Once"]

_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


class Once(Generic[_Value]):
    """The answer of a function, which is called once, when it is first asked for."""

    def __init__(self, make: Callable[[], _Value]) -> None:
        self._make: Callable[[], _Value] | None = make
        self._made: _Value

    @classmethod
    def of(cls, made: _Value) -> Once[_Value]:
        """Return a value that is made already."""
        return cls(lambda: made)

    def __call__(self) -> _Value:
        """Return it."""
        if self._make is not None:
            self._made, self._make = self._make(), None
        return self._made

    def __reduce__(self) -> Any:
        """Travel to other processes as the value."""
        return Once.of, (self(),)


class Later(Mapping[_Key, _Value]):
    """A mapping that is made when it is first looked into."""

    def __init__(self, make: Callable[[], Mapping[_Key, _Value]]) -> None:
        self._all = Once(make)

    def __getitem__(self, key: _Key) -> _Value:
        """Return the value of a key."""
        return self._all()[key]

    def __iter__(self) -> Iterator[_Key]:
        """Return all keys in turn."""
        return iter(self._all())

    def __len__(self) -> int:
        """Return the number of entries."""
        return len(self._all())

    def __repr__(self) -> str:
        """Return its representation as a dict."""
        return repr(dict(self))

    def __reduce__(self) -> Any:
        """Travel to other processes as the values."""
        return dict, (dict(self),)
