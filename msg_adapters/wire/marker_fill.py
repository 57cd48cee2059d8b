"""How markers follow one another in a serialized array of them, found by trying."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from visualization_msgs.msg import Marker, MeshFile

from msg_adapters.wire.fields import find_count, marked_stamps, MARKED_TIME

__all__ = ["ALIGNMENT", "Fill", "probe_fill"]

ALIGNMENT = 8
"""Bytes of the largest field, after which the layout of a message repeats."""


class Fill(NamedTuple):
    """How markers follow one another; indexed by position modulo ALIGNMENT."""

    first: int
    """Where the first marker begins."""
    gap: tuple[int, ...]
    """Bytes between a marker that ends at a position and the next one."""
    before: dict[int, Marker]
    """What to put before a marker, so that it begins at such a position."""
    length: int
    """Where the number of markers is."""


def probe_fill(array: Callable[[list[Marker]], bytes]) -> Fill:
    """Find how markers follow one another, by markers that end at every position.

    ``array`` serializes an array of markers.
    """
    marked = Marker()
    marked.header.stamp = MARKED_TIME
    (first,) = marked_stamps(array([marked]))
    gap, before = [-1] * ALIGNMENT, {}
    for length in range(ALIGNMENT):
        other = Marker(mesh_file=MeshFile(data=bytes(length)))
        end = len(array([other]))
        (begin,) = marked_stamps(array([other, marked]))
        gap[end % ALIGNMENT] = begin - end
        before[begin % ALIGNMENT] = other
    assert min(gap) >= 0, "not every position was tried"
    length_at = find_count(array([Marker()])[:first], array([Marker(), Marker()])[:first])
    return Fill(first, tuple(gap), before, length_at)
