"""Answers about one snapshot: asking twice computes once."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, TypeVar

from scene_graph_ros.geometry.model.snapshot import Snapshot

__all__ = ["Memo"]

Result = TypeVar("Result")

_REMEMBERED = 32
"""Answers that are kept at once."""


class Memo:
    """A snapshot, and the answers about it by their questions, as long as they are few."""

    __slots__ = ("_values", "snapshot")

    def __init__(self, snapshot: Snapshot) -> None:
        self.snapshot = snapshot
        self._values: dict[Hashable, Any] = {}

    def get(self, key: Hashable, compute: Callable[..., Result], *arguments: Any) -> Result:
        """Return the answer to ``key``: ``compute(snapshot, *arguments)``, kept."""
        values = self._values
        if key in values:
            answer: Result = values[key]
            return answer
        result = compute(self.snapshot, *arguments)
        if len(values) >= _REMEMBERED:
            values.clear()
        values[key] = result
        return result
