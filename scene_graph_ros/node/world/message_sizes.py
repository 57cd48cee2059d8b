"""How long a message may be that is read, while everybody's poses wait."""

from __future__ import annotations

__all__ = ["most_bytes", "too_long"]

_BYTES = 1 << 18
_BYTES_PER_NAME = 2048
"""Far more than a pose takes with its name: a message that has more is not about what there is,
but of a hundred thousand unknown names, and to read those takes seconds."""


def most_bytes(count: int) -> int:
    """Return the bytes that a message about so many frames, joints or geometries may have."""
    return _BYTES + _BYTES_PER_NAME * count


def too_long(data: bytes, most: int) -> str:
    """Say that a message is longer than `most_bytes`."""
    return f"a message has {len(data)} bytes, for what the source has {most} are more than enough"
