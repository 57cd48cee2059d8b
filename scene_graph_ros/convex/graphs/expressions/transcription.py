"""In which of the programs of a graph a cost or constraint counts."""

from __future__ import annotations

from collections.abc import Iterable
import enum
from typing import Any

from scene_graph_ros.convex.errors import ConvexSetError
from scene_graph_ros.geometry.quoting import quoted

__all__ = ["ALL_TRANSCRIPTIONS", "Transcription", "as_transcriptions"]


class Transcription(enum.IntEnum):
    """The programs that a shortest path problem becomes."""

    MIP = 0
    """The exact problem, whose paths are searched."""
    RELAXATION = 1
    """The convex relaxation, of ``convex_relaxation``."""
    RESTRICTION = 2
    """The points of one path: of rounded ones, and of `solve_convex_restriction`."""


ALL_TRANSCRIPTIONS = frozenset(Transcription)

_ALONE = {each: frozenset([each]) for each in Transcription}


def as_transcriptions(value: Any, label: str) -> frozenset[Transcription]:
    """Return a set of them. Raises ConvexSetError for an empty one, and for unknown names."""
    if type(value) is Transcription:
        return _ALONE[value]
    if value is ALL_TRANSCRIPTIONS:
        return ALL_TRANSCRIPTIONS
    some = value if isinstance(value, Iterable) and not isinstance(value, str) else [value]
    found = list(some)
    if not found or not all(isinstance(each, Transcription) for each in found):
        raise ConvexSetError(f"{label} must have one Transcription or more, not {quoted(value)}")
    return frozenset(found)
