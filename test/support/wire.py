"""What of a serialized message is said by its definition, and what is left between its fields."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message

_M_PERTURB = -6
"""Of glibc's mallopt: fill memory that is handed out with a byte derived from the value."""

_HEADER = 4
"""Bytes that say how the rest is encoded."""

_LARGE = 1100
"""Bytes from which on glibc fills every block; smaller ones may come as they were left."""


def padding(message: Any, places: np.ndarray | None = None) -> np.ndarray:
    """Return which bytes of a serialized message the serializer leaves as they happen to be.

    Only bytes at ``places`` are looked at, by default all.
    """
    data = serialize_message(message)
    if len(data) > _LARGE:
        return _by_memory(message)
    if places is None:
        places = np.arange(len(data))
    return _by_trial(message, data, places[places >= _HEADER])


def _by_memory(message: Any) -> np.ndarray:
    libc = ctypes.CDLL(None)
    versions = []
    for value in (0x0F, 0xF0):
        libc.mallopt(_M_PERTURB, value)
        versions.append(np.frombuffer(serialize_message(message), np.uint8))
    libc.mallopt(_M_PERTURB, 0)
    return versions[0] != versions[1]


def _by_trial(message: Any, data: bytes, places: np.ndarray) -> np.ndarray:
    # As it comes back: its float32 fields are rounded.
    message = deserialize_message(data, type(message))
    result = np.zeros(len(data), dtype=bool)
    for place in places:
        changed = bytearray(data)
        changed[place] ^= 0xFF
        try:
            result[place] = deserialize_message(bytes(changed), type(message)) == message
        except Exception:  # noqa: BLE001 - the middleware raises whatever it likes
            continue
    return result


def assert_same_bytes(ours: bytes, message: Any) -> None:
    """Fail unless ``ours`` is what the serializer makes of a message, byte for byte."""
    theirs = serialize_message(message)
    assert len(ours) == len(theirs)
    differs = np.flatnonzero(np.frombuffer(ours, np.uint8) != np.frombuffer(theirs, np.uint8))
    if len(differs):
        wrong = differs[~padding(message, differs)[differs]]
        assert not len(wrong), wrong
    kind = type(message)
    assert deserialize_message(ours, kind) == deserialize_message(theirs, kind)
