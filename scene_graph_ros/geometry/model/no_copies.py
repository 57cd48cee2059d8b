"""Objects that are neither copied attribute by attribute nor pickled, and name the remedy."""

from __future__ import annotations

from typing import ClassVar, NoReturn, SupportsIndex

__all__ = ["NotCopied"]


class NotCopied:
    """Refuses ``copy.copy``, ``copy.deepcopy`` and pickling, unless a class defines its own."""

    __slots__ = ()
    _instead: ClassVar[str]
    """What to do, for the message."""

    def __reduce_ex__(self, protocol: SupportsIndex) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} can't be copied or pickled like plain data: {self._instead}"
        )
