"""What a view needs of the world at one time."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Protocol, TypeVar

from scene_graph_ros.geometry.query.query_object import QueryObject

__all__ = ["Moment"]

T = TypeVar("T")


class Moment(Protocol):
    """The world at one time. Nothing in it changes any more."""

    @property
    def query(self) -> QueryObject:
        """Answers about a snapshot."""

    @property
    def inspector(self) -> Any:
        """Introspects the model of the snapshot."""

    @property
    def scene_version(self) -> int:
        """Another number for each model."""

    @property
    def sequence(self) -> int:
        """Another number for each moment."""

    @property
    def stamp(self) -> int:
        """Of the newest pose, in nanoseconds of the clock that stamps poses."""

    def ask(self, question: Callable[..., T], *arguments: Hashable) -> T:
        """Return what a method of ``QueryObject`` answers; the same question is answered once."""
